// Where along the body a vertex was when the body came to touch it within a part.

#include <algorithm>
#include <limits>
#include <vector>

#include "fem/contact/press_part_iterate.h"

namespace touchstone::fem {

/// What sticks keeps the place at which it was touched. A part begins before that, so a vertex that was open goes along
/// with the gel at first, as if it could slide, and with the body from then on. When it is touched is told by its gap:
/// as a contact grows over a gel, from the gaps of what touched before to those at its new border, the depth grows with
/// them (a sphere's contact on a half-space, whose radius' square and gaps grow with the depth [Johnson1985,
/// eq. 4.23]).
void PartSolver::keep_places_at_touch(ContactProblem& contact, const PressSnapshot& from, const Iterate& now,
                                      const Eigen::VectorXd& start, PartEffort& effort) {
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  ContactProblem sliding = contact;
  bool any = false;
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = vertices[j];
    if (now.owner[v] < 0 || from.state[v] != NodeState::open) continue;
    sliding.friction[j] = 0.0;
    any = true;
  }
  if (!any) return;
  ContactMemory none;
  const ContactAnswer free = solve_frictional(sliding, start, traction_, none);
  effort.solves += free.iterations;
  effort.factorisations += free.factorisations;
  effort.sweeps += free.sweeps;
  if (!free.converged) return;
  const Eigen::VectorXd slack = free.response + contact.border * free.shift;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    double first = kInfinity, touched = -kInfinity, last = -kInfinity;
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      if (now.owner[v] != static_cast<int>(b) || free.state[j] == NodeState::open) continue;
      const double gap = now.gap(v) / surface_.weight[v];
      first = std::min(first, gap);
      last = std::max(last, gap);
      if (from.owner[v] == static_cast<int>(b)) touched = std::max(touched, gap);
    }
    const double begin = touched > first ? touched : first;
    if (!(last > begin)) continue;
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      if (now.owner[v] != static_cast<int>(b) || from.state[v] != NodeState::open) continue;
      const double when = std::clamp((now.gap(v) / surface_.weight[v] - begin) / (last - begin), 0.0, 1.0);
      auto place = contact.drag.segment<2>(2 * j);
      place = (1.0 - when) * place + when * slack.segment<2>(3 * j + 1);
    }
  }
}

}  // namespace touchstone::fem
