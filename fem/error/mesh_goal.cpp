#include "fem/error/mesh_goal.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// The observed order isn't trusted over more than this ratio of edges, nor below this order.
constexpr double kFarthestStep = 3.0;
constexpr double kLeastOrder = 0.5;
const double kStep = std::pow(2.0, 0.25);

struct Measured {
  double edge = 0.0;
  double error = 1.0;
  double order = 1.0;

  /// What the error would be with other edges.
  double at(double other) const { return error * std::pow(other / edge, order); }
};

Measured measured(const MeshErrorTable& table, const ErrorGoal& goal, double edge) {
  Measured result{edge, 1.0, kLeastOrder};
  const BodyErrors& body = goal.sharp_bodies ? table.sharp : table.smooth;
  if (body.errors.empty()) return result;
  result.error = errors_at(body, goal.contact_radius / edge)[ErrorOf::normal_force];
  result.order = std::max(kLeastOrder, body.mesh_order[ErrorOf::normal_force]);
  return result;
}

[[noreturn]] void refuse(const ErrorGoal& goal, const GelOfEdge& gel, const std::optional<Measured>& last, double edge,
                         const std::string& why) {
  const std::string wanted = fmt::format("a force error of {:.3g} for {} of contact radius {} mm", goal.force_error,
                                         goal.sharp_bodies ? "sharp bodies" : "smooth bodies", goal.contact_radius);
  if (!last) fail("{} can't be had: {}", wanted, why);
  // The finest edges that pass the cheap check, and what the error would be then.
  double finest = edge;
  for (; finest < last->edge; finest *= kStep) {
    try {
      gel.check(finest);
      break;
    } catch (const Error&) {
    }
  }
  finest = std::min(finest, last->edge);
  fail("{} needs edges of about {:.2g} mm, and {}. With edges of {:.2g} mm the error is about {:.2g}", wanted, edge,
       why, finest, last->at(finest));
}

}  // namespace

void check(const ErrorGoal& goal) {
  if (!(goal.force_error > 0.0 && goal.force_error < 1.0)) {
    fail("the wanted force error is {}; it must be above 0 and below 1", goal.force_error);
  }
  if (!std::isfinite(goal.contact_radius) || goal.contact_radius <= 0.0) {
    fail("the contact radius is {} mm; it must be finite and above zero", goal.contact_radius);
  }
}

Compliance gel_within(const ErrorGoal& goal, const GelOfEdge& gel, const Progress& progress) {
  check(goal);
  double edge = std::min(gel.coarsest, goal.contact_radius);
  std::optional<Measured> last;
  while (true) {
    Compliance made;
    try {
      gel.check(edge);
      made = gel.make(edge);
    } catch (const Error& error) {
      refuse(goal, gel, last, edge, error.what());
    }
    made.mesh_error = measure_mesh_error(made, gel.ladder(edge), progress);
    last = measured(made.mesh_error, goal, edge);
    if (last->error <= goal.force_error) {
      made.report.fine_edge = edge;
      return made;
    }
    const double wanted = std::pow(last->error / goal.force_error, 1.0 / last->order);  // so many times finer
    const double steps = std::ceil(std::log(std::min(wanted, kFarthestStep)) / std::log(kStep) - 1e-9);
    edge /= std::pow(kStep, std::max(1.0, steps));
  }
}

}  // namespace touchstone::fem
