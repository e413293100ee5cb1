#include "apps/estimators/overlay_sink.h"

#include <utility>

#include "sim/files/image_file.h"

namespace touchstone::apps {

OverlaySink::OverlaySink(std::filesystem::path folder, LiveView* view) : folder_(std::move(folder)), view_(view) {}

void OverlaySink::take(const std::string& stem, const cv::Mat& picture) const {
  if (!folder_.empty()) {
    const std::filesystem::path file = folder_ / (stem + ".png");
    std::filesystem::create_directories(file.parent_path());
    sim::write_png(file, picture);
  }
  if (view_ != nullptr) view_->show(picture);
}

}  // namespace touchstone::apps
