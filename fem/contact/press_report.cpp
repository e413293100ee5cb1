#include "fem/contact/press_report.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/elements/surface_strain.h"

namespace touchstone::fem {
namespace {

constexpr int kResolvedVertices = 13;

/// The traction that displaces the gel. One that relaxes is displaced as by its pseudo-elastic traction, also where
/// nothing touches it any more.
Eigen::VectorXd moving_traction(const PressSnapshot& snapshot) {
  return snapshot.history.empty() ? snapshot.traction
                                  : Eigen::VectorXd(snapshot.history.elastic.head(snapshot.traction.size()));
}

/// Displacements of the whole surface, and the strain measures.
void add_fields(const Compliance& gel, const ContactSurface& surface, const SurfaceMassFactor& mass,
                const PressSnapshot& snapshot, const Eigen::VectorXd& moving, PressState& s) {
  const int n = static_cast<int>(gel.vertices.size());
  s.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  if (!snapshot.touching() && snapshot.history.empty()) return;
  // `snapshot.weighted` is what cut hats see of it.
  add_displacement(gel, surface, mass, gel.surface.times(moving), s);
}

}  // namespace

void add_displacement(const Compliance& gel, const ContactSurface& surface, const SurfaceMassFactor& mass,
                      const Eigen::VectorXd& weighted, PressState& state) {
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  Eigen::MatrixX3d rows(n, 3);
  for (Eigen::Index v = 0; v < n; ++v) rows.row(v) = weighted.segment<3>(3 * v);
  state.surface_displacement = mass.solve(rows);
  state.largest_gradient = largest_surface_gradient(gel.vertices, gel.triangles, state.surface_displacement);
  double deepest = 0.0;
  for (Eigen::Index v = 0; v < n; ++v) {
    const Eigen::Vector3d& normal = surface.normals[static_cast<std::size_t>(v)];
    deepest = std::max(deepest, std::abs(normal.dot(state.surface_displacement.row(v))));
  }
  state.largest_strain = std::max(state.largest_gradient, deepest / gel.thickness);
}

bool is_resolved(const ContactSurface& surface, const std::vector<int>& owner, int body) {
  int vertices = 0;
  bool surrounded = false;
  for (std::size_t v = 0; v < owner.size(); ++v) {
    if (owner[v] != body) continue;
    ++vertices;
    const auto& around = surface.around[v];
    surrounded = surrounded || std::all_of(around.begin(), around.end(), [&](int u) { return owner[u] == body; });
  }
  return surrounded && vertices >= kResolvedVertices;
}

PressState report(const Compliance& gel, const PartSolver& solver, const SurfaceMassFactor& mass, PressOutput output,
                  const PressSnapshot& snapshot) {
  const ContactSurface& surface = solver.surface();
  const int n = static_cast<int>(gel.vertices.size());
  PressState s;
  for (const BodySnapshot& body : snapshot.bodies) {
    BodyState state;
    state.gel_from_object = body.pose;
    state.wrench << body.force, body.moment;
    s.bodies.push_back(state);
  }
  s.gel_from_object = s.bodies.front().gel_from_object;
  s.wrench = s.bodies.front().wrench;
  s.node_state = snapshot.state;
  s.node_owner = snapshot.owner;
  if (solver.outlines()) s.bearing_share = snapshot.share;
  s.cuts = snapshot.cuts;
  s.traction.resize(n, 3);
  for (int v = 0; v < n; ++v) s.traction.row(v) = snapshot.traction.segment<3>(3 * v);
  s.largest_penetration = snapshot.penetration;
  s.lookup_error = snapshot.lookup_error;
  s.contact_residual = snapshot.residual;

  const auto bead_compliance = gel.beads.view();
  Eigen::VectorXd beads = Eigen::VectorXd::Zero(gel.beads.rows());
  const Eigen::VectorXd moving = moving_traction(snapshot);
  for (int v = 0; v < n && beads.size() > 0; ++v) {
    const Eigen::Vector3d t = moving.segment<3>(3 * v);
    if (!t.isZero(0.0)) beads += bead_compliance.middleCols<3>(3 * v) * t;
  }
  const auto soft = [](const PressBody& body) { return body.elastic != nullptr; };
  if (snapshot.history.empty() && std::any_of(solver.bodies().begin(), solver.bodies().end(), soft)) {
    s.object_gives = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN());
  }
  double largest_pressure = 0.0;
  for (int v = 0; v < n; ++v) {
    if (snapshot.state[v] == NodeState::open) continue;
    const Eigen::Vector3d t = snapshot.traction.segment<3>(3 * v);
    const double pressure = -surface.normals[v].dot(t);
    largest_pressure = std::max(largest_pressure, pressure);
    s.largest_tension = std::max(s.largest_tension, -pressure);
    const double area = surface.weight[v] * snapshot.share[v];
    if (s.object_gives.size() > 0 && soft(solver.bodies()[snapshot.owner[v]])) {
      s.object_gives[v] =
          surface.normals[v].dot(snapshot.weighted.segment<3>(3 * v) - snapshot.relative.segment<3>(3 * v)) / area;
    }
    s.contact_area += area;
    ++s.contact_vertices;
    s.bodies[snapshot.owner[v]].contact_area += area;
    ++s.bodies[snapshot.owner[v]].contact_vertices;
  }
  for (int v = 0; v < n && largest_pressure > 0.0; ++v) {
    if (snapshot.state[v] == NodeState::open) continue;
    const double friction = solver.bodies()[snapshot.owner[v]].friction;
    if (!(friction > 0.0) || std::isinf(friction)) continue;
    const Eigen::Vector3d t = snapshot.traction.segment<3>(3 * v);
    const double pressure = -surface.normals[v].dot(t);
    const double excess = (t + pressure * surface.normals[v]).norm() - friction * std::max(0.0, pressure);
    s.cone_violation = std::max(s.cone_violation, excess / (friction * largest_pressure));
  }
  s.bead_displacement.resize(gel.beads.rows() / 3, 3);
  for (Eigen::Index b = 0; b < s.bead_displacement.rows(); ++b) s.bead_displacement.row(b) = beads.segment<3>(3 * b);
  if (output == PressOutput::fields) add_fields(gel, surface, mass, snapshot, moving, s);
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    const BodySnapshot& body = snapshot.bodies[b];
    s.under_resolved = s.under_resolved || ((body.touching || body.overlapping) &&
                                            !is_resolved(surface, snapshot.owner, static_cast<int>(b)));
  }
  return s;
}

}  // namespace touchstone::fem
