#include "apps/estimators/overlay_sink.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <utility>

#include "sim/files/image_file.h"

namespace touchstone::apps {

OverlaySink::OverlaySink(const PictureOptions& options, std::filesystem::path folder, const std::string& title)
    : options_(options), folder_(std::move(folder)) {
  if (!options.video.empty()) video_ = std::make_unique<datasets::VideoFile>(options.video);
  if (!options.live) return;
  view_ = std::make_unique<LiveView>(title, options.port);
  fmt::print(stderr, "live: http://127.0.0.1:{}/\n", view_->port());
}

void OverlaySink::take(const datasets::SourceFrame& frame, const cv::Mat& picture) {
  if (!folder_.empty()) {
    const std::filesystem::path file = folder_ / (frame.stem + ".png");
    std::filesystem::create_directories(file.parent_path());
    sim::write_png(file, picture);
  }
  if (video_) video_->add(picture, frame.label.timed ? std::optional(frame.label.t_us) : std::nullopt);
  if (view_) view_->show(picture);
}

void OverlaySink::begin_again() {
  if (!video_) return;
  video_.reset();  // its unfinished file goes first
  video_ = std::make_unique<datasets::VideoFile>(options_.video);
}

void OverlaySink::finish() {
  if (!video_) return;
  video_->finish();
  fmt::print(stderr, "{}: {}\n", options_.video.string(),
             video_->slowed() > 1.0 ? fmt::format("shown {:.3g} times slower than it was", video_->slowed())
                                    : "shown as fast as it was");
}

}  // namespace touchstone::apps
