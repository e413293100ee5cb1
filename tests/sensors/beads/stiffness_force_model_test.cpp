#include "sensors/beads/stiffness_force_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/sensors/beads/force_samples.h"

namespace touchstone::sensors {
namespace {

using fixtures::known_model;
using fixtures::moved;
using fixtures::rest_grid;

TEST(BeadCoordinates, DepthIsTheMeanDistanceToTheFourNeighbours) {
  std::vector<Eigen::Vector2d> positions = rest_grid(3, 10.0);
  EXPECT_DOUBLE_EQ(bead_coordinates(positions, 3, 0, 0).z(), 10.0);
  EXPECT_DOUBLE_EQ(bead_coordinates(positions, 3, 1, 1).z(), 10.0);
  positions[5].x() += 4.0;  // right of the middle
  EXPECT_DOUBLE_EQ(bead_coordinates(positions, 3, 1, 1).z(), (10.0 + 10.0 + 10.0 + 14.0) / 4.0);
  const double slanted = std::hypot(10.0, 4.0);
  EXPECT_DOUBLE_EQ(bead_coordinates(positions, 3, 0, 2).z(), (10.0 + slanted) / 2.0);
  EXPECT_DOUBLE_EQ(bead_coordinates(positions, 3, 1, 2).z(), (14.0 + 2.0 * slanted) / 3.0);
  EXPECT_EQ((bead_coordinates(positions, 3, 1, 2).head<2>()), positions[5]);
}

TEST(StiffnessForceModel, RestGivesNoForceAtAll) {
  for (const int grid : {2, 3, 10}) {
    const StiffnessForceModel model = known_model(grid, MatrixForm::kAsymmetric, 1);
    EXPECT_EQ(estimate_force(model, model.rest, model.rest), Eigen::Vector3d::Zero());
    EXPECT_FALSE(is_extrapolated(model, model.rest, model.rest));
  }
}

TEST(StiffnessForceModel, IsTheSumOverSquaresOfTheirMatrixTimesTheirBoxSum) {
  for (const int grid : {2, 3, 5}) {
    const StiffnessForceModel model = known_model(grid, MatrixForm::kAsymmetric, 2);
    const auto positions = moved(model.rest, 3.0, 5);
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (int i = 0; i + 1 < grid; ++i) {
      for (int j = 0; j + 1 < grid; ++j) {
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const auto& [row, column] : {std::pair{i, j}, {i, j + 1}, {i + 1, j}, {i + 1, j + 1}}) {
          u += bead_coordinates(positions, grid, row, column) - bead_coordinates(model.rest, grid, row, column);
        }
        expected += model.stiffness[static_cast<std::size_t>(i * (grid - 1) + j)] * u;
      }
    }
    EXPECT_LT((estimate_force(model, positions, model.rest) - expected).norm(), 1e-12 * expected.norm() + 1e-12);
  }
}

TEST(StiffnessForceModel, MovingSensorAndImageTogetherChangesNothing) {
  const StiffnessForceModel model = known_model(3, MatrixForm::kAsymmetric, 3);
  auto positions = moved(model.rest, 3.0, 6);
  auto rest = model.rest;
  const Eigen::Vector3d before = estimate_force(model, positions, rest);
  for (auto& position : positions) position += Eigen::Vector2d(37.0, -12.0);
  for (auto& position : rest) position += Eigen::Vector2d(37.0, -12.0);
  EXPECT_LT((estimate_force(model, positions, rest) - before).norm(), 1e-10);
}

TEST(StiffnessForceModel, WhatWasNotSeenInTrainingIsFlagged) {
  StiffnessForceModel model = known_model(3, MatrixForm::kAsymmetric, 4);
  for (std::size_t i = 0; i < 9; ++i) {
    model.lowest_seen[i] = {-2.0, -2.0, -1.0};
    model.highest_seen[i] = {2.0, 2.0, 1.0};
  }
  auto positions = model.rest;
  for (auto& position : positions) position.x() += 2.25;  // within 5 % of the range and 0.1 px
  EXPECT_FALSE(is_extrapolated(model, positions, model.rest));
  positions[8].x() += 0.1;  // one bead of nine
  EXPECT_TRUE(is_extrapolated(model, positions, model.rest));
  positions = model.rest;
  positions[0].y() = std::nan("");
  EXPECT_TRUE(is_extrapolated(model, positions, model.rest));
  for (std::size_t i = 0; i < 9; ++i) positions[i] = 1.05 * model.rest[i];  // the pattern widens by 3.5 px a step
  EXPECT_TRUE(is_extrapolated(model, positions, model.rest));
}

TEST(StiffnessForceModel, EstimateCountsTheBeadsThatWereNotSeen) {
  const StiffnessForceModel model = known_model(3, MatrixForm::kAsymmetric, 5);
  TrackedBeads beads;
  beads.t_us = 77;
  beads.positions = moved(model.rest, 1.0, 8);
  beads.status.assign(9, BeadStatus::kFound);
  beads.status[1] = BeadStatus::kHidden;
  beads.status[2] = BeadStatus::kFoundAgain;
  beads.status[3] = BeadStatus::kReset;
  const ForceEstimate forced = estimate(model, beads);
  EXPECT_EQ(forced.t_us, 77);
  EXPECT_EQ(forced.beads_missing, 2);
  EXPECT_EQ(forced.force, estimate_force(model, beads.positions, model.rest));
  EXPECT_EQ(estimate(model, beads, beads.positions).force, Eigen::Vector3d::Zero());
}

TEST(StiffnessForceModel, WrongNumberOfBeadsIsRefused) {
  const StiffnessForceModel model = known_model(3, MatrixForm::kAsymmetric, 6);
  const auto four = rest_grid(2, 10.0);
  EXPECT_THROW(estimate_force(model, four, model.rest), Error);
  EXPECT_THROW(estimate_force(model, model.rest, four), Error);
  EXPECT_THROW(is_extrapolated(model, four, model.rest), Error);
}

TEST(StiffnessForceModel, FaultsAreNamed) {
  const StiffnessForceModel good = known_model(3, MatrixForm::kAsymmetric, 7);
  EXPECT_EQ(fault_of(good), "");
  const auto fault = [&](auto change) {
    StiffnessForceModel model = good;
    change(model);
    return fault_of(model);
  };
  using testing::HasSubstr;
  EXPECT_THAT(fault([](auto& m) { m.grid = 4; }), HasSubstr("stiffness has 4"));
  EXPECT_THAT(fault([](auto& m) { m.grid = 1; }), HasSubstr("grid is 1"));
  EXPECT_THAT(fault([](auto& m) { m.stiffness[2](2, 1) = std::nan(""); }), HasSubstr("stiffness 2"));
  EXPECT_THAT(fault([](auto& m) { m.stiffness[1](0, 2) = 0.5; }), HasSubstr("asymmetric"));
  EXPECT_THAT(fault([](auto& m) { m.form = MatrixForm::kDiagonal; }), HasSubstr("diagonal"));
  EXPECT_THAT(fault([](auto& m) { m.form = MatrixForm::kSymmetric; }), HasSubstr("isn't symmetric"));
  EXPECT_THAT(fault([](auto& m) { m.rest.pop_back(); }), HasSubstr("rest has 8"));
  EXPECT_THAT(fault([](auto& m) { m.rest[3].x() = INFINITY; }), HasSubstr("rest 3"));
  EXPECT_THAT(fault([](auto& m) { m.lowest_seen[3].x() = 1e9; }), HasSubstr("lowest_seen 3 is above"));
}

}  // namespace
}  // namespace touchstone::sensors
