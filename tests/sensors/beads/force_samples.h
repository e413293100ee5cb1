#pragma once
// Models with known coefficients and samples that obey them.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/random.h"
#include "sensors/beads/stiffness_force_model.h"
#include "sensors/beads/stiffness_training.h"

namespace touchstone::sensors::fixtures {

inline std::vector<Eigen::Vector2d> rest_grid(int grid, double spacing) {
  std::vector<Eigen::Vector2d> rest;
  for (int row = 0; row < grid; ++row) {
    for (int column = 0; column < grid; ++column) {
      rest.push_back(spacing * Eigen::Vector2d(column + 2.0, row + 3.0));
    }
  }
  return rest;
}

/// Positions moved by normal deviates of `deviation` px.
inline std::vector<Eigen::Vector2d> moved(std::vector<Eigen::Vector2d> positions, double deviation,
                                          std::uint64_t index) {
  RandomStream random(11, index, Purpose::kTest);
  for (Eigen::Vector2d& position : positions) {
    const double x = random.normal();
    const double y = random.normal();
    position += deviation * Eigen::Vector2d(x, y);
  }
  return positions;
}

/// Coefficients of the size that a real sensor has, different in each square.
inline StiffnessForceModel known_model(int grid, MatrixForm form, std::uint64_t index) {
  RandomStream random(12, index, Purpose::kTest);
  StiffnessForceModel model;
  model.grid = grid;
  model.form = form;
  model.rest = rest_grid(grid, 70.0);
  for (int square = 0; square < (grid - 1) * (grid - 1); ++square) {
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    for (int axis = 0; axis < 3; ++axis) h(axis, axis) = 0.05 + 0.02 * random.uniform();
    if (form != MatrixForm::kDiagonal) {
      for (int axis = 0; axis < 2; ++axis) {
        h(2, axis) = 0.04 * (random.uniform() - 0.5);
        if (form == MatrixForm::kSymmetric) h(axis, 2) = h(2, axis);
      }
    }
    model.stiffness.push_back(h);
  }
  model.lowest_seen.assign(model.rest.size(), Eigen::Vector3d::Constant(-10.0));
  model.highest_seen.assign(model.rest.size(), Eigen::Vector3d::Constant(10.0));
  return model;
}

/// Samples of a model: the beads move at random, the force is what the model says plus noise (N).
inline ForceSamples samples_of(const StiffnessForceModel& model, int count, double noise_N = 0.0) {
  ForceSamples samples;
  samples.grid = model.grid;
  samples.rest = model.rest;
  RandomStream random(13, 0, Purpose::kTest);
  for (int i = 0; i < count; ++i) {
    samples.positions.push_back(moved(model.rest, 3.0, 1000 + static_cast<std::uint64_t>(i)));
    Eigen::Vector3d force = estimate_force(model, samples.positions.back(), model.rest);
    for (double& value : force) value += noise_N * random.normal();
    samples.forces.push_back(force);
  }
  return samples;
}

/// Samples like those of the load cycle of [VisioHaptic2024, sec. 4.3]: the beads' motions are few smooth patterns, so
/// that the features are strongly correlated; shear moves beads that the normal axis' features see too.
inline ForceSamples load_cycle_samples(int count, double noise_px) {
  ForceSamples samples;
  samples.grid = 3;
  samples.rest = rest_grid(3, 70.0);
  RandomStream random(14, 0, Purpose::kTest);
  for (int i = 0; i < count; ++i) {
    const double time = 4.0 * i / count;
    const int square = static_cast<int>(time);
    const double phase = 2.0 * 3.14159265358979323846 * (time - square);
    const double normal = 2.5 * (1.0 - std::cos(phase));
    const double x = 1.5 * std::sin(3.0 * phase);
    const double y = 1.5 * std::sin(5.0 * phase);
    const Eigen::Vector2d load =
        samples.rest[4] + 35.0 * Eigen::Vector2d(square % 2 == 0 ? -1.0 : 1.0, square / 2 == 0 ? -1.0 : 1.0);
    std::vector<Eigen::Vector2d> positions;
    for (const Eigen::Vector2d& place : samples.rest) {
      const Eigen::Vector2d away = (place - load) / 70.0;
      const double near = std::exp(-0.5 * away.squaredNorm() / 9.0);
      Eigen::Vector2d position = place + near * (1.6 * normal * away + 5.0 * Eigen::Vector2d(x, y));
      for (double& value : position) value += noise_px * random.normal();
      positions.push_back(position);
    }
    samples.positions.push_back(positions);
    samples.forces.push_back({x, y, normal});
  }
  return samples;
}

}  // namespace touchstone::sensors::fixtures
