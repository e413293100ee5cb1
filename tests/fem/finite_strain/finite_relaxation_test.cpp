// Laws of a press at finite strain on a gel that relaxes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

constexpr double kRadius = 5.0;
const PronySeries kSeries = {{0.2, 0.1}, {0.3, 2.0}};

const FiniteGel& gel() {
  static const FiniteGel made(fixtures::box_mesh({8, 8, 3}, 6, 6, 3), std::vector<ElasticMaterial>{{0.33, 0.49}}, {},
                              3.0);
  return made;
}

PressTarget sphere_at(double x, double depth, double seconds) {
  PressTarget target;
  target.axis = {AxisControl::at(x), AxisControl::at(0.0), AxisControl::at(kRadius - depth)};
  target.seconds = seconds;
  return target;
}

FinitePress pressed(double friction, PronySeries series = kSeries) {
  return FinitePress(gel(), SphereShape{kRadius}, friction, {}, std::move(series));
}

/// The hereditary integral of a force that goes linearly between the times given, by a fine sum.
double integral(const std::vector<double>& time, const std::vector<double>& force) {
  constexpr int kParts = 2000;
  double sum = 0.0;
  for (std::size_t k = 1; k < time.size(); ++k) {
    for (int i = 0; i < kParts; ++i) {
      const double then = time[k - 1] + (time[k] - time[k - 1]) * (i + 0.5) / kParts;
      sum += relaxation_at(kSeries, time.back() - then) * (force[k] - force[k - 1]) / kParts;
    }
  }
  return sum;
}

TEST(FiniteRelaxation, WithoutASeriesTimeDoesNothingToTheLastBit) {
  FinitePress with_time = pressed(0.5, {});
  FinitePress without(gel(), SphereShape{kRadius}, 0.5);
  for (const double depth : {0.3, 0.6, 0.4}) {
    const PressState& a = with_time.step(sphere_at(0.1, depth, 3.0));
    const PressState& b = without.step(sphere_at(0.1, depth, 0.0));
    EXPECT_EQ(a.wrench, b.wrench);
    EXPECT_EQ(a.traction, b.traction);
    EXPECT_EQ(a.surface_displacement, b.surface_displacement);
  }
}

TEST(FiniteRelaxation, ASphereHeldAtItsDepthRelaxesAsTheModulusAndMovesNothing) {
  FinitePress press = pressed(0.5);
  FinitePress elastic = pressed(0.5, {});
  const PressState start = press.step(sphere_at(0.0, 0.6, 0.0));
  EXPECT_LT((start.traction - elastic.step(sphere_at(0.0, 0.6, 0.0)).traction).norm(), 1e-12 * start.traction.norm());
  double time = 0.0;
  for (const double seconds : {0.1, 1.0, 10.0}) {
    const PressState& state = press.step(sphere_at(0.0, 0.6, seconds));
    const double share = relaxation_at(kSeries, time += seconds);
    EXPECT_NEAR(state.wrench[2], share * start.wrench[2], 1e-6 * start.wrench[2]) << time;
    EXPECT_LT((state.traction - share * start.traction).norm(), 1e-5 * start.traction.norm()) << time;
    EXPECT_LT((state.surface_displacement - start.surface_displacement).norm(), 1e-5);
  }
}

/// Into the gel and half out again: its shape is the elastic one's, its force that force's hereditary integral.
TEST(FiniteRelaxation, TheForceIsTheElasticForcesIntegralAlongThePath) {
  FinitePress press = pressed(0.0);
  FinitePress elastic = pressed(0.0, {});
  // The mesh's surface is touched a little below the apex: until then there's no force.
  press.step(sphere_at(0.0, -0.1, 0.0));
  elastic.step(sphere_at(0.0, -0.1, 0.0));
  const double touch = kRadius - elastic.touching({Eigen::Matrix3d::Identity(), {0, 0, 5}})->translation.z();
  EXPECT_NEAR(touch, 0.0, 0.05);
  std::vector<double> time = {0.0, 0.2 * (touch + 0.1) / 0.5};
  std::vector<double> force = {0.0, 0.0};
  double now = 0.0;
  for (const auto& [depth, seconds] : {std::pair{0.4, 0.2}, {0.8, 0.2}, {0.8, 1.0}, {0.7, 0.1}}) {
    const PressState& state = press.step(sphere_at(0.0, depth, seconds));
    const PressState& whole = elastic.step(sphere_at(0.0, depth, 0.0));
    time.push_back(now += seconds);
    force.push_back(whole.wrench[2]);
    EXPECT_NEAR(state.wrench[2], integral(time, force), 1e-6 * force.back());
    EXPECT_EQ(state.surface_displacement, whole.surface_displacement);
  }
}

TEST(FiniteRelaxation, AHeldForceMakesItCreepWithThatForce) {
  FinitePress press = pressed(0.0);
  FinitePress elastic = pressed(0.0, {});
  PressTarget target;
  target.axis[2] = AxisControl::with_force(1.0);
  std::vector<double> time = {0.0, 0.0};
  std::vector<double> force = {0.0};
  double height = kRadius;
  for (const double seconds : {0.0, 0.1, 0.5, 3.0}) {
    target.seconds = seconds;
    const PressState state = press.step(target);
    EXPECT_NEAR(state.wrench[2], 1.0, 1e-5);
    EXPECT_LT(state.force_residual, 1e-5);
    EXPECT_LT(state.gel_from_object.translation.z(), height);
    height = state.gel_from_object.translation.z();
    if (seconds > 0.0) time.push_back(time.back() + seconds);
    force.push_back(elastic.step(sphere_at(0.0, kRadius - height, 0.0)).wrench[2]);
    EXPECT_NEAR(integral(time, force), 1.0, 1e-4);
  }
  EXPECT_GT(force.back(), 1.3);
}

/// After a long hold the gel has forgotten half of its force; who goes back at once is pushed by nothing at half the
/// depth.
TEST(FiniteRelaxation, AGelThatIsLetGoFastNeverPulls) {
  FinitePress press = pressed(0.3);
  press.step(sphere_at(0.0, 0.6, 0.0));
  press.step(sphere_at(0.0, 0.6, 100.0));
  const PressState& back = press.step(sphere_at(0.0, 0.1, 0.0));
  EXPECT_GT(back.contact_vertices, 0);
  EXPECT_EQ(back.wrench.norm(), 0.0);
  EXPECT_EQ(back.traction.norm(), 0.0);
  EXPECT_GT(press.step(sphere_at(0.0, 0.1, 100.0)).wrench[2], 0.0) << "what lasts of it pushes again";
}

/// A gel that isn't touched recovers, on the way to the next touch as well.
TEST(FiniteRelaxation, WhatIsntTouchedRecovers) {
  FinitePress press = pressed(0.0);
  const double fresh = press.step(sphere_at(0.0, 0.5, 0.0)).wrench[2];
  press.step(sphere_at(0.0, 0.5, 10.0));
  EXPECT_EQ(press.step(sphere_at(0.0, -1.0, 0.0)).wrench.norm(), 0.0);
  EXPECT_LT(press.step(sphere_at(0.0, 0.5, 0.0)).wrench[2], 0.9 * fresh) << "at once";
  press.step(sphere_at(0.0, -1e-3, 0.0));
  press.step(sphere_at(0.0, -1e-3, 100.0));
  EXPECT_NEAR(press.step(sphere_at(0.0, 0.5, 0.0)).wrench[2], fresh, 1e-6 * fresh);
}

TEST(FiniteRelaxation, ABadSeriesIsRefused) {
  EXPECT_THROW(pressed(0.0, {{1.0, 1.0}}), Error);
  EXPECT_THROW(pressed(0.0, {{0.2, 0.0}}), Error);
}

}  // namespace
}  // namespace touchstone::fem
