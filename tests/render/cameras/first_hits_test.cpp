#include "render/cameras/first_hits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/message_of.h"

namespace touchstone::render {
namespace {

using test::message_of;
using ::testing::HasSubstr;

ReadyCamera camera_below() {
  PinholeCamera camera;
  camera.width = 160;
  camera.height = 120;
  camera.pixel_pitch_um = 18.0;
  camera.distance_mm = 5.0;
  camera.hole_diameter_um = 100.0;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera.translation = {0.0, 0.0, -18.0};
  return make_ready(camera);
}

// Air, a plate of 1 mm and a gel of 4 mm.
Scene layers() {
  Scene scene;
  scene.media = {Medium{1.0}, Medium{1.5}, Medium{1.45}};
  scene.faces = {{-5.0, 0, 1}, {-4.0, 1, 2}};
  return scene;
}

TEST(ProjectThroughFaces, FacesOfMediaThatAreNotThereAreRefused) {
  const ReadyCamera camera = camera_below();
  const Eigen::Vector3d point(1.0, -0.5, -0.8);
  const auto project = [&](const Scene& scene) { return project_through_faces(scene, camera, point); };
  ASSERT_TRUE(project(layers()));
  Scene scene = layers();
  scene.media.resize(1);
  EXPECT_THAT(message_of([&] { project(scene); }),
              HasSubstr("face 0: medium_above is medium 1; the scene has media 0 to 0"));
  scene = layers();
  scene.faces[1].medium_above = -1;
  EXPECT_THAT(message_of([&] { project(scene); }), HasSubstr("face 1: medium_above is medium -1"));
  scene = layers();
  scene.media.clear();
  EXPECT_THAT(message_of([&] { project(scene); }), HasSubstr("no medium"));
  scene = layers();
  std::swap(scene.faces[0], scene.faces[1]);
  EXPECT_THAT(message_of([&] { project(scene); }), HasSubstr("face 1: z is -5"));
}

}  // namespace
}  // namespace touchstone::render
