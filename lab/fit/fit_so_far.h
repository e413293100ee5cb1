#pragma once
// What a fit that was broken off has found, and the file that keeps it (lab/fit/fit_folder.h).

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "datasets/sets/run_identity.h"
#include "lab/fit/bounded_least_squares.h"
#include "lab/fit/unit_simulation.h"

namespace touchstone::lab {

/// All that a fit has found out so far, and that would take long to find out again.
struct FitSoFar {
  LeastSquaresState search;
  std::size_t level = 0;            ///< of UnitFitSpec::field_accuracy
  int steps_before = 0;             ///< of coarser ones
  Eigen::VectorXd before;           ///< residuals where the fit begins
  std::vector<PressPose> labelled;  ///< labelled_poses
};

/// A matrix file (core/matrix_file.h): scalars, poses, where the fit begins, and the search; after these whose it is.
struct KeptFit {
  FitSoFar so_far;
  datasets::RunIdentity identity;
};

/// The file's bytes.
std::string kept_fit(const KeptFit& kept);
/// @throws Error that says why it isn't such a file; `name` is the file's
KeptFit kept_fit_in(std::string_view content, const std::string& name);

}  // namespace touchstone::lab
