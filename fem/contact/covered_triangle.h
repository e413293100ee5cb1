#pragma once
// The part of a surface triangle whose lines hit a body, as points of integration.

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <optional>

namespace touchstone::fem {

/// Radon's rule of degree 5 on a triangle [Radon1948]: barycentric points and weights.
struct RadonRule {
  std::array<Eigen::Vector3d, 7> points;
  std::array<double, 7> weights;
  RadonRule();
};
/// The rule, made once for the program.
const RadonRule& radon_rule();

/// The part of a cell on the side of its corners that hit, one or two of them: `piece(a, b, c)` is called for each of
/// its triangles; `crossing(hit, miss)` is the point of an edge where the silhouette crosses it. Corners are columns.
template <typename Crossing, typename Piece>
void clip_to_hits(const Eigen::Matrix3d& corners, const std::array<bool, 3>& hit, int hits, const Crossing& crossing,
                  const Piece& piece) {
  // Turn so that corner 0 is the odd one out.
  int odd = 0;
  while (hit[odd] != (hits == 1)) ++odd;
  const Eigen::Vector3d a = corners.col(odd);
  const Eigen::Vector3d b = corners.col((odd + 1) % 3);
  const Eigen::Vector3d d = corners.col((odd + 2) % 3);
  if (hits == 1) {
    piece(a, crossing(a, b), crossing(a, d));
  } else {
    const Eigen::Vector3d ab = crossing(b, a);
    const Eigen::Vector3d ad = crossing(d, a);
    piece(ab, b, d);
    piece(ab, d, ad);
  }
}

/// Visits points that cover the hit part of a triangle: `visit(barycentric, value, weight)`, the weights summing to the
/// hit share of its area. `line(barycentric)` is the value there, or nothing for a miss. Cells on the silhouette are
/// split and at last clipped at it, so that the answer is continuous as the body moves.
template <typename Line, typename Visit>
class CoveredTriangle {
 public:
  CoveredTriangle(const Line& line, const Visit& visit) : line_(line), visit_(visit) {}

  /// `splits`: levels of splitting before anything else, for bodies smaller than the triangle.
  void integrate(int splits) { cell(Eigen::Matrix3d::Identity(), splits, kSilhouetteSplits); }

 private:
  static constexpr int kSilhouetteSplits = 2;  // levels of splitting on the silhouette
  static constexpr int kBisections = 34;       // of a cell's edge: a quarter of a triangle's to 1e-11

  /// `corners` holds the barycentric corners as columns.
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
      corner_hit[k] = line_(corners.col(k)).has_value();
      hits += corner_hit[k];
    }
    const int corner_hits = hits;
    for (int k = 0; k < 7; ++k) {
      value[k] = line_(corners * rule.points[k]);
      hits += value[k].has_value();
    }
    if (hits == 0) return;
    if (hits == 10) {
      const double area = std::abs(corners.determinant());
      for (int k = 0; k < 7; ++k) visit_(corners * rule.points[k], *value[k], rule.weights[k] * area);
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
      (line_(middle) ? hit : miss) = middle;
    }
    return hit;
  }

  void clip(const Eigen::Matrix3d& c, const std::array<bool, 3>& hit, int hits) {
    clip_to_hits(
        c, hit, hits, [&](const auto& in, const auto& out) { return crossing(in, out); },
        [&](const auto& a, const auto& b, const auto& d) { piece(a, b, d); });
  }

  /// A cell that hits all over, but for slivers at a curved silhouette.
  void piece(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& d) {
    Eigen::Matrix3d corners;
    corners << a, b, d;
    const double area = std::abs(corners.determinant());
    const RadonRule& rule = radon_rule();
    for (int k = 0; k < 7; ++k) {
      const Eigen::Vector3d point = corners * rule.points[k];
      if (const auto value = line_(point)) visit_(point, *value, rule.weights[k] * area);
    }
  }

  const Line& line_;
  const Visit& visit_;
};

/// How often a triangle of this area must be split so that a body of this radius can't fall between its points.
int splits_for_body(double area, double body_radius);

}  // namespace touchstone::fem
