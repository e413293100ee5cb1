#include "fem/finite_press.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "fem/contact_solver.h"
#include "fem/elimination_order.h"
#include "fem/finite_contact.h"
#include "fem/press_part.h"
#include "fem/press_report.h"
#include "fem/surface_strain.h"

namespace touchstone::fem {
namespace {

constexpr int kMostNewton = 25;
constexpr int kPlainSteps = 2;    // before Aitken's rule
constexpr int kTurningSteps = 4;  // after these the lines of contact stay
constexpr int kMostBacktracks = 5;
constexpr double kLeastShrink = 0.2;  // of the least J in one Newton step
constexpr double kBalanced = 1e-8;    // residual over the elements' forces
constexpr double kLargestPart = 0.1;  // of the thickness: the way of one part
constexpr double kLargestForceGrowth = 3.0;
constexpr double kFirstTouch = 0.02;   // of the thickness: where a force-controlled press begins
constexpr double kHold = 1000.0;       // stiffness that holds what touches, over the surface's own
constexpr double kReach = 0.5;         // of a vertex's own size: open gaps below this are candidates
constexpr int kResolvedVertices = 13;  // as in press_report.cpp

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// A converged state of gel and object.
struct Snapshot {
  RigidTransform pose;
  ElasticSolution elastic;
  Eigen::VectorXd pressure;  ///< n, MPa: the gap's multiplier
  Eigen::MatrixX3d shear;    ///< n x 3, MPa, on the gel
  std::vector<NodeState> state;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the object, N
  bool touching = false;
  DeformedGap gap;  ///< of a touching state
  double penetration = 0.0;
  double residual = 0.0;
};

struct Effort {
  int updates = 0;
  int solves = 0;
  int factorisations = 0;
  int sweeps = 0;
  int candidates = 0;
  int parts = 0;
};

/// Columns: along the force of contact (into the gel) and two across it.
Eigen::Matrix3d axes_along(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d first = direction.normalized();
  const Eigen::Vector3d guide = std::abs(first.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d second = (guide - guide.dot(first) * first).normalized();
  Eigen::Matrix3d axes;
  axes << first, second, first.cross(second);
  return axes;
}

/// Adds factor * row row^T, upper triangle.
void add_square(const std::vector<std::pair<int, double>>& row, double factor, SymmetricEntries& matrix) {
  for (const auto& [i, x] : row) {
    for (const auto& [j, y] : row) {
      if (j >= i) matrix.add(i, j, factor * x * y);
    }
  }
}

}  // namespace

FiniteGel::FiniteGel(TetMesh given, std::span<const ElasticMaterial> materials, std::span<const Bead> beads,
                     double depth)
    : mesh(std::move(given)),
      space(make_space(mesh, materials)),
      problem(space, materials),
      thickness(depth),
      order(elimination_order(space)),
      outer(outer_surface(mesh)),
      mass(surface_mass(mesh, outer)),
      coupling(surface_coupling(space, outer)),
      bead_weight(bead_means(space, beads)),
      rest(
          [this] {
            std::vector<Eigen::Vector3d> vertices;
            for (const int v : outer.mesh_vertex) vertices.push_back(mesh.vertices[v]);
            return vertices;
          }(),
          outer.triangles, mass) {
  if (!std::isfinite(thickness) || thickness <= 0.0) {
    fail("the gel's thickness is {} mm; it must be finite and above zero", thickness);
  }
}

struct FinitePress::Parts {
  Parts(const FiniteGel& on, ContactShape body, double mu, PressTolerance wanted)
      : gel(on),
        shape(std::move(body)),
        friction(mu),
        tolerance(wanted),
        n(static_cast<int>(gel.rest.vertices.size())) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
    now = untouched_at({});
    state = report(now);
  }

  const FiniteGel& gel;
  ContactShape shape;
  double friction;
  PressTolerance tolerance;
  int n;
  SurfaceMassFactor mass;
  Snapshot now;
  bool placed = false;
  PressState state;
  std::string why_not;

  Snapshot untouched_at(const RigidTransform& pose) const;
  double overlap(const RigidTransform& pose) const {
    return -weighted_gap(gel.rest, shape, pose, {}).deepest;  // minus infinity: not over the gel
  }
  void refuse_too_deep(const RigidTransform& pose) const;
  Eigen::MatrixX3d nodal_forces(const Snapshot& at) const;
  Eigen::MatrixX3d bulge_forces(const Snapshot& at) const;
  Eigen::VectorXd free_part(const Eigen::MatrixX3d& nodal) const;
  std::vector<int> candidates(const Snapshot& at) const;
  struct Iteration;
  bool arrived(const Snapshot& from, const PartTarget& target, const Iteration& at, const Eigen::VectorXd& scale,
               double& error) const;
  Eigen::Vector2d slid(const Snapshot& from, const Snapshot& at, int vertex, const Eigen::Matrix3d& axes) const;
  void add_curvature(const DeformedGap& gap, const std::vector<int>& forced, SymmetricEntries& matrix) const;
  std::optional<Snapshot> solve(const Snapshot& from, const PartTarget& target, Effort& effort);
  std::optional<Snapshot> advance(const Snapshot& start, const PartTarget& target, const Snapshot& from, double begin,
                                  double end, int halvings, Effort& effort);
  std::optional<RigidTransform> straight_above(RigidTransform pose) const;
  Snapshot follow(const PressTarget& target, Effort& effort);
  PressState report(const Snapshot& at) const;
};

Snapshot FinitePress::Parts::untouched_at(const RigidTransform& pose) const {
  Snapshot s;
  s.pose = pose;
  s.elastic = gel.problem.at_rest();
  s.pressure = Eigen::VectorXd::Zero(n);
  s.shear = Eigen::MatrixX3d::Zero(n, 3);
  s.state.assign(n, NodeState::open);
  return s;
}

void FinitePress::Parts::refuse_too_deep(const RigidTransform& pose) const {
  const double depth = overlap(pose);
  if (depth > gel.thickness) fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", depth, gel.thickness);
}

/// What the edges in contact do to the gel's nodes against their bulging, N.
Eigen::MatrixX3d FinitePress::Parts::bulge_forces(const Snapshot& at) const {
  Eigen::MatrixX3d forces = Eigen::MatrixX3d::Zero(gel.space.nodes, 3);
  for (const EdgeBulge& bulge : at.gap.bulges) {
    for (int i = 0; i < 3; ++i) {
      forces.row(bulge.nodes[i]) -= (bulge.stiffness * bulge.value) * bulge.gradient[i].transpose();
    }
  }
  return forces;
}

/// What the tractions of contact do to the gel's nodes, N.
Eigen::MatrixX3d FinitePress::Parts::nodal_forces(const Snapshot& at) const {
  Eigen::MatrixX3d forces = gel.coupling.transpose() * at.shear;
  for (int v = 0; v < n; ++v) {
    if (at.pressure[v] == 0.0) continue;
    for (RowSparse::InnerIterator it(at.gap.gradient, v); it; ++it) {
      forces(it.col() / 3, it.col() % 3) += at.pressure[v] * it.value();
    }
  }
  return forces;
}

/// Over the space's unknowns, without units.
Eigen::VectorXd FinitePress::Parts::free_part(const Eigen::MatrixX3d& nodal) const {
  const Scales& scales = gel.problem.scales();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(gel.space.unknowns);
  for (int node = 0; node < gel.space.nodes; ++node) {
    if (!gel.space.clamped[node]) {
      result.segment<3>(gel.space.displacement[node]) =
          nodal.row(node).transpose() / (scales.stress * scales.length * scales.length);
    }
  }
  return result;
}

/// Vertices in contact and around it, and those that nearly touch.
std::vector<int> FinitePress::Parts::candidates(const Snapshot& at) const {
  std::vector<int> result;
  for (int v = 0; v < n; ++v) {
    if (!std::isfinite(at.gap.weighted[v])) continue;
    const double weight = gel.rest.weight[v];
    const auto& around = gel.rest.around[v];
    const bool beside =
        std::any_of(around.begin(), around.end(), [&](int u) { return at.state[u] != NodeState::open; });
    if (at.state[v] != NodeState::open || beside || at.gap.weighted[v] / weight < kReach * std::sqrt(weight)) {
      result.push_back(v);
    }
  }
  return result;
}

/// How far the vertex's hat has slid over the object since `from`, in the vertex's axes, mm^3.
Eigen::Vector2d FinitePress::Parts::slid(const Snapshot& from, const Snapshot& at, int vertex,
                                         const Eigen::Matrix3d& axes) const {
  const RigidTransform motion = at.pose * from.pose.inverse();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (RowSparse::InnerIterator it(gel.coupling, vertex); it; ++it) {
    const int node = static_cast<int>(it.col());
    const Eigen::Vector3d place = gel.space.position(node);
    const Eigen::Vector3d was = place + from.elastic.displacement.row(node).transpose();
    const Eigen::Vector3d is = place + at.elastic.displacement.row(node).transpose();
    way += it.value() * (is - motion * was);
  }
  return axes.rightCols<2>().transpose() * way;
}

/// One Newton iterate.
struct FinitePress::Parts::Iteration {
  Snapshot at;
  FiniteStrain::Residual residual;                   ///< with the forces of contact
  Eigen::VectorXd inside;                            ///< without them
  Eigen::Vector3d bulges = Eigen::Vector3d::Zero();  ///< sum of bulge_forces, N
  std::vector<Eigen::Matrix3d> axes;                 ///< per vertex; only where it has a gap
  double balance = 0.0;
};

/// True if the iterate is a solution; `error` is the largest of its errors over what is allowed.
bool FinitePress::Parts::arrived(const Snapshot& from, const PartTarget& target, const Iteration& iterate,
                                 const Eigen::VectorXd& scale, double& error) const {
  const Snapshot& at = iterate.at;
  error = iterate.balance / kBalanced;
  const double largest = at.pressure.maxCoeff();
  for (int v = 0; v < n; ++v) {
    if (!std::isfinite(at.gap.weighted[v])) {
      if (at.state[v] != NodeState::open) error = std::numeric_limits<double>::infinity();
      continue;
    }
    const double gap = at.gap.weighted[v] / gel.rest.weight[v];
    const double wrong = at.state[v] == NodeState::open ? std::max(0.0, -gap) : std::abs(gap);
    if (at.state[v] == NodeState::open && at.pressure[v] > 1e-9 * largest) {
      error = std::numeric_limits<double>::infinity();  // a shortened step leaves some
    }
    error = std::max(error, wrong / tolerance.lookup_mm);
    if (friction == 0.0 || at.state[v] == NodeState::open || scale.size() == 0) continue;
    if (!(scale[v] > 0.0)) {
      error = std::numeric_limits<double>::infinity();
      continue;
    }
    // The laws of friction as a projection, as in contact_solver.h.
    const Eigen::Vector2d t = iterate.axes[v].rightCols<2>().transpose() * at.shear.row(v).transpose();
    Eigen::Vector2d kept = t - slid(from, at, v, iterate.axes[v]) / scale[v];
    const double limit = friction * std::max(0.0, at.pressure[v]);
    if (kept.norm() > limit) kept *= limit / kept.norm();
    error = std::max(error, (t - kept).norm() / (largest * std::max(1e-6, 100.0 * tolerance.traction)));
  }
  for (int a = 0; a < 3; ++a) {
    if (!target.forced[a]) continue;
    const double allowed = tolerance.force * std::max(1.0, std::abs(target.force[a]));
    error = std::max(error, std::abs(at.force[a] - target.force[a]) / (0.5 * allowed));
  }
  return error <= 1.0;
}

/// How the forces of contact turn as the gel moves over the body, or the body over the gel.
void FinitePress::Parts::add_curvature(const DeformedGap& gap, const std::vector<int>& forced,
                                       SymmetricEntries& matrix) const {
  const Scales& scales = gel.problem.scales();
  const double unit = scales.length / (scales.stress * scales.length * scales.length);
  for (Eigen::Index column = 0; column < gap.curvature.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(gap.curvature, column); it; ++it) {
      const auto unknown = [&](Eigen::Index place) {
        const auto node = static_cast<int>(place / 3);
        return gel.space.clamped[node] ? -1 : gel.space.displacement[node] + static_cast<int>(place % 3);
      };
      const int i = unknown(it.row());
      const int j = unknown(it.col());
      const double value = unit * it.value();
      if (i >= 0 && j >= i) matrix.add(i, j, -value);
      for (int b = 0; b < static_cast<int>(forced.size()); ++b) {
        if (forced[b] != it.col() % 3) continue;
        if (i >= 0) matrix.add(i, gel.space.unknowns + b, value);
        for (int a = 0; a <= b; ++a) {
          if (forced[a] == it.row() % 3) matrix.add(gel.space.unknowns + a, gel.space.unknowns + b, -value);
        }
      }
    }
  }
}

std::optional<Snapshot> FinitePress::Parts::solve(const Snapshot& from, const PartTarget& target, Effort& effort) {
  const Scales& scales = gel.problem.scales();
  const TaylorHoodSpace& space = gel.space;
  const int c = friction > 0.0 ? 3 : 1;
  std::vector<int> forced;
  for (int a = 0; a < 3; ++a) {
    if (target.forced[a]) forced.push_back(a);
  }
  const int k = static_cast<int>(forced.size());
  Iteration iterate;
  iterate.at = from;
  iterate.at.pose = target.pose;
  const double border_scale = std::sqrt(static_cast<double>(gel.mesh.outer.size())) / (scales.length * scales.length);
  const double force_scale = scales.stress * scales.length * scales.length;  // N
  double least = gel.problem.smallest_volume_ratio(iterate.at.elastic);
  Eigen::VectorXd tangential_scale;  // mm^3 per MPa, per vertex
  double error = 0.0;
  GapLines lines;
  Eigen::VectorXd last_change;
  double last_factor = 1.0;

  const auto evaluate = [&](int step) {
    Snapshot& at = iterate.at;
    const double depth = std::max(0.0, overlap(at.pose));
    // How the lines turn, and which of them hit, isn't in the tangent. It hardly matters but at an edge as narrow as
    // the mesh, where Newton's steps may alternate; so the lines stay once they are nearly right.
    if (step < kTurningSteps) {
      lines = gap_lines(space, gel.outer, at.elastic.displacement, shape, at.pose, depth);
    }
    at.gap = deformed_gap(space, gel.outer, gel.rest.weight, lines, at.elastic.displacement, shape, at.pose, depth,
                          at.pressure);
    ++effort.updates;
    for (int v = 0; v < n; ++v) {
      if (std::isfinite(at.gap.weighted[v])) continue;
      at.pressure[v] = 0.0;
      at.shear.row(v).setZero();
      at.state[v] = NodeState::open;
    }
    iterate.axes.resize(n);
    for (int v = 0; v < n; ++v) {
      if (!std::isfinite(at.gap.weighted[v])) continue;
      iterate.axes[v] = axes_along(at.gap.direction.row(v));
      // The frame turns with the gel, and the traction with it.
      if (c == 3 && at.state[v] != NodeState::open) {
        const Eigen::Vector3d normal = iterate.axes[v].col(0);
        at.shear.row(v) -= (at.shear.row(v) * normal) * normal.transpose();
      }
    }
    const Eigen::MatrixX3d nodal = nodal_forces(at);
    const Eigen::MatrixX3d bulges = bulge_forces(at);
    iterate.bulges = bulges.colwise().sum();
    at.force = -(nodal + bulges).colwise().sum().transpose();
    iterate.residual = gel.problem.residual(at.elastic);
    iterate.residual.values -= free_part(bulges);
    iterate.inside = iterate.residual.values;
    const Eigen::VectorXd outside = free_part(nodal);
    iterate.residual.values -= outside;
    const double size = std::max(iterate.residual.scale, outside.norm());
    iterate.balance = size > 0.0 ? iterate.residual.values.norm() / size : 0.0;
  };
  evaluate(0);

  for (int iteration = 0; iteration < kMostNewton; ++iteration) {
    Snapshot& at = iterate.at;
    const std::vector<int> block = candidates(at);
    const auto m = static_cast<Eigen::Index>(block.size());
    if (m == 0) {
      if (target.forced[2]) {
        why_not = "the object has lost the gel";
        return std::nullopt;
      }
      return untouched_at(at.pose);
    }
    effort.candidates = std::max(effort.candidates, static_cast<int>(m));

    // Rows of the block's laws over the gel's unknowns and the object's shift along the forced axes, mm^3 per mm.
    const int inner = space.unknowns + static_cast<int>(k);
    std::vector<std::vector<std::pair<int, double>>> rows(static_cast<std::size_t>(c * m));
    Eigen::VectorXd opening(c * m);  // of the laws, at this iterate: gap and slid way
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = block[static_cast<std::size_t>(j)];
      const Eigen::Matrix3d& axes = iterate.axes[v];
      auto* row = &rows[static_cast<std::size_t>(c * j)];
      opening[c * j] = at.gap.weighted[v];
      for (RowSparse::InnerIterator it(at.gap.gradient, v); it; ++it) {
        const int node = static_cast<int>(it.col() / 3);
        if (space.clamped[node]) continue;
        row[0].emplace_back(space.displacement[node] + static_cast<int>(it.col() % 3), it.value());
      }
      for (RowSparse::InnerIterator it(gel.coupling, v); c == 3 && it; ++it) {
        const int node = static_cast<int>(it.col());
        if (space.clamped[node]) continue;
        for (int t = 1; t < 3; ++t) {
          for (int a = 0; a < 3; ++a) row[t].emplace_back(space.displacement[node] + a, it.value() * axes(a, t));
        }
      }
      if (c == 3) opening.segment<2>(c * j + 1) = slid(from, at, v, axes);
      for (int b = 0; b < k; ++b) {
        const int a = forced[b];
        row[0].emplace_back(space.unknowns + b, -at.gap.direction(v, a));
        for (int t = 1; t < c; ++t) row[t].emplace_back(space.unknowns + b, -gel.rest.weight[v] * axes(a, t));
      }
    }
    SymmetricEntries matrix = gel.problem.tangent(at.elastic);
    Eigen::VectorXd right(inner);
    right.head(space.unknowns) = -iterate.inside;
    for (int b = 0; b < k; ++b) {
      right[space.unknowns + b] = -(target.force[forced[b]] + iterate.bulges[forced[b]]) / force_scale;
    }
    // A gel under pressure is stable in the hold of its contact, not under the same pressure as dead load (from a
    // pressure of some 2 G on). What is held is therefore made stiff, by terms that vanish where it holds (the
    // augmented Lagrangian of Hestenes and Powell), so that the compliance stays positive definite.
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = block[static_cast<std::size_t>(j)];
      if (at.state[v] == NodeState::open) continue;
      const double stiffness = kHold * scales.stress / std::pow(gel.rest.weight[v], 1.5);  // MPa per mm^3
      for (int t = 0; t < (at.state[v] == NodeState::stick ? c : 1); ++t) {
        const auto& row = rows[static_cast<std::size_t>(c * j + t)];
        for (const auto& [i, x] : row) {
          right[i] -= stiffness * x * opening[c * j + t] / force_scale;
        }
        add_square(row, stiffness * scales.length / force_scale, matrix);
      }
    }
    add_curvature(at.gap, forced, matrix);
    for (const EdgeBulge& bulge : at.gap.bulges) {
      std::vector<std::pair<int, double>> row;
      for (int i = 0; i < 9; ++i) {
        const int node = bulge.nodes[i / 3];
        if (!space.clamped[node]) row.emplace_back(space.displacement[node] + i % 3, bulge.gradient[i / 3][i % 3]);
      }
      for (int b = 0; b < k; ++b) {
        const int a = forced[b];
        row.emplace_back(space.unknowns + b, -(bulge.gradient[0][a] + bulge.gradient[1][a] + bulge.gradient[2][a]));
      }
      add_square(row, bulge.stiffness * scales.length / force_scale, matrix);
    }
    for (std::size_t r = 0; r < rows.size(); ++r) {
      for (const auto& [i, x] : rows[r]) matrix.add(i, inner + static_cast<int>(r), border_scale * x);
    }
    matrix.size = inner + c * static_cast<int>(m);
    const auto along = [&](const Eigen::VectorXd& unknowns) {  // what the laws see of a change, mm^3
      Eigen::VectorXd seen = Eigen::VectorXd::Zero(c * m);
      for (std::size_t r = 0; r < rows.size(); ++r) {
        for (const auto& [i, x] : rows[r]) seen[static_cast<Eigen::Index>(r)] += scales.length * x * unknowns[i];
      }
      return seen;
    };

    ContactAnswer answer;
    Eigen::VectorXd change;
    try {
      std::vector<int> order = gel.order;
      for (int b = 0; b < k; ++b) order.push_back(space.unknowns + b);
      BorderedFactor factor(matrix, c * static_cast<int>(m), order);
      ++effort.factorisations;
      const Eigen::MatrixXd compliance =
          factor.complement() * (-scales.length / force_scale / (border_scale * border_scale));
      // Where gel and object would go if contact let go at once.
      const Eigen::VectorXd back = factor.solve(right);
      const Eigen::VectorXd ahead = opening + along(back);
      ContactProblem contact;
      contact.compliance = &compliance;
      contact.components = c;
      contact.friction = friction;
      contact.gap.resize(m);
      contact.border.resize(c * m, 0);
      if (c == 3) contact.drag.resize(2 * m);
      Eigen::VectorXd start(c * m);
      tangential_scale = Eigen::VectorXd::Zero(n);
      for (Eigen::Index j = 0; j < m; ++j) {
        const int v = block[static_cast<std::size_t>(j)];
        contact.gap[j] = ahead[c * j];
        start[c * j] = at.pressure[v];
        if (c == 3) {
          contact.drag.segment<2>(2 * j) = -ahead.segment<2>(c * j + 1);
          start.segment<2>(c * j + 1) = iterate.axes[v].rightCols<2>().transpose() * at.shear.row(v).transpose();
          tangential_scale[v] = std::max(compliance(c * j + 1, c * j + 1), compliance(c * j + 2, c * j + 2));
        }
      }
      if (!at.touching && iteration == 0) start.resize(0);
      ContactMemory memory;
      answer = c == 1 ? solve_frictionless(contact, start, memory)
                      : solve_frictional(contact, start, std::max(tolerance.traction, 1e-10), memory);
      effort.solves += answer.iterations;
      effort.sweeps += answer.sweeps;
      if (!answer.converged) {
        why_not = fmt::format("the contact laws are met to {:.2g} of the largest pressure only, with {} candidates",
                              answer.residual, m);
        return std::nullopt;
      }
      Eigen::VectorXd push = Eigen::VectorXd::Zero(inner);
      for (std::size_t r = 0; r < rows.size(); ++r) {
        for (const auto& [i, x] : rows[r]) push[i] += x * answer.z[static_cast<Eigen::Index>(r)] / force_scale;
      }
      change = back + factor.solve(push);
    } catch (const Error& singular) {
      why_not = singular.what();
      return std::nullopt;
    }

    // Aitken's rule (Irons and Tuck 1969) against steps that alternate.
    double factor = 1.0;
    if (last_change.size() == change.size() && iteration >= kPlainSteps) {
      const double ratio = change.dot(last_change) / last_change.squaredNorm();
      if (ratio < 0.0) factor = std::clamp(last_factor / (1.0 - ratio), 0.1, 1.0);
    }
    last_change = change;
    ElasticSolution next;
    RigidTransform pose;
    for (int tries = 0;; factor *= 0.5, ++tries) {
      if (tries > kMostBacktracks) return std::nullopt;
      next = gel.problem.moved(at.elastic, change, factor);
      const double ratio = gel.problem.smallest_volume_ratio(next);
      pose = at.pose;
      for (int b = 0; b < k; ++b) {
        pose.translation[forced[b]] += factor * scales.length * change[space.unknowns + b];
      }
      if (!(ratio > kLeastShrink * least)) {
        why_not = fmt::format("a tetrahedron turns inside out (its volume falls to {:.2g} of what it was)", ratio);
        continue;
      }
      if (!pose.translation.allFinite() || overlap(pose) > 0.98 * gel.thickness) {
        why_not = fmt::format("the wanted force needs the object deeper than the gel's {:.4g} mm", gel.thickness);
        continue;
      }
      least = ratio;
      break;
    }
    last_factor = factor;
    at.elastic = std::move(next);
    at.pose = pose;
    at.pressure *= 1.0 - factor;
    at.shear *= 1.0 - factor;
    std::vector<NodeState> states(n, NodeState::open);
    at.touching = false;
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = block[static_cast<std::size_t>(j)];
      states[v] = answer.state[static_cast<std::size_t>(j)];
      at.touching = at.touching || states[v] != NodeState::open;
      at.pressure[v] += factor * answer.z[c * j];
      if (c == 3) {
        at.shear.row(v) += factor * (iterate.axes[v].rightCols<2>() * answer.z.segment<2>(c * j + 1)).transpose();
      }
    }
    at.state = std::move(states);
    at.residual = answer.residual;
    evaluate(iteration + 1);
    if (arrived(from, target, iterate, tangential_scale, error)) {
      Snapshot found = std::move(iterate.at);
      if (!found.touching) return untouched_at(found.pose);
      found.penetration = 0.0;
      for (int v = 0; v < n; ++v) {
        if (std::isfinite(found.gap.weighted[v])) {
          found.penetration = std::max(found.penetration, -found.gap.weighted[v] / gel.rest.weight[v]);
        }
      }
      return found;
    }
    if (!std::isfinite(iterate.balance)) break;
  }
  why_not = fmt::format("Newton's method is {:.2g} times its tolerance off after {} steps", error, kMostNewton);
  return std::nullopt;
}

/// From the share `begin` of the way from `start` to the target to the share `end`, halved where it doesn't converge.
std::optional<Snapshot> FinitePress::Parts::advance(const Snapshot& start, const PartTarget& target,
                                                    const Snapshot& from, double begin, double end, int halvings,
                                                    Effort& effort) {
  PartTarget part = target;
  part.pose = between(start.pose, target.pose, end);
  if (end < 1.0) part.force = start.force + end * (target.force - start.force);
  for (int a = 0; a < 3; ++a) {
    if (target.forced[a]) part.pose.translation[a] = from.pose.translation[a];
  }
  if (auto next = solve(from, part, effort)) {
    ++effort.parts;
    return next;
  }
  if (halvings == 0) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  const auto half = advance(start, target, from, begin, middle, halvings - 1, effort);
  if (!half) return std::nullopt;
  return advance(start, target, *half, middle, end, halvings - 1, effort);
}

/// The pose straight above `pose` in which the body just touches the undeformed gel; nothing if it isn't over it.
std::optional<RigidTransform> FinitePress::Parts::straight_above(RigidTransform pose) const {
  for (int k = 0; k < 30; ++k) {
    const double depth = overlap(pose);
    if (!std::isfinite(depth)) return std::nullopt;
    pose.translation.z() += depth;
    if (std::abs(depth) < 1e-12 * (std::abs(pose.translation.z()) + gel.thickness)) break;
  }
  return pose;
}

Snapshot FinitePress::Parts::follow(const PressTarget& target, Effort& effort) {
  PartTarget to;
  to.pose = {target.rotation, now.pose.translation};
  for (int a = 0; a < 3; ++a) {
    to.forced[a] = target.axis[a].kind == AxisControl::Kind::force;
    (to.forced[a] ? to.force[a] : to.pose.translation[a]) = target.axis[a].value;
  }
  double shear = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (to.forced[a]) shear = std::hypot(shear, to.force[a]);
  }
  if (shear > 0.0 && friction == 0.0) {
    fail("gross slip: a shear force of {:.6g} N is wanted without friction", shear);
  }
  const double held = to.force[2] > 0.0 && friction > 0.0 ? friction * to.force[2] : 0.0;
  if (shear > 0.0 && to.forced[2] && shear >= held * (1.0 - 1e-9)) {
    fail(
        "gross slip: a shear force of {:.6g} N is wanted, but a normal force of {:.6g} N with a friction of {:.4g} "
        "holds less than {:.6g} N",
        shear, to.force[2], friction, held);
  }
  // A forced axis that nothing can push on stays where it is: without friction, along the surface.
  for (int a = 0; a < 2 && friction == 0.0; ++a) to.forced[a] = false;

  Snapshot start = now;
  const bool no_force = to.forced[2] && to.force[2] == 0.0;
  if (!now.touching || no_force) {
    std::optional<RigidTransform> touch = straight_above(to.pose);
    if (to.forced[2]) {
      if (!touch) fail("the object isn't over the gel: a force of {:.4g} N can't be reached", to.force[2]);
      if (no_force) return untouched_at(*touch);
      to.pose = *touch;
    } else {
      refuse_too_deep(to.pose);
      if (!(overlap(to.pose) > 0.0)) {
        if (shear > 0.0) {
          fail("gross slip: a shear force of {:.6g} N is wanted, but the object doesn't touch the gel", shear);
        }
        return untouched_at(to.pose);
      }
      if (placed && !(overlap(now.pose) > 0.0)) {
        double clear = 0.0;
        double overlapping = 1.0;
        for (int k = 0; k < 50; ++k) {
          const double middle = 0.5 * (clear + overlapping);
          (overlap(between(now.pose, to.pose, middle)) > 0.0 ? overlapping : clear) = middle;
        }
        touch = between(now.pose, to.pose, clear);
      }
    }
    start = untouched_at(touch ? *touch : to.pose);
  }
  if (!to.forced[2]) refuse_too_deep(to.pose);
  if (to.forced[2] && !start.touching) {
    // A little by position first: a force has nothing to act on yet.
    PartTarget first;
    first.pose = to.pose;
    first.pose.translation.z() -= kFirstTouch * gel.thickness;
    auto begun = advance(start, first, start, 0.0, 1.0, tolerance.most_halvings, effort);
    if (!begun || !begun->touching) fail("the press doesn't converge: {}", begun ? "no vertex touches" : why_not);
    start = std::move(*begun);
  }

  double parts = 1.0;
  Eigen::Vector3d way = to.pose.translation - start.pose.translation;
  for (int a = 0; a < 3; ++a) {
    if (to.forced[a]) way[a] = 0.0;
  }
  parts = std::max(parts, std::ceil(way.norm() / std::min(kLargestPart * gel.thickness, tolerance.largest_motion)));
  Snapshot at = start;
  if (to.forced[2]) {
    // Forces grow by a factor at a time, not by equal amounts: a contact that widens follows its tangent only so far.
    while (at.force.z() * kLargestForceGrowth < to.force.z() * 0.999) {
      PartTarget part = to;
      part.force = to.force * (at.force.z() * kLargestForceGrowth / to.force.z());
      part.pose = between(start.pose, to.pose, 1.0);
      auto next = advance(at, part, at, 0.0, 1.0, tolerance.most_halvings, effort);
      if (!next) fail("the press doesn't converge: {}", why_not);
      at = std::move(*next);
    }
    start = at;
  }
  for (int part = 0; part < static_cast<int>(parts); ++part) {
    const double end = part + 1 >= parts ? 1.0 : (part + 1) / parts;
    auto next = advance(start, to, at, part / parts, end, tolerance.most_halvings, effort);
    if (!next) fail("the press doesn't converge: {}", why_not);
    at = std::move(*next);
  }
  return at;
}

PressState FinitePress::Parts::report(const Snapshot& at) const {
  PressState s;
  s.gel_from_object = at.pose;
  s.node_state = at.state;
  s.traction = Eigen::MatrixX3d::Zero(n, 3);
  s.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  s.bead_displacement = gel.bead_weight * at.elastic.displacement;
  s.largest_penetration = at.penetration;
  s.contact_residual = at.residual;
  if (at.touching) {
    s.surface_displacement = mass.solve(gel.coupling * at.elastic.displacement);
    const Eigen::MatrixX3d nodal = nodal_forces(at) + bulge_forces(at);
    s.wrench.head<3>() = at.force;
    for (int node = 0; node < gel.space.nodes; ++node) {
      const Eigen::Vector3d place = gel.space.position(node) + at.elastic.displacement.row(node).transpose();
      s.wrench.tail<3>() -= place.cross(Eigen::Vector3d(nodal.row(node)));
    }
    double excess = 0.0;
    for (int v = 0; v < n; ++v) {
      if (at.state[v] == NodeState::open) continue;
      s.traction.row(v) = at.pressure[v] * at.gap.direction.row(v) / gel.rest.weight[v] + at.shear.row(v);
      s.largest_tension = std::max(s.largest_tension, -at.pressure[v]);
      if (std::isfinite(friction)) {
        excess = std::max(excess, at.shear.row(v).norm() - friction * std::max(0.0, at.pressure[v]));
      }
      s.contact_area += gel.rest.weight[v];
      ++s.contact_vertices;
    }
    const double largest = at.pressure.maxCoeff();
    if (friction > 0.0 && largest > 0.0) s.cone_violation = excess / (friction * largest);
    s.largest_gradient = largest_surface_gradient(gel.rest.vertices, gel.rest.triangles, s.surface_displacement);
    double deepest = 0.0;
    for (int v = 0; v < n; ++v) {
      deepest = std::max(deepest, std::abs(gel.rest.normals[v].dot(s.surface_displacement.row(v))));
    }
    s.largest_strain = std::max(s.largest_gradient, deepest / gel.thickness);
  }
  s.under_resolved = (at.touching || overlap(at.pose) > 0.0) && s.contact_vertices < kResolvedVertices;
  return s;
}

FinitePress::FinitePress(const FiniteGel& gel, ContactShape shape, double friction, PressTolerance tolerance) {
  check_shape(shape);
  if (!(friction >= 0.0)) fail("the friction coefficient is {}, it must be at least 0", friction);
  parts_ = std::make_unique<Parts>(gel, std::move(shape), friction, tolerance);
}

FinitePress::FinitePress(FinitePress&&) noexcept = default;
FinitePress& FinitePress::operator=(FinitePress&&) noexcept = default;
FinitePress::~FinitePress() = default;

const PressState& FinitePress::step(const PressTarget& target) {
  check_target(target);
  Parts& p = *parts_;
  Effort effort;
  Snapshot next = p.follow(target, effort);
  p.now = std::move(next);
  p.placed = true;
  p.state = p.report(p.now);
  for (int a = 0; a < 3; ++a) {
    if (target.axis[a].kind == AxisControl::Kind::force) {
      p.state.force_residual = std::max(p.state.force_residual, std::abs(p.now.force[a] - target.axis[a].value));
    }
  }
  p.state.candidates = effort.candidates;
  p.state.geometry_updates = effort.updates;
  p.state.solves = effort.solves;
  p.state.factorisations = effort.factorisations;
  p.state.sweeps = effort.sweeps;
  p.state.parts = effort.parts;
  return p.state;
}

const PressState& FinitePress::state() const {
  return parts_->state;
}

const ElasticSolution& FinitePress::solution() const {
  return parts_->now.elastic;
}

double FinitePress::stored_energy() const {
  return parts_->gel.problem.stored_energy(parts_->now.elastic);
}

}  // namespace touchstone::fem
