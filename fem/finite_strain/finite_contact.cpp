#include "fem/finite_strain/finite_contact.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fem/contact/contact_gap.h"
#include "fem/contact/covered_triangle.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStep = 1e-5;          // of a triangle's size: for the body's slope by central differences
constexpr double kWideStep = 0.02;      // of a triangle's size: for the body's curvature by second differences
constexpr double kMostCurvature = 3.0;  // over a triangle's size
constexpr double kBulge = 4.0;          // an edge's stiffness over pressure times length
constexpr double kSteepest = 3.0;       // slope of the body against the gel beyond which a line only grazes its flank

/// Values of the six quadratic functions of a triangle: corners, then the edges 01, 12, 20.
Eigen::Matrix<double, 6, 1> face_shape(const Eigen::Vector3d& b) {
  Eigen::Matrix<double, 6, 1> values;
  for (int k = 0; k < 3; ++k) {
    values[k] = b[k] * (2.0 * b[k] - 1.0);
    values[3 + k] = 4.0 * b[k] * b[(k + 1) % 3];
  }
  return values;
}

/// What one triangle adds to its three vertices.
struct TrianglePart {
  Eigen::Vector3d gap = Eigen::Vector3d::Zero();
  Eigen::Vector3d covered = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 18> gradient = Eigen::Matrix<double, 3, 18>::Zero();
  Eigen::Matrix<double, 18, 18> curvature = Eigen::Matrix<double, 18, 18>::Zero();
  std::vector<EdgeBulge> bulges;
  double lowest = kInfinity;
};

/// One deformed triangle in the object's frame.
template <typename Shape>
struct DeformedTriangle {
  const Shape& shape;
  Eigen::Matrix<double, 3, 6> points;
  Eigen::Matrix3d normals;
  Eigen::Matrix3d gel_from_object;
  Eigen::Vector3d pressure;  // of the corners
  double area = 0.0;         // undeformed
  double size = 0.0;
  double deepest = 0.0;  // no point of the gel's surface can be further inside the body

  Eigen::Vector3d direction(const Eigen::Vector3d& b) const { return (normals * b).normalized(); }

  /// The gap's second derivative by the point's place, in the object's frame. Along the line the gap is linear.
  Eigen::Matrix3d bend(const Eigen::Vector3d& point, const Eigen::Vector3d& along, double gap) const {
    const double step = kWideStep * size;
    const Eigen::Vector3d x = along.unitOrthogonal();
    const Eigen::Vector3d y = along.cross(x);
    const auto second = [&](const Eigen::Vector3d& across) {
      const auto up = first_entry(shape, point + step * across, along);
      const auto down = first_entry(shape, point - step * across, along);
      if (!up || !down) return 0.0;
      const double most = kMostCurvature / size;
      return std::clamp((*up + *down - 2.0 * gap) / (step * step), -most, most);
    };
    const double xx = second(x);
    const double yy = second(y);
    const double xy = 0.5 * (second((x + y).normalized()) - second((x - y).normalized()));
    return xx * x * x.transpose() + yy * y * y.transpose() + xy * (x * y.transpose() + y * x.transpose());
  }

  /// The gap's gradient by the point's place, in the object's frame.
  Eigen::Vector3d slope(const Eigen::Vector3d& point, const Eigen::Vector3d& along, double gap) const {
    const double step = kStep * size;
    Eigen::Vector3d result = -along;
    const Eigen::Vector3d first = along.unitOrthogonal();
    for (const Eigen::Vector3d& across : {first, Eigen::Vector3d(along.cross(first))}) {
      const auto up = first_entry(shape, point + step * across, along);
      const auto down = first_entry(shape, point - step * across, along);
      if (!up && !down) continue;
      result += (up.value_or(gap) - down.value_or(gap)) / ((up ? step : 0.0) + (down ? step : 0.0)) * across;
    }
    return result;
  }

  std::optional<double> gap_at(const Eigen::Vector3d& point, const Eigen::Vector3d& along) const {
    const auto gap = first_entry(shape, point, along);
    // A line from a part of the gel that faces away may come out of the body's far side.
    if (gap && -*gap > deepest + size) return std::nullopt;
    return gap;
  }

  void cover(double body_radius, std::vector<GapLines::Point>& points_found) const {
    const auto line = [this](const Eigen::Vector3d& b) -> std::optional<double> {
      const Eigen::Vector3d point = points * face_shape(b);
      const Eigen::Vector3d along = direction(b);
      const auto gap = gap_at(point, along);
      // A line that grazes a flank of the body (beside a punch, where the gel's face is tilted towards it) is a miss.
      if (gap && slope(point, along, *gap).squaredNorm() > 1.0 + kSteepest * kSteepest) return std::nullopt;
      return gap;
    };
    const auto visit = [&](const Eigen::Vector3d& b, double, double share) {
      points_found.push_back({b, share * area});
    };
    CoveredTriangle(line, visit).integrate(splits_for_body(area, body_radius));
  }

  void integrate(const std::vector<GapLines::Point>& covering, TrianglePart& part) const {
    for (const auto& [b, weight] : covering) {
      const Eigen::Matrix<double, 6, 1> values = face_shape(b);
      const Eigen::Vector3d point = points * values;
      const Eigen::Vector3d along = direction(b);
      const auto hit = gap_at(point, along);
      if (!hit) continue;
      const double gap = *hit;
      const Eigen::Vector3d gradient = gel_from_object * slope(point, along, gap);
      part.gap += weight * gap * b;
      part.covered += weight * b;
      part.lowest = std::min(part.lowest, gap);
      for (int node = 0; node < 6; ++node) {
        part.gradient.middleCols<3>(3 * node) += (weight * values[node]) * b * gradient.transpose();
      }
      const double push = weight * b.dot(pressure);
      if (push == 0.0) continue;
      const Eigen::Matrix3d turned = gel_from_object * bend(point, along, gap) * gel_from_object.transpose();
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          part.curvature.block<3, 3>(3 * i, 3 * j) += (push * values[i] * values[j]) * turned;
        }
      }
    }
  }
};

/// The bulge of the triangle's edge from corner k to the next, its stiffness left open; nothing if a line misses.
template <typename Shape>
std::optional<EdgeBulge> bulge_of(const DeformedTriangle<Shape>& triangle, const std::array<int, 6>& nodes, int k) {
  EdgeBulge bulge;
  const int next = (k + 1) % 3;
  bulge.nodes = {nodes[3 + k], nodes[k], nodes[next]};
  const Eigen::Vector3d one = Eigen::Vector3d::Unit(k);
  const Eigen::Vector3d other = Eigen::Vector3d::Unit(next);
  const std::array<Eigen::Vector3d, 3> at = {0.5 * (one + other), one, other};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d point = triangle.points * face_shape(at[i]);
    const Eigen::Vector3d along = triangle.direction(at[i]);
    const auto gap = triangle.gap_at(point, along);
    if (!gap) return std::nullopt;
    const double share = i == 0 ? 1.0 : -0.5;
    bulge.value += share * *gap;
    bulge.gradient[i] = share * (triangle.gel_from_object * triangle.slope(point, along, *gap));
  }
  return bulge;
}

std::array<int, 6> nodes_of(const TaylorHoodSpace& space, const std::array<int, 3>& face) {
  return {face[0],
          face[1],
          face[2],
          space.middle(face[0], face[1]),
          space.middle(face[1], face[2]),
          space.middle(face[2], face[0])};
}

Eigen::Vector3d moved(const TaylorHoodSpace& space, const Eigen::MatrixX3d& displacement, int node) {
  return space.position(node) + displacement.row(node).transpose();
}

/// The t-th triangle of the surface, in the object's frame.
template <typename Shape>
DeformedTriangle<Shape> triangle_of(const TaylorHoodSpace& space, const OuterSurface& surface, std::size_t t,
                                    const GapLines& lines, const Eigen::MatrixX3d& displacement, const Shape& shape,
                                    const RigidTransform& gel_from_object) {
  const TetMesh& mesh = *space.mesh;
  const RigidTransform object_from_gel = gel_from_object.inverse();
  const std::array<int, 6> nodes = nodes_of(space, mesh.outer[t]);
  DeformedTriangle<Shape> triangle{shape, {}, {}, {}, Eigen::Vector3d::Zero(), 0.0, 0.0, lines.deepest};
  for (int k = 0; k < 6; ++k) triangle.points.col(k) = object_from_gel * moved(space, displacement, nodes[k]);
  for (int k = 0; k < 3; ++k) {
    triangle.normals.col(k) = object_from_gel.turn(lines.normals[surface.triangles[t][k]]);
  }
  triangle.gel_from_object = gel_from_object.rotation;
  const Eigen::Vector3d a = mesh.vertices[mesh.outer[t][0]];
  triangle.area = 0.5 * (mesh.vertices[mesh.outer[t][1]] - a).cross(mesh.vertices[mesh.outer[t][2]] - a).norm();
  triangle.size = std::sqrt(triangle.area);
  return triangle;
}

/// Whether a line of the triangle may hit a ball about the body.
template <typename Shape>
bool may_hit(const DeformedTriangle<Shape>& triangle, const BoundingBall& ball) {
  const Eigen::Vector3d middle = triangle.points.template leftCols<3>().rowwise().mean();
  const Eigen::Vector3d axis = triangle.normals.rowwise().mean().normalized();
  double reach = 0.0;
  for (int k = 0; k < 6; ++k) reach = std::max(reach, (triangle.points.col(k) - middle).norm());
  // Lines that spread with the normals reach further aside the further the body is.
  double spread = 0.0;
  for (int k = 0; k < 3; ++k) spread = std::max(spread, (triangle.normals.col(k) - axis).norm());
  const Eigen::Vector3d away = ball.centre - middle;
  const double aside = (away - away.dot(axis) * axis).norm();
  return aside <= reach + ball.radius + 2.0 * spread * (away.norm() + ball.radius);
}

}  // namespace

GapLines gap_lines(const TaylorHoodSpace& space, const OuterSurface& surface, const Eigen::MatrixX3d& displacement,
                   const ContactShape& shape, const RigidTransform& gel_from_object, double overlap) {
  GapLines lines;
  lines.deepest = 2.0 * overlap;
  lines.normals.assign(surface.mesh_vertex.size(), Eigen::Vector3d::Zero());
  const auto corner = [&](int vertex) { return moved(space, displacement, surface.mesh_vertex[vertex]); };
  for (const auto& t : surface.triangles) {
    const Eigen::Vector3d a = corner(t[0]);
    const Eigen::Vector3d twice_area = (corner(t[1]) - a).cross(corner(t[2]) - a);
    for (const int v : t) lines.normals[v] += twice_area;
  }
  for (auto& normal : lines.normals) normal.normalize();
  const BoundingBall ball = bounding_ball(shape);
  lines.points.resize(surface.triangles.size());
  tbb::parallel_for(std::size_t{0}, lines.points.size(), [&](std::size_t t) {
    std::visit(
        [&](const auto& body) {
          const auto triangle = triangle_of(space, surface, t, lines, displacement, body, gel_from_object);
          if (may_hit(triangle, ball)) triangle.cover(ball.radius, lines.points[t]);
        },
        shape);
  });
  return lines;
}

DeformedGap deformed_gap(const TaylorHoodSpace& space, const OuterSurface& surface, const Eigen::VectorXd& weight,
                         const GapLines& lines, const Eigen::MatrixX3d& displacement, const ContactShape& shape,
                         const RigidTransform& gel_from_object, double overlap, const Eigen::VectorXd& pressure) {
  const TetMesh& mesh = *space.mesh;
  const auto n = static_cast<Eigen::Index>(surface.mesh_vertex.size());
  // The pressure that a point of a partly covered hat carries.
  Eigen::VectorXd share = Eigen::VectorXd::Zero(n);
  for (std::size_t t = 0; t < lines.points.size(); ++t) {
    for (const auto& point : lines.points[t]) {
      for (int k = 0; k < 3; ++k) share[surface.triangles[t][k]] += point.weight * point.barycentric[k];
    }
  }
  const Eigen::VectorXd carried = pressure.array() * weight.array() / share.array().max(kLeastShare * weight.array());
  std::vector<TrianglePart> parts(surface.triangles.size());
  std::vector<std::array<int, 6>> nodes(surface.triangles.size());
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t t) {
    nodes[t] = nodes_of(space, mesh.outer[t]);
    if (lines.points[t].empty()) return;
    std::visit(
        [&](const auto& body) {
          auto triangle = triangle_of(space, surface, t, lines, displacement, body, gel_from_object);
          for (int k = 0; k < 3; ++k) triangle.pressure[k] = carried[surface.triangles[t][k]];
          triangle.integrate(lines.points[t], parts[t]);
          for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            // Each edge once, from the triangle that goes along it from its lower vertex.
            if (surface.triangles[t][k] > surface.triangles[t][next]) continue;
            const auto whole = [&](int v) { return share[v] > 0.99 * weight[v]; };  // not on the body's rim
            if (triangle.pressure[k] <= 0.0 || triangle.pressure[next] <= 0.0) continue;
            if (!whole(surface.triangles[t][k]) || !whole(surface.triangles[t][next])) continue;
            const double length = (mesh.vertices[mesh.outer[t][k]] - mesh.vertices[mesh.outer[t][next]]).norm();
            if (auto bulge = bulge_of(triangle, nodes[t], k)) {
              // The harmonic mean: a vertex that just begins to touch changes nothing at once.
              const double one = triangle.pressure[k];
              const double other = triangle.pressure[next];
              bulge->stiffness = kBulge * 2.0 * one * other / (one + other) * length;
              parts[t].bulges.push_back(*bulge);
            }
          }
        },
        shape);
  });

  DeformedGap result;
  result.weighted = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd covered = Eigen::VectorXd::Zero(n);
  for (std::size_t t = 0; t < parts.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      result.weighted[surface.triangles[t][k]] += parts[t].gap[k];
      covered[surface.triangles[t][k]] += parts[t].covered[k];
    }
    result.deepest = std::min(result.deepest, parts[t].lowest);
    result.bulges.insert(result.bulges.end(), parts[t].bulges.begin(), parts[t].bulges.end());
  }
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double hit = covered[i] / weight[i];
    if (hit < kLeastShare) {
      result.weighted[i] = kInfinity;
      continue;
    }
    scale[i] = weight[i] / covered[i];
    result.weighted[i] *= scale[i];
    if (hit < kBearingShare) result.weighted[i] += weight[i] * (kBearingShare - hit) / kBearingFade * overlap;
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::Triplet<double>> bends;
  result.direction = Eigen::MatrixX3d::Zero(n, 3);
  for (std::size_t t = 0; t < parts.size(); ++t) {
    if (!parts[t].curvature.isZero(0.0)) {
      for (int i = 0; i < 18; ++i) {
        for (int j = 0; j < 18; ++j) {
          bends.emplace_back(3 * nodes[t][i / 3] + i % 3, 3 * nodes[t][j / 3] + j % 3, parts[t].curvature(i, j));
        }
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int v = surface.triangles[t][k];
      if (scale[v] == 0.0) continue;
      for (int node = 0; node < 6; ++node) {
        for (int a = 0; a < 3; ++a) {
          const double value = scale[v] * parts[t].gradient(k, 3 * node + a);
          entries.emplace_back(v, 3 * nodes[t][node] + a, value);
          result.direction(v, a) += value;
        }
      }
    }
  }
  const auto unknowns = 3 * static_cast<Eigen::Index>(space.nodes);
  result.curvature.emplace_back(unknowns, unknowns).setFromTriplets(bends.begin(), bends.end());
  result.gradient.resize(n, unknowns);
  result.gradient.setFromTriplets(entries.begin(), entries.end());
  return result;
}

DeformedGap merged_gap(std::vector<DeformedGap> gaps, const std::vector<int>& owner) {
  if (gaps.size() == 1) return std::move(gaps.front());
  const auto n = static_cast<Eigen::Index>(owner.size());
  DeformedGap merged;
  merged.weighted = Eigen::VectorXd::Constant(n, kInfinity);
  merged.direction = Eigen::MatrixX3d::Zero(n, 3);
  merged.gradient.resize(n, gaps.front().gradient.cols());
  for (Eigen::Index v = 0; v < n; ++v) {
    const int body = owner[static_cast<std::size_t>(v)];
    merged.gradient.startVec(v);
    if (body < 0) continue;
    const DeformedGap& own = gaps[static_cast<std::size_t>(body)];
    merged.weighted[v] = own.weighted[v];
    merged.direction.row(v) = own.direction.row(v);
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(own.gradient, v); it; ++it) {
      merged.gradient.insertBack(v, it.col()) = it.value();
    }
  }
  merged.gradient.finalize();
  for (std::size_t b = 0; b < gaps.size(); ++b) {
    merged.deepest = std::min(merged.deepest, gaps[b].deepest);
    merged.curvature.push_back(std::move(gaps[b].curvature.front()));
    for (EdgeBulge& bulge : gaps[b].bulges) {
      bulge.body = static_cast<int>(b);
      merged.bulges.push_back(bulge);
    }
  }
  return merged;
}

}  // namespace touchstone::fem
