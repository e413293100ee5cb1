#include "fem/contact/contact_gap.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/error.h"
#include "fem/contact/triangle_gap.h"
#include "fem/shapes/mesh_lines.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kBulge = 0.5;           // of the depth: the gel doesn't rise higher beside a contact
constexpr double kCutMargin = 0.5;       // of a triangle's size, on top
constexpr double kLeastCutShare = 1e-9;  // of a hat's support
constexpr double kBodiesLarge = 4.0;     // bodies larger than this times a triangle can't hide between its corners

}  // namespace

ContactSurface::ContactSurface(const Compliance& gel)
    : ContactSurface(gel.vertices, gel.triangles, gel.mass, gel.thickness) {
  TS_ASSERT(static_cast<std::size_t>(gel.surface.rows()) == 3 * vertices.size());
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

namespace {

/// `deepest_only`: all else than `deepest` is left as it comes.
WeightedGap gap_of(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object,
                   const PatchMotion& lookup, GapReach asked, bool cut, std::shared_ptr<const CutHats> kept,
                   bool deepest_only) {
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
  const Eigen::Vector3d along = gel_from_object.inverse().turn(surface.normals.front());
  const auto integrate = [&](const auto& body) {
    double narrowest = ball.radius;  // a needle is seen as wide as it is, not as long
    if (surface.flat) {
      const double middle = silhouette_distance(body, ball.centre, along).value_or(ball.radius);
      if (middle > 0.0) narrowest = std::min(narrowest, middle);
    }
    TriangleGap triangle(body, gel_from_object.inverse(), ball.radius, narrowest, surface.farthest_behind, cut);
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
      triangle.integrate(corners, normals, one_normal, surface.triangle_area[t], least, size, cut && !kept);
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
    if (deepest_only) return;
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
  };
  std::visit(
      [&](const auto& body) {
        if constexpr (std::is_same_v<std::decay_t<decltype(body)>, MeshShape>) {
          integrate(MeshLines(body, along));
        } else {
          integrate(body);
        }
      },
      shape);
  if (deepest_only) return result;
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
  const auto bears = [&](std::size_t k) {
    const auto at = static_cast<Eigen::Index>(k);
    return std::isfinite(cut_gaps[at]) && result.cuts->share[at] >= kLeastCutShare;
  };
  if (result.cuts) {
    // A tip that only just touches covers nothing: its hats aren't cut, or a press by force would find nothing to
    // press on.
    bool any = false;
    for (std::size_t k = 0; k < result.cuts->vertices.size(); ++k) any = any || bears(k);
    if (!any) result.cuts = nullptr;
  }
  for (std::size_t k = 0; result.cuts && k < result.cuts->vertices.size(); ++k) {
    const int i = result.cuts->vertices[k];
    const double gap = cut_gaps[static_cast<Eigen::Index>(k)];
    if (skipped[i]) continue;
    const bool far = !bears(k);
    result.plain[i] = result.weighted[i] = far ? kInfinity : surface.weight[i] * gap;
    result.edge[i] = 0.0;
    if (far) result.lowest[i] = kInfinity;
  }
  return result;
}

}  // namespace

WeightedGap weighted_gap(const ContactSurface& surface, const ContactShape& shape,
                         const RigidTransform& gel_from_object, const PatchMotion& lookup, GapReach reach, bool cut,
                         std::shared_ptr<const CutHats> kept) {
  return gap_of(surface, shape, gel_from_object, lookup, reach, cut, std::move(kept), false);
}

double deepest_gap(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object,
                   bool cut) {
  const GapReach nothing_beside = surface.flat ? GapReach{0.0, 0.0} : GapReach{};
  return gap_of(surface, shape, gel_from_object, {}, nothing_beside, cut, nullptr, true).deepest;
}

}  // namespace touchstone::fem
