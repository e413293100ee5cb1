#pragma once
// What an estimate shows while it runs, over HTTP: to be watched with a browser, on this machine or through a tunnel.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

namespace touchstone::apps {

/// Answers GET / (a page), /stream.mjpg (every picture that is shown, as far as a client is quick enough) and
/// /frame.jpg (the last one) at 127.0.0.1. Pictures are encoded only if somebody watches, in threads of its own.
class LiveView {
 public:
  /// @param port 0: any free one @throws Error if it can't be had
  LiveView(std::string title, int port);
  /// Ends all streams.
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  int port() const;
  /// From now on this picture, 8 or 16 bit, grey or BGR, is the last one.
  void show(const cv::Mat& picture);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::apps
