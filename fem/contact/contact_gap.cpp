#include "fem/contact/contact_gap.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "fem/contact/covered_triangle.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kSilhouetteSplits = 2;  // levels of splitting on the silhouette
constexpr int kBisections = 34;       // of a cell's edge: a quarter of a triangle's to 1e-11
constexpr int kFalsePositions = 40;   // likewise, where the distance to the silhouette is known: some 5 do
constexpr double kSteep = 2.0;        // rise within a triangle, in its size, from which the body's side is seen
constexpr double kBent = 0.1;   // of a triangle's range of gaps: off its corners' plane by more, it may hold a step
constexpr double kFlat = 1e-6;  // of a triangle's size: ranges below it hold no step
constexpr double kMixedPiece = 1e-3;              // of a triangle: larger pieces don't lie on both sides of a step
constexpr double kBulge = 0.5;                    // of the depth: the gel doesn't rise higher beside a contact
constexpr double kCutMargin = 0.5;                // of a triangle's size, on top
constexpr double kLeastStraddling = 1.0 / 200.0;  // likewise, where the gap changes its sign
constexpr double kLeastPiece = 1e-9;              // of a triangle
constexpr double kWallSlope = 4.0;                // of a gap along the surface, from which the body's side is seen
constexpr double kWallRise = 0.15;  // of a triangle's size: lower than this above the body nobody asks for the slope
constexpr double kWallStep = 1e-4;  // of a triangle
constexpr int kStepBisections = 8;
constexpr double kStepLeft = 0.6;     // of a difference, left where the interval is so much smaller: a step
constexpr double kBodiesLarge = 4.0;  // bodies larger than this times a triangle can't hide between its corners

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
  /// What crosses it, if asked for.
  CrossedTriangle crossed;
  bool is_crossed = false;
  /// The least and the largest gap, if it's bent.
  std::optional<std::array<double, 2>> bent;

  /// Gap at one surface point.
  double corner_gap(const Eigen::Vector3d& corner, const Eigen::Vector3d& normal) const {
    return entry(object_from_gel_ * corner, object_from_gel_.turn(normal)).value_or(kInfinity);
  }

  /// Where the gap is more than `steep` above `level` the body's side is seen, which doesn't bear: it fades out, up to
  /// twice that.
  void integrate(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals,
                 bool one_normal, double area, double level, double steep, bool collect) {
    collect_ = collect;
    lowest_wall_ = std::min(0.0, level) + kWallRise * steep / kSteep;
    is_crossed = false;
    bent.reset();
    crossed = {};
    to_keep_.clear();
    slope_sum_.setZero();
    slope_weight_ = 0.0;
    level_ = level;
    steep_ = steep;
    gap.setZero();
    covered.setZero();
    lowest = kInfinity;
    for (int k = 0; k < 3; ++k) {
      points_.col(k) = object_from_gel_ * corners[k];
      normals_.col(k) = object_from_gel_.turn(normals[k]);
    }
    one_normal_ = one_normal;
    area_ = area;
    has_silhouette_ = one_normal_ && silhouette_distance(shape_, points_.col(0), normals_.col(0)).has_value();
    // Bodies smaller than the triangle must not fall between its points.
    const int splits = splits_for_body(area_, body_radius_);
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
    for (int k = 0; k < 3; ++k) {
      points_.col(k) = object_from_gel_ * corners[k];
      normals_.col(k) = object_from_gel_.turn(normals[k]);
    }
    one_normal_ = one_normal;
    collect_ = false;
  }
  double gap_at(const Eigen::Vector3d& b) const { return at(b).value_or(kInfinity); }

 private:
  /// Nothing, too, on the body's side where hats are cut: on a curved gel a wall is seen as a steep rise.
  std::optional<double> at(const Eigen::Vector3d& b) const {
    const auto found = entry(points_ * b, direction(b));
    return collect_ && found && *found > lowest_wall_ && is_wall(b, *found) ? std::nullopt : found;
  }
  bool is_wall(const Eigen::Vector3d& b, double value) const {
    const std::array<Eigen::Vector3d, 2> along = {Eigen::Vector3d(-1.0, 1.0, 0.0), Eigen::Vector3d(-1.0, 0.0, 1.0)};
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Vector2d rise;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = points_ * along[k];
      const Eigen::Vector3d beside = b + kWallStep * along[k];
      const auto there = entry(points_ * beside, direction(beside));
      if (!there) return true;
      rise[k] = (*there - value) / kWallStep;
    }
    return rise.dot((edges.transpose() * edges).inverse() * rise) > kWallSlope * kWallSlope;
  }
  Eigen::Vector3d direction(const Eigen::Vector3d& b) const {
    return one_normal_ ? Eigen::Vector3d(normals_.col(0)) : (normals_ * b).normalized();
  }
  std::optional<double> entry(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    const auto found = first_entry(shape_, point, normal);
    if (!found || *found >= -farthest_behind_) return found;
    const auto back = first_entry(shape_, point, -normal);  // where the line leaves the body, seen from outside
    return back && -*back < -farthest_behind_ ? std::nullopt : found;
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
  const double farthest_behind_;
  Eigen::Matrix3d points_;
  Eigen::Matrix3d normals_;
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

}  // namespace

ContactSurface::ContactSurface(const Compliance& gel)
    : ContactSurface(gel.vertices, gel.triangles, gel.mass, gel.thickness) {
  TS_ASSERT(static_cast<std::size_t>(gel.surface.rows()) == 3 * vertices.size());
  TS_ASSERT(gel.surface.cols() == gel.surface.rows());
}

ContactSurface::ContactSurface(std::vector<Eigen::Vector3d> places, std::vector<std::array<int, 3>> faces,
                               const Eigen::SparseMatrix<double>& mass, double thickness)
    : vertices(std::move(places)), triangles(std::move(faces)) {
  const std::size_t n = vertices.size();
  TS_ASSERT(static_cast<std::size_t>(mass.rows()) == n);
  normals.assign(n, Eigen::Vector3d::Zero());
  around.resize(n);
  triangles_of.resize(n);
  for (const auto& t : triangles) {
    for (const int v : t) triangles_of[v].push_back(static_cast<int>(triangle_area.size()));
    const Eigen::Vector3d middle = (vertices[t[0]] + vertices[t[1]] + vertices[t[2]]) / 3.0;
    double size = 0.0;
    for (const int v : t) size = std::max(size, (vertices[v] - middle).norm());
    triangle_size.push_back(size);
    const Eigen::Vector3d twice_area = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    triangle_area.push_back(0.5 * twice_area.norm());
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
  for (const Eigen::Vector3d& normal : normals) flat = flat && normal == normals.front();
  if (!flat) farthest_behind = 0.5 * thickness;
}

void WeightedGap::move_along_normals(const Eigen::VectorXd& weight, double distance) {
  deepest += distance;
  reach += distance;
  const double depth = std::max(0.0, -deepest);
  for (Eigen::Index i = 0; i < weighted.size(); ++i) {
    if (!std::isfinite(weighted[i])) continue;
    plain[i] += weight[i] * distance;
    lowest[i] += distance;
    weighted[i] = plain[i] + edge[i] * depth;
  }
  for (std::array<double, 2>& range : bent) {
    for (double& gap : range) gap += distance;
  }
}

bool WeightedGap::overlap_cuts_after(double distance) const {
  return (cuts && cuts->by_overlap) || std::any_of(bent.begin(), bent.end(), [&](const std::array<double, 2>& range) {
           return range[0] + distance < 0.0 && range[1] + distance > 0.0;
         });
}

WeightedGap weighted_gap(const ContactSurface& surface, const ContactShape& shape,
                         const RigidTransform& gel_from_object, const PatchMotion& lookup, GapReach asked, bool cut,
                         std::shared_ptr<const CutHats> kept) {
  const auto n = static_cast<Eigen::Index>(surface.vertices.size());
  WeightedGap result;
  result.plain = Eigen::VectorXd::Zero(n);
  result.lowest = Eigen::VectorXd::Constant(n, kInfinity);
  result.edge = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd covered = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd cut_gaps;
  std::vector<char> skipped(surface.vertices.size(), 0);  // a triangle of its support is above `reach`
  const BoundingBall ball = bounding_ball(shape);
  const Eigen::Vector3d centre = gel_from_object * ball.centre;
  const bool may_skip = std::isfinite(asked.margin) && is_convex(shape);
  std::vector<Eigen::Vector3d> moved(surface.vertices);
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const Eigen::Vector3d& normal = surface.normals[v];
    const Eigen::Vector3d displacement = lookup.displacement(moved[v]);
    moved[v] += displacement - normal.dot(displacement) * normal;
  }
  std::visit(
      [&](const auto& body) {
        TriangleGap triangle(body, gel_from_object.inverse(), ball.radius, surface.farthest_behind);
        Eigen::VectorXd corner_gap(n);
        for (std::size_t v = 0; v < moved.size(); ++v) {
          corner_gap[static_cast<Eigen::Index>(v)] = triangle.corner_gap(moved[v], surface.normals[v]);
        }
        if (may_skip) {
          const double least = corner_gap.minCoeff();
          result.reach = std::max(0.0, least) + asked.margin + asked.of_depth * std::max(0.0, -least);
        }
        std::vector<CrossedTriangle> crossed;
        std::vector<double> lowest_in(surface.triangles.size(), kInfinity);
        for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
          const auto& index = surface.triangles[t];
          const std::array<Eigen::Vector3d, 3> corners{moved[index[0]], moved[index[1]], moved[index[2]]};
          const std::array<Eigen::Vector3d, 3> normals{surface.normals[index[0]], surface.normals[index[1]],
                                                       surface.normals[index[2]]};
          const double size = surface.triangle_size[t];
          const bool one_normal = normals[0] == normals[1] && normals[0] == normals[2];
          if (one_normal) {
            const Eigen::Vector3d away = centre - (corners[0] + corners[1] + corners[2]) / 3.0;
            const double limit = size + ball.radius;
            if (away.squaredNorm() - std::pow(away.dot(normals[0]), 2) > limit * limit) continue;
          }
          double least = std::min({corner_gap[index[0]], corner_gap[index[1]], corner_gap[index[2]]});
          if (may_skip && ball.radius > kBodiesLarge * size) {
            // A convex body's gap is convex along the surface; steeper than 45 degrees it is beside the contact.
            const double most = std::max({corner_gap[index[0]], corner_gap[index[1]], corner_gap[index[2]]});
            if (std::isfinite(most) && least > result.reach + size) {
              for (const int v : index) skipped[v] = 1;
              continue;
            }
          }
          // Integrals over the undeformed surface: the moved triangle only says where to look.
          for (int k = 0; k < 3 && !std::isfinite(least); ++k) {
            for (const int u : surface.around[index[k]]) least = std::min(least, corner_gap[u]);
          }
          if (!std::isfinite(least)) least = std::numeric_limits<double>::max();  // a small body between the vertices
          triangle.integrate(corners, normals, one_normal, surface.triangle_area[t], least, kSteep * size,
                             cut && !kept);
          for (int k = 0; k < 3; ++k) {
            result.plain[index[k]] += triangle.gap[k];
            covered[index[k]] += triangle.covered[k];
            result.lowest[index[k]] = std::min(result.lowest[index[k]], triangle.lowest);
          }
          result.deepest = std::min(result.deepest, triangle.lowest);
          if (triangle.bent) result.bent.push_back(*triangle.bent);
          if (triangle.is_crossed) {
            for (const CoveredPiece& piece : triangle.crossed.pieces) {
              result.deepest = std::min(result.deepest, piece.low);
            }
            lowest_in[t] = triangle.lowest;
            crossed.push_back(std::move(triangle.crossed));
            crossed.back().triangle = static_cast<int>(t);
          }
        }
        // What the gel can't reach cuts nothing.
        const double reached = std::max(0.0, result.deepest) + kBulge * std::max(0.0, -result.deepest);
        std::erase_if(crossed, [&](const CrossedTriangle& t) {
          return lowest_in[static_cast<std::size_t>(t.triangle)] >
                 reached + kCutMargin * surface.triangle_size[static_cast<std::size_t>(t.triangle)];
        });
        if (crossed.empty() && !kept) return;
        int set_up = -1;
        const auto gap_at = [&](int t, const Eigen::Vector3d& b) {
          if (set_up == t) return triangle.gap_at(b);
          set_up = t;
          const auto& index = surface.triangles[t];
          const std::array<Eigen::Vector3d, 3> corners{moved[index[0]], moved[index[1]], moved[index[2]]};
          const std::array<Eigen::Vector3d, 3> normals{surface.normals[index[0]], surface.normals[index[1]],
                                                       surface.normals[index[2]]};
          triangle.set_up(corners, normals, normals[0] == normals[1] && normals[0] == normals[2]);
          return triangle.gap_at(b);
        };
        result.cuts = kept ? kept : std::make_shared<const CutHats>(cut_hats(surface, crossed, gap_at));
        cut_gaps = kept ? moved_gaps(surface, *kept, gap_at) : result.cuts->gap;
      },
      shape);
  const double depth = std::max(0.0, -result.deepest);
  result.weighted = result.plain;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double share = covered[i] / surface.weight[i];
    if (share < kLeastShare || skipped[i]) {
      result.weighted[i] = result.plain[i] = result.lowest[i] = kInfinity;
      continue;
    }
    if (share < kBearingShare) result.edge[i] = surface.weight[i] * (kBearingShare - share) / kBearingFade;
    result.plain[i] *= surface.weight[i] / covered[i];
    result.weighted[i] = result.plain[i] + result.edge[i] * depth;
  }
  for (std::size_t k = 0; result.cuts && k < result.cuts->vertices.size(); ++k) {
    const int i = result.cuts->vertices[k];
    const double share = result.cuts->share[static_cast<Eigen::Index>(k)];
    const double gap = cut_gaps[static_cast<Eigen::Index>(k)];
    if (skipped[i]) continue;
    const bool far = !std::isfinite(gap) || share < kLeastPiece;
    result.plain[i] = result.weighted[i] = far ? kInfinity : surface.weight[i] * gap;
    result.edge[i] = 0.0;
    if (far) result.lowest[i] = kInfinity;
  }
  return result;
}

}  // namespace touchstone::fem
