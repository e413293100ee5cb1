#include "bench/gelsight_scene.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace touchstone::bench {
namespace {

constexpr double kHalfX = 12.0, kHalfY = 9.0;  // mm
constexpr double kFloor = 1.0;                 // mm, the deepest that anything presses

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// The membrane follows what presses it and leaves it over some tenths of a mm, as a gel does.
double under_ball(double x, double y) {
  constexpr double radius = 2.0;
  constexpr double depth = 0.6;
  const double r = std::hypot(x, y);
  const double edge = std::sqrt(2.0 * radius * depth - depth * depth) * 0.8;
  if (r < edge) return -depth + radius - std::sqrt(radius * radius - r * r);
  const double rim = -depth + radius - std::sqrt(radius * radius - edge * edge);
  return rim * std::exp(-(r - edge) / 0.7);
}

double under_coin(double x, double y) {
  constexpr double radius = 5.0;
  const double r = std::hypot(x, y);
  const double inside = 1.0 - smooth_step(radius, radius + 0.5, r);
  double relief = smooth_step(4.3, 4.45, r) * (1.0 - smooth_step(4.75, 4.9, r));  // the rim
  relief += smooth_step(2.5, 2.65, r) * (1.0 - smooth_step(2.85, 3.0, r));
  for (int stud = 0; stud < 12; ++stud) {
    const double angle = 2.0 * kPi * stud / 12;
    relief += 1.0 - smooth_step(0.2, 0.4, std::hypot(x - 3.6 * std::cos(angle), y - 3.6 * std::sin(angle)));
  }
  for (int bar = -1; bar <= 1; ++bar) {
    relief += (1.0 - smooth_step(0.2, 0.35, std::abs(x - 1.1 * bar))) * (1.0 - smooth_step(1.3, 1.5, std::abs(y)));
  }
  return -inside * (0.25 + 0.15 * std::min(1.0, relief));
}

}  // namespace

render::Scene gelsight_scene(Pressed pressed, int triangles, const render::Material& membrane, bool interreflection,
                             double shift) {
  render::Scene scene;
  scene.media = {render::Medium{1.0, {}}, render::Medium{1.49, {}}, render::Medium{1.41, {}}};
  scene.faces = {{-6.0, 0, 1}, {-3.0, 1, 2}};
  scene.environment = render::flat_spectrum(3, 0.0);
  scene.interreflection = interreflection;
  const int rows = static_cast<int>(std::lround(std::sqrt(triangles / 2.0 * kHalfY / kHalfX)));
  const int columns = static_cast<int>(std::lround(rows * kHalfX / kHalfY));
  TriangleMesh mesh;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double x = kHalfX * (2.0 * i / columns - 1.0);
      const double y = kHalfY * (2.0 * j / rows - 1.0);
      double z = 0.0;
      if (pressed == Pressed::kBall) z = under_ball(x - 1.0 - shift, y - 0.5);
      if (pressed == Pressed::kCoin) z = under_coin(x - shift, y);
      mesh.vertices.emplace_back(x, y, z);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = j * (columns + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + columns + 2});
      mesh.triangles.push_back({a, a + columns + 2, a + columns + 1});
    }
  }
  scene.surfaces.push_back({std::move(mesh), membrane});
  const double colours[4][3] = {{0.02, 0.05, 0.9}, {0.05, 0.9, 0.05}, {0.9, 0.05, 0.02}, {0.35, 0.35, 0.35}};
  for (int side = 0; side < 4; ++side) {
    const double angle = 0.5 * kPi * side;
    const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d along(-outward.y(), outward.x(), 0.0);
    for (int k = -1; k <= 1; ++k) {
      render::SpotLamp lamp;
      lamp.position = (side % 2 == 0 ? 20.0 : 17.0) * outward + 5.0 * k * along + Eigen::Vector3d(0, 0, -5.0);
      lamp.direction = (-outward + Eigen::Vector3d(0, 0, 0.3)).normalized();
      lamp.lens_radius = 0.5;
      lamp.half_angle = 50.0 * kRadiansPerDegree;
      lamp.soft_angle = 15.0 * kRadiansPerDegree;
      lamp.power_W = 0.02 * Eigen::Map<const Eigen::Array3d>(colours[side]);
      scene.lamps.push_back(lamp);
    }
  }
  return scene;
}

Eigen::AlignedBox3d gelsight_reach() {
  return {Eigen::Vector3d(-kHalfX, -kHalfY, -kFloor), Eigen::Vector3d(kHalfX, kHalfY, 0.0)};
}

render::LensCamera gelsight_camera(int width, int height) {
  // The membrane's apparent depth below the lens's axis point: 16 mm of air and both layers over their indices.
  const double depth = 16.0 + 3.0 / 1.49 + 3.0 / 1.41;
  render::LensCamera camera;
  camera.width = width;
  camera.height = height;
  camera.pixel_pitch_um = 8.4 * 320 / width;
  camera.matrix = render::matrix_of_lens(2.7, depth, camera.pixel_pitch_um, width, height);
  camera.aperture_mm = 2.7 / 2.8;
  camera.focus_distance_mm = depth;
  camera.gel_from_camera = look_at({0, 0, -22}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

}  // namespace touchstone::bench
