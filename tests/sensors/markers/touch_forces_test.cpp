// A gel's lines from touches with known forces: samples by formula, and frames that are painted.

#include "sensors/markers/touch_forces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "tests/sensors/markers/painted_marked_gel.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kScale = 0.05;

/// Presses and drags: 4 N for a mm^3 and 0.1 N more, 3 N for a mm, with noise.
std::vector<TouchForceSample> samples(int series, double noise_N, double shear = 1.0, bool heights = true) {
  RandomStream random(8, 0, Purpose::kTest);
  std::vector<TouchForceSample> made;
  for (int one = 0; one < series; ++one) {
    for (int i = 1; i <= 20; ++i) {
      TouchForceSample sample;
      const double sum = 0.01 * i + 0.003 * one;
      if (heights) sample.height_sum_mm3 = sum;
      sample.moved_mm = shear * 0.01 * i * Eigen::Vector2d(std::cos(one), std::sin(one));
      sample.force_N << -3.0 * sample.moved_mm, 4.0 * sum + 0.1;
      for (int axis = 0; axis < 3; ++axis) sample.force_N[axis] += noise_N * random.normal();
      sample.series = one;
      made.push_back(sample);
    }
  }
  return made;
}

TEST(TouchForces, LinesAndTheirErrorsAreThoseOfTheFormula) {
  const GelForceFit fit = fit_gel_forces(samples(6, 0.02), kScale, "gel", "ball");
  const LinearForce& normal = normal_line(fit.model, "ball");
  EXPECT_NEAR(normal.newton_per_unit, 4.0, 0.1);
  EXPECT_NEAR(normal.offset_N, 0.1, 0.015);
  EXPECT_NEAR(shear_line(fit.model).newton_per_unit, 3.0, 0.06);
  EXPECT_EQ(fit.model.mm_per_px, kScale);
  for (const LinearForce& line : {normal, shear_line(fit.model)}) EXPECT_NEAR(line.standard_error_N(), 0.02, 0.004);
  for (const auto& left_out : fit.left_out_N) EXPECT_NEAR(left_out.value(), 0.02, 0.005);
}

TEST(TouchForces, WhatIsntShownHasNoLine) {
  const GelForceFit pressed = fit_gel_forces(samples(2, 0.0, 0.01), kScale, "gel", "ball");
  EXPECT_FALSE(pressed.model.shear);
  EXPECT_FALSE(pressed.left_out_N[0]);
  EXPECT_TRUE(pressed.left_out_N[2]);
  const GelForceFit dragged = fit_gel_forces(samples(1, 0.0, 1.0, false), kScale, "gel", "ball");
  EXPECT_TRUE(dragged.model.normal.empty());
  EXPECT_NEAR(shear_line(dragged.model).newton_per_unit, 3.0, 1e-9);
  EXPECT_FALSE(dragged.left_out_N[0]);  // one series
  EXPECT_THAT(message_of([] { fit_gel_forces(samples(2, 0.0, 0.01, false), kScale, "gel", "ball"); }),
              HasSubstr("without a height model only shear can be read"));
  EXPECT_THAT(message_of([] { fit_gel_forces({}, kScale, "gel", "ball"); }), HasSubstr("no frame"));
  std::vector<TouchForceSample> mixed = samples(2, 0.0);
  mixed.back().height_sum_mm3.reset();
  EXPECT_THAT(message_of([&] { fit_gel_forces(mixed, kScale, "gel", "ball"); }), HasSubstr("some samples have"));
  std::vector<TouchForceSample> wrong = samples(2, 0.0);
  for (TouchForceSample& one : wrong) one.force_N.z() = -one.force_N.z();  // the force on the gel
  EXPECT_THAT(message_of([&] { fit_gel_forces(wrong, kScale, "gel", "ball"); }), HasSubstr("slope"));
}

TEST(TouchForces, AModelIsForTheGelThatItWasFittedTo) {
  const GelForceModel model = fit_gel_forces(samples(2, 0.0), kScale, "gel", "ball").model;
  MarkedGel gel;
  TouchCalibration parts;
  use_forces(parts, model);
  EXPECT_FALSE(parts.normal);
  EXPECT_TRUE(parts.shear);
  EXPECT_EQ(parts.mm_per_px, kScale);
  EXPECT_THAT(message_of([&] { use_forces(parts, model, "ball"); }), HasSubstr("needs a height model"));
  parts = {};
  parts.height = small_height_model(gel.painter);
  EXPECT_THAT(message_of([&] { use_forces(parts, model); }), HasSubstr("0.05 mm a pixel, these pictures have 0.053"));
  parts.height->mm_per_px = kScale;
  use_forces(parts, model, "ball");
  EXPECT_TRUE(parts.normal && parts.shear);
  EXPECT_THAT(message_of([&] { use_forces(parts, model, "bal"); }), HasSubstr("did you mean 'ball'"));
  GelForceModel two = model;
  two.normal.push_back({"punch", model.normal.front().line});
  EXPECT_THAT(message_of([&] { use_forces(parts, two); }), HasSubstr("one must be named: ball, punch"));
  two.shear.reset();
  parts = {};
  EXPECT_THAT(message_of([&] { use_forces(parts, two); }), HasSubstr("no force can be read"));
}

TEST(TouchForces, PaintedPressesAreReadBack) {
  // Force by formula of what is painted, not of what was read: 2 N for a mm^3 of the dent, 3 N for a mm of shift.
  MarkedGel gel;
  const TouchCalibration parts = at_rest({.background = {}, .height = small_height_model(gel.painter)},
                                         gel.frame([](const Eigen::Vector2d&) { return fixtures::Relief{}; }));
  const auto press = [&](double contact_mm) {
    const fixtures::Ball ball{kGelScale_mm * Eigen::Vector2d(120, 90), 6.0, contact_mm};
    const auto field = [ball](const Eigen::Vector2d& place) { return ball.at(place); };
    return std::pair(gel.frame(field), 2.0 * height_sum_mm3(gel.painter.heights(field), kGelScale_mm));
  };
  std::vector<TouchForceSample> seen;
  TouchReader reader(parts);
  std::int64_t t_us = 0;
  EXPECT_FALSE(force_sample(reader.read({parts.background, ++t_us}), {0, 0, 0}, kGelScale_mm, 0)) << "untouched";
  for (const double contact_mm : {1.2, 1.5, 1.8, 2.1, 2.4}) {
    const auto [frame, force_N] = press(contact_mm);
    const auto sample = force_sample(reader.read({frame, ++t_us}), {0, 0, force_N}, kGelScale_mm, 0);
    ASSERT_TRUE(sample);
    seen.push_back(*sample);
  }
  TouchCalibration with_lines = parts;
  use_forces(with_lines, fit_gel_forces(seen, kGelScale_mm, "gel", "ball").model);
  TouchReader forces(with_lines);
  const auto [frame, force_N] = press(2.0);
  const TouchReading& touch = forces.read({frame, 1});
  EXPECT_FALSE(touch.shear_N) << "nothing was sheared";
  EXPECT_GT(touch.normal_error_N, 0.0);
  EXPECT_NEAR(*touch.normal_N, force_N, 3.0 * touch.normal_error_N);
  EXPECT_LT(touch.normal_error_N, 0.1 * force_N);
}

}  // namespace
}  // namespace touchstone::sensors
