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

/// What is known of one sensor. Of a gel that nothing more is known of than how it looks at rest, contact, motion and
/// slip at the rim are read; forces and the thesis's slip rule need lines, heights and normal force a height model.
struct TouchCalibration {
  cv::Mat background;  ///< one frame of the untouched gel, with its markers; grey or BGR, 8 bit
  MarkerTrackerSettings markers = {};
  std::optional<HeightModel> height = {};  ///< its background without markers (marked_gel.h)
  std::optional<LinearForce> normal = {};  ///< of the height map's sum, mm^3, for the shape of what is touched
  std::optional<LinearForce> shear = {};   ///< of the mean marker displacement, mm
  double mm_per_px = 0.0;                  ///< of the gel's face; 0: the height model's
};

/// Those parts for a gel that looks like this at rest, markers and all: the height model is made for_marked_gel.
/// @throws Error as that and MarkerTracker::track do
TouchCalibration at_rest(TouchCalibration parts, const cv::Mat& rest);

/// The thresholds of slip, and the least contact.
struct TouchReaderSettings {
  MotionRatioSettings motion = {};
  SlipThresholds rule = {};
  IncipientSlipSettings rim = {};
  int least_patch_px = 50;  ///< a smaller contact is noise; at least 1
};

/// What one frame says.
struct TouchReading {
  cv::Mat
      height_mm;  ///< CV_32FC1, markers painted over (height_map.h); valid until the next frame; empty without model
  double height_max_mm = 0.0;            ///< of that, indentation positive
  std::optional<double> height_sum_mm3;  ///< of that; none without height model
  std::optional<ContactPatch> patch;     ///< none: nothing touches
  PatchMotion moved;                     ///< of the markers on the patch since rest
  std::optional<double> normal_N;        ///< its line's answer, 0 where nothing touches; none without line
  /// The object's on the gel, along u and v, zero where nothing touches; none without line. That on the object is the
  /// opposite one.
  std::optional<Eigen::Vector2d> shear_N;
  double normal_error_N = 0.0, shear_error_N = 0.0;  ///< standard errors (of each component), of the lines' samples
  bool beyond_calibration = false;  ///< a measure is larger than any that a line was fitted to: that force is a guess
  std::optional<double> force_ratio, motion_ratio;  ///< slip_rule.h, motion_ratio.h
  bool rule_slip = false;                           ///< both of them above their thresholds
  IncipientSlip rim;                                ///< slip that begins at the contact's rim
  int markers_found = 0;
  /// Of the frame. Where it isn't normal nothing is measured: heights and forces mean nothing, markers are held.
  FrameLight light = FrameLight::kNormal;
  bool trusted = false;  ///< it has light, markers have their own names, no frame so far has shown that the
                         ///< gel at rest was touched, and heights aren't of an overexposed frame
};

/// Reads the frames of one sensor, in their order. One object is for one thread.
class TouchReader {
 public:
  /// @throws Error for a background of another size or kind than the height model's, or without markers that could be
  /// followed; for a line whose measure can't be had (normal force without heights, shear without mm_per_px); for
  /// settings out of their range
  explicit TouchReader(const TouchCalibration& calibration, const TouchReaderSettings& settings = {});

  /// @throws Error for a frame of another size or kind than the background, or that isn't later than the one before;
  /// reader and last reading are then as they were
  const TouchReading& read(const Frame& frame);

  /// The rim's detector forgets the frames before: for who has just answered slip, since the answer moves the contact,
  /// too.
  void forget_slip() { rim_.restart(); }

  /// Of the last frame, or of the background; valid until the next one.
  const TrackedMarkers& markers() const { return tracker_.tracked(); }

  /// It follows them: what markers look like, and how far apart they are.
  const MarkerTracker& tracker() const { return tracker_; }

 private:
  void read_heights(const Frame& frame, const TrackedMarkers& markers, double diameter_px);
  void read_forces();

  TouchCalibration calibration_;
  TouchReaderSettings settings_;
  std::optional<HeightEstimator> heights_;
  MarkerTracker tracker_;
  IncipientSlipDetector rim_;
  cv::Mat before_, bare_, contact_;
  TouchReading reading_;
};

}  // namespace touchstone::sensors
