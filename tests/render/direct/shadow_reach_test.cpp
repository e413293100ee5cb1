#include <gtest/gtest.h>

#include <random>

#include "render/direct/shadow_reach.h"
#include "render/scene/ray_scene.h"
#include "tests/render/direct/direct_scenes.h"

namespace touchstone::render {
namespace {

/// Rays from places on a sheet to the lamps, against what the map says of them.
struct ReachTally {
  int hidden = 0;  // rays that meet something
  int missed = 0;  // of them, those that the map would have spared
  int spared = 0;
};

ReachTally tally(const Scene& scene, bool soft) {
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  const LampBearings bearings(field, soft);
  const ShadowReach reach(bearings, scene, is_connected(scene.surfaces[0].mesh));
  const RayScene rays(scene);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  ReachTally result;
  for (int k = 0; k < 20000; ++k) {
    // From a place on the sheet, to its lower side.
    RayHit start;
    if (!rays.intersect({6.99 * unit(random), 6.99 * unit(random), 3.0}, {0, 0, -1}, 10.0, start)) continue;
    if (start.object != 0) continue;
    const Eigen::Vector3d from = start.position - RayScene::leave_distance(start.position) * start.normal;
    const std::uint64_t doubt = reach.doubtful(float(start.position.x()), float(start.position.y()), start.object);
    for (int lamp = 0; lamp < field.beam_count(); ++lamp) {
      // The direction as DirectBatch takes it, for a soft shadow at a place set off by up to the lens's radius.
      const double off = soft ? disc_radius(field.lamp(lamp)) : 0.0;
      float flow[4 * 8];
      look_up_flow(
          field,
          find_cell(field, float(from.x() + off * unit(random)), float(from.y() + off * unit(random)), float(from.z())),
          flow);
      const Eigen::Vector3d towards =
          -Eigen::Vector3f(flow[4 * lamp], flow[4 * lamp + 1], flow[4 * lamp + 2]).cast<double>().normalized();
      if (towards.dot(start.normal) >= 0.0) continue;
      const bool doubtful = (doubt >> lamp & 1u) != 0;
      RayHit hit;
      if (rays.intersect(from, towards, 50.0, hit)) {
        ++result.hidden;
        result.missed += doubtful ? 0 : 1;
      } else {
        result.spared += doubtful ? 0 : 1;
      }
    }
  }
  return result;
}

TEST(ShadowReach, NeverSparesALampThatSomethingHides) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.5)});
  scene.surfaces.push_back({square_sheet(0.5, -1.2), Black{}});
  for (auto& vertex : scene.surfaces[1].mesh.vertices) vertex.x() += 4.0;
  scene.balls.push_back({{-3, 2, -0.9}, 0.4, Black{}});
  scene.balls.push_back({{-4, -4, -3.0}, 0.8, Black{}});
  scene.lamps.push_back(lamp_from({25, -20, -9}, 1.0));
  for (const bool soft : {false, true}) {
    const ReachTally found = tally(scene, soft);
    EXPECT_EQ(found.missed, 0);
    EXPECT_GT(found.hidden, 500);
    EXPECT_GT(found.spared, soft ? 5000 : 30000);
  }
}

TEST(ShadowReach, SparesNothingOverAFold) {
  Scene scene = lit_stack(0.0);
  TriangleMesh two = square_sheet(5.0, 0.0);
  const TriangleMesh lower = square_sheet(2.0, -1.0);
  for (const auto& vertex : lower.vertices) two.vertices.push_back(vertex);
  for (const auto& t : lower.triangles) two.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  scene.surfaces.push_back({two, Lambertian{grey(0.5)}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LampBearings bearings(field, false);
  const ShadowReach reach(bearings, scene, is_connected(scene.surfaces[0].mesh));
  EXPECT_EQ(reach.doubtful(0.0f, 0.0f, 0), 7u);
}

TEST(ShadowReach, SparesNothingOnBallsAndBesideTheMap) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.5)});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LampBearings bearings(field, false);
  const ShadowReach reach(bearings, scene, true);
  EXPECT_EQ(reach.doubtful(0.0f, 0.0f, 1), 7u);
  EXPECT_EQ(reach.doubtful(9.0f, 0.0f, 0), 7u);
  EXPECT_EQ(reach.doubtful(-5.0f, 3.0f, 0), 0u);  // flat there
}

}  // namespace
}  // namespace touchstone::render
