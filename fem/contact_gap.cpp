#include "fem/contact_gap.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastShare = 0.25;     // covered share below which a vertex is far
constexpr int kSilhouetteSplits = 2;     // levels of splitting on the silhouette
constexpr int kBisections = 34;          // of a cell's edge: a quarter of a triangle's to 1e-11
constexpr double kSplitAboveBody = 1.0;  // a cell larger than this times the body's radius is split

/// Radon's rule of degree 5 on a triangle (J. Radon, Monatsh. Math. Phys. 52, 1948): barycentric points and weights.
struct RadonRule {
  std::array<Eigen::Vector3d, 7> points;
  std::array<double, 7> weights;
  RadonRule() {
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
};

const RadonRule& radon_rule() {
  static const RadonRule rule;
  return rule;
}

/// Integrates over one surface triangle; coordinates inside it are barycentric.
template <typename Shape>
class TriangleGap {
 public:
  TriangleGap(const Shape& shape, const RigidTransform& object_from_gel, double body_radius, double farthest_behind)
      : shape_(shape),
        object_from_gel_(object_from_gel),
        body_radius_(body_radius),
        farthest_behind_(farthest_behind) {}

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
    const double size = std::sqrt(2.0 * area_);
    // Bodies smaller than the triangle must not fall between its points.
    int splits = 0;
    for (double s = size; s > kSplitAboveBody * body_radius_ && splits < 6; s *= 0.5) ++splits;
    cell(Eigen::Matrix3d::Identity(), splits, kSilhouetteSplits);
  }

 private:
  std::optional<double> at(const Eigen::Vector3d& b) const {
    const Eigen::Vector3d point = points_ * b;
    const Eigen::Vector3d normal = one_normal_ ? normals_.col(0) : (normals_ * b).normalized();
    const auto entry = first_entry(shape_, point, normal);
    if (!entry || *entry >= -farthest_behind_) return entry;
    const auto back = first_entry(shape_, point, -normal);  // where the line leaves the body, seen from outside
    return back && -*back < -farthest_behind_ ? std::nullopt : entry;
  }

  /// `cell` holds the barycentric corners as columns.
  void cell(const Eigen::Matrix3d& corners, int forced_splits, int silhouette_splits) {
    if (forced_splits > 0) {
      split(corners, forced_splits - 1, silhouette_splits);
      return;
    }
    const RadonRule& rule = radon_rule();
    std::array<std::optional<double>, 7> value;
    std::array<bool, 3> corner_hit;
    int hits = 0;
    for (int k = 0; k < 3; ++k) {
      corner_hit[k] = at(corners.col(k)).has_value();
      hits += corner_hit[k];
    }
    const int corner_hits = hits;
    for (int k = 0; k < 7; ++k) {
      value[k] = at(corners * rule.points[k]);
      hits += value[k].has_value();
    }
    if (hits == 0) return;
    if (hits == 10) {
      const double area = area_ * std::abs(corners.determinant());
      for (int k = 0; k < 7; ++k) add(corners * rule.points[k], *value[k], rule.weights[k] * area);
      return;
    }
    if (silhouette_splits > 0) {
      split(corners, 0, silhouette_splits - 1);
      return;
    }
    if (corner_hits == 3) {
      piece(corners.col(0), corners.col(1), corners.col(2));
    } else if (corner_hits > 0) {
      clip(corners, corner_hit, corner_hits);
    }
  }

  void split(const Eigen::Matrix3d& c, int forced_splits, int silhouette_splits) {
    const Eigen::Vector3d m01 = 0.5 * (c.col(0) + c.col(1));
    const Eigen::Vector3d m12 = 0.5 * (c.col(1) + c.col(2));
    const Eigen::Vector3d m20 = 0.5 * (c.col(2) + c.col(0));
    const auto corners = [](const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
      Eigen::Matrix3d m;
      m << x, y, z;
      return m;
    };
    cell(corners(c.col(0), m01, m20), forced_splits, silhouette_splits);
    cell(corners(m01, c.col(1), m12), forced_splits, silhouette_splits);
    cell(corners(m20, m12, c.col(2)), forced_splits, silhouette_splits);
    cell(corners(m01, m12, m20), forced_splits, silhouette_splits);
  }

  /// The point on the edge from a hit to a miss where the silhouette crosses it.
  Eigen::Vector3d crossing(Eigen::Vector3d hit, Eigen::Vector3d miss) const {
    for (int k = 0; k < kBisections; ++k) {
      const Eigen::Vector3d middle = 0.5 * (hit + miss);
      (at(middle) ? hit : miss) = middle;
    }
    return hit;
  }

  void clip(const Eigen::Matrix3d& c, const std::array<bool, 3>& hit, int hits) {
    // Turn so that corner 0 is the odd one out.
    int odd = 0;
    while (hit[odd] != (hits == 1)) ++odd;
    const Eigen::Vector3d a = c.col(odd);
    const Eigen::Vector3d b = c.col((odd + 1) % 3);
    const Eigen::Vector3d d = c.col((odd + 2) % 3);
    if (hits == 1) {
      piece(a, crossing(a, b), crossing(a, d));
    } else {
      const Eigen::Vector3d ab = crossing(b, a);
      const Eigen::Vector3d ad = crossing(d, a);
      piece(ab, b, d);
      piece(ab, d, ad);
    }
  }

  /// A cell that hits all over, but for slivers at a curved silhouette.
  void piece(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& d) {
    Eigen::Matrix3d corners;
    corners << a, b, d;
    const double area = area_ * std::abs(corners.determinant());
    const RadonRule& rule = radon_rule();
    for (int k = 0; k < 7; ++k) {
      const Eigen::Vector3d point = corners * rule.points[k];
      if (const auto value = at(point)) add(point, *value, rule.weights[k] * area);
    }
  }

  void add(const Eigen::Vector3d& b, double value, double weight) {
    gap += weight * value * b;
    covered += weight * b;
    lowest = std::min(lowest, value);
  }

  const Shape& shape_;
  const RigidTransform object_from_gel_;
  const double body_radius_;
  const double farthest_behind_;
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

ContactSurface::ContactSurface(const Compliance& gel) : vertices(gel.vertices), triangles(gel.triangles) {
  const std::size_t n = vertices.size();
  TS_ASSERT(static_cast<std::size_t>(gel.mass.rows()) == n);
  TS_ASSERT(static_cast<std::size_t>(gel.surface.rows()) == 3 * n && gel.surface.cols() == gel.surface.rows());
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
  weight = gel.mass * Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
  const bool flat =
      std::all_of(normals.begin(), normals.end(), [&](const auto& one) { return one == normals.front(); });
  if (!flat) farthest_behind = 0.5 * gel.thickness;
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
        TriangleGap triangle(body, gel_from_object.inverse(), bounding_ball(shape).radius, surface.farthest_behind);
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
