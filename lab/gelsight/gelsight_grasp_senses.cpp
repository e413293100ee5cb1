#include "lab/gelsight/gelsight_grasp_senses.h"

#include <memory>

#include "lab/gelsight/gelsight_force_experiment.h"
#include "lab/gelsight/gelsight_height_experiment.h"

namespace touchstone::lab {
namespace {

constexpr double kForceBall_mm = 12.7;
constexpr double kShearEnd_mm = 10.0;
constexpr double kShearNormal_N = 0.6;
constexpr double kShearDrag_mm = 0.3;  // it slides at some 0.2
constexpr int kShearSteps = 12;
constexpr double kCalibrationFriction = 0.5;
constexpr int kFrameOfBackground = 2000000;  // its noise is no other frame's

/// The estimators of one trial, and what they remember.
class Perception {
 public:
  Perception(const sensors::TouchCalibration& calibration, const GraspSenseSettings& settings)
      : settings_(settings), reader_(calibration, {.rule = settings.rule}) {}

  sensors::GraspReading sense(const cv::Mat& frame) {
    const sensors::TouchReading& touch = reader_.read({frame, frames_++});
    sensors::GraspReading reading;
    reading.height_max_mm = touch.height_max_mm;
    reading.normal_force_N = touch.normal_N;
    reading.slip = touch.rule_slip || (settings_.rim && touch.rim.slips());
    if (reading.slip) forgetting_ = settings_.forget_frames;
    if (forgetting_ > 0) {
      reader_.forget_slip();
      --forgetting_;
    }
    return reading;
  }

 private:
  GraspSenseSettings settings_;
  sensors::TouchReader reader_;
  std::int64_t frames_ = 0;
  int forgetting_ = 0;  // frames
};

}  // namespace

sensors::TouchCalibration calibrate_for_grasps(const sim::VirtualSensor& flat, const sim::VirtualSensor& marked,
                                               std::uint64_t seed) {
  sensors::TouchCalibration calibration;
  const sensors::HeightModel of_flat = calibrate_heights(flat, {}, {}, seed).calibration.model;
  calibration.height = for_marked_gel(of_flat, marked, seed);
  calibration.markers = marker_settings(marked);
  calibration.background = marked.background(seed, kFrameOfBackground);
  calibration.normal =
      press_with_forces(marked, *calibration.height, with_friction(ball_of(kForceBall_mm), kCalibrationFriction),
                        {0.1, 0.2, 0.4, 0.6}, seed)
          .estimated;
  calibration.shear = shear_until_slip(marked, with_friction(flat_cylinder_of(kShearEnd_mm), kCalibrationFriction),
                                       kShearNormal_N, kShearDrag_mm, kShearSteps, seed)
                          .line;
  return calibration;
}

GraspSenses grasp_senses(const sensors::TouchCalibration& calibration, const GraspSenseSettings& settings) {
  return [perception = std::make_shared<Perception>(calibration, settings)](const cv::Mat& frame) {
    return perception->sense(frame);
  };
}

}  // namespace touchstone::lab
