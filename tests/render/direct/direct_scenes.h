#pragma once
// Scenes that direct light is tried on: a membrane on gel and glass with lamps below, and a bare plane.

#include <Eigen/Geometry>
#include <cmath>

#include "render/direct/light_field.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {

/// A dent of 1 mm, as a ball of some 4 mm would press, with walls of 40 degrees.
inline double dent(double x, double y) {
  return -0.8 * std::exp(-(x * x + y * y) / 1.2) - 0.2 * std::exp(-((x - 3) * (x - 3) + y * y) / 0.3);
}

inline SpotLamp lamp_from(const Eigen::Vector3d& position, double lens_radius) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = -position;
  lamp.lens_radius = lens_radius;
  lamp.half_angle = 0.7;
  lamp.soft_angle = 0.2;
  lamp.power_W = grey(0.5);
  return lamp;
}

/// Glass and gel, three lamps from below, one of them low.
inline Scene lit_stack(double environment) {
  Scene scene = sensor_stack(environment);
  scene.interreflection = false;
  scene.lamps = {lamp_from({15, 0, -20}, 1.0), lamp_from({-10, 12, -18}, 1.0), lamp_from({-6, -30, -12}, 1.5)};
  return scene;
}

inline Scene dented_scene(double environment, const Material& material) {
  Scene scene = lit_stack(environment);
  scene.surfaces.push_back({square_relief(7.0, 70, dent), material});
  return scene;
}

inline Eigen::AlignedBox3d reach_of_membrane() {
  return {Eigen::Vector3d(-7, -7, -1.5), Eigen::Vector3d(7, 7, 0)};
}

inline LightFieldSettings accuracy(double value) {
  LightFieldSettings settings;
  settings.accuracy = value;
  return settings;
}

/// A plane of albedo 0.6 at z = 0 without faces, a point lamp under it.
inline Scene plane_scene(const Eigen::Vector3d& lamp) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.lamps = {half_space_lamp(lamp, {0, 0, 1}, 2.0)};
  scene.surfaces.push_back({square_sheet(9.0, 0.0), Lambertian{grey(0.6)}});
  return scene;
}

}  // namespace touchstone::render
