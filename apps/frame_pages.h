#pragma once
// What a shown camera answers over HTTP: MJPEG, single JPEGs, and what is true of them as JSON.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/request_source.h"
#include "apps/served_camera.h"

namespace httplib {
class Server;
}

namespace touchstone::apps {

/// The values that a request gave, by name.
using Requested = std::map<std::string, std::string>;

/// What a POST request does.
struct Command {
  std::function<void(const Requested&)> carry_out;  ///< what it throws as Error is the client's mistake
  std::string example = "";                         ///< of what it wants to be given; empty: nothing
};

/// GET answers / (a page that shows the stream), /stream.mjpg (multipart/x-mixed-replace, a JPEG a frame; frames that a
/// client is too slow for are left out), /frame.jpg and /status.json (the frame that is due: its picture, with its
/// number as the header X-Touchstone-Frame; its number and truth, the rate, the clients) and /truth.json?frame=N (the
/// truth of frame number N); POST answers what `commands` has. A mistake is answered by 4xx and {"error": "..."}, more
/// than can be done at once by 503.
class FramePages {
 public:
  struct Contents {
    std::string title;
    AllowedSources sources;
    std::map<std::string, Command> commands;  ///< by path ("/hold")
  };

  /// Of a camera that outlives this.
  FramePages(ServedCamera& camera, Contents contents);
  ~FramePages();
  FramePages(const FramePages&) = delete;
  FramePages& operator=(const FramePages&) = delete;

  /// Has the server answer by these pages, which must outlive it.
  void add_to(httplib::Server& server);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// One of the values as a number. @throws Error naming it if it isn't one or, without `otherwise`, isn't there
double number_of(const Requested& requested, const std::string& name, std::optional<double> otherwise = std::nullopt);
/// The same, degrees from -360 to 360; 0 where it isn't there.
double angle_of(const Requested& requested, const std::string& name);
/// The same, a whole one from 0.
int count_of(const Requested& requested, const std::string& name);
/// @throws Error naming a value that isn't among `allowed`
void allow_only(const Requested& requested, const std::vector<std::string>& allowed);

}  // namespace touchstone::apps
