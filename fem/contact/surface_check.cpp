#include "fem/contact/surface_check.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/triangle_crossing.h"
#include "core/triangle_mesh.h"

namespace touchstone::fem {
namespace {

constexpr double kNoArea = 1e-12;  // of the undeformed triangle's
constexpr double kNoTilt = 1e-12;  // one less the cosine between triangles of one plane

/// How far a point is within the body, along the nearest of the frame's six directions; 0 outside.
double depth_within(const ContactShape& shape, const Eigen::Vector3d& point, const Eigen::Matrix3d& frame) {
  double depth = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const auto entry = first_entry(shape, point, sign * frame.col(axis));
      if (!entry || !(*entry < 0.0)) return 0.0;
      depth = std::min(depth, -*entry);
    }
  }
  return depth;
}

/// How a triangle is deformed.
struct Deformed {
  double shortening;  // by which part of it a line in it is shorter, at most
  double aside;       // norm of the gradient of its displacement along its own plane
};

Deformed deformed(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& was_a,
                  const Eigen::Vector3d& was_b) {
  Eigen::Matrix<double, 3, 2> axes;
  axes.col(0) = was_a.normalized();
  axes.col(1) = was_a.cross(was_b).cross(was_a).normalized();
  Eigen::Matrix2d before;
  before << axes.transpose() * was_a, axes.transpose() * was_b;
  Eigen::Matrix<double, 3, 2> after;
  after << a, b;
  const Eigen::Matrix<double, 3, 2> gradient = after * before.inverse();
  const Eigen::Matrix2d square = gradient.transpose() * gradient;
  const double half_trace = 0.5 * square.trace();
  const double root = std::sqrt(std::max(0.0, half_trace * half_trace - square.determinant()));
  return {1.0 - std::sqrt(std::max(0.0, half_trace - root)),
          (axes.transpose() * gradient - Eigen::Matrix2d::Identity()).norm()};
}

}  // namespace

SurfaceCheck check_surface(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                           std::span<const ContactShape* const> bodies, const PressState& state) {
  SurfaceCheck result;
  if (state.surface_displacement.rows() != static_cast<Eigen::Index>(vertices.size())) return result;
  TriangleMesh moved;  // what hasn't turned over
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3d displacement = state.surface_displacement.row(static_cast<Eigen::Index>(v));
    moved.vertices.push_back(vertices[v] + displacement);
  }
  std::vector<int> number;
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();  // normal of the first triangle
  bool flat = true;
  double aside = 0.0;
  std::vector<double> edge(vertices.size(), 0.0);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& corner = triangles[t];
    const Eigen::Vector3d was_a = vertices[corner[1]] - vertices[corner[0]];
    const Eigen::Vector3d was_b = vertices[corner[2]] - vertices[corner[0]];
    const Eigen::Vector3d a = moved.vertices[corner[1]] - moved.vertices[corner[0]];
    const Eigen::Vector3d b = moved.vertices[corner[2]] - moved.vertices[corner[0]];
    const Eigen::Vector3d was = was_a.cross(was_b);
    if (!(a.cross(b).dot(was) > kNoArea * was.squaredNorm())) {
      ++result.turned_over;
    } else {
      moved.triangles.push_back(corner);
      number.push_back(static_cast<int>(t));
    }
    const Deformed here = deformed(a, b, was_a, was_b);
    result.shortening = std::max(result.shortening, here.shortening);
    aside = std::max(aside, here.aside);
    if (t == 0) plane = was;
    flat = flat && was.dot(plane) > (1.0 - kNoTilt) * was.norm() * plane.norm();
    const double longest = std::max({was_a.norm(), was_b.norm(), (was_b - was_a).norm()});
    for (const int v : corner) edge[v] = std::max(edge[v], longest);
  }
  // Flat gels are slabs, whose outer face is convex: two of its points stay apart even as seen along its normal if
  // neither is displaced along it by as much as they are apart.
  if (!(flat && aside < 1.0)) {
    if (const auto crossing = first_crossing(moved)) {
      result.crossing = std::pair(number[crossing->first], number[crossing->second]);
    }
  }
  for (std::size_t b = 0; b < bodies.size() && b < state.bodies.size(); ++b) {
    if (bodies[b] == nullptr) continue;
    const RigidTransform object_from_gel = state.bodies[b].gel_from_object.inverse();
    const BoundingBall ball = bounding_ball(*bodies[b]);
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      if (state.node_owner[v] >= 0) continue;
      const Eigen::Vector3d point = object_from_gel * moved.vertices[v];
      if ((point - ball.centre).norm() > ball.radius) continue;
      const double depth = depth_within(*bodies[b], point, object_from_gel.rotation);
      if (depth > result.into_object) {
        result.into_object = depth;
        result.edge = edge[v];
      }
    }
  }
  return result;
}

double wrinkling_strain(const ElasticMaterial& film, const ElasticMaterial& body) {
  const auto plane = [](const ElasticMaterial& of) {
    return of.youngs_modulus / (1.0 - of.poisson_ratio * of.poisson_ratio);
  };
  const double ratio = plane(body) / plane(film);
  return ratio < 1.0 ? 0.25 * std::cbrt(9.0 * ratio * ratio) : std::numeric_limits<double>::infinity();
}

std::vector<std::string> surface_doubts(const SurfaceCheck& check, std::span<const ElasticMaterial> materials) {
  std::vector<std::string> doubts;
  if (check.turned_over > 0) {
    doubts.push_back(
        fmt::format("{} of the surface's triangles have turned over: the gel folds, and its contact with "
                    "itself isn't solved",
                    check.turned_over));
  } else if (check.crossing) {
    doubts.push_back(
        fmt::format("the surface's triangles {} and {} cross: the gel folds onto itself, and that contact "
                    "isn't solved",
                    check.crossing->first, check.crossing->second));
  }
  if (check.into_object > kIntoObject * check.edge) {
    doubts.push_back(fmt::format("the free surface reaches {:.3g} mm into the object: its side isn't in contact here",
                                 check.into_object));
  }
  // The layer that wrinkles first.
  std::size_t first = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < materials.size(); ++k) {
    const double strain = wrinkling_strain(materials[k], materials[0]);
    if (strain < least) {
      least = strain;
      first = k;
    }
  }
  if (check.shortening > least) {
    doubts.push_back(fmt::format(
        "the surface is shortened by {:.3g}: from {:.3g} on a layer {:.3g} times as stiff as the gel wrinkles, which "
        "isn't computed",
        check.shortening, least, materials[first].youngs_modulus / materials[0].youngs_modulus));
  }
  return doubts;
}

}  // namespace touchstone::fem
