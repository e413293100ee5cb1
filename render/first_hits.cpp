#include "render/first_hits.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/ray_scene.h"

namespace touchstone::render {
namespace {

/// Number of faces below the height.
int layer_at(const Scene& scene, double z) {
  int layer = 0;
  while (layer < static_cast<int>(scene.faces.size()) && scene.faces[layer].z < z) ++layer;
  return layer;
}

double index_of_layer(const Scene& scene, int layer) {
  if (scene.faces.empty()) return scene.media[0].index;
  return scene.media[layer == 0 ? scene.faces.front().medium_below : scene.faces[layer - 1].medium_above].index;
}

FirstHit trace(const Scene& scene, const RayScene& rays, Eigen::Vector3d origin, Eigen::Vector3d direction) {
  FirstHit first;
  int layer = layer_at(scene, origin.z());
  for (;;) {
    const bool up = direction.z() > 0.0;
    const int face = up ? layer : layer - 1;
    const bool bounded = direction.z() != 0.0 && face >= 0 && face < static_cast<int>(scene.faces.size());
    const double most = bounded ? std::max(0.0, (scene.faces[face].z - origin.z()) / direction.z())
                                : std::numeric_limits<double>::infinity();
    RayHit hit;
    if (rays.intersect(origin, direction, most, hit)) {
      first.object = hit.object;
      first.triangle = hit.triangle;
      first.u = hit.weight_1;
      first.v = hit.weight_2;
      first.position = hit.position;
      first.normal = hit.shading_normal;
      return first;
    }
    if (!bounded) return first;
    origin += most * direction;
    origin.z() = scene.faces[face].z;
    const int next = up ? layer + 1 : layer - 1;
    const double eta = index_of_layer(scene, layer) / index_of_layer(scene, next);
    const double cosine2 = 1.0 - eta * eta * direction.head<2>().squaredNorm();
    if (!(cosine2 > 0.0)) return first;
    direction = {eta * direction.x(), eta * direction.y(), std::copysign(std::sqrt(cosine2), direction.z())};
    layer = next;
  }
}

}  // namespace

std::vector<FirstHit> first_hits(const Scene& scene, const PinholeCamera& camera) {
  check_scene(scene);
  check_camera(camera);
  const RayScene rays(scene);
  std::vector<FirstHit> hits(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  const double pitch = camera.pixel_pitch_um * 1e-3;
  tbb::parallel_for(0, camera.height, [&](int row) {
    for (int column = 0; column < camera.width; ++column) {
      const Eigen::Vector3d view((column + 0.5 - 0.5 * camera.width) * pitch, (row + 0.5 - 0.5 * camera.height) * pitch,
                                 camera.distance_mm);
      hits[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(column)] =
          trace(scene, rays, camera.gel_from_camera.translation, camera.gel_from_camera.turn(view.normalized()));
    }
  });
  return hits;
}

std::optional<Eigen::Vector2d> project_through_faces(const Scene& scene, const PinholeCamera& camera,
                                                     const Eigen::Vector3d& point) {
  const Eigen::Vector3d eye = camera.gel_from_camera.translation;
  const Eigen::Vector3d way = point - eye;
  const auto seen_along = [&](const Eigen::Vector3d& direction) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector3d in_camera = camera.gel_from_camera.inverse().turn(direction);
    if (!(in_camera.z() > 0.0)) return std::nullopt;
    return project(camera, in_camera);
  };
  const int eye_layer = layer_at(scene, eye.z());
  const int point_layer = layer_at(scene, point.z());
  const double across = way.head<2>().norm();
  if (eye_layer == point_layer || across == 0.0) return seen_along(way);
  if (way.z() == 0.0) return std::nullopt;

  // The layers between, from the eye: thickness and index.
  std::vector<Eigen::Vector2d> layers;
  const double low = std::min(eye.z(), point.z());
  const double high = std::max(eye.z(), point.z());
  double least_index = std::numeric_limits<double>::infinity();
  for (int layer = std::min(eye_layer, point_layer); layer <= std::max(eye_layer, point_layer); ++layer) {
    const double from = layer == 0 ? low : std::max(low, scene.faces[layer - 1].z);
    const double to = layer == static_cast<int>(scene.faces.size()) ? high : std::min(high, scene.faces[layer].z);
    if (!(to > from)) continue;
    layers.emplace_back(to - from, index_of_layer(scene, layer));
    least_index = std::min(least_index, layers.back().y());
  }
  // Newton on p, held between bounds. The way across grows with p without bound, convexly.
  double below = 0.0;
  double above = least_index;
  double p = least_index * across / way.norm();
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
  const double index = index_of_layer(scene, eye_layer);
  const double sine = std::min(1.0, p / index);
  const Eigen::Vector2d sideways = way.head<2>() * (sine / across);
  return seen_along({sideways.x(), sideways.y(), std::copysign(std::sqrt(1.0 - sine * sine), way.z())});
}

}  // namespace touchstone::render
