#include "render/cameras/first_hits.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/scene/flat_faces.h"
#include "render/scene/ray_scene.h"

namespace touchstone::render {
namespace {

FirstHit trace(const Scene& scene, const RayScene& rays, RayInLayer ray) {
  FirstHit first;
  for (;;) {
    const double distance = distance_to_face(scene, ray);
    RayHit hit;
    if (rays.intersect(ray.origin, ray.direction, distance, hit)) {
      first.object = hit.object;
      first.triangle = hit.triangle;
      first.u = hit.weight_1;
      first.v = hit.weight_2;
      first.position = hit.position;
      first.normal = hit.shading_normal;
      return first;
    }
    if (std::isinf(distance) || cross_face(scene, distance, ray).cos_refracted <= 0.0) return first;
  }
}

}  // namespace

std::vector<FirstHit> first_hits(const Scene& scene, const ReadyCamera& camera) {
  check_scene(scene);
  const RayScene rays(scene);
  const Eigen::Vector2i size = size_of(camera);
  const RigidTransform& pose = pose_of(camera);
  const int layer = layer_of_height(scene.faces, pose.translation.z());
  std::vector<FirstHit> hits(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()));
  tbb::parallel_for(0, size.y(), [&](int row) {
    FirstHit* hit = hits.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x());
    for (int column = 0; column < size.x(); ++column, ++hit) {
      const std::optional<Eigen::Vector3d> view = view_direction(camera, column + 0.5, row + 0.5);
      if (view) *hit = trace(scene, rays, {pose.translation, pose.turn(*view), layer});
    }
  });
  return hits;
}

std::optional<Eigen::Vector2d> project_through_faces(const Scene& scene, const ReadyCamera& camera,
                                                     const Eigen::Vector3d& point) {
  check_faces(scene);
  const RigidTransform& pose = pose_of(camera);
  const Eigen::Vector3d eye = pose.translation;
  const Eigen::Vector3d offset = point - eye;
  const auto seen_along = [&](const Eigen::Vector3d& direction) {
    return image_point(camera, pose.inverse().turn(direction));
  };
  const int eye_layer = layer_of_height(scene.faces, eye.z());
  const int point_layer = layer_of_height(scene.faces, point.z());
  const double across = offset.head<2>().norm();
  if (eye_layer == point_layer || across == 0.0) return seen_along(offset);
  if (offset.z() == 0.0) return std::nullopt;

  // The layers between, from the eye: thickness and index.
  std::vector<Eigen::Vector2d> layers;
  const double low = std::min(eye.z(), point.z());
  const double high = std::max(eye.z(), point.z());
  double least_index = std::numeric_limits<double>::infinity();
  for (int layer = std::min(eye_layer, point_layer); layer <= std::max(eye_layer, point_layer); ++layer) {
    const double from = layer == 0 ? low : std::max(low, scene.faces[layer - 1].z);
    const double to = layer == static_cast<int>(scene.faces.size()) ? high : std::min(high, scene.faces[layer].z);
    if (!(to > from)) continue;
    layers.emplace_back(to - from, medium_of_layer(scene, layer).index);
    least_index = std::min(least_index, layers.back().y());
  }
  // Newton on p, held between bounds. The distance across grows with p without bound, convexly.
  double below = 0.0;
  double above = least_index;
  double p = least_index * across / offset.norm();
  constexpr int kMostSteps = 100;
  for (int step = 0; step < kMostSteps; ++step) {
    double reach = -across;
    double slope = 0.0;
    for (const Eigen::Vector2d& layer : layers) {
      const double n2 = layer.y() * layer.y();
      const double cosine = std::sqrt(std::max(n2 - p * p, 1e-300));
      reach += layer.x() * p / cosine;
      slope += layer.x() * n2 / (cosine * cosine * cosine);
    }
    if (std::abs(reach) <= 1e-13 * (1.0 + across)) break;
    (reach < 0.0 ? below : above) = p;
    p -= reach / slope;
    if (!(p > below && p < above)) p = 0.5 * (below + above);
  }
  const double index = medium_of_layer(scene, eye_layer).index;
  const double sine = std::min(1.0, p / index);
  const Eigen::Vector2d sideways = offset.head<2>() * (sine / across);
  return seen_along({sideways.x(), sideways.y(), std::copysign(std::sqrt(1.0 - sine * sine), offset.z())});
}

}  // namespace touchstone::render
