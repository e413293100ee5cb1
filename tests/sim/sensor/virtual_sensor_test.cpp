#include "sim/sensor/virtual_sensor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/whole_file.h"
#include "render/direct/direct_error.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_camera.h"
#include "sim/sensor/light_file.h"
#include "sim/view/scene_view.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// Made once: the gel's set-up takes longest.
const VirtualSensor& sensor() {
  static const test::TemporaryFolder cache;
  static const VirtualSensor one(test::small_coated_device(), cache.path());
  return one;
}

ObjectSpec ball(double radius_mm) {
  ObjectSpec object;
  object.name = "ball";
  object.shape.radius_mm = radius_mm;
  object.friction = 0.5;
  return object;
}

MotionSpec press(double x, double y, double from, double to) {
  MotionSpec motion;
  motion.start_mm = {x, y, from};
  MotionKey key;
  key.z = AxisKey{to, std::nullopt};
  motion.keys = {key};
  return motion;
}

TEST(VirtualSensor, PlacesAndPixelsAreOneMapInBothDirections) {
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), Eigen::Vector2d(1.5, -1.0), Eigen::Vector2d(-2.0, 0.7)}) {
    EXPECT_LT((sensor().gel_from_pixel(sensor().pixel_from_gel(place)) - place).norm(), 1e-7);
  }
  const double step = (sensor().gel_from_pixel({41, 30}) - sensor().gel_from_pixel({40, 30})).norm();
  EXPECT_NEAR(step, sensor().mm_per_px(), 0.01 * step);
}

/// A cap of 18 mm that ends on its plate, lit by LEDs in the plate, a millimetre and more beside the cap.
DeviceSpec domed_device() {
  return parse_yaml<DeviceSpec>(R"(name: domed
gel: {shape: dome, sphere_radius_mm: 20, base_radius_mm: 9, youngs_modulus_MPa: 0.4, poisson_ratio: 0.49,
      refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [4, 4], fine_depth_mm: 1}
plate: {thickness_mm: 6, refractive_index: 1.49}
coating: {type: matt, albedo: 0.5}
lamps:
  - {type: led, position_mm: [7.2, -10.5, -5], target_mm: [0, 0, -5], chip_radius_mm: 0.5, viewing_angle_deg: 71,
     power_W: [0.02, 0, 0]}
  - {type: led, position_mm: [-10.2, 0, -3.2], target_mm: [0, 0, -3.2], viewing_angle_deg: 71, power_W: [0, 0.02, 0]}
  - {type: led, position_mm: [0, 13.5, -5], target_mm: [0, 0, -5], viewing_angle_deg: 71, power_W: [0, 0, 0.02]}
camera:
  type: lens
  width: 48
  height: 64
  pixel_pitch_um: 17.5
  active_area_um2: 3
  focal_length_mm: 1.08
  f_number: 3
  focus_distance_mm: 19
  lens_position_mm: [0, 0, -21.67]
  look_at_mm: [0, 0, 0]
  exposure_us: 8000
  bayer: binned
  full_well_e: 5000
  read_noise_e: 4
)",
                                "device.yaml");
}

TEST(VirtualSensor, ADomeThatEndsOnThePlateIsLitByLampsInThePlate) {
  const test::TemporaryFolder cache;
  const DeviceSpec device = domed_device();
  const VirtualSensor domed(device, cache.path());
  ASSERT_TRUE(domed.light().direct) << domed.light().reason;
  const TouchObject object = domed.object(ball(3));
  const render::Camera camera = camera_of(*device.camera);
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), Eigen::Vector2d(4, -5)}) {
    PressSpec press;
    press.place_mm = place;
    press.depth_mm = 0.4;
    const Touch touch = domed.press(object, press);
    EXPECT_GT(touch.force_N().z(), 0.1);
    EXPECT_GT(cv::countNonZero(touch.contact), 20);
    // Against path tracing of what is seen.
    const SceneSpec scene = touch_scene(device, {}, object.spec(), domed.motion_of(object, press));
    const SceneView view(scene, make_plan(scene), domed.gel());
    const render::Scene seen = view.seen(touch.press, view.relief(touch.press));
    double lowest = 0.0;
    for (const Eigen::Vector3d& vertex : seen.surfaces.front().mesh.vertices) lowest = std::min(lowest, vertex.z());
    EXPECT_GE(lowest, -device.gel.thickness_mm) << "the gel reaches into the plate";
    const render::DirectError error = render::measure_direct_error(touch.light, seen, camera, {.samples = 256});
    EXPECT_LT(error.rms, 0.03 + 2 * error.rms_error) << place.transpose();
    EXPECT_NEAR(error.mean, 0.0, 0.005 + 2 * error.mean_error) << place.transpose();
  }
}

TEST(VirtualSensor, WhatDoesNotTouchLeavesTheBackgroundAndNoHeight) {
  const TouchObject object = sensor().object(ball(2));
  const auto states = sensor().play(object, press(0, 0, 5, 4));
  const Touch touch = sensor().capture(object, states.back().press, 3, 1);
  EXPECT_EQ(cv::norm(touch.frame, sensor().background(3, 1), cv::NORM_INF), 0.0);
  EXPECT_NE(cv::norm(touch.frame, sensor().background(4, 1), cv::NORM_INF), 0.0) << "noise has a seed";
  EXPECT_EQ(cv::countNonZero(touch.contact), 0);
  EXPECT_LT(cv::norm(touch.height, cv::NORM_INF), 1e-6);
}

TEST(VirtualSensor, APressedBallIsSeenWhereItIsAndAsDeepAsItIs) {
  const TouchObject object = sensor().object(ball(4));
  const auto states = sensor().play(object, press(0.8, -0.5, 4.1, 3.6));
  const Touch touch = sensor().capture(object, states.back().press, 3);
  double deepest = 0.0;
  cv::Point where;
  cv::minMaxLoc(touch.height, nullptr, &deepest, nullptr, &where);
  EXPECT_NEAR(deepest, 0.4, 0.02) << "the fine contact keeps the force and shifts the object a little";
  const Eigen::Vector2d wanted = sensor().pixel_from_gel({0.8, -0.5});
  EXPECT_LT((Eigen::Vector2d(where.x + 0.5, where.y + 0.5) - wanted).norm(), 1.5);
  const double seen_mm2 = cv::countNonZero(touch.contact) * std::pow(sensor().mm_per_px(), 2);
  EXPECT_NEAR(seen_mm2, states.back().press.contact_area, 0.15 * states.back().press.contact_area);
  EXPECT_GT(cv::norm(touch.frame, sensor().background(3), cv::NORM_INF), 20.0) << "its flanks are lit differently";
}

TEST(VirtualSensor, PicturesAreTheSameFromAnyNumberOfThreads) {
  const TouchObject object = sensor().object(ball(1.5));
  const auto states = sensor().play(object, press(-0.5, 0.5, 1.6, 1.2));
  const Touch alone = sensor().capture(object, states.back().press, 5);
  std::vector<Touch> many(6);
  tbb::parallel_for(0, 6, [&](int i) { many[i] = sensor().capture(object, states.back().press, 5); });
  for (const Touch& one : many) {
    EXPECT_EQ(cv::norm(one.frame, alone.frame, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(one.height, alone.height, cv::NORM_INF), 0.0);
  }
}

TEST(VirtualSensor, LightThatWasKeptMakesTheSameFrames) {
  const test::TemporaryFolder cache;
  VirtualSensorSettings settings;
  settings.light_key = "this device, this program";
  const auto frame_of = [&](const VirtualSensor& one) {
    const TouchObject object = one.object(ball(2));
    return one.capture(object, one.play(object, press(0.3, 0, 2.05, 1.8)).back().press, 3).light;
  };
  const auto kept = [&] {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(cache.path())) {
      if (entry.path().filename().string().starts_with("light-")) files.push_back(entry.path());
    }
    return files;
  };
  const VirtualSensor first(test::small_coated_device(), cache.path(), settings);
  EXPECT_EQ(kept().size(), 0U) << "nobody has asked for light";
  first.light();
  ASSERT_EQ(kept().size(), 1U);
  const cv::Mat light = frame_of(first);
  EXPECT_EQ(cv::norm(light, frame_of(sensor()), cv::NORM_INF), 0.0) << "one that keeps none";
  std::string content = read_whole_file(kept().front());
  const VirtualSensor second(test::small_coated_device(), cache.path(), settings);
  EXPECT_EQ(second.light().reason, first.light().reason);
  EXPECT_EQ(second.light().error->rms, first.light().error->rms);
  EXPECT_EQ(cv::norm(light, frame_of(second), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(first.background_light(), second.background_light(), cv::NORM_INF), 0.0);

  content[content.size() / 2] ^= 1;
  write_whole_file(kept().front(), content);
  const VirtualSensor third(test::small_coated_device(), cache.path(), settings);
  EXPECT_EQ(cv::norm(light, frame_of(third), cv::NORM_INF), 0.0) << "a damaged file is made anew";
  EXPECT_NE(read_whole_file(kept().front()), content);

  // A sound file with the light of another sensor, whose camera is larger or whose lamps are more.
  const std::string key = kept().front().stem().string().substr(std::string("light-").size());
  const FoundLight own = read_light(cache.path(), key).value();
  FoundLight others = own;
  others.field.lamp_of.back() = 99;
  const auto expect_made_anew = [&](const FoundLight& other) {
    write_light(cache.path(), key, other);
    const std::string sealed = read_whole_file(kept().front());
    const VirtualSensor one(test::small_coated_device(), cache.path(), settings);
    EXPECT_EQ(cv::norm(light, frame_of(one), cv::NORM_INF), 0.0);
    EXPECT_NE(read_whole_file(kept().front()), sealed);
  };
  expect_made_anew(others);
  others = own;
  others.bounced = cv::Mat(3, 4, CV_32FC3, cv::Scalar::all(1.0));
  expect_made_anew(others);

  settings.deepest_mm *= 0.9;
  const VirtualSensor fourth(test::small_coated_device(), cache.path(), settings);
  fourth.light();
  EXPECT_EQ(kept().size(), 2U);
}

TEST(VirtualSensor, RefusesWhatItCannotShow) {
  const test::TemporaryFolder cache;
  const auto error_of = [](const auto& act) -> std::string {
    try {
      act();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  DeviceSpec blind = test::small_coated_device();
  blind.camera.reset();
  const VirtualSensor without(blind, cache.path());
  EXPECT_NEAR(without.press(ball(2), {.force_N = 0.1}, {.picture = false}).force_N().z(), 0.1, 1e-5);
  EXPECT_THAT(error_of([&] { without.press(ball(2), {.force_N = 0.1}); }), HasSubstr("has no camera"));
  EXPECT_THAT(error_of([&] { without.light(); }), HasSubstr("has no camera"));
  const TouchObject object = sensor().object(ball(2));
  const auto states = sensor().play(object, press(0, 0, 2.1, 0.2));
  EXPECT_THAT(error_of([&] { sensor().capture(object, states.back().press, 1); }), HasSubstr("beyond the 1.2 mm in"));
}

// By Hertz the force at a depth goes with 1 / (1 / E1* + 1 / E2*), E* = E / (1 - nu^2): a ball of 1 MPa and nu 0.3 is
// pressed by 0.848 times what a rigid one is on the coated gel's 0.15 MPa, by 0.736 on the clear one's 0.3 MPa. Thin
// gels and a ball that is held change that by some per cent.
TEST(VirtualSensor, ElasticObjectsPressCoatedAndClearGels) {
  const test::TemporaryFolder cache;
  const VirtualSensor clear(test::small_device(), cache.path());
  for (const VirtualSensor* one : {&sensor(), &clear}) {
    ObjectSpec object = ball(2);
    const PressSpec how{.depth_mm = 0.2};
    const Touch rigid = one->press(one->object(object), how, {.picture = false});
    object.elastic = ElasticSpec{};
    object.elastic->youngs_modulus_MPa = 1.0;
    object.elastic->poisson_ratio = 0.3;
    object.elastic->mesh_mm = 0.5;
    const Touch soft = one->press(one->object(object), how);
    EXPECT_NEAR(soft.force_N().z() / rigid.force_N().z(), one == &clear ? 0.736 : 0.848, 0.08);
    EXPECT_FALSE(soft.frame.empty());
  }
}

// A press and its capture are the same picture: press() is play() and capture() of its last state.
TEST(VirtualSensor, APressIsItsMotionsLastState) {
  const TouchObject object = sensor().object(ball(2));
  const PressSpec how{.place_mm = {0.4, 0.1}, .depth_mm = 0.3};
  const Touch pressed = sensor().press(object, how, {.noise_seed = 5});
  const Truth last = sensor().play(object, sensor().motion_of(object, how)).back();
  const Touch captured = sensor().capture(object, last.press, 5);
  EXPECT_EQ(cv::norm(pressed.frame, captured.frame, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(pressed.light, captured.light, cv::NORM_INF), 0.0);
  EXPECT_EQ(pressed.force_N(), Eigen::Vector3d(last.press.wrench.head<3>()));
  EXPECT_EQ(cv::norm(pressed.expose(5), pressed.frame, cv::NORM_INF), 0.0);
  EXPECT_NEAR(last.press.gel_from_object.translation.z(), 2.0 - 0.3, 1e-12);
}

}  // namespace
}  // namespace touchstone::sim
