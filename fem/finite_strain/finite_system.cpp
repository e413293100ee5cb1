#include "fem/finite_strain/finite_system.h"

#include <Eigen/Geometry>

#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {
namespace {

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

Eigen::Vector3d direction_of(const LedAxis& axis) {
  return Eigen::Vector3d::Unit(axis.axis % 3);
}

Eigen::Vector3d place_of(const FiniteGel& gel, const FiniteSnapshot& at, int node) {
  return gel.space.position(node) + at.elastic.displacement.row(node).transpose();
}

/// Adds what the forces of contact change by as they turn with the body: `nodal`, on the gel, nodes x 3.
void add_turning_forces(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<LedAxis>& led, int body,
                        const Eigen::MatrixX3d& nodal, double unit, SymmetricEntries& matrix) {
  const TaylorHoodSpace& space = gel.space;
  for (int b = 0; b < std::ssize(led); ++b) {
    const LedAxis& turn = led[b];
    if (turn.body != body || !turn.turns()) continue;
    const Eigen::Vector3d about = direction_of(turn);
    Eigen::VectorXd pairs = Eigen::VectorXd::Zero(std::ssize(led));
    for (int node = 0; node < space.nodes; ++node) {
      const Eigen::Vector3d force = nodal.row(node);
      if (force.isZero(0.0)) continue;
      const Eigen::Vector3d turned = about.cross(force) / turn.arm;
      if (!space.clamped[node]) {
        for (int a = 0; a < 3; ++a) matrix.add(space.displacement[node] + a, space.unknowns + b, -unit * turned[a]);
      }
      for (int other = 0; other < std::ssize(led); ++other) {
        const LedAxis& one = led[other];
        if (one.body == body) pairs[other] += turned.dot(motion_along(one, at, place_of(gel, at, node)));
      }
    }
    // Of two turns what the one does to the other's torque depends on their order, so it's shared.
    for (int other = 0; other < std::ssize(led); ++other) {
      const double share = led[other].turns() && other != b ? 0.5 : 1.0;
      if (pairs[other] != 0.0)
        matrix.add(std::min(b, other) + space.unknowns, std::max(b, other) + space.unknowns,
                   share * unit * pairs[other]);
    }
  }
}

}  // namespace

std::vector<LedAxis> led_axes(std::span<const PartTarget> targets, std::span<const PressBody> bodies) {
  std::vector<LedAxis> led;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    const BoundingBall ball = bounding_ball(bodies[b].shape);
    for (int a = 0; a < 6; ++a) {
      if (a < 3 ? targets[b].forced[a] : targets[b].turned[a - 3])
        led.push_back({static_cast<int>(b), a, ball.centre.norm() + ball.radius});
    }
  }
  return led;
}

Eigen::Vector3d motion_along(const LedAxis& axis, const FiniteSnapshot& at, const Eigen::Vector3d& place) {
  if (!axis.turns()) return direction_of(axis);
  return direction_of(axis).cross(place - at.bodies[axis.body].pose.translation) / axis.arm;
}

double work_along(const LedAxis& axis, const FiniteGel& gel, const FiniteSnapshot& at, const Eigen::MatrixX3d& nodal) {
  if (!axis.turns()) return nodal.col(axis.axis).sum();
  double sum = 0.0;
  for (int node = 0; node < gel.space.nodes; ++node) {
    const Eigen::Vector3d force = nodal.row(node);
    if (!force.isZero(0.0)) sum += force.dot(motion_along(axis, at, place_of(gel, at, node)));
  }
  return sum;
}

double wanted_along(const LedAxis& axis, std::span<const PartTarget> targets) {
  const PartTarget& target = targets[axis.body];
  return axis.turns() ? target.torque[axis.axis - 3] / axis.arm : target.force[axis.axis];
}

double force_scale(const FiniteGel& gel) {
  const Scales& scales = gel.problem.scales();
  return scales.stress * scales.length * scales.length;
}

Eigen::VectorXd over_unknowns(const FiniteGel& gel, const Eigen::MatrixX3d& nodal) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(gel.space.unknowns);
  for (int node = 0; node < gel.space.nodes; ++node) {
    if (!gel.space.clamped[node]) {
      result.segment<3>(gel.space.displacement[node]) = nodal.row(node).transpose() / force_scale(gel);
    }
  }
  return result;
}

LawRows law_rows(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<Eigen::Matrix3d>& axes,
                 const std::vector<int>& block, int components, const std::vector<LedAxis>& led) {
  const TaylorHoodSpace& space = gel.space;
  const auto c = static_cast<std::size_t>(components);
  LawRows laws;
  laws.inner = space.unknowns + static_cast<int>(led.size());
  laws.rows.resize(c * block.size() + led.size());
  for (std::size_t b = 0; b < led.size(); ++b) {
    laws.rows[c * block.size() + b].emplace_back(space.unknowns + static_cast<int>(b), 1.0);
  }
  for (std::size_t j = 0; j < block.size(); ++j) {
    const int v = block[j];
    LawRow* row = &laws.rows[c * j];
    for (RowSparse::InnerIterator it(at.gap.gradient, v); it; ++it) {
      const int node = static_cast<int>(it.col() / 3);
      if (space.clamped[node]) continue;
      row[0].emplace_back(space.displacement[node] + static_cast<int>(it.col() % 3), it.value());
    }
    for (RowSparse::InnerIterator it(gel.coupling, v); components == 3 && it; ++it) {
      const int node = static_cast<int>(it.col());
      if (space.clamped[node]) continue;
      for (int t = 1; t < 3; ++t) {
        for (int a = 0; a < 3; ++a) row[t].emplace_back(space.displacement[node] + a, it.value() * axes[v](a, t));
      }
    }
    for (std::size_t b = 0; b < led.size(); ++b) {
      if (led[b].body != at.owner[v]) continue;
      const int unknown = space.unknowns + static_cast<int>(b);
      if (!led[b].turns()) {
        const int a = led[b].axis;
        row[0].emplace_back(unknown, -at.gap.direction(v, a));
        for (int t = 1; t < components; ++t) row[t].emplace_back(unknown, -gel.rest.weight[v] * axes[v](a, t));
        continue;
      }
      double gap = 0.0;
      for (RowSparse::InnerIterator it(at.gap.gradient, v); it; ++it) {
        const auto node = static_cast<int>(it.col() / 3);
        gap += it.value() * motion_along(led[b], at, place_of(gel, at, node))[it.col() % 3];
      }
      row[0].emplace_back(unknown, -gap);
      Eigen::Vector3d moved = Eigen::Vector3d::Zero();
      for (RowSparse::InnerIterator it(gel.coupling, v); components == 3 && it; ++it) {
        moved += it.value() * motion_along(led[b], at, place_of(gel, at, static_cast<int>(it.col())));
      }
      for (int t = 1; t < components; ++t) row[t].emplace_back(unknown, -axes[v].col(t).dot(moved));
    }
  }
  return laws;
}

void add_square(const LawRow& row, double factor, SymmetricEntries& matrix) {
  for (const auto& [i, x] : row) {
    for (const auto& [j, y] : row) {
      if (j >= i) matrix.add(i, j, factor * x * y);
    }
  }
}

void add_contact_stiffness(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<LedAxis>& led,
                           SymmetricEntries& matrix) {
  const TaylorHoodSpace& space = gel.space;
  const double unit = gel.problem.scales().length / force_scale(gel);
  const auto unknown = [&](Eigen::Index place) {
    const auto node = static_cast<int>(place / 3);
    return space.clamped[node] ? -1 : space.displacement[node] + static_cast<int>(place % 3);
  };
  const auto motion = [&](const LedAxis& axis, Eigen::Index place) {
    return motion_along(axis, at, place_of(gel, at, static_cast<int>(place / 3)))[place % 3];
  };
  for (int body = 0; body < std::ssize(at.gap.curvature); ++body) {
    const Eigen::SparseMatrix<double>& curvature = at.gap.curvature[body];
    for (Eigen::Index column = 0; column < curvature.outerSize(); ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(curvature, column); it; ++it) {
        const int i = unknown(it.row());
        const int j = unknown(it.col());
        const double value = unit * it.value();
        if (i >= 0 && j >= i) matrix.add(i, j, -value);
        for (int b = 0; b < static_cast<int>(led.size()); ++b) {
          if (led[b].body != body) continue;
          const double by = value * motion(led[b], it.col());
          if (by == 0.0) continue;
          if (i >= 0) matrix.add(i, space.unknowns + b, by);
          for (int a = 0; a <= b; ++a) {
            if (led[a].body != body) continue;
            const double both = by * motion(led[a], it.row());
            if (both != 0.0) matrix.add(space.unknowns + a, space.unknowns + b, -both);
          }
        }
      }
    }
    const auto turns = [&](const LedAxis& axis) { return axis.body == body && axis.turns(); };
    if (std::any_of(led.begin(), led.end(), turns))
      add_turning_forces(gel, at, led, body, pressure_forces(gel, at, body), unit, matrix);
  }
  for (const EdgeBulge& bulge : at.gap.bulges) {
    LawRow row;
    for (int i = 0; i < 9; ++i) {
      const int node = bulge.nodes[i / 3];
      if (!space.clamped[node]) row.emplace_back(space.displacement[node] + i % 3, bulge.gradient[i / 3][i % 3]);
    }
    for (std::size_t b = 0; b < led.size(); ++b) {
      if (led[b].body != bulge.body) continue;
      double along = 0.0;
      for (int i = 0; i < 3; ++i) {
        along += bulge.gradient[i].dot(motion_along(led[b], at, place_of(gel, at, bulge.nodes[i])));
      }
      row.emplace_back(space.unknowns + static_cast<int>(b), -along);
    }
    add_square(row, unit * bulge.stiffness, matrix);
  }
}

}  // namespace touchstone::fem
