#include "lab/gelsight/height_source.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/natural_order.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/frame_sequence.h"
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

HeightSource::HeightSource(const sensors::HeightModel& model, const fs::path& frames)
    : files_(datasets::picture_files(frames)), mm_per_px_(model.mm_per_px) {
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

cv::Mat HeightSource::read(const fs::path& file) {
  cv::Mat heights;
  datasets::naming(file, [&] {
    if (!estimator_) {
      heights = heights_of(file);
    } else {
      const sensors::HeightResult& result = estimator_->estimate(sim::read_image(file));
      if (!result.trusted()) fail("is {}", result.overexposed ? "overexposed" : result.dark ? "dark" : "of one colour");
      heights = result.height_mm;
    }
    if (!cv::checkRange(heights)) fail("has heights that aren't finite");
  });
  return heights;
}

}  // namespace touchstone::lab
