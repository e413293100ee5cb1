#pragma once
// How good force estimates are, as [Naeini2020] counts it (sec. V.C).

#include <Eigen/Core>
#include <optional>
#include <span>

namespace touchstone::sensors {

/// Mean of (estimate - reference)^2, N^2. The paper calls it "MSE of 0.16 N"; it is taken for a mean square.
/// @throws Error for no values, other lengths, or a value that isn't finite
double mean_squared_error(const Eigen::VectorXd& estimate_N, const Eigen::VectorXd& reference_N);

/// "The minimum value of changes in the estimated force for all the points over 0.2 N": the least difference of two
/// estimates that follow each other, N, where `level_N` of both is at least `least_N`. The paper eliminates "data
/// points with the force value of less than 0.2 N" because its reference is bad there; whether it means the reference's
/// or the estimated force it doesn't say, so the caller gives either as the level. Nothing where no two such follow
/// each other.
/// @throws Error as mean_squared_error()
std::optional<double> least_force_change(const Eigen::VectorXd& estimate_N, const Eigen::VectorXd& level_N,
                                         double least_N = 0.2);

/// The sensitivity: least_force_change() averaged over the folds that have one. @throws Error if none has
double sensitivity(std::span<const std::optional<double>> least_changes);

}  // namespace touchstone::sensors
