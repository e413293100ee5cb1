#pragma once
// Small scenes that several tests of light use.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>

#include "render/paths/path_tracer.h"

namespace touchstone::render {

inline Spectrum grey(double value) {
  return Spectrum::Constant(1, value);
}

/// The square |x|, |y| <= half at height z; normal up, or down.
inline TriangleMesh square_sheet(double half, double z, bool up = true) {
  TriangleMesh mesh;
  mesh.vertices = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
  if (up) {
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  } else {
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  }
  return mesh;
}

/// A sheet of n x n squares, |x|, |y| <= half, at height(x, y); normal up, or down.
template <typename Height>
TriangleMesh square_relief(double half, int n, const Height& height, bool up = true) {
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const double x = half * (2.0 * i / n - 1.0);
      const double y = half * (2.0 * j / n - 1.0);
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + n + 2});
      mesh.triangles.push_back({a, a + n + 2, a + n + 1});
    }
  }
  if (!up) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  return mesh;
}

/// One grey band, surroundings of the given radiance, nothing else.
inline Scene empty_scene(double environment) {
  Scene scene;
  scene.environment = grey(environment);
  return scene;
}

/// Air below z = -7, glass to z = -5, gel above; media 0 air, 1 glass, 2 gel.
inline Scene sensor_stack(double environment) {
  Scene scene = empty_scene(environment);
  scene.media = {Medium{1.0, {}}, Medium{1.52, {}}, Medium{1.41, {}}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  return scene;
}

/// A point lamp that shines evenly into the half space round `direction`, of the given intensity (W/sr).
inline SpotLamp half_space_lamp(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double intensity) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = direction;
  lamp.half_angle = 1.5707963267948966;
  lamp.soft_angle = 0.0;
  lamp.power_W = grey(intensity * 6.283185307179586);
  return lamp;
}

inline RenderSettings samples(int count, int max_depth = 10000) {
  RenderSettings settings;
  settings.seed = 7;
  settings.min_samples = settings.max_samples = count;
  settings.max_depth = max_depth;
  return settings;
}

/// A mean and its standard error.
struct Estimate {
  double mean = 0.0;
  double error = 0.0;
};

/// Mean radiance (first band) along a ray over `runs` runs of 16 paths, each of its own seed.
inline Estimate view(const Scene& scene, const Eigen::Vector3d& from, const Eigen::Vector3d& direction, int runs) {
  const Tracer tracer(scene);
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < runs; ++i) {
    RenderSettings settings = samples(16);
    settings.seed = static_cast<std::uint64_t>(i);
    const double value = tracer.radiance(from, direction, settings)[0];
    sum += value;
    squares += value * value;
  }
  const double mean = sum / runs;
  return {mean, std::sqrt(std::max(0.0, squares / runs - mean * mean) / (runs - 1))};
}

/// A camera 20 mm below the stack's glass that looks up at the gel.
inline PinholeCamera small_camera(int width, int height) {
  PinholeCamera camera;
  camera.width = width;
  camera.height = height;
  camera.pixel_pitch_um = 2000.0 / width;
  camera.distance_mm = 3.0;
  camera.gel_from_camera = look_at({0, 0, -27}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

}  // namespace touchstone::render
