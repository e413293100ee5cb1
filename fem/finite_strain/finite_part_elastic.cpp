// An elastic object in a part of a finite-strain press: what it gives way, and what that adds to the laws of contact.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "fem/finite_strain/finite_part_iterate.h"

namespace touchstone::fem {
namespace {

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

constexpr int kFacePasses = 3;  // over an elastic object's face

/// The gradients along a surface of what its corners have, as means over the triangles about each.
Eigen::MatrixX3d vertex_slopes(const std::vector<Eigen::Vector3d>& corners,
                               const std::vector<std::array<Eigen::Index, 3>>& triangles,
                               const Eigen::VectorXd& values) {
  Eigen::MatrixX3d slopes = Eigen::MatrixX3d::Zero(values.size(), 3);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(values.size());
  for (const auto& t : triangles) {
    const Eigen::Vector3d twice_area = (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]);
    const double size = twice_area.norm();
    if (!(size > 0.0)) continue;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();  // times the size
    for (int k = 0; k < 3; ++k) {
      slope += values[t[k]] / size * twice_area.cross(corners[t[(k + 2) % 3]] - corners[t[(k + 1) % 3]]);
    }
    for (const Eigen::Index k : t) {
      slopes.row(k) += slope.transpose();
      areas[k] += size;
    }
  }
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (areas[k] > 0.0) slopes.row(k) /= areas[k];
  }
  return slopes;
}

}  // namespace

/// What the object's surface gives way under the iterate's tractions, and the gaps from where it is then. Gel and
/// object meet where the gel's deformed surface is, along its normals; as the gap's lines, that stays near the answer.
/// What is given changes along the surface: so much is the object's face turned, and contact acts along it. Without
/// that the force isn't the derivative of the stored energy (6 % off with a ball as soft as the gel, a third of the gel
/// deep, on any mesh).
void FinitePartSolver::give_way(bool anew, Iterate& iterate) const {
  FiniteSnapshot& at = iterate.at;
  at.given = Eigen::MatrixX3d::Zero(n_, 3);
  iterate.soft.resize(bodies_.size());
  if (anew) iterate.face = Eigen::MatrixX3d::Zero(n_, 3);
  const std::vector<int> near = with_those_beside(at, candidates(at));
  for (int b = 0; b < std::ssize(bodies_); ++b) {
    if (soft_[b]) give_way(b, anew, near, iterate);
  }
  std::vector<Eigen::Triplet<double>> turned;
  for (const std::shared_ptr<const Soft>& soft : iterate.soft) {
    if (!soft) continue;
    for (const int v : soft->vertices) {
      at.gap.weighted[v] += at.gap.direction.row(v).dot(at.given.row(v)) / gel_.rest.weight[v];
      for (RowSparse::InnerIterator it(gel_.coupling, v); it; ++it) {
        for (int a = 0; a < 3; ++a) turned.emplace_back(v, 3 * it.col() + a, it.value() * iterate.face(v, a));
      }
    }
  }
  RowSparse by_face(at.gap.gradient.rows(), at.gap.gradient.cols());
  by_face.setFromTriplets(turned.begin(), turned.end());
  at.gap.gradient += by_face;
}

/// One body's part of it: what is given, and how the directions of its gaps turn. `near`: vertices that may touch any.
void FinitePartSolver::give_way(int body, bool anew, const std::vector<int>& near, Iterate& iterate) const {
  FiniteSnapshot& at = iterate.at;
  const auto place_of = [&](int v) -> Eigen::Vector3d {
    return gel_.rest.vertices[v] + at.elastic.displacement.row(gel_.outer.mesh_vertex[v]).transpose();
  };
  std::vector<int> wanted;
  std::copy_if(near.begin(), near.end(), std::back_inserter(wanted), [&](int v) { return at.owner[v] == body; });
  const std::shared_ptr<const Soft>& known = iterate.soft[body];
  const bool covered =
      known && std::includes(known->vertices.begin(), known->vertices.end(), wanted.begin(), wanted.end());
  if (anew || !covered) {
    ContactSurface deformed = gel_.rest;
    for (int v = 0; v < n_; ++v) deformed.vertices[v] = place_of(v);
    deformed.normals = iterate.lines[body].normals;
    const auto m = static_cast<Eigen::Index>(wanted.size());
    auto soft = std::make_shared<Soft>();
    soft->vertices = std::move(wanted);
    soft->compliance = Eigen::MatrixXd::Zero(3 * m, 3 * m);
    for (const auto& t : gel_.rest.triangles) {
      const std::array<Eigen::Index, 3> places = {soft->place(t[0]), soft->place(t[1]), soft->place(t[2])};
      if (*std::min_element(places.begin(), places.end()) >= 0) soft->triangles.push_back(places);
    }
    soft_[body]->add_to(soft->compliance, 1.0, deformed, soft->vertices, std::vector<char>(soft->vertices.size(), 1),
                        std::vector<Eigen::Matrix3d>(soft->vertices.size(), Eigen::Matrix3d::Identity()),
                        at.bodies[body].pose, {}, nullptr);
    iterate.soft[body] = std::move(soft);
  }
  const Soft& soft = *iterate.soft[body];
  const auto m = std::ssize(soft.vertices);
  const auto give = [&] {
    Eigen::VectorXd tractions(3 * m);
    for (Eigen::Index k = 0; k < m; ++k) tractions.segment<3>(3 * k) = traction_at(gel_, at, soft.vertices[k]);
    const Eigen::VectorXd given = soft.compliance * tractions;
    for (Eigen::Index k = 0; k < m; ++k) at.given.row(soft.vertices[k]) = given.segment<3>(3 * k).transpose();
  };
  const auto turn_face = [&](const Eigen::MatrixX3d& rigid) {
    for (const int v : soft.vertices)
      at.gap.direction.row(v) = rigid.row(v) + gel_.rest.weight[v] * iterate.face.row(v);
  };
  const Eigen::MatrixX3d rigid = at.gap.direction;
  if (anew) {
    std::vector<Eigen::Vector3d> corners;
    for (const int v : soft.vertices) corners.push_back(place_of(v));
    // What is given and how the face turns depend on each other, weakly.
    for (int pass = 0; pass < kFacePasses; ++pass) {
      give();
      Eigen::VectorXd along(m);  // mm
      for (Eigen::Index k = 0; k < m; ++k) {
        const int v = soft.vertices[k];
        const double weight = gel_.rest.weight[v];
        along[k] = at.gap.direction.row(v).dot(at.given.row(v)) / (weight * weight);
      }
      const Eigen::MatrixX3d slopes = vertex_slopes(corners, soft.triangles, along);
      for (Eigen::Index k = 0; k < m; ++k) iterate.face.row(soft.vertices[k]) = slopes.row(k);
      turn_face(rigid);
    }
  } else {
    turn_face(rigid);
  }
  give();
}

/// Adds the elastic bodies' part for the block's rows of laws, as many a vertex as in LawRows. @pre the iterate's
/// `soft` covers what they touch of it
void FinitePartSolver::add_given(const Iterate& iterate, const std::vector<int>& block, int components,
                                 Eigen::MatrixXd& compliance) const {
  const auto m = std::ssize(block);
  const Eigen::Index c = components;
  std::vector<Eigen::Matrix3d> laws;  // rows: how the vertex's gap and slips change with what is given there
  for (const int v : block) {
    Eigen::Matrix3d rows = iterate.axes[v].transpose();
    rows.row(0) = iterate.at.gap.direction.row(v) / gel_.rest.weight[v];
    laws.push_back(rows);
  }
  for (int body = 0; body < std::ssize(bodies_); ++body) {
    if (!soft_[body]) continue;
    const Soft& soft = *iterate.soft[body];
    std::vector<Eigen::Index> places;  // -1: another body's
    for (const int v : block) places.push_back(iterate.at.owner[v] == body ? soft.place(v) : -1);
    for (Eigen::Index j = 0; j < m; ++j) {
      for (Eigen::Index i = 0; i < m; ++i) {
        if (places[i] < 0 || places[j] < 0) continue;
        const Eigen::Matrix3d own = soft.compliance.block<3, 3>(3 * places[i], 3 * places[j]);
        compliance.block(c * i, c * j, c, c) += (laws[i] * own * laws[j].transpose()).topLeftCorner(c, c);
      }
    }
  }
}

}  // namespace touchstone::fem
