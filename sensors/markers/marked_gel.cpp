#include "sensors/markers/marked_gel.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "sensors/markers/marker_filling.h"

namespace touchstone::sensors {

HeightModel for_marked_gel(HeightModel model, std::span<const cv::Mat> rest, const MarkerTrackerSettings& markers) {
  std::vector<cv::Mat> bare;
  for (const cv::Mat& picture : rest) {
    if (const std::string fault = frame_fault(picture, model.background.mean.size()); !fault.empty()) {
      fail("the gel at rest: {}", fault);
    }
    MarkerTracker tracker(markers);
    const TrackedMarkers& seen = tracker.track({picture, 0});
    bare.push_back(picture.clone());
    fill_markers(bare.back(), seen.positions, fill_radius_px(tracker.appearance()->diameter_px));
  }
  const std::optional<cv::Vec3d> noise_DN = model.background.noise_DN;
  model.background = mean_background(bare);
  if (!model.background.noise_DN) model.background.noise_DN = noise_DN;  // one picture shows none
  return model;
}

}  // namespace touchstone::sensors
