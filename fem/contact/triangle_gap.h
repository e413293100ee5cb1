#pragma once
// The gap over one surface triangle: its integral, and what crosses it.

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/transform.h"
#include "fem/contact/covered_triangle.h"
#include "fem/contact/cut_hats.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// first_entry(), but nothing for a body that lies wholly farther behind the point than `farthest_behind` (mm).
template <typename Shape>
std::optional<double> entry_before(const Shape& shape, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                   double farthest_behind) {
  const auto found = first_entry(shape, point, normal);
  if (!found || *found >= -farthest_behind) return found;
  const auto back = first_entry(shape, point, -normal);  // where the line leaves the body, seen from outside
  return back && -*back < -farthest_behind ? std::nullopt : found;
}

/// Integrates over one surface triangle; coordinates inside it are barycentric.
template <typename Shape>
class TriangleGap {
 public:
  /// `narrowest`: how wide the body is seen along the normals of a flat gel, from its middle to its outline. `curved`:
  /// triangles of a curved gel bulge to where their normals say that the gel is.
  TriangleGap(const Shape& shape, const RigidTransform& object_from_gel, double body_radius, double narrowest,
              double farthest_behind, bool curved)
      : shape_(shape),
        object_from_gel_(object_from_gel),
        body_radius_(body_radius),
        narrowest_(narrowest),
        farthest_behind_(farthest_behind),
        curved_(curved) {}

  /// int phi_k gap dA, int phi_k dA over the part that hits, and the least gap.
  Eigen::Vector3d gap;
  Eigen::Vector3d covered;
  double lowest = kInfinity;
  /// What crosses it, if asked for.
  CrossedTriangle crossed;
  bool is_crossed = false;
  /// The least and the largest gap, if it's bent.
  std::optional<std::array<double, 2>> bent;

  /// Gap at one surface point.
  double corner_gap(const Eigen::Vector3d& corner, const Eigen::Vector3d& normal) const {
    return entry(object_from_gel_ * corner, object_from_gel_.turn(normal)).value_or(kInfinity);
  }

  /// `size`: of the triangle (mm), from its middle to its farthest corner. Where the gap is more than twice this above
  /// `level` the body's side is seen, which doesn't bear: it fades out, up to twice that.
  void integrate(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals,
                 bool one_normal, double area, double level, double size, bool collect) {
    collect_ = collect;
    lowest_wall_ = std::min(0.0, level) + kWallRise * size;
    is_crossed = false;
    bent.reset();
    crossed = {};
    to_keep_.clear();
    slope_sum_.setZero();
    slope_weight_ = 0.0;
    level_ = level;
    steep_ = kSteep * size;
    gap.setZero();
    covered.setZero();
    lowest = kInfinity;
    place(corners, normals, one_normal);
    area_ = area;
    has_silhouette_ = one_normal_ && silhouette_distance(shape_, points_.col(0), normals_.col(0)).has_value();
    // Bodies smaller than the triangle must not fall between its points.
    const int splits = splits_for_body(area_, has_silhouette_ ? narrowest_ : body_radius_);
    if (has_silhouette_) {
      cell(Eigen::Matrix3d::Identity(), 0, splits + kSilhouetteSplits);
    } else {
      cell(Eigen::Matrix3d::Identity(), splits, kSilhouetteSplits);
    }
    is_crossed = is_crossed || crossed.bend > kBent;
    if (is_crossed) make_pieces();
  }

  /// The gap at a point of the triangle last set up.
  void set_up(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals,
              bool one_normal) {
    place(corners, normals, one_normal);
    collect_ = false;
  }
  double gap_at(const Eigen::Vector3d& b) const { return at(b).value_or(kInfinity); }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr int kSilhouetteSplits = 2;  // levels of splitting on the silhouette
  static constexpr int kBisections = 34;       // of a cell's edge: a quarter of a triangle's to 1e-11
  static constexpr int kFalsePositions = 40;   // likewise, where the distance to the silhouette is known: some 5 do
  static constexpr double kBent =
      0.1;  // of a triangle's range of gaps: off its corners' plane by more, it may hold a step
  static constexpr double kSteep = 2.0;  // rise within a triangle, in its size, from which the body's side is seen
  static constexpr double kFlat = 1e-6;  // of a triangle's size: ranges below it hold no step
  static constexpr double kMixedPiece = 1e-3;  // of a triangle: larger pieces don't lie on both sides of a step
  static constexpr double kLeastStraddling = 1.0 / 200.0;  // likewise, where the gap changes its sign
  static constexpr double kLeastPiece = 1e-9;              // of a triangle
  static constexpr double kWallSlope = 4.0;  // of a gap along the surface, from which the body's side is seen
  static constexpr double kWallRise =
      0.15;  // of a triangle's size: lower than this above the body nobody asks for the slope
  static constexpr double kWallStep = 1e-4;   // of a triangle
  static constexpr double kSharpEdge = 0.94;  // cosine between a triangle and its normals: where they differ by more,
                                              // by 20 degrees, the gel has an edge
  static constexpr int kStepBisections = 8;
  static constexpr double kStepLeft = 0.6;  // of a difference, left where the interval is so much smaller: a step

  void place(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals,
             bool one_normal) {
    for (int k = 0; k < 3; ++k) {
      points_.col(k) = object_from_gel_ * corners[k];
      normals_.col(k) = object_from_gel_.turn(normals[k]);
    }
    one_normal_ = one_normal;
    bulge_.setZero();
    if (!curved_ || one_normal) return;
    const Eigen::Vector3d flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (const Eigen::Vector3d& normal : normals) {
      if (normal.dot(flat) < kSharpEdge) return;
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      bulge_[k] = 0.5 * (normals[next] - normals[k]).dot(corners[next] - corners[k]);
    }
  }

  /// How far the gel stands out beyond the flat triangle: as far as a parabola along each edge whose slope changes by
  /// its normals' difference.
  double bulge(const Eigen::Vector3d& b) const {
    return bulge_[0] * b[0] * b[1] + bulge_[1] * b[1] * b[2] + bulge_[2] * b[2] * b[0];
  }

  /// Nothing, too, on the body's side where hats are cut: on a curved gel a wall is seen as a steep rise. On a flat
  /// one, where the silhouette is known, lines miss a wall, and what is steep is the flank of a needle.
  std::optional<double> at(const Eigen::Vector3d& b) const {
    const auto found = gap_along(b);
    const bool may_be_wall = collect_ && !has_silhouette_ && found && *found > lowest_wall_;
    return may_be_wall && is_wall(b, *found) ? std::nullopt : found;
  }
  bool is_wall(const Eigen::Vector3d& b, double value) const {
    const std::array<Eigen::Vector3d, 2> along = {Eigen::Vector3d(-1.0, 1.0, 0.0), Eigen::Vector3d(-1.0, 0.0, 1.0)};
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Vector2d rise;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = points_ * along[k];
      const Eigen::Vector3d beside = b + kWallStep * along[k];
      const auto there = gap_along(beside);
      if (!there) return true;
      rise[k] = (*there - value) / kWallStep;
    }
    return rise.dot((edges.transpose() * edges).inverse() * rise) > kWallSlope * kWallSlope;
  }
  Eigen::Vector3d direction(const Eigen::Vector3d& b) const {
    return one_normal_ ? Eigen::Vector3d(normals_.col(0)) : (normals_ * b).normalized();
  }
  std::optional<double> entry(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    return entry_before(shape_, point, normal, farthest_behind_);
  }
  std::optional<double> gap_along(const Eigen::Vector3d& b) const {
    auto found = entry(points_ * b, direction(b));
    if (found) *found -= bulge(b);
    return found;
  }
  /// Whether there is an entry.
  bool hits(const Eigen::Vector3d& b) const {
    if (std::isfinite(farthest_behind_) || collect_) return at(b).has_value();
    return is_hit(shape_, points_ * b, direction(b));
  }
  /// The values at a cell's corners and at the rule's points in it; nothing for a miss.
  struct CellGaps {
    std::array<std::optional<double>, 3> corner;
    std::array<std::optional<double>, 7> inner;
  };
  std::array<std::optional<double>, 7> inner_gaps(const Eigen::Matrix3d& corners) const {
    std::array<std::optional<double>, 7> result;
    for (int k = 0; k < 7; ++k) result[k] = at(corners * radon_rule().points[k]);
    return result;
  }
  CellGaps gaps_in(const Eigen::Matrix3d& corners) const {
    CellGaps result;
    for (int k = 0; k < 3; ++k) result.corner[k] = at(corners.col(k));
    result.inner = inner_gaps(corners);
    return result;
  }

  /// Signed, positive inside.
  double silhouette(const Eigen::Vector3d& b) const {
    return *silhouette_distance(shape_, points_ * b, normals_.col(0));
  }

  /// `cell` holds the barycentric corners as columns.
  void cell(const Eigen::Matrix3d& corners, int forced_splits, int silhouette_splits) {
    if (forced_splits > 0) {
      split(corners, forced_splits - 1, silhouette_splits);
      return;
    }
    std::array<bool, 3> corner_hit;
    int corner_hits = 0;
    if (has_silhouette_) {
      const Eigen::Vector3d middle = corners.rowwise().mean();
      double reach2 = 0.0;
      for (int k = 0; k < 3; ++k) reach2 = std::max(reach2, (points_ * (corners.col(k) - middle)).squaredNorm());
      const double inside = silhouette(middle);
      if (inside * inside > reach2) {
        if (inside <= 0.0) return;
        if (!collect_) return whole(corners);
        const CellGaps gaps = gaps_in(corners);
        if (!bent_cell(corners, gaps, silhouette_splits)) whole(corners, gaps.inner);
        return;
      }
      for (int k = 0; k < 3; ++k) corner_hits += corner_hit[k] = silhouette(corners.col(k)) >= 0.0;
    } else {
      const CellGaps gaps = gaps_in(corners);
      int hits = 0;
      for (int k = 0; k < 3; ++k) corner_hits += corner_hit[k] = gaps.corner[k].has_value();
      for (const auto& value : gaps.inner) hits += value.has_value();
      if (hits + corner_hits == 0) return;
      if (hits + corner_hits == 10) {
        if (!(collect_ && bent_cell(corners, gaps, silhouette_splits))) whole(corners, gaps.inner);
        return;
      }
    }
    if (silhouette_splits > 0) {
      split(corners, 0, silhouette_splits - 1);
    } else if (corner_hits == 3) {
      whole(corners);
    } else if (corner_hits > 0) {
      clip(corners, corner_hit, corner_hits);
    }
  }

  void split(const Eigen::Matrix3d& c, int forced_splits, int silhouette_splits) {
    for (const Eigen::Matrix3d& part : quarters_of(c)) cell(part, forced_splits, silhouette_splits);
  }

  static std::array<Eigen::Matrix3d, 4> quarters_of(const Eigen::Matrix3d& c) {
    const Eigen::Vector3d m01 = 0.5 * (c.col(0) + c.col(1));
    const Eigen::Vector3d m12 = 0.5 * (c.col(1) + c.col(2));
    const Eigen::Vector3d m20 = 0.5 * (c.col(2) + c.col(0));
    return {triangle(c.col(0), m01, m20), triangle(m01, c.col(1), m12), triangle(m20, m12, c.col(2)),
            triangle(m01, m12, m20)};
  }

  static Eigen::Matrix3d triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    Eigen::Matrix3d m;
    m << a, b, c;
    return m;
  }

  /// The point on the edge from a hit to a miss where the silhouette crosses it.
  Eigen::Vector3d crossing(Eigen::Vector3d hit, Eigen::Vector3d miss) const {
    if (!has_silhouette_) {
      for (int k = 0; k < kBisections; ++k) {
        const Eigen::Vector3d middle = 0.5 * (hit + miss);
        (hits(middle) ? hit : miss) = middle;
      }
      return hit;
    }
    // False position with the Illinois rule: the kept end's value is halved when it is kept twice.
    double at_hit = silhouette(hit);
    double at_miss = silhouette(miss);
    int kept = 0;
    for (int k = 0; k < kFalsePositions; ++k) {
      const Eigen::Vector3d middle = hit + at_hit / (at_hit - at_miss) * (miss - hit);
      const double value = silhouette(middle);
      if (std::abs(value) <= 1e-14 * body_radius_ || middle == hit || middle == miss) return middle;
      if (value > 0.0) {
        hit = middle;
        at_hit = value;
        if (kept == 1) at_miss *= 0.5;
        kept = 1;
      } else {
        miss = middle;
        at_miss = value;
        if (kept == -1) at_hit *= 0.5;
        kept = -1;
      }
    }
    return hit;
  }

  void clip(const Eigen::Matrix3d& c, const std::array<bool, 3>& hit, int hits) {
    std::vector<Eigen::Vector3d> ends;
    clip_to_hits(
        c, hit, hits,
        [&](const auto& in, const auto& out) {
          ends.push_back(crossing(in, out));
          return ends.back();
        },
        [&](const auto& a, const auto& b, const auto& d) { whole(triangle(a, b, d)); });
    if (!collect_) return;
    is_crossed = true;
    crossed.outline.push_back({ends[0], ends[1]});
  }

  /// A cell that hits all over, where the gap isn't plane: split further, and cut at the step if that is it. False: it
  /// is to be taken as it is.
  bool bent_cell(const Eigen::Matrix3d& corners, const CellGaps& gaps, int splits) {
    Eigen::Vector3d at_corner;
    for (int k = 0; k < 3; ++k) at_corner[k] = gaps.corner[k].value_or(0.0);
    double low = at_corner.minCoeff();
    double high = at_corner.maxCoeff();
    const double bend = bend_of(at_corner, gaps.inner, low, high);
    if (corners.isIdentity(0.0)) {
      if (low < 0.0 && high > 0.0) crossed.bend = bend;
      if (bend > kBent) bent = {low, high};
    }
    if (bend <= kBent) {
      // A linear function's values at the triangle's corners from those at the cell's.
      const double share = std::abs(corners.determinant());
      Eigen::Vector3d trend = corners.transpose().inverse() * at_corner;
      trend.array() -= trend.mean();
      slope_sum_ += share * trend;
      slope_weight_ += share;
      return false;
    }
    if (splits > 0) {
      split(corners, 0, splits - 1);
      return true;
    }
    return cut_at_step(corners);
  }

  /// How far the gap is from plane, of its range, which is widened; 0 where that is next to nothing.
  double bend_of(const Eigen::Vector3d& at_corner, const std::array<std::optional<double>, 7>& inner, double& low,
                 double& high) const {
    double off = 0.0;
    for (int k = 0; k < 7; ++k) {
      const double value = inner[k].value_or(0.0);
      low = std::min(low, value);
      high = std::max(high, value);
      off = std::max(off, std::abs(value - at_corner.dot(radon_rule().points[k])));
    }
    return high - low > kFlat * body_radius_ ? off / (high - low) : 0.0;
  }

  /// Cuts a small cell at the step that crosses it; false if it's only bent.
  bool cut_at_step(const Eigen::Matrix3d& corners) {
    double threshold = kInfinity;
    double step = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d a = corners.col(k);
      Eigen::Vector3d b = corners.col((k + 1) % 3);
      double at_a = *at(a);
      double at_b = *at(b);
      double lowest_seen = std::min(at_a, at_b);  // the ends alone may be alike on both flanks of a ridge
      double highest_seen = std::max(at_a, at_b);
      for (int n = 0; n < kStepBisections; ++n) {
        const Eigen::Vector3d middle = 0.5 * (a + b);
        const auto value = at(middle);
        if (!value) return false;
        lowest_seen = std::min(lowest_seen, *value);
        highest_seen = std::max(highest_seen, *value);
        if (std::abs(*value - at_a) > std::abs(at_b - *value)) {
          b = middle;
          at_b = *value;
        } else {
          a = middle;
          at_a = *value;
        }
      }
      const double left = std::abs(at_b - at_a);
      if (left > kStepLeft * (highest_seen - lowest_seen) && left > kFlat * body_radius_ && left > step) {
        step = left;
        threshold = 0.5 * (at_a + at_b);
        place = 0.5 * (a + b);
      }
    }
    if (step == 0.0) return false;
    std::array<bool, 3> low;
    int lows = 0;
    for (int k = 0; k < 3; ++k) lows += low[k] = *at(corners.col(k)) < threshold;
    if (lows == 0 || lows == 3) return false;  // something narrower than the cell stands within it
    is_crossed = true;
    crossed.steps.push_back({place, threshold});
    std::vector<Eigen::Vector3d> ends;
    const auto side = [&](const Eigen::Vector3d& inside, const Eigen::Vector3d& outside) {
      Eigen::Vector3d in = inside;
      Eigen::Vector3d out = outside;
      const bool in_low = *at(in) < threshold;
      for (int n = 0; n < kBisections; ++n) {
        const Eigen::Vector3d middle = 0.5 * (in + out);
        const auto value = at(middle);
        ((value && *value < threshold) == in_low ? in : out) = middle;
      }
      ends.push_back(in);
      return in;
    };
    const auto piece = [&](const auto& a, const auto& b, const auto& d) { whole(triangle(a, b, d)); };
    clip_to_hits(corners, low, lows, side, piece);
    crossed.outline.push_back({ends[0], ends[1]});
    std::array<bool, 3> high;
    for (int k = 0; k < 3; ++k) high[k] = !low[k];
    clip_to_hits(corners, high, 3 - lows, side, piece);
    return true;
  }

  bool is_mixed(const CoveredPiece& piece) const {
    const double threshold = threshold_at(crossed, piece.corners.rowwise().mean());
    return piece.low < threshold && piece.high > threshold;
  }

  /// A covered cell whose pieces are made once it is known that the triangle is crossed: most aren't.
  struct CellToKeep {
    Eigen::Matrix3d corners;
    std::array<std::optional<double>, 7> gaps;
    std::size_t steps;  ///< so many had been found
  };

  void make_pieces() {
    const std::vector<StepPoint> steps = std::exchange(crossed.steps, {});
    for (const CellToKeep& cell : to_keep_) {
      crossed.steps.assign(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(cell.steps));
      keep(cell.corners, &cell.gaps);
    }
    crossed.steps = steps;
    if (slope_weight_ > 0.0) crossed.slope = slope_sum_ / slope_weight_;
    // Pieces from before a step was found may lie on both sides of it, where it crosses none of their edges or two.
    for (const CoveredPiece& piece : std::exchange(crossed.pieces, {})) {
      if (is_mixed(piece) && std::abs(piece.corners.determinant()) > kMixedPiece) {
        keep_quarters(piece.corners);
      } else {
        crossed.pieces.push_back(piece);
      }
    }
  }

  void keep_quarters(const Eigen::Matrix3d& corners) {
    for (const Eigen::Matrix3d& part : quarters_of(corners)) keep(part);
  }

  /// Keeps a covered cell in pieces of at most a quarter of an edge. `gaps`: at the rule's points, if they are known.
  void keep(const Eigen::Matrix3d& corners, const std::array<std::optional<double>, 7>* gaps = nullptr) {
    const double share = std::abs(corners.determinant());
    if (share < kLeastPiece) return;  // an outline along an edge cuts off nothing
    if (share > 1.5 / 16.0) return keep_quarters(corners);
    CoveredPiece piece;
    piece.corners = corners;
    piece.low = kInfinity;
    piece.high = -kInfinity;
    double weight = 0.0;
    const auto inner = gaps ? *gaps : inner_gaps(corners);
    for (int k = 0; k < 7; ++k) {
      if (const auto& value = inner[k]) {
        piece.value += radon_rule().weights[k] * *value;
        piece.weighted += radon_rule().weights[k] * *value * (corners * radon_rule().points[k]);
        weight += radon_rule().weights[k];
        piece.low = std::min(piece.low, *value);
        piece.high = std::max(piece.high, *value);
      }
    }
    if (weight <= 0.0) return;
    piece.value /= weight;
    piece.weighted /= weight;
    set_overlap(piece);
    const bool straddles = crossed.bend > kBent && piece.overlap > 0.0 && piece.overlap < 1.0;
    if ((straddles && share > kLeastStraddling) || (is_mixed(piece) && share > kMixedPiece)) {
      return keep_quarters(corners);
    }
    crossed.pieces.push_back(piece);
  }

  /// A cell that hits all over, but for slivers at a curved silhouette.
  void whole(const Eigen::Matrix3d& corners) { whole(corners, inner_gaps(corners)); }
  void whole(const Eigen::Matrix3d& corners, const std::array<std::optional<double>, 7>& inner) {
    if (collect_) to_keep_.push_back({corners, inner, crossed.steps.size()});
    const double area = area_ * std::abs(corners.determinant());
    const RadonRule& rule = radon_rule();
    for (int k = 0; k < 7; ++k) {
      if (inner[k]) add(corners * rule.points[k], *inner[k], rule.weights[k] * area);
    }
  }

  void add(const Eigen::Vector3d& b, double value, double weight) {
    weight *= std::clamp(2.0 - (value - level_) / steep_, 0.0, 1.0);
    gap += weight * value * b;
    covered += weight * b;
    lowest = std::min(lowest, value);
  }

  const Shape& shape_;
  const RigidTransform object_from_gel_;
  const double body_radius_;
  const double narrowest_;
  const double farthest_behind_;
  const bool curved_;
  Eigen::Matrix3d points_;
  Eigen::Matrix3d normals_;
  Eigen::Vector3d bulge_ = Eigen::Vector3d::Zero();  ///< mm, of each edge: four times what it is in its middle
  bool one_normal_ = true;
  bool has_silhouette_ = false;
  double area_ = 0.0;
  double level_ = 0.0;
  double steep_ = 1.0;
  bool collect_ = false;
  double lowest_wall_ = 0.0;
  Eigen::Vector3d slope_sum_;  // of the trends of plane cells, by their share of the triangle
  double slope_weight_ = 0.0;
  std::vector<CellToKeep> to_keep_;
};

}  // namespace touchstone::fem
