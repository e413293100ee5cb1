#include "sim/press/force_law.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr double kStraight = 1e-9;  // mm: a press that goes sideways by less is straight

/// The piece of the table that `value` is on: the index of its upper end, at least 1.
std::size_t piece_of(const std::vector<double>& points, double value, const char* what, const char* unit) {
  TS_ASSERT(points.size() >= 2);
  if (!(value >= points.front() && value <= points.back())) {
    fail("the force law knows {} from {:.6g} to {:.6g} {}, not {:.6g}", what, points.front(), points.back(), unit,
         value);
  }
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(
      std::lower_bound(points.begin(), points.end(), value) - points.begin(), std::ptrdiff_t{1}));
}

double share_of(const std::vector<double>& points, std::size_t upper, double value) {
  return (value - points[upper - 1]) / (points[upper] - points[upper - 1]);
}

}  // namespace

double ForceLaw::force(double depth) const {
  if (depth <= 0.0) return 0.0;
  const std::size_t k = piece_of(depth_mm, depth, "depths", "mm");
  return force_N[k - 1] + share_of(depth_mm, k, depth) * (force_N[k] - force_N[k - 1]);
}

double ForceLaw::error(double depth) const {
  return depth <= 0.0 ? 0.0 : std::max(least_error_N, relative_error * force(depth));
}

double ForceLaw::stiffness(double depth) const {
  if (depth <= 0.0) return 0.0;
  const std::size_t k = piece_of(depth_mm, depth, "depths", "mm");
  return (force_N[k] - force_N[k - 1]) / (depth_mm[k] - depth_mm[k - 1]);
}

double ForceLaw::energy(double depth) const {
  if (depth <= 0.0) return 0.0;
  const std::size_t last = piece_of(depth_mm, depth, "depths", "mm");
  double work = 0.5 * (force_N[last - 1] + force(depth)) * (depth - depth_mm[last - 1]);
  for (std::size_t k = 1; k < last; ++k) {
    work += 0.5 * (force_N[k - 1] + force_N[k]) * (depth_mm[k] - depth_mm[k - 1]);
  }
  return work;
}

double ForceLaw::depth(double force) const {
  const auto falls = std::adjacent_find(force_N.begin(), force_N.end(), std::greater_equal<>());
  if (falls != force_N.end()) {
    fail("the force law doesn't rise at {:.6g} mm: no depth belongs to a force",
         depth_mm[static_cast<std::size_t>(falls - force_N.begin())]);
  }
  const std::size_t k = piece_of(force_N, force, "forces", "N");
  return depth_mm[k - 1] + share_of(force_N, k, force) * (depth_mm[k] - depth_mm[k - 1]);
}

ForceLaw force_law(const PressPath& path, const PlayedPath& played, double relative_error, double least_error_N) {
  TS_ASSERT(played.states.size() <= path.points.size());
  for (const double error : {relative_error, least_error_N}) {
    if (!(error >= 0.0 && std::isfinite(error))) {
      fail("an error of the force law is {}, it must be finite and at least 0", error);
    }
  }
  ForceLaw law{{0.0}, {0.0}, relative_error, least_error_N};
  for (std::size_t k = 0; k < played.states.size(); ++k) {
    const Eigen::Vector3d& shift = path.points[k].shift_mm;
    if (shift.head<2>().norm() > kStraight) {
      fail("a force law is of a straight press; this one goes sideways by {:.4g}, {:.4g} mm at {:.6g}", shift.x(),
           shift.y(), path.points[k].at);
    }
    const double depth = -shift.z();
    if (!(depth > 0.0) && law.depth_mm.size() == 1) continue;
    if (!(depth > law.depth_mm.back())) {
      fail("a force law is of a press that goes down; this one goes from {:.6g} to {:.6g} mm at {:.6g}",
           law.depth_mm.back(), depth, path.points[k].at);
    }
    law.depth_mm.push_back(depth);
    law.force_N.push_back(played.states[k].wrench[2]);
  }
  if (law.depth_mm.size() == 1) fail("a force law needs states below the touch; there are none");
  return law;
}

RelaxingForce::RelaxingForce(ForceLaw law, fem::PronySeries series) : law_(std::move(law)), series_(std::move(series)) {
  fem::check(series_);
}

double RelaxingForce::after(double depth, double seconds) const {
  if (!(seconds >= 0.0 && std::isfinite(seconds))) {
    fail("a step of {} s; the time must be finite and at least 0", seconds);
  }
  const double elastic = law_.force(depth);
  if (series_.empty()) return elastic;
  const fem::RelaxationStep step = fem::relaxation_step(series_, seconds);
  return std::max(0.0, step.stiffness * elastic + fem::carried_over(step, history_, 1)[0]);
}

double RelaxingForce::step(double depth, double seconds) {
  const double force = after(depth, seconds);
  if (!series_.empty()) {
    const fem::RelaxationStep step = fem::relaxation_step(series_, seconds);
    const Eigen::VectorXd now =
        step.stiffness * Eigen::VectorXd::Constant(1, law_.force(depth)) + fem::carried_over(step, history_, 1);
    history_ = fem::after_step(step, history_, now);
  }
  return force;
}

}  // namespace touchstone::sim
