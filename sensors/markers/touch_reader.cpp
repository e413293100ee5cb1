#include "sensors/markers/touch_reader.h"

#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "sensors/markers/marker_filling.h"

namespace touchstone::sensors {

TouchReader::TouchReader(const TouchCalibration& calibration, const TouchReaderSettings& settings)
    : calibration_(calibration),
      settings_(settings),
      heights_(calibration.height),
      tracker_(calibration.markers),
      rim_(settings.rim) {
  if (settings.least_patch_px < 1)
    fail("touch reader: least_patch_px is {}, at least 1 is needed", settings.least_patch_px);
  if (calibration.background.size() != calibration.height.background.mean.size())
    fail("touch reader: the background is {} x {} px, the height model's {} x {}", calibration.background.cols,
         calibration.background.rows, calibration.height.background.mean.cols, calibration.height.background.mean.rows);
  calibration_.background = calibration.background.clone();  // who gave it may paint on it
  calibration_.background.copyTo(before_);
  // Before any other frame, whatever clock they have. Markers are at rest in it.
  tracker_.track({calibration_.background, std::numeric_limits<std::int64_t>::min()});
}

const TouchReading& TouchReader::read(const Frame& frame) {
  const double diameter_px = tracker_.appearance()->diameter_px;
  const double mm_per_px = calibration_.height.mm_per_px;
  // Either refuses a frame that can't be taken; until then the last reading stays.
  const MotionRatio motion = motion_ratio(calibration_.background, before_, frame.image, settings_.motion, &contact_);
  const TrackedMarkers& markers = tracker_.track(frame);
  reading_ = {};
  reading_.light = markers.light;
  const bool lit = markers.light == FrameLight::kNormal;
  if (lit) frame.image.copyTo(before_);  // the next frame's motion is that since the gel was seen
  reading_.motion_ratio = motion.ratio;
  reading_.markers_found = markers.found();

  frame.image.copyTo(bare_);
  fill_markers(bare_, markers.positions, fill_radius_px(diameter_px));
  reading_.height_mm = heights_.estimate(bare_).height_mm;
  cv::minMaxLoc(reading_.height_mm, nullptr, &reading_.height_max_mm);
  reading_.normal_N = calibration_.normal.force_N(height_sum_mm3(reading_.height_mm, mm_per_px));

  erase_markers(contact_, markers, diameter_px);
  reading_.patch = contact_patch(contact_, settings_.least_patch_px);
  if (reading_.patch) {
    const Eigen::Vector2d moved_mm = mm_per_px * mean_displacement(markers, *reading_.patch).px;
    reading_.shear_N = shear_force_N(calibration_.shear, moved_mm);
    reading_.force_ratio = force_ratio(reading_.shear_N, reading_.normal_N);
  }
  reading_.rule_slip = lit && is_slip(reading_.force_ratio, reading_.motion_ratio, settings_.rule);
  reading_.rim = rim_.update(markers, reading_.patch);
  return reading_;
}

}  // namespace touchstone::sensors
