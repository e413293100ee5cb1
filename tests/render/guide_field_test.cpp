// Light guides in a light field and in direct light, against the path tracer's connections.

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "lamp_scenes.h"
#include "render/direct_error.h"
#include "render/direct_renderer.h"
#include "render/guide_connection.h"
#include "render/light_field.h"

namespace touchstone::render {
namespace {

/// Air, acrylic from z = -6 to -3, silicone above; a guide that rises by `tilt` before x = -13.
Scene guide_scene(double tilt, double half_power_angle) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.media = {Medium{1.0, {}}, Medium{1.49, {}}, Medium{1.41, {}}};
  scene.faces = {{-6.0, 0, 1}, {-3.0, 1, 2}};
  GuideLamp lamp;
  lamp.centre = {-13, 0, -4.5};
  lamp.direction = {1, 0, 0};
  lamp.tilt = tilt;
  lamp.width = 18.0;
  lamp.half_power_angle = half_power_angle;
  lamp.power_W = grey(1.0);
  scene.lamps = {lamp};
  return scene;
}

/// The vector irradiance of lamp 0 of unit intensity at a place, the mean of `side`^2 connections.
Eigen::Vector3d flow_by_connections(Scene scene, const Eigen::Vector3d& place, int side) {
  std::visit([&](auto& lamp) { lamp.power_W = grey(emission_integral(scene.lamps[0])); }, scene.lamps[0]);
  const PreparedScene<1> prepared(scene);
  const Receiver receiver{place, Eigen::Vector3d::Zero(), 2, 2};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::uint64_t uncounted = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      Arrival<1> arrival;
      if (connect_to_guide(prepared, prepared.lamps[0], {(i + 0.5) / side, (j + 0.5) / side}, receiver, uncounted,
                           arrival)) {
        sum -= arrival.irradiance[0] * arrival.direction;
      }
    }
  }
  return sum / (static_cast<double>(side) * side);
}

TEST(GuideField, BeamsTogetherAreAllLight) {
  LightFieldSettings rough;
  rough.accuracy = 0.5;
  rough.guide_points = 8;
  for (double tilt : {0.0, 0.45, -0.3}) {
    for (double lobe : {0.17, 0.6}) {
      const Scene scene = guide_scene(tilt, lobe);
      const LightField field =
          make_light_field(scene, {Eigen::Vector3d(-0.1, -0.1, -1), Eigen::Vector3d(0.1, 0.1, 0)}, rough);
      for (const Eigen::Vector3d& place :
           {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-9, 6, -0.5), Eigen::Vector3d(11, -8, -1.5)}) {
        const Eigen::Vector3d expected = flow_by_connections(scene, place, 400);
        const Eigen::Vector3d found = exact_flow(field, 0, place).head<3>();
        EXPECT_LT((found - expected).norm(), 5e-3 * expected.norm())
            << "tilt " << tilt << ", lobe " << lobe << ", at " << place.transpose() << ": " << found.transpose()
            << " for " << expected.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace touchstone::render
