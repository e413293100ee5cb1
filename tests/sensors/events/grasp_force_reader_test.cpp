// Force from events as they come, and forces of readings of their own times.

#include "sensors/events/grasp_force_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sensors/events/force_readings.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/learning/gaussian_process_tuning.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/sensors/models/resealed_json.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

const EventWindowSettings kWindows{.start_us = 5000, .size = {32, 24}};

/// Grasps of one material: then counts tell the force, but for their noise.
std::vector<ForceSeries> one_material(int count, bool with_time) {
  std::vector<ForceSeries> series;
  for (int i = 0; i < count; ++i) series.push_back(synthetic_series(synthetic_grasp(i, 1), with_time));
  return series;
}

TimeDelayNetwork network() {
  TimeDelayNetworkSettings settings;
  settings.hidden_layers = 1;
  settings.units = 6;
  settings.training.most_steps = 30;
  return train_time_delay_network(one_material(8, false), range(0, 6), range(6, 8), settings).model;
}

GaussianProcess process() {
  const std::vector<ForceSeries> series = one_material(8, true);
  const StackedSeries stacked = stack(series, range(0, 8));
  return tune_gaussian_process(stacked.features, stacked.force_N, {}, {},
                               {.method = TuningMethod::kGradient, .aim = TuningAim::kEvidence})
      .process;
}

TEST(GraspForceReader, AnswersAsAWholeGraspWouldWhateverThePortions) {
  const SyntheticGrasp grasp = synthetic_grasp(30, 1);
  const TimeDelayNetwork model = network();
  const Eigen::VectorXd wanted = estimate_force(model, synthetic_series(grasp, false).features);
  const std::vector<Event> events = events_of(grasp, kWindows.start_us);
  for (const std::size_t portion : {std::size_t{1}, std::size_t{977}, events.size()}) {
    GraspForceReader reader({model}, kWindows);
    for (std::size_t i = 0; i < events.size(); i += portion) {
      reader.add(std::span(events).subspan(i, std::min(portion, events.size() - i)));
    }
    reader.end_at(kWindows.start_us + 7000 * std::ssize(grasp.windows));
    ASSERT_EQ(reader.forces().size(), grasp.windows.size());
    for (std::size_t i = 0; i < grasp.windows.size(); ++i) {
      const WindowForce& window = reader.forces()[i];
      EXPECT_EQ(window.counts, grasp.windows[i]);
      EXPECT_EQ(window.end_us, kWindows.start_us + 7000 * (static_cast<std::int64_t>(i) + 1));
      EXPECT_EQ(window.touched, static_cast<int>(i) >= grasp.first_touch) << i;
      const Eigen::Index row = static_cast<Eigen::Index>(i) - grasp.first_touch;
      EXPECT_EQ(window.force_N, row >= 0 && row < wanted.size() ? wanted[row] : window.force_N) << i;
      if (row < 0) {
        EXPECT_EQ(window.force_N, 0.0);
      }
      EXPECT_FALSE(window.sigma_N) << "it was never tried on another grasp";
    }
  }
}

TEST(GraspForceReader, AProcessStatesItsErrorAndWhatIsBeyondIt) {
  const GaussianProcess model = process();
  for (int index = 40; index < 50; ++index) {
    const SyntheticGrasp grasp = synthetic_grasp(index, 1);
    GraspForceReader reader({model, GraspForceError{0.2, 0.1, 0.25}}, kWindows);
    GraspForceReader untried({model}, kWindows);
    untried.add(events_of(grasp, kWindows.start_us));
    reader.add(events_of(grasp, kWindows.start_us));
    for (std::size_t i = 30; i < 30 + 22; ++i) {
      const WindowForce& window = reader.forces()[i];
      ASSERT_TRUE(window.sigma_N);
      // Instead of the process' own noise, errors of which a quarter grows with the force.
      const double variance = std::pow(*untried.forces()[i].sigma_N, 2) - std::pow(model.parameters.noise, 2);
      EXPECT_GE(variance, -1e-12);
      EXPECT_NEAR(std::pow(*window.sigma_N, 2), variance + 0.01 + std::pow(0.25 * window.force_N, 2), 1e-9);
      EXPECT_NEAR(window.force_N, grasp.force_N[static_cast<Eigen::Index>(i)], 0.5);
    }
  }
  SyntheticGrasp long_one = synthetic_grasp(60, 1);
  long_one.windows.insert(long_one.windows.begin() + 60, 60, EventCounts{20, 20});  // held for 0.42 s more
  GraspForceReader reader({model}, kWindows);
  reader.add(events_of(long_one, kWindows.start_us));
  EXPECT_FALSE(reader.forces()[35].extrapolates);
  EXPECT_TRUE(reader.forces().back().extrapolates);
}

TEST(GraspForceReader, WithoutATouchThereIsNoForce) {
  SyntheticGrasp rest = synthetic_grasp(3, 1);
  rest.windows.assign(80, EventCounts{20, 21});
  GraspForceReader reader({network()}, kWindows);
  const std::vector<Event> events = events_of(rest, kWindows.start_us);
  reader.add(std::span(events).first(events.size() / 8));
  EXPECT_FALSE(reader.touch_threshold()) << "the scene at rest is still looked at";
  reader.add(std::span(events).subspan(events.size() / 8));
  ASSERT_TRUE(reader.touch_threshold());
  EXPECT_GT(*reader.touch_threshold(), 21);
  for (const WindowForce& window : reader.forces()) EXPECT_TRUE(!window.touched && window.force_N == 0.0);
}

TEST(GraspForceReader, WhatCantBeReadIsRefused) {
  GraspForceReader reader({network()}, kWindows);
  const std::vector<Event> events = events_of(synthetic_grasp(3, 1), kWindows.start_us);
  reader.add(std::span(events).first(2000));
  const std::size_t before = reader.forces().size();
  EXPECT_GT(before, 10U);
  EXPECT_NE(message_of([&] { reader.add(std::span(events).first(1)); }), "no error");
  EXPECT_EQ(reader.forces().size(), before);
  const std::vector<ForceSeries> three = one_material(4, true);
  const StackedSeries stacked = stack(three, range(0, 4));
  EXPECT_THAT(message_of([&] {
                const Eigen::MatrixXd counts = stacked.features.leftCols(2);
                GraspForceReader({condition({Eigen::Vector2d(1, 1), 1.0, 0.5}, counts, stacked.force_N)}, kWindows);
              }),
              HasSubstr("2 inputs"));
  TimeDelayNetworkSettings small;
  small.hidden_layers = 1;
  small.units = 2;
  small.training.most_steps = 2;
  EXPECT_THAT(
      message_of([&] { GraspForceReader({train_time_delay_network(three, range(0, 4), {}, small).model}, kWindows); }),
      HasSubstr("3 features"));
}

TEST(GraspForceModelFile, EitherKindComesBackToTheBit) {
  const touchstone::test::TemporaryFolder folder;
  for (const GraspForceModel& model :
       {GraspForceModel{network(), GraspForceError{0.125, 0.1, 0.02}}, GraspForceModel{process()}}) {
    save(model, folder.path() / "model.json");
    const GraspForceModel back = load_grasp_force_model(folder.path() / "model.json");
    EXPECT_EQ(to_json(back), to_json(model));
    EXPECT_EQ(back.error.has_value(), model.error.has_value());
    EXPECT_EQ(back.sigma_N(1.5, 0.25), model.sigma_N(1.5, 0.25));
    EXPECT_EQ(back.estimator.index(), model.estimator.index());
  }
}

TEST(GraspForceModelFile, FaultyFilesAreRefused) {
  const std::string good = to_json(GraspForceModel{network(), GraspForceError{0.125, 0.1, 1.5}});
  const auto refused = [&](const auto& change, const std::string& part) {
    EXPECT_THAT(message_of([&] { grasp_force_model_from_json(test::resealed(good, change), "x.json"); }),
                testing::AllOf(HasSubstr("x.json"), HasSubstr(part)));
  };
  refused([](auto& json) { json["error"]["absolute_N"] = -1.0; }, "an error is -1");
  refused([](auto& json) { json["error"].erase("relative"); }, "'relative' is missing");
  refused([](auto& json) { json["error"]["left_out_N"] = "x"; }, "error.left_out_N");
  refused([](auto& json) { json["error"] = 3; }, "error");
  refused([](auto& json) { json["scale"] = 1.0; }, "'scale' isn't known");
  refused([](auto& json) { json["estimator"]["format"] = "touchstone.hue_model"; }, "'touchstone.hue_model'");
  refused([](auto& json) { json["estimator"]["delays"] = 4; }, "checksum");  // the estimator's own
  refused([](auto& json) { json["estimator"] = 3; }, "a map is needed");
  std::string changed = good;
  changed.replace(changed.find("1.5"), 3, "2.5");
  EXPECT_THAT(message_of([&] { grasp_force_model_from_json(changed, "x.json"); }), HasSubstr("checksum"));
  EXPECT_THAT(message_of([] { grasp_force_model_from_json("[1]", "x.json"); }), HasSubstr("x.json"));
}

TEST(GraspForceError, BothPartsAreThoseOfTheErrors) {
  RandomStream random(3, 0, Purpose::kTest);
  std::vector<double> force_N, off_N, small_N, doubled_N;
  for (int i = 0; i < 20000; ++i) {
    force_N.push_back(3.0 * random.uniform());
    off_N.push_back(std::hypot(0.05, 0.1 * force_N.back()) * random.normal());
    small_N.push_back(0.05 * random.normal());
    doubled_N.push_back(0.1 * force_N.back() * random.normal());
  }
  const GraspForceError error = fit_force_error(off_N, force_N);
  EXPECT_NEAR(error.absolute_N, 0.05, 0.015);
  EXPECT_NEAR(error.relative, 0.1, 0.005);
  EXPECT_NEAR(error.left_out_N, std::sqrt(0.0025 + 0.03), 0.005);  // 0.1^2 times 3 N^2
  EXPECT_LT(fit_force_error(small_N, force_N).relative, 0.01);
  EXPECT_LT(fit_force_error(doubled_N, force_N).absolute_N, 0.03);
  const std::vector<double> one_force(20000, 2.0);
  EXPECT_EQ(fit_force_error(off_N, one_force).relative, 0.0) << "what grows can't be seen";
}

TEST(ForceReadings, MeansAreThoseOfAStraightCourse) {
  const ForceReadings readings{{100, 200, 400}, {1.0, 3.0, 3.0}};
  EXPECT_NEAR(mean_force_N(readings, 100, 200), 2.0, 1e-12);
  EXPECT_NEAR(mean_force_N(readings, 150, 250), (50 * 2.5 + 50 * 3.0) / 100, 1e-12);
  EXPECT_NEAR(mean_force_N(readings, 0, 150), (100 * 1.0 + 50 * 1.5) / 150, 1e-12) << "before the first as that";
  EXPECT_NEAR(mean_force_N(readings, 300, 900), 3.0, 1e-12) << "after the last as that";
  EXPECT_NEAR(mean_force_N(readings, 120, 130), 1.5, 1e-12) << "between two";
  EXPECT_EQ(fault_of(readings), "");
  EXPECT_THAT(fault_of(ForceReadings{{1, 1}, {0, 0}}), HasSubstr("1 us, the one before of 1 us"));
  EXPECT_THAT(fault_of(ForceReadings{{1}, {std::numeric_limits<double>::quiet_NaN()}}), HasSubstr("force 0"));
  EXPECT_THAT(fault_of(ForceReadings{}), HasSubstr("no forces"));
  EXPECT_THAT(fault_of(ForceReadings{{1, 2}, {0}}), HasSubstr("2 times have 1"));
}

}  // namespace
}  // namespace touchstone::sensors
