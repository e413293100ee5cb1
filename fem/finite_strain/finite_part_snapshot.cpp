// Converged states of a finite-strain press, and what contact does to the gel there.

#include <utility>

#include "fem/finite_strain/finite_part.h"

namespace touchstone::fem {
namespace {

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

}  // namespace

FiniteSnapshot untouched(const FiniteGel& gel, std::vector<BodySnapshot> bodies) {
  const auto n = static_cast<Eigen::Index>(gel.rest.vertices.size());
  FiniteSnapshot s;
  for (BodySnapshot& body : bodies) {
    body.force = body.moment = Eigen::Vector3d::Zero();
    body.touching = false;
  }
  s.bodies = std::move(bodies);
  s.elastic = gel.problem.at_rest();
  s.pressure = Eigen::VectorXd::Zero(n);
  s.shear = Eigen::MatrixX3d::Zero(n, 3);
  s.state.assign(gel.rest.vertices.size(), NodeState::open);
  s.owner.assign(gel.rest.vertices.size(), -1);
  return s;
}

Eigen::MatrixX3d pressure_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body) {
  Eigen::MatrixX3d forces = Eigen::MatrixX3d::Zero(gel.space.nodes, 3);
  for (Eigen::Index v = 0; v < at.pressure.size(); ++v) {
    if (at.pressure[v] == 0.0 || at.owner[static_cast<std::size_t>(v)] != body) continue;
    for (RowSparse::InnerIterator it(at.gap.gradient, v); it; ++it) {
      forces(it.col() / 3, it.col() % 3) += at.pressure[v] * it.value();
    }
  }
  return forces;
}

Eigen::MatrixX3d traction_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body) {
  Eigen::MatrixX3d shear = at.shear;
  for (Eigen::Index v = 0; v < shear.rows(); ++v) {
    if (at.owner[static_cast<std::size_t>(v)] != body) shear.row(v).setZero();
  }
  return gel.coupling.transpose() * shear + pressure_forces(gel, at, body);
}

Eigen::MatrixX3d bulge_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body) {
  Eigen::MatrixX3d forces = Eigen::MatrixX3d::Zero(gel.space.nodes, 3);
  for (const EdgeBulge& bulge : at.gap.bulges) {
    if (bulge.body != body) continue;
    for (int i = 0; i < 3; ++i) {
      forces.row(bulge.nodes[i]) -= (bulge.stiffness * bulge.value) * bulge.gradient[i].transpose();
    }
  }
  return forces;
}

Eigen::Vector3d traction_at(const FiniteGel& gel, const FiniteSnapshot& at, int vertex) {
  return at.pressure[vertex] * at.gap.direction.row(vertex).transpose() / gel.rest.weight[vertex] +
         at.shear.row(vertex).transpose();
}

}  // namespace touchstone::fem
