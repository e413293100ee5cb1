#pragma once
// Frame in, touch out: what a fingertip with markers reads from one picture [Li2015, ch. 4] -- how deep, how hard,
// sheared how far, and whether it slips. The order in which the parts of this library are asked is here, once:
// markers are followed, painted over for the heights and taken out of the contact mask, and what is left of that mask
// says which of them lie on the object.

#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/frame.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/markers/contact_patch.h"
#include "sensors/markers/incipient_slip.h"
#include "sensors/markers/linear_force.h"
#include "sensors/markers/marker_tracker.h"
#include "sensors/markers/motion_ratio.h"
#include "sensors/markers/slip_rule.h"

namespace touchstone::sensors {

/// What has to be known of one sensor.
struct TouchCalibration {
  HeightModel height;  ///< its background without markers (marker_filling.h)
  MarkerTrackerSettings markers;
  cv::Mat background;  ///< one frame of the untouched gel, with its markers
  LinearForce normal;  ///< of the height map's sum, mm^3, for the shape of what is touched
  LinearForce shear;   ///< of the mean marker displacement, mm
};

/// The thresholds of slip, and the least contact.
struct TouchReaderSettings {
  MotionRatioSettings motion = {};
  SlipThresholds rule = {};
  IncipientSlipSettings rim = {};
  int least_patch_px = 50;  ///< a smaller contact is noise; at least 1
};

/// What one frame says.
struct TouchReading {
  cv::Mat height_mm;                  ///< CV_32FC1, markers painted over (height_map.h); valid until the next frame
  double height_max_mm = 0.0;         ///< of that, indentation positive
  std::optional<ContactPatch> patch;  ///< none: nothing touches
  double normal_N = 0.0;              ///< its line's answer, which is the offset where nothing touches
  Eigen::Vector2d shear_N = Eigen::Vector2d::Zero();  ///< along u and v; zero without a patch
  std::optional<double> force_ratio, motion_ratio;    ///< slip_rule.h, motion_ratio.h
  bool rule_slip = false;                             ///< both of them above their thresholds
  IncipientSlip rim;                                  ///< slip that begins at the contact's rim
  int markers_found = 0;
  /// Of the frame. Where it isn't normal nothing is measured: heights and forces mean nothing, markers are held.
  FrameLight light = FrameLight::kNormal;
};

/// Reads the frames of one sensor, in their order. One object is for one thread.
class TouchReader {
 public:
  /// @throws Error for a background of another size than the height model's, or without markers that could be
  /// followed; for settings out of their range
  explicit TouchReader(const TouchCalibration& calibration, const TouchReaderSettings& settings = {});

  /// @throws Error for a frame of another size or kind than the background, or that isn't later than the one before;
  /// reader and last reading are then as they were
  const TouchReading& read(const Frame& frame);

  /// The rim's detector forgets the frames before: for who has just answered slip, since the answer moves the contact,
  /// too.
  void forget_slip() { rim_.restart(); }

  /// Of the last frame, or of the background; valid until the next one.
  const TrackedMarkers& markers() const { return tracker_.tracked(); }

 private:
  TouchCalibration calibration_;
  TouchReaderSettings settings_;
  HeightEstimator heights_;
  MarkerTracker tracker_;
  IncipientSlipDetector rim_;
  cv::Mat before_, bare_, contact_;
  TouchReading reading_;
};

}  // namespace touchstone::sensors
