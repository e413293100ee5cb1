#include "lab/gelsight_grasp_senses.h"

#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "lab/gelsight_force_experiment.h"
#include "lab/gelsight_height_experiment.h"
#include "sensors/contact_patch.h"
#include "sensors/height_estimator.h"
#include "sensors/incipient_slip.h"
#include "sensors/motion_ratio.h"

namespace touchstone::lab {
namespace {

constexpr double kForceBall_mm = 12.7;
constexpr double kShearEnd_mm = 10.0;
constexpr double kShearNormal_N = 0.6;
constexpr double kShearDrag_mm = 1.0;
constexpr int kShearSteps = 10;
constexpr double kCalibrationFriction = 0.5;
constexpr int kLeastPatch_px = 50;
constexpr int kFrameOfBackground = 2000000;  // its noise is no other frame's

/// The estimators of one trial, and what they remember.
class Eyes {
 public:
  Eyes(const GraspCalibration& calibration, const GraspSenseSettings& settings)
      : calibration_(calibration),
        settings_(settings),
        heights_(calibration.height),
        tracker_(calibration.markers),
        before_(calibration.background) {}

  sensors::GraspSight look(const cv::Mat& frame) {
    const double diameter = calibration_.markers.look.diameter_px;
    const double mm_per_px = calibration_.height.mm_per_px;
    const sensors::TrackedMarkers& markers = tracker_.track({frame, frames_++});
    const cv::Mat& height = heights_.estimate(without_markers(frame, &markers, diameter)).height_mm;
    const sensors::MotionRatio motion = sensors::motion_ratio(calibration_.background, before_, frame, {}, &contact_);
    before_ = frame;
    sensors::erase_markers(contact_, markers, diameter);
    const auto patch = sensors::contact_patch(contact_, kLeastPatch_px);
    const double normal_N = calibration_.normal.force_N(sensors::height_sum_mm3(height, mm_per_px));
    std::optional<double> force_ratio;
    if (patch) {
      const Eigen::Vector2d moved_mm = mm_per_px * sensors::mean_displacement(markers, *patch).px;
      force_ratio = sensors::force_ratio(calibration_.shear.newton_per_unit * moved_mm, normal_N);
    }
    const sensors::SlipState rim = incipient_.look(markers, patch).state;
    sensors::GraspSight sight;
    cv::minMaxLoc(height, nullptr, &sight.height_max_mm);
    sight.normal_force_N = normal_N;
    sight.slip = sensors::is_slip(force_ratio, motion.ratio, settings_.rule) ||
                 (settings_.rim && (rim == sensors::SlipState::kIncipient || rim == sensors::SlipState::kSliding));
    if (sight.slip) forgetting_ = settings_.forget_frames;
    if (forgetting_ > 0) {
      incipient_.restart();
      --forgetting_;
    }
    return sight;
  }

 private:
  GraspCalibration calibration_;
  GraspSenseSettings settings_;
  sensors::HeightEstimator heights_;
  sensors::MarkerTracker tracker_;
  sensors::IncipientSlipDetector incipient_;
  cv::Mat before_;
  cv::Mat contact_;
  std::int64_t frames_ = 0;
  int forgetting_ = 0;  // frames
};

}  // namespace

GraspCalibration calibrate_for_grasps(const sim::TouchRig& flat, const sim::TouchRig& marked, std::uint64_t seed) {
  GraspCalibration calibration;
  const sensors::HeightModel of_flat = calibrate_rig(flat, {}, {}, seed).calibration.model;
  calibration.height = for_marked_gel(of_flat, marked, seed);
  calibration.markers = marker_settings(marked);
  calibration.background = marked.background(seed, kFrameOfBackground);
  calibration.normal =
      press_with_forces(marked, calibration.height, with_friction(ball_of(kForceBall_mm), kCalibrationFriction),
                        {0.1, 0.2, 0.4, 0.6}, seed)
          .estimated;
  calibration.shear = shear_until_slip(marked, with_friction(flat_cylinder_of(kShearEnd_mm), kCalibrationFriction),
                                       kShearNormal_N, kShearDrag_mm, kShearSteps, seed)
                          .line;
  return calibration;
}

GraspSenses grasp_senses(const GraspCalibration& calibration, const GraspSenseSettings& settings) {
  return [eyes = std::make_shared<Eyes>(calibration, settings)](const cv::Mat& frame) { return eyes->look(frame); };
}

}  // namespace touchstone::lab
