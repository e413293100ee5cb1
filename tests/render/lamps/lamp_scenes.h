#pragma once
// What the tests of lamps measure with.

#include <cmath>

#include "core/units.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {

/// Irradiance (W/m^2, first band) at (x, y, 0) on the side `normal_z` of a white level sheet, by `count` samples.
inline double irradiance_at(Scene scene, double x, double y, double normal_z, int count) {
  scene.interreflection = false;
  scene.surfaces.push_back({square_sheet(200.0, 0.0), Lambertian{grey(1.0)}});
  const Eigen::Vector3d eye(x, y, 0.01 * normal_z);
  return kPi * Tracer(scene).radiance(eye, {0, 0, -normal_z}, samples(count))[0];
}

/// All that a scene's lamps send to the inside of a ball, by `count` places on it. Nothing else may be in the
/// scene.
inline double power_on_all_sides(Scene scene, int count) {
  constexpr double kRadius = 6.0;
  scene.interreflection = false;
  scene.balls.push_back({{0, 0, 0}, kRadius, Lambertian{grey(1.0)}});
  const Tracer tracer(scene);
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    // Evenly over the sphere: a spiral of the golden angle.
    const double z = (2.0 * i + 1.0) / count - 1.0;
    const double azimuth = i * kPi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d out(r * std::cos(azimuth), r * std::sin(azimuth), z);
    RenderSettings settings = samples(16);
    settings.seed = static_cast<std::uint64_t>(i);
    sum += kPi * tracer.radiance(0.999 * kRadius * out, out, settings)[0];
  }
  return sum / count * 4.0 * kPi * kRadius * kRadius * 1e-6;
}

/// `of` standard errors of the difference.
inline double difference(const Estimate& a, const Estimate& b) {
  return std::abs(a.mean - b.mean) / std::hypot(a.error, b.error);
}

}  // namespace touchstone::render
