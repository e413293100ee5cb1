#include "sensors/reflex/dots_flow.h"

#include <algorithm>
#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::sensors {
namespace {

using Unknowns = Eigen::Matrix<double, 5, 1>;  // dilation, shift, gain, offset

/// One linear solution; nothing where it isn't determined.
std::optional<Unknowns> solve(const DotsPicture& before, const DotsPicture& now, const DotsMotion& motion,
                              bool free_light) {
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Unknowns right = Unknowns::Zero();
  const double half = 0.5 * before.columns();
  // Differences are taken over cubes of 2x2 pixels and both pictures, all of one middle [Horn1981]: central differences
  // beside the middle pixel's change would make steps of such coarse dots up to twice too long.
  for (int row = 0; row + 1 < before.rows(); ++row) {
    for (int column = 0; column + 1 < before.columns(); ++column) {
      const Eigen::Vector2d corner = before.place_of(row, column);
      double weight = 1.0;
      double then[4], after[4];
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector2d at = motion(corner + Eigen::Vector2d(i % 2, i / 2));
        weight = std::min(weight, now.inside(at));
        then[i] = before.at(row + i / 2, column + i % 2);
        after[i] = now.at(at);
      }
      if (weight <= 0.0) continue;
      const auto both = [&](int i) { return then[i] + after[i]; };
      const double gx = 0.25 * (both(1) - both(0) + both(3) - both(2));
      const double gy = 0.25 * (both(2) - both(0) + both(3) - both(1));
      const Eigen::Vector2d place = corner + Eigen::Vector2d(0.5, 0.5);
      const double mean = 0.25 * (then[0] + then[1] + then[2] + then[3]);
      Unknowns equation;
      equation << (gx * place.x() + gy * place.y()) / half, gx, gy, mean, 1.0;
      const double change = mean - 0.25 * (after[0] + after[1] + after[2] + after[3]);
      normal += weight * equation * equation.transpose();
      right += weight * change * equation;
    }
  }
  const int size = free_light ? 5 : 3;
  // Dilation and shifts must be distinguishable from each other and from no gradient at all: DN^2, over the whole
  // picture.
  constexpr double kLeastGradient = 1.0;
  constexpr double kLeastPart = 1e-3;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> gradients(normal.topLeftCorner<3, 3>());
  if (gradients.eigenvalues()[0] < std::max(kLeastGradient, kLeastPart * gradients.eigenvalues()[2])) return {};
  const Eigen::LDLT<Eigen::MatrixXd> factors(Eigen::MatrixXd(normal.topLeftCorner(size, size)));
  Unknowns solution = Unknowns::Zero();
  solution.head(size) = factors.solve(Eigen::VectorXd(right.head(size)));
  if (!solution.allFinite()) return {};
  solution[0] /= half;
  return solution;
}

}  // namespace

std::optional<DotsMotion> dots_flow(const DotsPicture& before, const DotsPicture& now, const DotsFlowSettings& settings,
                                    const DotsMotion& start) {
  constexpr double kDone_px = 1e-4;
  if (before.rows() != now.rows() || before.columns() != now.columns()) {
    fail("dots: pictures of {}x{} and {}x{} pixels; both must be of one size", before.columns(), before.rows(),
         now.columns(), now.rows());
  }
  if (settings.rounds < 1) fail("rounds is {}, it must be at least 1", settings.rounds);
  if (!(settings.most_step_px > 0.0)) fail("most_step_px is {}, it must be above 0", settings.most_step_px);
  const double half = 0.5 * before.columns();
  DotsMotion motion = start;
  for (int round = 0; round < settings.rounds; ++round) {
    const std::optional<Unknowns> found = solve(before, now, motion, settings.free_light);
    if (!found) return {};
    // now(motion(x + step)) = before(x), to first order in the step
    motion = then({1.0 + (*found)[0], found->segment<2>(1)}, motion);
    const double step_px = std::abs((*found)[0]) * half + found->segment<2>(1).norm();
    const DotsMotion from_start = between(start, motion);
    if (std::abs(from_start.dilation - 1.0) * half + from_start.shift_px.norm() > settings.most_step_px) return {};
    if (step_px < kDone_px) break;
  }
  return motion;
}

}  // namespace touchstone::sensors
