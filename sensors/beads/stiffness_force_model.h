#pragma once
// Force from bead positions by a matrix of stiffness coefficients [VisioHaptic2024, sec. 3.3, eqs. 1 to 3].
//
// For beads on an N x N grid, P holds (p_x, p_y, p_z) of each: the image coordinates and the mean distance to the
// adjacent beads (eq. 1), which are its neighbours left, right, above and below (2 at a corner, 3 at a side, 4 inside).
// dP = P - P_rest (eq. 2). U, of order N-1, is dP summed over the four beads of each square (fig. 3: convolution with
// a 2x2 matrix of ones). Each square has a 3x3 matrix h (eq. 3) and adds h u to the force.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sensors/beads/bead_tracker.h"

namespace touchstone::sensors {

/// Which entries of a square's 3x3 matrix may be other than 0.
enum class MatrixForm : std::uint8_t {
  kAsymmetric,  ///< eq. 3: x and y from themselves, z from x, y and z (h_x, h_y, h_za, h_zb, h_zc)
  kSymmetric,   ///< as eq. 3, and what couples x or y into z couples z back in the same way
  kDiagonal,    ///< each axis from itself alone
};
/// "asymmetric", "symmetric", "diagonal"
const char* name_of(MatrixForm form);

/// When training ends (stiffness_training.h).
enum class StopRule : std::uint8_t {
  kLossDrop,     ///< the loss has dropped by a given factor (the paper: two orders of magnitude)
  kConvergence,  ///< the loss no longer gets better
};
/// "loss_drop", "convergence"
const char* name_of(StopRule rule);

/// How a model came to be; kept in its file.
struct TrainingSummary {
  std::int64_t samples = 0;
  StopRule stop = StopRule::kLossDrop;
  std::int64_t iterations = 0;
  Eigen::Vector3d rms_error_N = Eigen::Vector3d::Zero();  ///< on the training samples, per axis
};

/// A trained model. It holds for the gel, the camera and the direction of forces that it was trained with.
struct StiffnessForceModel {
  int grid = 3;  ///< N, beads a side
  MatrixForm form = MatrixForm::kAsymmetric;
  std::vector<Eigen::Matrix3d> stiffness;     ///< (N-1)^2 matrices h, row-major, in N/px
  std::vector<Eigen::Vector2d> rest;          ///< N^2 positions without load, row-major, px
  std::vector<Eigen::Vector3d> lowest_seen;   ///< N^2: least dP of each bead in training, px
  std::vector<Eigen::Vector3d> highest_seen;  ///< N^2: largest dP of each bead in training, px
  TrainingSummary training;
};

/// What is wrong with a model (sizes, values that aren't finite, entries that its form forbids), or nothing.
std::string fault_of(const StiffnessForceModel& model);

/// P of one bead (eq. 1), px. @pre positions.size() == grid^2, row-major
Eigen::Vector3d bead_coordinates(std::span<const Eigen::Vector2d> positions, int grid, int row, int column);

/// Force on the sensor in N, in the axes of the samples it was trained on. Positions equal to `rest` give exactly 0.
/// Allocates nothing. @throws Error if the number of positions isn't the model's
Eigen::Vector3d estimate_force(const StiffnessForceModel& model, std::span<const Eigen::Vector2d> positions,
                               std::span<const Eigen::Vector2d> rest);

/// Whether a bead's dP leaves the range seen in training by more than 5 % of that range and 0.1 px: the force is then
/// a guess by extrapolation.
bool is_extrapolated(const StiffnessForceModel& model, std::span<const Eigen::Vector2d> positions,
                     std::span<const Eigen::Vector2d> rest);

/// The force of one frame, and whether to believe it.
struct ForceEstimate {
  std::int64_t t_us = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N
  bool extrapolated = false;
  int beads_missing = 0;  ///< beads whose position is held or reset, not measured; the force is doubtful if any is
};

/// The force of one tracked frame, against the model's own rest positions, or against those given (where the sensor
/// was mounted anew, its own first frame without load).
ForceEstimate estimate(const StiffnessForceModel& model, const TrackedBeads& beads);
/// Against rest positions given here, N^2 in px.
ForceEstimate estimate(const StiffnessForceModel& model, const TrackedBeads& beads,
                       std::span<const Eigen::Vector2d> rest);

}  // namespace touchstone::sensors
