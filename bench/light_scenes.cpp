#include "bench/light_scenes.h"

#include <cmath>

#include "core/units.h"

namespace touchstone::bench {

using render::flat_spectrum;

TriangleMesh height_field(int cells, const std::function<double(double x, double y)>& height) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = kBenchHalf * (2.0 * i / cells - 1.0);
      const double y = kBenchHalf * (2.0 * j / cells - 1.0);
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + cells + 2});
      mesh.triangles.push_back({a, a + cells + 2, a + cells + 1});
    }
  }
  return mesh;
}

render::Scene bench_scene(int triangles, int lamps, int bands, bool interreflection, double shift) {
  render::Scene scene;
  scene.media = {render::Medium{1.0, {}}, render::Medium{1.517, {}}, render::Medium{1.41, {}}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  scene.environment = flat_spectrum(bands, 0.0);
  scene.interreflection = interreflection;
  TriangleMesh mesh = height_field(static_cast<int>(std::lround(std::sqrt(triangles / 2.0))), [&](double x, double y) {
    const double r2 = (x - shift) * (x - shift) + y * y;
    const double s2 = (x - shift - 3.0) * (x - shift - 3.0) + (y - 1.0) * (y - 1.0);
    return -0.8 * std::exp(-r2 / 0.5) - 0.3 * std::exp(-s2 / 0.05);
  });
  scene.surfaces.push_back({std::move(mesh), render::Lambertian{flat_spectrum(bands, 0.6)}});
  for (int bead = 0; bead < 9; ++bead) {
    scene.balls.push_back({{2.0 * (bead % 3) - 4.0, 2.0 * (bead / 3) - 2.0, -1.2},  // clear of the imprint
                           0.25,
                           render::Lambertian{flat_spectrum(bands, 0.1)}});
  }
  for (int k = 0; k < lamps; ++k) {
    const double angle = 2.0 * kPi * k / lamps;
    render::SpotLamp lamp;
    lamp.position = {30.0 * std::cos(angle), 30.0 * std::sin(angle), -12.0};
    lamp.direction = (Eigen::Vector3d(0, 0, -3) - lamp.position).normalized();
    lamp.lens_radius = 1.0;
    lamp.half_angle = 30.0 * kRadiansPerDegree;
    lamp.soft_angle = 4.0 * kRadiansPerDegree;
    lamp.power_W = flat_spectrum(bands, 0.5);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

Eigen::AlignedBox3d bench_reach() {
  return {Eigen::Vector3d(-kBenchHalf, -kBenchHalf, -1.5), Eigen::Vector3d(kBenchHalf, kBenchHalf, 0.0)};
}

render::PinholeCamera bench_camera(int width, int height) {
  render::PinholeCamera camera;
  camera.width = width;
  camera.height = height;
  camera.pixel_pitch_um = 6.9 * 640 / width;
  camera.hole_diameter_um = 100.0;
  camera.foil_thickness_um = 50.0;
  camera.distance_mm = 5.0;
  camera.gel_from_camera = look_at({0, 0, -22.4}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

}  // namespace touchstone::bench
