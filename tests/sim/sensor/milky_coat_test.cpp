// Pictures of a milky slab under a dark coat from what was traced once, against path tracing of each state.

#include "sim/sensor/milky_coat.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/whole_file.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/sensor/coated_view.h"
#include "sim/sensor/light_file.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const std::string kThreeLeds = R"(
  - {type: led, position_mm: [-6, -5, -11], target_mm: [0, 0, 0], chip_radius_mm: 0.4, power_W: 0.01}
  - {type: led, position_mm: [6, -5, -11], target_mm: [0, 0, 0], chip_radius_mm: 0.4, power_W: 0.01}
  - {type: led, position_mm: [0, 7, -11], target_mm: [0, 0, 0], chip_radius_mm: 0.4, power_W: 0.02}
)";
const std::string kDarkCoat = "coating: {type: matt, albedo: 0.08}\n";

/// Another sensor than any that is shipped: 16 x 14 x 3 mm, forward scattering, grey walls, three LEDs.
DeviceSpec milky_coat_device(const std::string& more = kDarkCoat, const std::string& lamps = kThreeLeds) {
  static const test::TemporaryFolder folder;
  write_whole_file(folder.path() / "device.yaml", [&](const std::filesystem::path& file) {
    std::ofstream(file) << R"(name: milky
gel: {size_x_mm: 16, size_y_mm: 14, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41,
  scattering_per_mm: 1.0, scattering_anisotropy: 0.5, frame_albedo: 0.4}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [4, 4], fine_depth_mm: 1}
plate: {thickness_mm: 6, refractive_index: 1.49}
camera: {type: lens, width: 36, height: 27, pixel_pitch_um: 30, focal_length_mm: 1.8, f_number: 4, focus_distance_mm: 16,
  lens_position_mm: [0, 0, -18], look_at_mm: [0, 0, 0], exposure_us: 10000, full_well_e: 10000}
band_wavelengths_nm: [550]
)" << more << "lamps:" << lamps;
  });
  return read_device(folder.path() / "device.yaml");
}

ObjectSpec milky_coat_ball() {
  ObjectSpec object;
  object.name = "ball";
  object.shape.radius_mm = 3.0;
  object.friction = 1.0;
  return object;
}

VirtualSensorSettings milky_coat_settings() {
  VirtualSensorSettings made;
  made.always_friction = true;
  return made;
}

/// The device with the ball's motion down to a depth at a place.
struct PressedMilkyCoat {
  std::unique_ptr<SceneView> view;
  fem::PressState rest, deep;
};

PressedMilkyCoat press_milky_coat(const DeviceSpec& device, const fem::Compliance& gel, double depth_mm,
                                  const Eigen::Vector2d& place) {
  MotionSpec motion;
  motion.start_mm = {place.x(), place.y(), 3.1};
  MotionKey key;
  key.frames = 4;
  key.z = AxisKey{3.0 - depth_mm, std::nullopt};
  motion.keys = {key};
  const SceneSpec scene = coated_scene(device, milky_coat_settings(), milky_coat_ball(), motion);
  const Plan plan = make_plan(scene);
  PressedMilkyCoat made;
  made.view = std::make_unique<SceneView>(scene, plan, gel);
  const std::vector<Truth> states = play_motion(scene, plan, gel);
  made.rest = at_rest(states.front().press);
  made.deep = states.back().press;
  return made;
}

TEST(MilkyCoat, PressesLookAsTracedShallowDeepAndAtTheEdge) {
  const test::TemporaryFolder cache;
  const DeviceSpec device = milky_coat_device();
  const auto gel = set_up_gel(device, cache.path());
  const render::Camera camera = camera_of(*device.camera);
  std::unique_ptr<MilkyCoat> coat;
  struct State {
    double depth_mm;
    Eigen::Vector2d place;
  };
  for (const State& state : {State{0.5, {0, 0}}, State{1.5, {0, 0}}, State{1.0, {5.0, 3.5}}}) {
    const PressedMilkyCoat pressed = press_milky_coat(device, *gel, state.depth_mm, state.place);
    if (!coat) coat = std::make_unique<MilkyCoat>(*pressed.view, camera, pressed.rest, 1);
    const auto relief = pressed.view->relief(pressed.deep);
    const SeenGeometry seen = pressed.view->geometry(pressed.deep, relief);
    const cv::Mat picture = coat->irradiance(seen.inside.surfaces.front().mesh);
    render::DirectErrorSettings judged;
    judged.pixels = 972;
    judged.samples = 48;
    const render::Scene scene = pressed.view->seen_coating(pressed.deep, seen);
    const render::DirectError error = render::measure_direct_error(picture, scene, camera, judged);
    const render::DirectError untouched = render::measure_direct_error(coat->traced().rest, scene, camera, judged);
    EXPECT_LT(error.rms, 0.05) << state.depth_mm << " mm, +- " << error.rms_error << "; as if untouched "
                               << untouched.rms;
    EXPECT_NEAR(error.mean, 0.0, 0.02) << state.depth_mm << " mm, +- " << error.mean_error;
    if (state.depth_mm >= 1.0) EXPECT_GT(untouched.rms, 0.03) << "there is something to be seen";
  }
  // What was traced makes the same pictures when it is read back.
  const std::string key(64, 'a');
  write_traced(cache.path(), key, coat->traced());
  auto again = read_traced(cache.path(), key);
  ASSERT_TRUE(again);
  const PressedMilkyCoat pressed = press_milky_coat(device, *gel, 0.5, {0, 0});
  const SeenGeometry seen = pressed.view->geometry(pressed.deep, pressed.view->relief(pressed.deep));
  const TriangleMesh& sheet = seen.inside.surfaces.front().mesh;
  const MilkyCoat read(*pressed.view, camera, pressed.rest, 1, std::move(*again));
  EXPECT_EQ(cv::norm(read.irradiance(sheet), coat->irradiance(sheet), cv::NORM_INF), 0.0);
  EXPECT_FALSE(read_traced(cache.path(), std::string(64, 'b')));
  TracedSlab smaller = coat->traced();
  smaller.rest = smaller.rest.rowRange(1, smaller.rest.rows).clone();
  EXPECT_THROW(MilkyCoat(*pressed.view, camera, pressed.rest, 1, std::move(smaller)), Error);
  std::string bytes = read_whole_file(light_file(cache.path(), key));
  bytes[bytes.size() / 2] ^= 1;
  write_whole_file(light_file(cache.path(), key), bytes);
  EXPECT_FALSE(read_traced(cache.path(), key)) << "damaged";
}

TEST(MilkyCoat, UnfitDevicesAreNamed) {
  const test::TemporaryFolder cache;
  const auto gel = set_up_gel(milky_coat_device(), cache.path());
  const auto unfit = [&](const std::string& more, const std::string& lamps = kThreeLeds) {
    const DeviceSpec device = milky_coat_device(more, lamps);
    const PressedMilkyCoat pressed = press_milky_coat(device, *gel, 0.2, {0, 0});
    return unfit_for_milky_coat(device, pressed.view->seen(pressed.rest, std::nullopt));
  };
  EXPECT_EQ(unfit(kDarkCoat), "");
  EXPECT_THAT(unfit("coating: {type: matt, albedo: 0.08, print: {grid: [3, 3], spacing_mm: [3, 3], diameter_mm: 1}}\n"),
              HasSubstr("something else in the gel or on its coating"));
  EXPECT_THAT(unfit(kDarkCoat,
                    "\n  - {type: led, position_mm: [0, 7, -11], target_mm: [0, 0, 0], chip_radius_mm: 0.4, "
                    "visible: true, power_W: 0.02}\n"),
              HasSubstr("a lamp has a body"));
}

}  // namespace
}  // namespace touchstone::sim
