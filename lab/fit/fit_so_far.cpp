#include "lab/fit/fit_so_far.h"

#include <cmath>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/sha256.h"

namespace touchstone::lab {
namespace {

constexpr std::string_view kMark = "TSFIT001";
constexpr int kMostSteps = 1'000'000;

/// Of all such files: whose one is stands in it, so that what differs can be named.
const std::string& file_key() {
  static const std::string key = sha256_of("touchstone fit, so far");
  return key;
}

int whole_number(double stored, int most) {
  if (!(stored >= 0.0 && stored <= most) || stored != std::floor(stored)) {
    fail("it has {} where a whole number from 0 to {} should be", stored, most);
  }
  return static_cast<int>(stored);
}

}  // namespace

KeptFit kept_fit_in(std::string_view content, const std::string& name) {
  MatrixFile matrices(content, kMark, "what was kept of a fit", file_key(), "program");
  const Eigen::MatrixXd scalars = matrices.take();
  const Eigen::MatrixXd poses = matrices.take();
  KeptFit kept;
  LeastSquaresState& search = kept.so_far.search;
  for (Eigen::VectorXd* column : {&kept.so_far.before, &search.x, &search.residuals}) {
    const Eigen::MatrixXd taken = matrices.take();
    if (taken.cols() > 1) fail("its columns are wider than one");
    *column = taken.reshaped();
  }
  search.jacobian = matrices.take();
  if (scalars.size() != 6 || (poses.cols() > 0 && poses.rows() != 3)) fail("its matrices have other shapes");
  search.damping = scalars.data()[0];
  search.growth = scalars.data()[1];
  search.steps = whole_number(scalars.data()[2], kMostSteps);
  kept.so_far.level = static_cast<std::size_t>(whole_number(scalars.data()[3], kMostSteps));
  kept.so_far.steps_before = whole_number(scalars.data()[4], kMostSteps);
  search.arrived = whole_number(scalars.data()[5], 1) == 1;
  for (Eigen::Index i = 0; i < poses.cols(); ++i) {
    kept.so_far.labelled.push_back({{poses(0, i), poses(1, i)}, poses(2, i)});
  }
  const bool finite = scalars.allFinite() && poses.allFinite() && kept.so_far.before.allFinite() &&
                      search.x.allFinite() && search.residuals.allFinite() && search.jacobian.allFinite();
  if (!finite || !(search.growth >= 2.0)) fail("it has numbers that can't be");
  kept.identity = datasets::run_identity_from_json(std::string(matrices.rest()), name);
  return kept;
}

std::string kept_fit(const KeptFit& kept) {
  const FitSoFar& so_far = kept.so_far;
  const LeastSquaresState& search = so_far.search;
  Eigen::MatrixXd scalars(6, 1);
  scalars << search.damping, search.growth, search.steps, static_cast<double>(so_far.level), so_far.steps_before,
      search.arrived ? 1.0 : 0.0;
  Eigen::MatrixXd poses(3, static_cast<Eigen::Index>(so_far.labelled.size()));
  for (Eigen::Index i = 0; i < poses.cols(); ++i) {
    const PressPose& pose = so_far.labelled[static_cast<std::size_t>(i)];
    poses.col(i) << pose.place_mm, pose.depth_mm;
  }
  return matrix_file(kMark, file_key(), {scalars, poses, so_far.before, search.x, search.residuals, search.jacobian},
                     datasets::to_json(kept.identity));
}

}  // namespace touchstone::lab
