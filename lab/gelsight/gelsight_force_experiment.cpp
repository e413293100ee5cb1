#include "lab/gelsight/gelsight_force_experiment.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/markers/contact_patch.h"
#include "sensors/markers/marked_gel.h"
#include "sensors/markers/marker_filling.h"
#include "sensors/markers/motion_ratio.h"

namespace touchstone::lab {

namespace {

constexpr int kBackgroundFrames = 4;
constexpr int kBackgroundFrame = 1000000;  ///< number of the first: its noise is no frame's
constexpr double kRisesTo = 0.95;   ///< of the largest shear force: up to there the gel sticks (samples_before_slip)
constexpr double kClear_mm = 0.02;  ///< above the gel, where motions start
constexpr int kLeastPatch_px = 50;

/// Truths of a press with a force that grows through all of `forces_N`.
std::vector<sim::Truth> press_truths(const sim::VirtualSensor& sensor, const sim::TouchObject& object,
                                     const std::vector<double>& forces_N) {
  sim::MotionSpec motion;
  motion.start_mm = {0, 0, sim::first_touch({}, object.spec(), sensor.device().gel) + kClear_mm};
  for (const double force : forces_N) {
    sim::MotionKey key;
    key.z = sim::AxisKey{std::nullopt, force};
    motion.keys.push_back(key);
  }
  std::vector<sim::Truth> truths = sensor.play(object, motion);
  truths.erase(truths.begin());  // the start, in the air
  return truths;
}

std::vector<cv::Mat> backgrounds(const sim::VirtualSensor& sensor, std::uint64_t seed) {
  std::vector<cv::Mat> frames;
  for (int i = 0; i < kBackgroundFrames; ++i) frames.push_back(sensor.background(seed, kBackgroundFrame + i));
  return frames;
}

double diameter_px(const sim::VirtualSensor& sensor) {
  return sensor.device().coating->print ? sensor.device().coating->print->width_mm / sensor.mm_per_px() : 0.0;
}

}  // namespace

sensors::MarkerTrackerSettings marker_settings(const sim::VirtualSensor& sensor) {
  const auto& print = sensor.device().coating->print;
  if (!print) fail("device {}: has no markers", sensor.device().name);
  sensors::MarkerAppearance appearance;
  appearance.diameter_px = print->width_mm / sensor.mm_per_px();
  appearance.spacing_px = print->spacing_mm.minCoeff() / sensor.mm_per_px();
  return {.appearance = appearance};
}

cv::Mat without_markers(const cv::Mat& frame, const sensors::TrackedMarkers* markers, double diameter) {
  cv::Mat filled = frame.clone();
  if (markers != nullptr) sensors::fill_markers(filled, markers->positions, sensors::fill_radius_px(diameter));
  return filled;
}

sensors::HeightModel for_marked_gel(sensors::HeightModel model, const sim::VirtualSensor& marked, std::uint64_t seed) {
  const std::vector<cv::Mat> rest = backgrounds(marked, seed);
  model = sensors::for_marked_gel(std::move(model), rest, marker_settings(marked));
  model.mm_per_px = marked.mm_per_px();
  return model;
}

NormalSeries press_with_forces(const sim::VirtualSensor& sensor, const sensors::HeightModel& model,
                               const sim::ObjectSpec& object, const std::vector<double>& forces_N, std::uint64_t seed) {
  const sim::TouchObject touch_object = sensor.object(object);
  const std::vector<sim::Truth> truths = press_truths(sensor, touch_object, forces_N);
  std::vector<sim::Touch> touches(truths.size());
  tbb::parallel_for(std::size_t{0}, truths.size(), [&](std::size_t i) {
    touches[i] = sensor.capture(touch_object, truths[i].press, seed, static_cast<int>(i));
  });
  const cv::Mat at_rest = sensor.background(seed, kBackgroundFrame);
  NormalSeries series;
  series.indenter = object.name;
  sensors::HeightEstimator estimator(model);
  std::optional<sensors::MarkerTracker> tracker;
  if (sensor.device().coating->print) tracker.emplace(marker_settings(sensor)).track({at_rest, 0});
  std::vector<double> force, estimated, truth;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const cv::Mat& frame = touches[i].frame;
    const auto t_us = static_cast<std::int64_t>(i) + 1;
    const cv::Mat bare =
        without_markers(frame, tracker ? &tracker->track({frame, t_us}) : nullptr, diameter_px(sensor));
    cv::Mat true_height = touches[i].height.clone();
    cv::patchNaNs(true_height, 0.0);
    NormalSample sample;
    sample.force_N = truths[i].press.wrench[2];
    sample.estimated_mm3 = sensors::height_sum_mm3(estimator.estimate(bare).height_mm, sensor.mm_per_px());
    sample.true_mm3 = sensors::height_sum_mm3(true_height, sensor.mm_per_px());
    series.samples.push_back(sample);
    force.push_back(sample.force_N);
    estimated.push_back(sample.estimated_mm3);
    truth.push_back(sample.true_mm3);
  }
  series.estimated = sensors::fit_linear_force(estimated, force, sensors::FitLine::kFree);
  series.truth = sensors::fit_linear_force(truth, force, sensors::FitLine::kFree);
  return series;
}

PooledLines pool(const std::vector<NormalSeries>& series) {
  std::vector<double> force, estimated, truth;
  for (const NormalSeries& one : series) {
    for (const NormalSample& sample : one.samples) {
      force.push_back(sample.force_N);
      estimated.push_back(sample.estimated_mm3);
      truth.push_back(sample.true_mm3);
    }
  }
  return {sensors::fit_linear_force(estimated, force, sensors::FitLine::kFree),
          sensors::fit_linear_force(truth, force, sensors::FitLine::kFree)};
}

ShearTest shear_until_slip(const sim::VirtualSensor& sensor, const sim::ObjectSpec& object, double normal_N,
                           double drag_mm, int steps, std::uint64_t seed) {
  const sim::TouchObject touch_object = sensor.object(object);
  sim::MotionSpec motion;
  motion.start_mm = {-0.5 * drag_mm, 0, sim::first_touch({}, object, sensor.device().gel) + kClear_mm};
  sim::MotionKey press, drag;
  press.frames = 3;
  press.z = sim::AxisKey{std::nullopt, normal_N};
  drag.frames = steps;
  drag.x = sim::AxisKey{0.5 * drag_mm, std::nullopt};
  motion.keys = {press, drag};
  const std::vector<sim::Truth> truths = sensor.play(touch_object, motion);
  std::vector<cv::Mat> frames(truths.size());
  tbb::parallel_for(std::size_t{0}, truths.size(), [&](std::size_t i) {
    frames[i] = sensor.capture(touch_object, truths[i].press, seed, static_cast<int>(i), false).frame;
  });

  const cv::Mat background = sensor.background(seed, kBackgroundFrame);
  sensors::MarkerTracker tracker(marker_settings(sensor));
  tracker.track({background, -1});
  ShearTest test;
  cv::Mat contact;
  std::vector<double> displacement, force;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const sensors::TrackedMarkers& markers = tracker.track({frames[i], static_cast<std::int64_t>(i)});
    if (static_cast<int>(i) < press.frames) continue;  // still pressing
    sensors::motion_ratio(background, background, frames[i], {}, &contact);
    sensors::erase_markers(contact, markers, diameter_px(sensor));
    const auto patch = sensors::contact_patch(contact, kLeastPatch_px);
    if (!patch) fail("shear test of {}: no contact is seen in frame {}", object.name, i);
    const fem::PressState& state = truths[i].press;
    ShearSample sample;
    sample.drag_mm = drag_mm * (static_cast<double>(i) - press.frames) / steps;
    sample.force_N = state.wrench.head<2>().norm();
    sample.displacement_mm = sensors::patch_motion(markers, *patch).px.norm() * sensor.mm_per_px();
    sample.slides =
        std::find(state.node_state.begin(), state.node_state.end(), fem::NodeState::stick) == state.node_state.end();
    test.samples.push_back(sample);
    displacement.push_back(sample.displacement_mm);
    force.push_back(sample.force_N);
  }
  test.before_slip = sensors::samples_before_slip(force, kRisesTo);
  const auto first = [&](const std::vector<double>& values) { return std::span(values).first(test.before_slip); };
  test.line = sensors::fit_linear_force(first(displacement), first(force), sensors::FitLine::kFree);
  return test;
}

}  // namespace touchstone::lab
