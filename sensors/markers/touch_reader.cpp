#include "sensors/markers/touch_reader.h"

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <utility>

#include "core/error.h"
#include "sensors/markers/marked_gel.h"
#include "sensors/markers/marker_filling.h"

namespace touchstone::sensors {

namespace {

void check(const TouchCalibration& calibration, const TouchReaderSettings& settings) {
  if (settings.least_patch_px < 1)
    fail("touch reader: least_patch_px is {}, at least 1 is needed", settings.least_patch_px);
  if (!(calibration.mm_per_px >= 0.0) || !std::isfinite(calibration.mm_per_px))
    fail("touch reader: mm_per_px is {}, above 0 is needed, or 0 for the height model's", calibration.mm_per_px);
  if (calibration.normal && !calibration.height)
    fail("touch reader: normal force is read from heights; a height model is needed");
  if (calibration.shear && !calibration.height && calibration.mm_per_px == 0.0)
    fail("touch reader: shear force is read from markers' way in mm; mm_per_px is needed");
  if (!calibration.height) return;
  const std::string fault = frame_fault(calibration.background, calibration.height->background.mean.size());
  if (!fault.empty()) fail("touch reader: the gel at rest, for the height model, {}", fault);
}

}  // namespace

TouchCalibration at_rest(TouchCalibration parts, const cv::Mat& rest) {
  if (parts.height) parts.height = for_marked_gel(std::move(*parts.height), std::span(&rest, 1), parts.markers);
  parts.background = rest.clone();
  return parts;
}

TouchReader::TouchReader(const TouchCalibration& calibration, const TouchReaderSettings& settings)
    : calibration_(calibration), settings_(settings), tracker_(calibration.markers), rim_(settings.rim) {
  check(calibration, settings);
  if (calibration.height) heights_.emplace(*calibration.height);
  if (calibration.height && calibration.mm_per_px == 0.0) calibration_.mm_per_px = calibration.height->mm_per_px;
  calibration_.background = calibration.background.clone();  // who gave it may paint on it
  calibration_.background.copyTo(before_);
  // Before any other frame, whatever clock they have. Markers are at rest in it.
  tracker_.track({calibration_.background, std::numeric_limits<std::int64_t>::min()});
}

void TouchReader::read_heights(const Frame& frame, const TrackedMarkers& markers, double diameter_px) {
  if (!heights_) return;
  frame.image.copyTo(bare_);
  fill_markers(bare_, markers.positions, fill_radius_px(diameter_px));
  const HeightResult& heights = heights_->estimate(bare_);
  reading_.height_mm = heights.height_mm;
  reading_.trusted &= heights.trusted();
  cv::minMaxLoc(reading_.height_mm, nullptr, &reading_.height_max_mm);
  reading_.height_sum_mm3 = height_sum_mm3(reading_.height_mm, calibration_.mm_per_px);
}

void TouchReader::read_forces() {
  const bool touched = reading_.patch.has_value();
  if (calibration_.normal) {
    const LinearForce& line = *calibration_.normal;
    reading_.normal_N = touched ? line.force_N(*reading_.height_sum_mm3) : 0.0;
    reading_.normal_error_N = line.standard_error_N();
    reading_.beyond_calibration |= touched && *reading_.height_sum_mm3 > line.highest_seen;
  }
  if (calibration_.shear) {
    const LinearForce& line = *calibration_.shear;
    const Eigen::Vector2d moved_mm = calibration_.mm_per_px * reading_.moved.px;
    reading_.shear_N = shear_force_N(line, moved_mm);
    reading_.shear_error_N = line.standard_error_N();
    reading_.beyond_calibration |= touched && moved_mm.norm() > line.highest_seen;
  }
  if (touched && reading_.normal_N && reading_.shear_N) {
    reading_.force_ratio = force_ratio(*reading_.shear_N, *reading_.normal_N);
  }
}

const TouchReading& TouchReader::read(const Frame& frame) {
  const double diameter_px = tracker_.appearance()->diameter_px;
  // Either refuses a frame that can't be taken; until then the last reading stays.
  const MotionRatio motion = motion_ratio(calibration_.background, before_, frame.image, settings_.motion, &contact_);
  const TrackedMarkers& markers = tracker_.track(frame);
  reading_ = {};
  reading_.light = markers.light;
  const bool lit = markers.light == FrameLight::kNormal;
  if (lit) frame.image.copyTo(before_);  // the next frame's motion is that since the gel was seen
  reading_.trusted = lit && !markers.jumped && !markers.rest_was_touched;
  reading_.motion_ratio = motion.ratio;
  reading_.markers_found = markers.found();
  read_heights(frame, markers, diameter_px);
  erase_markers(contact_, markers, diameter_px);
  reading_.patch = contact_patch(contact_, settings_.least_patch_px);
  if (reading_.patch) reading_.moved = patch_motion(markers, *reading_.patch);
  read_forces();
  reading_.rule_slip = lit && is_slip(reading_.force_ratio, reading_.motion_ratio, settings_.rule);
  reading_.rim = rim_.update(markers, reading_.patch);
  return reading_;
}

}  // namespace touchstone::sensors
