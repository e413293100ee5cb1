#include "fem/press_report.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "fem/surface_strain.h"

namespace touchstone::fem {
namespace {

constexpr int kResolvedVertices = 13;

}  // namespace

PressState report(const Compliance& gel, const ContactSurface& surface, const SurfaceMassFactor& mass, double friction,
                  const PressSnapshot& snapshot) {
  const int n = static_cast<int>(gel.vertices.size());
  PressState s;
  s.gel_from_object = snapshot.pose;
  s.node_state = snapshot.state;
  s.traction.resize(n, 3);
  for (int v = 0; v < n; ++v) s.traction.row(v) = snapshot.traction.segment<3>(3 * v);
  s.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  s.bead_displacement = Eigen::MatrixX3d::Zero(gel.beads.rows() / 3, 3);
  s.largest_penetration = snapshot.penetration;
  s.lookup_error = snapshot.lookup_error;
  s.contact_residual = snapshot.residual;
  if (snapshot.touching || !snapshot.history.empty()) {
    Eigen::MatrixX3d weighted(n, 3);
    for (int v = 0; v < n; ++v) weighted.row(v) = snapshot.weighted.segment<3>(3 * v);
    s.surface_displacement = mass.solve(weighted);
    Eigen::VectorXd beads = Eigen::VectorXd::Zero(gel.beads.rows());
    const Eigen::VectorXd& moving = snapshot.history.empty() ? snapshot.traction : snapshot.history.elastic;
    for (int v = 0; v < n && beads.size() > 0; ++v) {
      const Eigen::Vector3d t = moving.segment<3>(3 * v);
      if (!t.isZero(0.0)) beads += gel.beads.middleCols<3>(3 * v) * t;
    }
    double largest_pressure = 0.0;
    double excess = 0.0;
    for (int v = 0; v < n; ++v) {
      if (snapshot.state[v] == NodeState::open) continue;
      const Eigen::Vector3d t = snapshot.traction.segment<3>(3 * v);
      const double pressure = -surface.normals[v].dot(t);
      largest_pressure = std::max(largest_pressure, pressure);
      s.largest_tension = std::max(s.largest_tension, -pressure);
      const double shear = (t + pressure * surface.normals[v]).norm();
      if (std::isfinite(friction)) excess = std::max(excess, shear - friction * std::max(0.0, pressure));
      s.contact_area += surface.weight[v];
      ++s.contact_vertices;
      // Exact for P1 tractions at P1 displaced points.
      for (Eigen::SparseMatrix<double>::InnerIterator it(gel.mass, v); it; ++it) {
        const auto u = it.row();
        const Eigen::Vector3d at =
            gel.vertices[static_cast<std::size_t>(u)] + s.surface_displacement.row(u).transpose();
        s.wrench.tail<3>() -= it.value() * at.cross(t);
      }
    }
    s.wrench.head<3>() = snapshot.force;
    for (Eigen::Index b = 0; b < s.bead_displacement.rows(); ++b) s.bead_displacement.row(b) = beads.segment<3>(3 * b);
    if (friction > 0.0 && largest_pressure > 0.0) s.cone_violation = excess / (friction * largest_pressure);
    s.largest_gradient = largest_surface_gradient(gel.vertices, gel.triangles, s.surface_displacement);
    double deepest = 0.0;
    for (int v = 0; v < n; ++v) {
      deepest = std::max(deepest, std::abs(surface.normals[v].dot(s.surface_displacement.row(v))));
    }
    s.largest_strain = std::max(s.largest_gradient, deepest / gel.thickness);
  }
  s.under_resolved = (snapshot.touching || snapshot.overlapping) && s.contact_vertices < kResolvedVertices;
  return s;
}

}  // namespace touchstone::fem
