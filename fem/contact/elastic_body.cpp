#include "fem/contact/elastic_body.h"

#include <algorithm>
#include <map>

#include "core/error.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem {
namespace {

/// Products of two linear functions are quadratic; the cells of the two meshes don't fit, so more points than that.
constexpr int kRuleDegree = 6;

}  // namespace

ElasticBody::ElasticBody(const Compliance& body)
    : body_(body),
      outer_(body.vertices, body.triangles),
      weight_(body.mass * Eigen::VectorXd::Ones(body.mass.rows())) {}

Eigen::SparseMatrix<double> ElasticBody::coupling(const ContactSurface& surface, const std::vector<int>& vertices,
                                                  const std::vector<char>& mine, const RigidTransform& gel_from_object,
                                                  const PatchMotion& lookup, const CutHats* cuts,
                                                  std::vector<int>& met) const {
  TS_ASSERT(mine.size() == vertices.size());
  static const std::vector<SimplexPoint<3>> rule = triangle_rule(kRuleDegree);
  const RigidTransform object_from_gel = gel_from_object.inverse();
  std::vector<int> place(surface.vertices.size(), -1);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    if (mine[k]) place[vertices[k]] = static_cast<int>(k);
  }
  std::map<int, int> column_of;
  met.clear();
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int triangle, const Eigen::Vector3d& barycentric, const Eigen::Vector3d& density) {
    const auto& index = surface.triangles[triangle];
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      at += barycentric[k] * surface.vertices[index[k]];
      normal += barycentric[k] * surface.normals[index[k]];
    }
    normal.normalize();
    const Eigen::Vector3d carried = lookup.displacement(at);
    at += carried - normal.dot(carried) * normal;
    const auto hit = outer_.first_crossing(object_from_gel * at, object_from_gel.turn(normal));
    if (!hit) return;
    for (int k = 0; k < 3; ++k) {
      const int row = place[index[k]];
      if (row < 0 || density[k] == 0.0) continue;
      for (int j = 0; j < 3; ++j) {
        const int vertex = body_.triangles[hit->triangle][j];
        const auto [column, is_new] = column_of.try_emplace(vertex, static_cast<int>(met.size()));
        if (is_new) met.push_back(vertex);
        entries.emplace_back(row, column->second, density[k] * hit->barycentric[j] / weight_[vertex]);
      }
    }
  };
  static const std::vector<CutTriangle> none;
  const std::vector<CutTriangle>& cut = cuts != nullptr ? cuts->triangles : none;
  auto next_cut = cut.begin();
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    while (next_cut != cut.end() && next_cut->triangle < t) ++next_cut;
    const auto& index = surface.triangles[t];
    if (place[index[0]] < 0 && place[index[1]] < 0 && place[index[2]] < 0) continue;
    if (next_cut != cut.end() && next_cut->triangle == t) {
      for (const DensityCell& cell : next_cut->cells) add(t, cell.corners, cell.density);
    } else {
      for (const SimplexPoint<3>& point : rule) {
        add(t, point.barycentric, surface.triangle_area[t] * point.weight * point.barycentric);
      }
    }
  }
  const auto m = static_cast<Eigen::Index>(vertices.size());
  const auto count = static_cast<Eigen::Index>(met.size());
  Eigen::SparseMatrix<double> result(m, count);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

void ElasticBody::add_normal_to(Eigen::MatrixXd& compliance, double scale, const ContactSurface& surface,
                                const std::vector<int>& vertices, const std::vector<char>& mine,
                                const Eigen::Vector3d& normal, const RigidTransform& gel_from_object,
                                const PatchMotion& lookup, const CutHats* cuts) const {
  std::vector<int> met;
  const Eigen::SparseMatrix<double> onto = coupling(surface, vertices, mine, gel_from_object, lookup, cuts, met);
  const Eigen::Vector3d along = gel_from_object.rotation.transpose() * normal;
  const auto h = body_.surface.view();
  const auto count = static_cast<Eigen::Index>(met.size());
  Eigen::MatrixXd own(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    for (Eigen::Index i = 0; i < count; ++i) own(i, j) = along.dot(h.block<3, 3>(3 * met[i], 3 * met[j]) * along);
  }
  const Eigen::MatrixXd left = onto * own;
  compliance.noalias() += scale * (onto * left.transpose()).transpose();
}

void ElasticBody::add_to(Eigen::MatrixXd& compliance, double scale, const ContactSurface& surface,
                         const std::vector<int>& vertices, const std::vector<char>& mine,
                         const std::vector<Eigen::Matrix3d>& axes, const RigidTransform& gel_from_object,
                         const PatchMotion& lookup, const CutHats* cuts) const {
  std::vector<int> met;
  const Eigen::SparseMatrix<double> onto = coupling(surface, vertices, mine, gel_from_object, lookup, cuts, met);
  const auto m = static_cast<Eigen::Index>(vertices.size());
  const auto count = static_cast<Eigen::Index>(met.size());

  // One pair of components at a time: onto * H_ab * onto^T, turned from the object's axes into the vertices'.
  const auto h = body_.surface.view();
  std::array<std::array<Eigen::MatrixXd, 3>, 3> seen;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      Eigen::MatrixXd own(count, count);
      for (Eigen::Index j = 0; j < count; ++j) {
        for (Eigen::Index i = 0; i < count; ++i) own(i, j) = h(3 * met[i] + a, 3 * met[j] + b);
      }
      const Eigen::MatrixXd left = onto * own;
      seen[a][b] = (onto * left.transpose()).transpose();
    }
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    if (!mine[j]) continue;
    const Eigen::Matrix3d turn_j = gel_from_object.rotation.transpose() * axes[j];
    for (Eigen::Index i = 0; i < m; ++i) {
      if (!mine[i]) continue;
      Eigen::Matrix3d block;
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) block(a, b) = scale * seen[a][b](i, j);
      }
      compliance.block<3, 3>(3 * i, 3 * j).noalias() +=
          (gel_from_object.rotation.transpose() * axes[i]).transpose() * (block * turn_j);
    }
  }
}

}  // namespace touchstone::fem
