#include "sensors/dots_flow.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

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
  for (int row = 1; row + 1 < before.rows(); ++row) {
    for (int column = 1; column + 1 < before.columns(); ++column) {
      const Eigen::Vector2d place = before.place_of(row, column);
      const auto warped = [&](double x, double y) { return now.at(motion(place + Eigen::Vector2d(x, y))); };
      const double weight = std::min({now.inside(motion(place)), now.inside(motion(place + Eigen::Vector2d(1.0, 1.0))),
                                      now.inside(motion(place - Eigen::Vector2d(1.0, 1.0)))});
      if (weight <= 0.0) continue;
      // Gradients are the mean of both pictures': right to second order in the step.
      const double gx = 0.25 * (before.at(row, column + 1) - before.at(row, column - 1) + warped(1, 0) - warped(-1, 0));
      const double gy = 0.25 * (before.at(row + 1, column) - before.at(row - 1, column) + warped(0, 1) - warped(0, -1));
      Unknowns equation;
      equation << (gx * place.x() + gy * place.y()) / half, gx, gy, before.at(row, column), 1.0;
      const double change = before.at(row, column) - warped(0, 0);
      normal += weight * equation * equation.transpose();
      right += weight * change * equation;
    }
  }
  const int size = free_light ? 5 : 3;
  // Dilation and shifts must be told from each other and from no gradient at all: DN^2, over the whole picture.
  constexpr double kLeastGradient = 1.0;
  constexpr double kLeastPart = 1e-3;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> gradients(normal.topLeftCorner<3, 3>());
  if (gradients.eigenvalues()[0] < std::max(kLeastGradient, kLeastPart * gradients.eigenvalues()[2])) return {};
  const Eigen::LDLT<Eigen::MatrixXd> factors(normal.topLeftCorner(size, size));
  Unknowns solution = Unknowns::Zero();
  solution.head(size) = factors.solve(right.head(size));
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
