#include "lab/gelsight/height_source.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"
#include "core/natural_order.h"
#include "datasets/inspection/on_picture.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kChannel = "height_mm";

/// The one channel of a file that holds heights. @throws Error
cv::Mat heights_of(const fs::path& file) {
  const sim::LinearImage picture = sim::read_exr(file);
  const auto at = std::ranges::find(picture.channel_names, kChannel);
  if (at == picture.channel_names.end()) fail("has no channel '{}'", kChannel);
  cv::Mat heights;
  cv::extractChannel(picture.image, heights, static_cast<int>(at - picture.channel_names.begin()));
  return heights;
}

}  // namespace

HeightSource::HeightSource(const sensors::HeightModel& model, std::vector<datasets::FrameStream> streams)
    : streams_(std::move(streams)), mm_per_px_(model.mm_per_px) {
  estimator_.emplace(model, sensors::HeightSettings{.border = sensors::HeightBorder::free});
}

HeightSource::HeightSource(const fs::path& maps, double mm_per_px) : mm_per_px_(mm_per_px) {
  if (!(mm_per_px > 0.0) || !std::isfinite(mm_per_px)) fail("{} mm a pixel: above 0 is needed", mm_per_px);
  std::error_code failed;
  if (!fs::is_directory(maps, failed)) fail("{}: isn't a folder", maps.string());
  for (const auto& entry : fs::directory_iterator(maps)) {
    const fs::path name = entry.path().filename();
    if (name.extension() == ".exr" && !name.native().starts_with('.')) files_.push_back(entry.path());
  }
  if (files_.empty()) fail("{}: has no height map (.exr)", maps.string());
  std::ranges::sort(files_, [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
}

std::int64_t HeightSource::maps() const {
  return estimator_ ? datasets::frames_of(streams_) : static_cast<std::int64_t>(files_.size());
}

cv::Mat HeightSource::estimated(const cv::Mat& frame) {
  const sensors::HeightResult& result = estimator_->estimate(frame);
  if (!result.trusted()) fail("is {}", result.overexposed ? "overexposed" : result.dark ? "dark" : "of one colour");
  if (!cv::checkRange(result.height_mm)) fail("has heights that aren't finite");
  return result.height_mm;
}

bool HeightSource::next(SourceHeights& map) {
  map = {};
  if (!estimator_) {
    if (next_ == files_.size()) return false;
    const fs::path& file = files_[next_++];
    map.file = file.filename().string();
    map.title = file.string();
    map.fault = datasets::fault_in([&] { map.height_mm = checked(file, [&] { return heights_of(file); }); });
    return true;
  }
  for (;;) {
    if (!open_) {
      if (next_ == streams_.size()) return false;
      open_ = streams_[next_++].open();
    }
    datasets::SourceFrame frame;
    if (open_->next(frame)) {
      map.file = datasets::name_in_table(frame);
      map.title = frame.title;
      map.fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) { map.height_mm = estimated(image); });
      return true;
    }
    open_.reset();
  }
}

cv::Mat HeightSource::checked(const fs::path& file, const std::function<cv::Mat()>& heights) const {
  cv::Mat map;
  datasets::naming(file, [&] {
    map = heights();
    if (!cv::checkRange(map)) fail("has heights that aren't finite");
  });
  return map;
}

cv::Mat HeightSource::read(datasets::TableFrames& frames, const fs::path& file) {
  return checked(file, [&] { return estimator_ ? estimated(frames.read(file)) : heights_of(file); });
}

}  // namespace touchstone::lab
