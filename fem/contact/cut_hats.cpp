#include "fem/contact/cut_hats.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "fem/contact/contact_gap.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kAlong = 4;                // cells along an edge
constexpr double kHalfWidth = 0.66;      // of the root of a triangle's area: half of its height
constexpr double kSingularReach = 0.75;  // of an edge: how far from an edge the pressure rises
constexpr double kBentFrom = 0.1;        // bend from which what doesn't overlap begins to be left out
constexpr double kBentTo = 0.2;          // and is left out
constexpr double kStraddles = 0.05;  // of a triangle: overlapping share times the rest from which that counts in full
constexpr double kNarrow = 0.85;     // of a hat: overlaps that fill no hat by more than this are all that bears
constexpr double kWide = 1.0;        // by so much: narrower than no hat
constexpr double kLowBears = 0.03;   // of a hat: with so much below a step, only that bears
constexpr double kHighBears = 0.01;  // with less than this, only what is above it

/// The triangles that a triangle falls into when each edge is cut into so many; barycentric corners as columns.
std::vector<Matrix3d> split_into(int along) {
  std::vector<Matrix3d> result;
  const auto corner = [&](int i, int j) -> Vector3d { return Vector3d(i, j, along - i - j) / along; };
  for (int i = 0; i < along; ++i) {
    for (int j = 0; i + j < along; ++j) {
      Matrix3d m;
      m << corner(i, j), corner(i + 1, j), corner(i, j + 1);
      result.push_back(m);
      if (i + j + 2 > along) continue;
      m << corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j);
      result.push_back(m);
    }
  }
  return result;
}

const std::vector<Matrix3d>& quarters() {
  static const std::vector<Matrix3d> made = split_into(kAlong);
  return made;
}

/// A stretch of outline in the gel frame.
struct Stretch {
  Stretch(const Vector3d& a, const Vector3d& b)
      : from(a), along(b - a), per_length2(a != b ? 1.0 / along.squaredNorm() : 0.0) {}

  double squared_distance(const Vector3d& point) const {
    const Vector3d there = point - from;
    const double t = std::clamp(there.dot(along) * per_length2, 0.0, 1.0);
    return (there - t * along).squaredNorm();
  }

  Vector3d from, along;
  double per_length2;  ///< mm^-2; 0: a point
};

/// A step's point in the gel frame, with the gap's trend beside it.
struct Step {
  Vector3d at;
  double value;
  Vector3d gradient;

  double threshold(const Vector3d& point) const { return value + gradient.dot(point - at); }
};

/// What is nearest of them decides; infinity: there are none.
double threshold_by(const std::vector<const Step*>& steps, const Vector3d& point) {
  const Step* nearest = nullptr;
  for (const Step* step : steps) {
    if (!nearest || (step->at - point).squaredNorm() < (nearest->at - point).squaredNorm()) nearest = step;
  }
  return nearest ? nearest->threshold(point) : kInfinity;
}

/// In the plane of the corners (columns): of the linear function with these values at them.
Vector3d gradient_of(const Matrix3d& corners, const Vector3d& values) {
  Eigen::Matrix<double, 2, 3> edges;
  edges << (corners.col(1) - corners.col(0)).transpose(), (corners.col(2) - corners.col(0)).transpose();
  const Eigen::Vector2d rise(values[1] - values[0], values[2] - values[0]);
  return edges.transpose() * (edges * edges.transpose()).ldlt().solve(rise);
}

/// A piece with its integrals against the corners' hats, plain and with the rise towards edges.
struct Piece {
  Vector3d middle;  ///< barycentric
  Vector3d at;
  Vector3d raised_at;  ///< the middle of what bears, which the rise draws towards the edge
  double area;
  double value;
  Vector3d off = Vector3d::Zero();  ///< mm: by how much more the gap is where each hat weighs it
  double overlap;
  double within;
  Vector3d plain;
  Vector3d raised;
};

class Builder {
 public:
  Builder(const ContactSurface& surface, const std::vector<CrossedTriangle>& crossed,
          const std::function<double(int, const Vector3d&)>& gap_at)
      : surface_(surface), gap_at_(gap_at) {
    for (const CrossedTriangle& t : crossed) {
      crossed_[t.triangle] = &t;
      const Matrix3d corners = corners_of(surface, t.triangle);
      std::vector<Stretch>& own = stretches_[t.triangle];
      for (const auto& ends : t.outline) own.emplace_back(corners * ends[0], corners * ends[1]);
      if (t.steps.empty()) continue;
      const Vector3d gradient = gradient_of(corners, t.slope);
      for (const StepPoint& step : t.steps) steps_[t.triangle].push_back({corners * step.at, step.value, gradient});
    }
  }

  CutHats build() {
    // Crossed triangles cut their corners' hats; so does the rise in a neighbour that isn't crossed.
    std::vector<char> cut(surface_.vertices.size(), 0);
    std::vector<int> beside;
    for (const auto& [triangle, unused] : crossed_) {
      for (const int v : surface_.triangles[triangle]) {
        cut[v] = 1;
        for (const int t : surface_.triangles_of[v]) {
          if (!crossed_.contains(t)) beside.push_back(t);
        }
      }
    }
    std::sort(beside.begin(), beside.end());
    beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
    for (const int t : beside) {
      if (is_raised(pieces(t))) {
        for (const int v : surface_.triangles[t]) cut[v] = 1;
      }
    }
    CutHats result;
    for (int v = 0; v < static_cast<int>(cut.size()); ++v) {
      if (cut[v]) result.vertices.push_back(v);
    }
    result.gap.resize(static_cast<Eigen::Index>(result.vertices.size()));
    result.share.resize(result.gap.size());
    result.moment = Eigen::Matrix3Xd::Zero(3, result.gap.size());
    std::map<int, std::vector<DensityCell>> cells;
    for (Eigen::Index k = 0; k < result.gap.size(); ++k) {
      std::tie(result.gap[k], result.share[k]) = add_vertex(result.vertices[static_cast<std::size_t>(k)], cells);
    }
    for (auto& [triangle, list] : cells) {
      // Hats that stay whole.
      for (int a = 0; a < 3; ++a) {
        if (cut[surface_.triangles[triangle][a]]) continue;
        const std::vector<Piece>& own = pieces(triangle);
        for (std::size_t k = 0; k < own.size(); ++k) list[k].density[a] = own[k].plain[a];
      }
      result.triangles.push_back({triangle, std::move(list)});
    }
    for (const CutTriangle& triangle : result.triangles) {
      for (int a = 0; a < 3; ++a) {
        const Eigen::Index k = place_in(result, surface_.triangles[triangle.triangle][a]);
        for (const DensityCell& cell : triangle.cells) {
          if (k >= 0) result.moment.col(k) += cell.density[a] * cell.at;
        }
      }
    }
    result.by_overlap = by_overlap_;
    return result;
  }

 private:
  static bool is_raised(const std::vector<Piece>& list) {
    return std::any_of(list.begin(), list.end(), [](const Piece& p) { return p.raised != p.plain; });
  }

  /// Whether a vertex isn't on the surface's border: it then has as many triangles as neighbours.
  bool is_within(int vertex) const { return surface_.around[vertex].size() == surface_.triangles_of[vertex].size(); }

  /// How much the border of the overlap in a triangle leaves out what doesn't overlap: not at all where it only begins
  /// to cross it, so that nothing changes at once.
  static double bent_part(const CrossedTriangle& crossed) {
    double whole = 0.0;
    double overlap = 0.0;
    for (const CoveredPiece& piece : crossed.pieces) {
      const double share = std::abs(piece.corners.determinant());
      whole += share;
      overlap += share * piece.overlap;
    }
    if (whole <= 0.0) return 0.0;
    const double part = overlap / whole;
    return std::clamp((crossed.bend - kBentFrom) / (kBentTo - kBentFrom), 0.0, 1.0) *
           std::min(1.0, part * (1.0 - part) / kStraddles);
  }

  const std::vector<Piece>& pieces(int triangle) {
    const auto found = pieces_.find(triangle);
    if (found != pieces_.end()) return found->second;
    std::vector<Piece> list;
    const Beside beside = what_is_beside(triangle);
    const auto crossed = crossed_.find(triangle);
    if (crossed != crossed_.end()) {
      for (const CoveredPiece& piece : crossed->second->pieces) list.push_back(piece_of(triangle, piece, beside));
    } else {
      // Quarters share their corners.
      std::array<std::array<std::optional<double>, kAlong + 1>, kAlong + 1> known;
      const auto gap_at_corner = [&](const Vector3d& b) {
        std::optional<double>& value = known[static_cast<int>(kAlong * b[0])][static_cast<int>(kAlong * b[1])];
        if (!value) value = gap_at_(triangle, b);
        return *value;
      };
      for (const Matrix3d& corners : quarters()) {
        list.push_back(piece_of(triangle, covered_by(triangle, corners, gap_at_corner), beside));
      }
    }
    return pieces_.emplace(triangle, std::move(list)).first->second;
  }

  template <typename AtCorner>
  CoveredPiece covered_by(int triangle, const Matrix3d& corners, const AtCorner& gap_at_corner) const {
    CoveredPiece piece;
    piece.corners = corners;
    const Vector3d middle = corners.rowwise().mean();
    piece.value = piece.low = piece.high = gap_at_(triangle, middle);
    piece.weighted = piece.value * middle;
    for (int k = 0; k < 3; ++k) {
      const double value = gap_at_corner(corners.col(k));
      piece.low = std::min(piece.low, value);
      if (!std::isfinite(value)) continue;
      piece.high = std::max(piece.high, value);
      // Products of linear functions over a triangle.
      piece.weighted += (value - piece.value) / 12.0 * (corners.col(k) - middle);
    }
    set_overlap(piece);
    return piece;
  }

  /// What is in a triangle and in those that share a corner with it.
  struct Beside {
    std::vector<Stretch> stretches;
    std::vector<const Step*> steps;
  };

  Beside what_is_beside(int triangle) const {
    Beside result;
    std::vector<int> seen;
    for (const int v : surface_.triangles[triangle]) {
      add_steps(surface_.triangles_of[v], result.steps);
      for (const int t : surface_.triangles_of[v]) {
        const auto found = stretches_.find(t);
        if (found == stretches_.end() || std::find(seen.begin(), seen.end(), t) != seen.end()) continue;
        seen.push_back(t);
        result.stretches.insert(result.stretches.end(), found->second.begin(), found->second.end());
      }
    }
    return result;
  }

  /// Of all triangles that share a corner with this one, or have this vertex.
  void add_steps(const std::vector<int>& triangles, std::vector<const Step*>& steps) const {
    for (const int t : triangles) {
      const auto found = steps_.find(t);
      if (found == steps_.end()) continue;
      for (const Step& step : found->second) steps.push_back(&step);
    }
  }

  Piece piece_of(int triangle, const CoveredPiece& covered, const Beside& beside) const {
    const Matrix3d corners = corners_of(surface_, triangle);
    const Vector3d middle = covered.corners.rowwise().mean();
    Piece piece;
    piece.middle = middle;
    piece.value = covered.value;
    if (std::isfinite(covered.value)) piece.off = covered.weighted.cwiseQuotient(middle).array() - covered.value;
    piece.overlap = covered.overlap;
    piece.within = covered.within;
    piece.area = surface_.triangle_area[triangle] * std::abs(covered.corners.determinant());
    piece.at = piece.raised_at = corners * middle;
    piece.plain = piece.raised = piece.area * middle;
    // Where the gel ends it gives way sideways, and the pressure rises less.
    double inner = 0.0;
    for (int k = 0; k < 3; ++k) {
      if (is_within(surface_.triangles[triangle][k])) inner += middle[k];
    }
    const double reach = inner * kSingularReach * std::sqrt(surface_.triangle_area[triangle] * 4.0 / std::sqrt(3.0));
    const double size = std::sqrt(piece.area);
    if (piece.value > threshold_by(beside.steps, piece.at)) return piece;  // pressure doesn't rise at a step's foot
    std::vector<Stretch> near;
    const double farthest = reach + 2.0 * size;
    for (const Stretch& stretch : beside.stretches) {
      if (stretch.squared_distance(piece.at) < farthest * farthest) near.push_back(stretch);
    }
    if (near.empty() || !(piece.area > 0.0)) return piece;
    const double part = piece.area / static_cast<double>(quarters().size());
    const double half_width = kHalfWidth * std::sqrt(part);
    const auto rise = [&](const Vector3d& point) {
      double distance2 = kInfinity;
      for (const Stretch& stretch : near) distance2 = std::min(distance2, stretch.squared_distance(point));
      // The mean over the quarter's width.
      const double distance = std::sqrt(distance2);
      const double from = std::sqrt(std::max(0.0, distance - half_width));
      const double to = std::sqrt(distance + half_width);
      return std::max(1.0, 2.0 * std::sqrt(reach) / (from + to));
    };
    Vector3d raised = Vector3d::Zero();
    bool rises = false;
    for (const Matrix3d& quarter : quarters()) {
      const Vector3d at = covered.corners * quarter.rowwise().mean();
      const double here = rise(corners * at);
      rises = rises || here > 1.0;
      raised += part * here * at;
    }
    if (!rises) return piece;
    piece.raised = raised;
    piece.raised_at = corners * (raised / raised.sum());
    return piece;
  }

  /// The share of its hat that the overlap fills.
  double overlap_of(int vertex) {
    const auto found = overlap_.find(vertex);
    if (found != overlap_.end()) return found->second;
    double overlap = 0.0;
    for_pieces(vertex, [&](int, int corner, std::size_t, const Piece& piece) {
      if (std::isfinite(piece.value)) overlap += piece.overlap * piece.plain[corner];
    });
    return overlap_[vertex] = overlap / surface_.weight[vertex];
  }

  /// The largest of those of a vertex and its neighbours; 1 where nothing overlaps: the gel bulges there at most.
  double fullest_near(int vertex) {
    double fullest = overlap_of(vertex);
    for (const int v : surface_.around[vertex]) fullest = std::max(fullest, overlap_of(v));
    return fullest > 0.0 ? fullest : 1.0;
  }

  /// Adds a vertex's density; its mean gap (mm) and the share of its hat that bears.
  std::pair<double, double> add_vertex(int vertex, std::map<int, std::vector<DensityCell>>& cells) {
    std::vector<const Step*> steps;
    add_steps(surface_.triangles_of[vertex], steps);
    const auto is_low = [&](const Piece& piece) { return piece.value <= threshold_by(steps, piece.at); };
    const double weight = surface_.weight[vertex];
    double bent = 0.0;
    for (const int t : surface_.triangles_of[vertex]) {
      const auto found = crossed_.find(t);
      if (found != crossed_.end()) bent = std::max(bent, bent_part(*found->second));
    }
    const double narrow = std::clamp((fullest_near(vertex) - kNarrow) / (kWide - kNarrow), 0.0, 1.0);
    const double beyond = std::min(narrow, 1.0 - bent);
    // How much of a piece bears, and the gap there.
    const auto bearing = [&](const Piece& piece) { return piece.overlap + beyond * (1.0 - piece.overlap); };
    const auto gap_of = [&](const Piece& piece, int corner) {
      const double part = bearing(piece);
      const double off = part * piece.off[corner];
      if (part >= 1.0 || part <= 0.0) return piece.value + off;
      // The mean is that over the overlap and over what is beyond it.
      return (piece.overlap * piece.within + beyond * (piece.value - piece.overlap * piece.within)) / part + off;
    };
    double low = 0.0;
    double all = 0.0;
    for_pieces(vertex, [&](int, int corner, std::size_t, const Piece& piece) {
      if (!std::isfinite(piece.value)) return;
      by_overlap_ = by_overlap_ || bearing(piece) < 1.0;
      all += bearing(piece) * piece.plain[corner];
      if (is_low(piece)) low += bearing(piece) * piece.plain[corner];
    });
    const double lower =
        !steps.empty() ? std::clamp((low / weight - kHighBears) / (kLowBears - kHighBears), 0.0, 1.0) : 1.0;
    const auto density_of = [&](const Piece& piece, int corner) {
      if (!std::isfinite(piece.value)) return 0.0;
      const double here = is_low(piece) ? lower * piece.raised[corner] : 0.0;
      return bearing(piece) * (here + (1.0 - lower) * piece.plain[corner]);
    };
    const double share = (lower * low + (1.0 - lower) * all) / weight;
    double sum = 0.0;
    double moment = 0.0;
    for_pieces(vertex, [&](int, int corner, std::size_t, const Piece& piece) {
      const double density = density_of(piece, corner);
      if (density <= 0.0) return;
      sum += density;
      moment += density * gap_of(piece, corner);
    });
    const double scale = sum > 0.0 ? weight / sum : 0.0;
    for (const int t : surface_.triangles_of[vertex]) cells.try_emplace(t);  // also where an outline leaves no piece
    for_pieces(vertex, [&](int triangle, int corner, std::size_t k, const Piece& piece) {
      std::vector<DensityCell>& list = cells[triangle];
      if (list.empty()) {
        for (const Piece& each : pieces(triangle)) {
          list.push_back({each.middle, gap_at_(triangle, each.middle), each.raised_at, each.area, Vector3d::Zero()});
        }
      }
      list[k].density[corner] = scale * density_of(piece, corner);
    });
    return {sum > 0.0 ? moment / sum : kInfinity, share};
  }

  template <typename Visit>
  void for_pieces(int vertex, const Visit& visit) {
    for (const int t : surface_.triangles_of[vertex]) {
      const auto& index = surface_.triangles[t];
      const int corner = static_cast<int>(std::find(index.begin(), index.end(), vertex) - index.begin());
      const std::vector<Piece>& list = pieces(t);
      for (std::size_t k = 0; k < list.size(); ++k) visit(t, corner, k, list[k]);
    }
  }

  const ContactSurface& surface_;
  const std::function<double(int, const Vector3d&)>& gap_at_;
  std::map<int, const CrossedTriangle*> crossed_;
  std::map<int, std::vector<Stretch>> stretches_;
  std::map<int, std::vector<Step>> steps_;
  std::map<int, std::vector<Piece>> pieces_;
  std::map<int, double> overlap_;
  bool by_overlap_ = false;
};

}  // namespace

Matrix3d corners_of(const ContactSurface& surface, int triangle) {
  Matrix3d m;
  for (int k = 0; k < 3; ++k) m.col(k) = surface.vertices[surface.triangles[triangle][k]];
  return m;
}

std::vector<DensityCell> whole_cells(const ContactSurface& surface, int triangle) {
  const Matrix3d corners = corners_of(surface, triangle);
  std::vector<DensityCell> result;
  const double area = surface.triangle_area[triangle] / static_cast<double>(quarters().size());
  for (const Matrix3d& quarter : quarters()) {
    const Vector3d middle = quarter.rowwise().mean();
    result.push_back({middle, 0.0, corners * middle, area, area * middle});
  }
  return result;
}

double threshold_at(const CrossedTriangle& crossed, const Vector3d& point) {
  const StepPoint* nearest = nullptr;
  for (const StepPoint& step : crossed.steps) {
    if (!nearest || (step.at - point).squaredNorm() < (nearest->at - point).squaredNorm()) nearest = &step;
  }
  return nearest ? nearest->value + crossed.slope.dot(point - nearest->at) : kInfinity;
}

void set_overlap(CoveredPiece& piece) {
  const double range = piece.high - piece.low;
  piece.overlap = range > 0.0 ? std::clamp(-piece.low / range, 0.0, 1.0) : (piece.value < 0.0 ? 1.0 : 0.0);
  piece.within = piece.overlap < 1.0 ? 0.5 * std::min(piece.low, 0.0) : piece.value;
}

CutHats cut_hats(const ContactSurface& surface, const std::vector<CrossedTriangle>& crossed,
                 const std::function<double(int, const Vector3d&)>& gap_at) {
  return Builder(surface, crossed, gap_at).build();
}

}  // namespace touchstone::fem
