#include "sensors/beads/stiffness_force_model.h"

#include <algorithm>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// How far outside the trained range a bead may be before the force counts as extrapolated.
constexpr double kRangeMargin = 0.05;
constexpr double kRangeMarginPx = 0.1;

void check_count(const StiffnessForceModel& model, std::span<const Eigen::Vector2d> positions, const char* which) {
  const auto needed = static_cast<std::size_t>(model.grid) * static_cast<std::size_t>(model.grid);
  if (positions.size() != needed) {
    fail("force model: {} {} positions were given, the model's grid of {} x {} beads has {}", positions.size(), which,
         model.grid, model.grid, needed);
  }
}

bool may_be_set(MatrixForm form, int row, int column) {
  if (row == column) return true;
  if (form == MatrixForm::kDiagonal) return false;
  if (row == 2) return true;
  return form == MatrixForm::kSymmetric && column == 2;
}

}  // namespace

const char* name_of(MatrixForm form) {
  switch (form) {
    case MatrixForm::kAsymmetric:
      return "asymmetric";
    case MatrixForm::kSymmetric:
      return "symmetric";
    case MatrixForm::kDiagonal:
      return "diagonal";
  }
  return "?";
}

const char* name_of(StopRule rule) {
  switch (rule) {
    case StopRule::kLossDrop:
      return "loss_drop";
    case StopRule::kConvergence:
      return "convergence";
  }
  return "?";
}

std::string fault_of(const StiffnessForceModel& model) {
  if (model.grid < 2 || model.grid > 32) return fmt::format("grid is {}, it must be from 2 to 32", model.grid);
  const auto beads = static_cast<std::size_t>(model.grid) * static_cast<std::size_t>(model.grid);
  const auto squares = static_cast<std::size_t>(model.grid - 1) * static_cast<std::size_t>(model.grid - 1);
  if (model.stiffness.size() != squares) {
    return fmt::format("stiffness has {} matrices, a grid of {} has {} squares", model.stiffness.size(), model.grid,
                       squares);
  }
  if (model.rest.size() != beads) {
    return fmt::format("rest has {} positions, a grid of {} has {}", model.rest.size(), model.grid, beads);
  }
  if (model.lowest_seen.size() != beads || model.highest_seen.size() != beads) {
    return fmt::format("lowest_seen and highest_seen have {} and {} entries, a grid of {} has {}",
                       model.lowest_seen.size(), model.highest_seen.size(), model.grid, beads);
  }
  for (std::size_t i = 0; i < squares; ++i) {
    const Eigen::Matrix3d& h = model.stiffness[i];
    if (!h.allFinite()) return fmt::format("stiffness {} has a value that isn't finite", i);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        if (h(row, column) != 0.0 && !may_be_set(model.form, row, column)) {
          return fmt::format("stiffness {} has {} in row {}, column {}, which must be 0 in the {} form", i,
                             h(row, column), row, column, name_of(model.form));
        }
      }
    }
    if (model.form == MatrixForm::kSymmetric && h != h.transpose()) {
      return fmt::format("stiffness {} isn't symmetric", i);
    }
  }
  for (std::size_t i = 0; i < beads; ++i) {
    if (!model.rest[i].allFinite()) return fmt::format("rest {} has a value that isn't finite", i);
    if (!model.lowest_seen[i].allFinite() || !model.highest_seen[i].allFinite()) {
      return fmt::format("lowest_seen or highest_seen {} has a value that isn't finite", i);
    }
    if ((model.lowest_seen[i].array() > model.highest_seen[i].array()).any()) {
      return fmt::format("lowest_seen {} is above highest_seen {}", i, i);
    }
  }
  if (!model.training.rms_error_N.allFinite()) return "training.rms_error_N has a value that isn't finite";
  return {};
}

Eigen::Vector3d bead_coordinates(std::span<const Eigen::Vector2d> positions, int grid, int row, int column) {
  const auto at = [&](int r, int c) -> const Eigen::Vector2d& {
    return positions[static_cast<std::size_t>(r * grid + c)];
  };
  const Eigen::Vector2d& here = at(row, column);
  double sum = 0.0;
  int count = 0;
  const auto add = [&](int r, int c) {
    if (r < 0 || c < 0 || r >= grid || c >= grid) return;
    sum += (at(r, c) - here).norm();
    ++count;
  };
  add(row, column - 1);
  add(row, column + 1);
  add(row - 1, column);
  add(row + 1, column);
  return {here.x(), here.y(), sum / count};
}

Eigen::Vector3d estimate_force(const StiffnessForceModel& model, std::span<const Eigen::Vector2d> positions,
                               std::span<const Eigen::Vector2d> rest) {
  check_count(model, positions, "bead");
  check_count(model, rest, "rest");
  const int grid = model.grid;
  const int squares = grid - 1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (int row = 0; row < grid; ++row) {
    for (int column = 0; column < grid; ++column) {
      const Eigen::Vector3d dp =
          bead_coordinates(positions, grid, row, column) - bead_coordinates(rest, grid, row, column);
      // sum_ij h_ij u_ij with u_ij = the sum of dP over the square's beads, taken bead by bead.
      for (int i = std::max(row - 1, 0); i <= std::min(row, squares - 1); ++i) {
        for (int j = std::max(column - 1, 0); j <= std::min(column, squares - 1); ++j) {
          force.noalias() += model.stiffness[static_cast<std::size_t>(i * squares + j)] * dp;
        }
      }
    }
  }
  return force;
}

bool is_extrapolated(const StiffnessForceModel& model, std::span<const Eigen::Vector2d> positions,
                     std::span<const Eigen::Vector2d> rest) {
  check_count(model, positions, "bead");
  check_count(model, rest, "rest");
  for (int row = 0; row < model.grid; ++row) {
    for (int column = 0; column < model.grid; ++column) {
      const auto bead = static_cast<std::size_t>(row * model.grid + column);
      const Eigen::Array3d dp =
          bead_coordinates(positions, model.grid, row, column) - bead_coordinates(rest, model.grid, row, column);
      const Eigen::Array3d low = model.lowest_seen[bead];
      const Eigen::Array3d high = model.highest_seen[bead];
      const Eigen::Array3d margin = kRangeMargin * (high - low) + kRangeMarginPx;
      // Written so that a NaN counts as outside.
      if (!((dp >= low - margin).all() && (dp <= high + margin).all())) return true;
    }
  }
  return false;
}

ForceEstimate estimate(const StiffnessForceModel& model, const TrackedBeads& beads) {
  return estimate(model, beads, model.rest);
}

ForceEstimate estimate(const StiffnessForceModel& model, const TrackedBeads& beads,
                       std::span<const Eigen::Vector2d> rest) {
  ForceEstimate estimate;
  estimate.t_us = beads.t_us;
  estimate.force = estimate_force(model, beads.positions, rest);
  estimate.extrapolated = is_extrapolated(model, beads.positions, rest);
  estimate.beads_missing = static_cast<int>(beads.status.size()) - beads.found();
  return estimate;
}

}  // namespace touchstone::sensors
