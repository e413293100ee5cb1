#pragma once
// What a fit can't identify, in words.

#include <Eigen/Core>
#include <vector>

#include "lab/fit/unit_fit.h"

namespace touchstone::lab {

/// Combinations that span what `unidentified` (columns: orthonormal, rows: unknowns, in units of half ranges, whose
/// lengths are `scale`) does, each with as few unknowns as can be: by elimination, the largest part first.
std::vector<UnidentifiableCombination> unidentifiable_combinations(const std::vector<FitUnknown>& unknowns,
                                                                   const Eigen::MatrixXd& unidentified,
                                                                   const Eigen::VectorXd& scale);

}  // namespace touchstone::lab
