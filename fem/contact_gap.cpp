#include "fem/contact_gap.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "fem/covered_triangle.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastShare = 0.25;     // covered share below which a vertex is far
constexpr double kSplitAboveBody = 1.0;  // a cell larger than this times the body's radius is split

/// Integrates over one surface triangle; coordinates inside it are barycentric.
template <typename Shape>
class TriangleGap {
 public:
  TriangleGap(const Shape& shape, const RigidTransform& object_from_gel, double body_radius)
      : shape_(shape), object_from_gel_(object_from_gel), body_radius_(body_radius) {}

  /// int phi_k gap dA, int phi_k dA over the part that hits, and the least gap.
  Eigen::Vector3d gap;
  Eigen::Vector3d covered;
  double lowest = kInfinity;

  void integrate(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals) {
    gap.setZero();
    covered.setZero();
    lowest = kInfinity;
    for (int k = 0; k < 3; ++k) {
      points_.col(k) = object_from_gel_ * corners[k];
      normals_.col(k) = object_from_gel_.turn(normals[k]);
    }
    one_normal_ = normals[0] == normals[1] && normals[0] == normals[2];
    area_ = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    const auto line = [this](const Eigen::Vector3d& b) { return at(b); };
    const auto visit = [this](const Eigen::Vector3d& b, double value, double weight) { add(b, value, weight * area_); };
    CoveredTriangle(line, visit).integrate(splits_for_body(area_, body_radius_));
  }

 private:
  std::optional<double> at(const Eigen::Vector3d& b) const {
    const Eigen::Vector3d point = points_ * b;
    if (one_normal_) return first_entry(shape_, point, normals_.col(0));
    return first_entry(shape_, point, (normals_ * b).normalized());
  }

  void add(const Eigen::Vector3d& b, double value, double weight) {
    gap += weight * value * b;
    covered += weight * b;
    lowest = std::min(lowest, value);
  }

  const Shape& shape_;
  const RigidTransform object_from_gel_;
  const double body_radius_;
  Eigen::Matrix3d points_;
  Eigen::Matrix3d normals_;
  bool one_normal_ = true;
  double area_ = 0.0;
};

/// Calls visit(triangle index, corners moved by the tangential displacement, normals) for triangles whose lines may
/// hit.
template <typename Visit>
void for_each_near(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object,
                   std::span<const Eigen::Vector3d> tangential, std::span<const char> wanted, const Visit& visit) {
  const BoundingBall ball = bounding_ball(shape);
  const Eigen::Vector3d centre = gel_from_object * ball.centre;
  std::vector<Eigen::Vector3d> moved = surface.vertices;
  if (!tangential.empty()) {
    for (std::size_t v = 0; v < moved.size(); ++v) {
      const Eigen::Vector3d& n = surface.normals[v];
      moved[v] += tangential[v] - n.dot(tangential[v]) * n;
    }
  }
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& index = surface.triangles[t];
    if (!wanted.empty() && !wanted[index[0]] && !wanted[index[1]] && !wanted[index[2]]) continue;
    const std::array<Eigen::Vector3d, 3> corners{moved[index[0]], moved[index[1]], moved[index[2]]};
    const std::array<Eigen::Vector3d, 3> normals{surface.normals[index[0]], surface.normals[index[1]],
                                                 surface.normals[index[2]]};
    if (normals[0] == normals[1] && normals[0] == normals[2]) {
      const Eigen::Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3.0;
      double reach = 0.0;
      for (const auto& c : corners) reach = std::max(reach, (c - middle).norm());
      const Eigen::Vector3d away = centre - middle;
      const Eigen::Vector3d lateral = away - away.dot(normals[0]) * normals[0];
      if (lateral.norm() > reach + ball.radius) continue;
    }
    visit(t, corners, normals);
  }
}

}  // namespace

RadonRule::RadonRule() {
  const double root = std::sqrt(15.0);
  points[0] = Eigen::Vector3d::Constant(1.0 / 3.0);
  weights[0] = 9.0 / 40.0;
  for (int family = 0; family < 2; ++family) {
    const double sign = family == 0 ? -1.0 : 1.0;
    const double a = (6.0 + sign * root) / 21.0;
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d b = Eigen::Vector3d::Constant(a);
      b[k] = 1.0 - 2.0 * a;
      points[1 + 3 * family + k] = b;
      weights[1 + 3 * family + k] = (155.0 + sign * root) / 1200.0;
    }
  }
}

const RadonRule& radon_rule() {
  static const RadonRule rule;
  return rule;
}

int splits_for_body(double area, double body_radius) {
  int splits = 0;
  for (double size = std::sqrt(2.0 * area); size > kSplitAboveBody * body_radius && splits < 6; size *= 0.5) ++splits;
  return splits;
}

ContactSurface::ContactSurface(const Compliance& gel) : ContactSurface(gel.vertices, gel.triangles, gel.mass) {
  TS_ASSERT(static_cast<std::size_t>(gel.surface.rows()) == 3 * vertices.size());
  TS_ASSERT(gel.surface.cols() == gel.surface.rows());
}

ContactSurface::ContactSurface(std::vector<Eigen::Vector3d> places, std::vector<std::array<int, 3>> faces,
                               const Eigen::SparseMatrix<double>& mass)
    : vertices(std::move(places)), triangles(std::move(faces)) {
  const std::size_t n = vertices.size();
  TS_ASSERT(static_cast<std::size_t>(mass.rows()) == n);
  normals.assign(n, Eigen::Vector3d::Zero());
  around.resize(n);
  for (const auto& t : triangles) {
    const Eigen::Vector3d twice_area = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    for (int k = 0; k < 3; ++k) {
      normals[t[k]] += twice_area;
      around[t[k]].push_back(t[(k + 1) % 3]);
      around[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  for (std::size_t v = 0; v < n; ++v) {
    normals[v].normalize();
    // A flat pad's normals must be equal to the last bit: sums of parallel vectors differ by rounding.
    for (int a = 0; a < 3; ++a) {
      if (std::abs(normals[v][a]) < 1e-14) normals[v][a] = 0.0;
      if (std::abs(std::abs(normals[v][a]) - 1.0) < 1e-14) normals[v][a] = std::copysign(1.0, normals[v][a]);
    }
    std::sort(around[v].begin(), around[v].end());
    around[v].erase(std::unique(around[v].begin(), around[v].end()), around[v].end());
  }
  weight = mass * Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
}

WeightedGap weighted_gap(const ContactSurface& surface, const ContactShape& shape,
                         const RigidTransform& gel_from_object, std::span<const Eigen::Vector3d> tangential,
                         std::span<const char> wanted) {
  const auto n = static_cast<Eigen::Index>(surface.vertices.size());
  WeightedGap result;
  result.weighted = Eigen::VectorXd::Zero(n);
  result.lowest = Eigen::VectorXd::Constant(n, kInfinity);
  result.edge = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd covered = Eigen::VectorXd::Zero(n);
  std::visit(
      [&](const auto& body) {
        TriangleGap triangle(body, gel_from_object.inverse(), bounding_ball(shape).radius);
        for_each_near(surface, shape, gel_from_object, tangential, wanted,
                      [&](std::size_t t, const auto& corners, const auto& normals) {
                        triangle.integrate(corners, normals);
                        // Integrals over the undeformed surface: the moved triangle only says where to look.
                        const auto& index = surface.triangles[t];
                        const double moved_area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
                        const double own_area =
                            0.5 * (surface.vertices[index[1]] - surface.vertices[index[0]])
                                      .cross(surface.vertices[index[2]] - surface.vertices[index[0]])
                                      .norm();
                        const double scale = moved_area > 0.0 ? own_area / moved_area : 0.0;
                        for (int k = 0; k < 3; ++k) {
                          result.weighted[index[k]] += scale * triangle.gap[k];
                          covered[index[k]] += scale * triangle.covered[k];
                          result.lowest[index[k]] = std::min(result.lowest[index[k]], triangle.lowest);
                        }
                        result.deepest = std::min(result.deepest, triangle.lowest);
                      });
      },
      shape);
  const double depth = result.deepest < 0.0 ? -result.deepest : 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double share = covered[i] / surface.weight[i];
    if (share < kLeastShare || (!wanted.empty() && !wanted[i])) {
      result.weighted[i] = kInfinity;
      result.lowest[i] = kInfinity;
      continue;
    }
    if (share < 0.5) result.edge[i] = surface.weight[i] * (0.5 - share) / 0.1;
    result.weighted[i] *= surface.weight[i] / covered[i];
    result.weighted[i] += result.edge[i] * depth;
  }
  return result;
}

}  // namespace touchstone::fem
