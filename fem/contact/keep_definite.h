#pragma once

#include <Eigen/Core>
#include <vector>

namespace touchstone::fem {

/// Softens cut hats that are all but the same as what others can do together, the smallest last, so that the compliance
/// of them and of the whole hats beside them stays positive definite; rows of the compliance. A half-space isn't what
/// elements answer as, where a mesh is coarse and irregular or the gel ends, and work could then be had from the
/// difference of two densities that lie nearly on each other.
void keep_definite(Eigen::MatrixXd& compliance, const std::vector<Eigen::Index>& whole,
                   const std::vector<Eigen::Index>& cut);

}  // namespace touchstone::fem
