#pragma once
// A shown camera over HTTP, as network cameras are.

#include <memory>
#include <string>

#include "apps/frame_pages.h"

namespace touchstone::apps {

/// Answers by the camera's pages (FramePages).
class FrameServer {
 public:
  struct Settings {
    std::string address = "127.0.0.1";
    int port = 0;              ///< 0: any free one
    double patience_s = 10.0;  ///< for a client to send a request, and to take a frame
  };

  /// Listens; requests are answered from threads of its own. @throws Error if the port can't be had
  FrameServer(ServedCamera& camera, FramePages::Contents contents, const Settings& settings);
  /// Stops the camera and waits until all clients are gone.
  ~FrameServer();
  FrameServer(const FrameServer&) = delete;
  FrameServer& operator=(const FrameServer&) = delete;

  int port() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::apps
