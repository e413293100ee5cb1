#include "sim/view/skin_pins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/units.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_pins.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/pixel_truth.h"
#include "sim/view/scene_view.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kDome =
    "{shape: fingertip, radius_mm: 10.2, length_mm: 2, sleeve_mm: 2, youngs_modulus_MPa: 0.05, "
    "layers: [{thickness_mm: 1, youngs_modulus_MPa: 1}]}";
const char* const kPad = "{size_x_mm: 10, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.2}";

DeviceSpec device_with(const std::string& pins, const std::string& gel = kDome,
                       const std::string& coating = "{type: matt, albedo: 0.04}") {
  return parse_yaml<DeviceSpec>(
      "name: pinned\ngel: " + gel + "\npins: " + pins + (coating.empty() ? "" : "\ncoating: " + coating) + "\n",
      "device.yaml");
}

std::string pins(int rings, double first_mm, double diameter_mm, double height_mm) {
  return fmt::format("{{rings: {}, first_ring_mm: {}, diameter_mm: {}, height_mm: {}, tip_mm: 0.1}}", rings, first_mm,
                     diameter_mm, height_mm);
}

/// A surface that is only points.
fem::Compliance points_of(const std::vector<Eigen::Vector3d>& points) {
  fem::Compliance gel;
  gel.vertices = points;
  return gel;
}

std::vector<Eigen::Vector3d> flat_points() {
  std::vector<Eigen::Vector3d> points;
  for (int i = -12; i <= 12; ++i) {
    for (int k = -12; k <= 12; ++k) points.emplace_back(0.41 * i, 0.37 * k + 0.1 * (i % 3), 0.0);
  }
  return points;
}

/// Of a hemisphere, evenly, some 0.8 mm apart.
std::vector<Eigen::Vector3d> round_points(double radius_mm) {
  constexpr int kPoints = 1100;
  const double golden = kPi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < kPoints; ++i) {
    const double height = 1.0 - (i + 0.5) / kPoints;
    const double across = std::sqrt(1.0 - height * height);
    points.emplace_back(radius_mm * across * std::cos(golden * i), radius_mm * across * std::sin(golden * i),
                        radius_mm * (height - 1.0));
  }
  return points;
}

template <typename Moves>
fem::PressState pressed(const fem::Compliance& gel, Moves moves) {
  fem::PressState press;
  press.surface_displacement.resize(static_cast<Eigen::Index>(gel.vertices.size()), 3);
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    press.surface_displacement.row(static_cast<Eigen::Index>(i)) = Eigen::Vector3d(moves(gel.vertices[i])).transpose();
  }
  return press;
}

TEST(PinPlaces, AreOneInTheMiddleAndSixMoreInEachRing) {
  // The TacTip's: eight rings of a sphere of 9.2 mm inside a skin of 1.0 mm.
  const DeviceSpec device = device_with(pins(8, 1.5, 0.6, 0.75));
  const std::vector<PinPlace> places = pin_places(device);
  ASSERT_EQ(places.size(), 217U);
  EXPECT_DOUBLE_EQ(pin_reach_mm(device), 1.75);
  const Eigen::Vector3d centre(0, 0, -10.2);
  const double step = std::asin(1.5 / 9.2);
  std::size_t first = 1;
  for (int ring = 1; ring <= 8; ++ring) {
    for (int k = 0; k < 6 * ring; ++k) {
      const PinPlace& pin = places[first + static_cast<std::size_t>(k)];
      const Eigen::Vector3d out = (pin.skin - centre) / 10.2;
      EXPECT_NEAR(std::acos(out.z()), ring * step, 1e-12);
      EXPECT_LT((pin.inward + out).norm(), 1e-12);
    }
    EXPECT_NEAR(places[first].skin.x(), 0.0, 1e-12);
    first += static_cast<std::size_t>(6 * ring);
  }
  // Of a flat pad the rings are as far apart as the first one is from the middle.
  const std::vector<PinPlace> flat = pin_places(device_with(pins(2, 1.2, 0.6, 0.75), kPad));
  ASSERT_EQ(flat.size(), 19U);
  EXPECT_LT((flat[7].skin - Eigen::Vector3d(0, 2.4, 0)).norm(), 1e-12);
}

TEST(PinPlaces, WhatCannotStandIsRefusedByName) {
  const auto refused = [](const auto&... arguments) { return message_of([&] { device_with(arguments...); }); };
  EXPECT_NO_THROW(device_with(pins(9, 1.5, 0.6, 0.75)));
  EXPECT_THAT(refused(pins(10, 1.5, 0.6, 0.75)),
              AllOf(HasSubstr("device.yaml:"), HasSubstr("pins.rings: 10"), HasSubstr("rim at 90 degrees")));
  EXPECT_THAT(refused(pins(1, 9.5, 0.6, 0.75)), HasSubstr("pins: a first ring at 9.5 mm"));
  EXPECT_THAT(refused(pins(4, 1.0, 0.6, 0.75), kPad), HasSubstr("pins.rings: 4 rings"));
  EXPECT_THAT(refused(pins(3, 1.0, 0.6, 3.0), kPad),
              AllOf(HasSubstr("pins.height_mm: 3"), HasSubstr("allowed is below 3")));
  EXPECT_THAT(refused(pins(8, 1.5, 0.6, 11.0)), HasSubstr("pins.height_mm: 11"));
  EXPECT_THAT(refused(pins(8, 1.5, 1.1, 0.75)), AllOf(HasSubstr("pins.diameter_mm: 1.1"), HasSubstr("overlap")));
  // Of a dome pins lean towards each other: what is free at their feet touches at their ends.
  EXPECT_NO_THROW(device_with(pins(8, 1.5, 0.8, 0.75)));
  EXPECT_THAT(refused(pins(8, 1.5, 0.8, 4.0)), HasSubstr("pins.diameter_mm: 0.8"));
  EXPECT_THAT(refused(pins(2, 1.5, 0.6, 0.75), kDome, ""), HasSubstr("has no coating"));
  EXPECT_THAT(refused(pins(2, 1.5, 0.6, 0.75), kPad,
                      "{type: matt, albedo: 0.1, print: {grid: [2, 2], spacing_mm: [1, 1], diameter_mm: 0.3}}"),
              HasSubstr("pins or a print"));
  EXPECT_THAT(refused("{rings: 2, first_ring_mm: 1.5, diameter_mm: 0.6, height_mm: 0.5, tip_mm: 0.6}"),
              HasSubstr("tip_mm"));
  EXPECT_THAT(refused("{rings: 31, first_ring_mm: 0.2, diameter_mm: 0.1, height_mm: 0.5, tip_mm: 0.1}"),
              HasSubstr("rings"));
}

TEST(SkinPins, TurnWithARigidlyTurnedDome) {
  const DeviceSpec device = device_with(pins(8, 1.5, 0.6, 0.75));
  const fem::Compliance gel = points_of(round_points(10.2));
  const SkinPins skin(device, gel);
  ASSERT_EQ(skin.rest_mm().rows(), 217);
  EXPECT_LT((skin.rest_mm().row(0).transpose() - Eigen::Vector3d(0, 0, -1.7)).norm(), 1e-12);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Vector3d step(0.3, -0.2, 0.1);
  const fem::PressState press =
      pressed(gel, [&](const Eigen::Vector3d& point) -> Eigen::Vector3d { return turn * point + step - point; });
  const Eigen::MatrixX3d now = skin.tips_mm(press);
  for (Eigen::Index i = 0; i < now.rows(); ++i) {
    const Eigen::Vector3d rest = skin.rest_mm().row(i);
    EXPECT_LT((now.row(i).transpose() - (turn * rest + step)).norm(), 2e-4)
        << "pin " << i;  // what a quadratic misses of the sphere
  }
  // The mesh goes with them: each tip's vertices have the tip's size and their middle where the tip is.
  const TriangleMesh mesh = skin.tips(press);
  ASSERT_EQ(mesh.triangles.size(), 217U * SkinPins::kTriangles);
  const std::size_t a_tip = mesh.vertices.size() / 217;
  for (std::size_t pin : {std::size_t{0}, std::size_t{100}, std::size_t{216}}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 1; k < a_tip; ++k) sum += mesh.vertices[pin * a_tip + k] / static_cast<double>(a_tip - 1);
    EXPECT_LT((sum - now.row(static_cast<Eigen::Index>(pin)).transpose()).norm(), 1e-12);
  }
}

TEST(SkinPins, AreLeversOnASkinThatBends) {
  const DeviceSpec device = device_with(pins(2, 1.2, 0.6, 0.75), kPad);
  const fem::Compliance gel = points_of(flat_points());
  const SkinPins skin(device, gel);
  // A valley along y, z = -a + b x^2, stretched by a tenth along x: the skin's slope is 2 b x / 1.1.
  const double a = 0.4;
  const double b = 0.1;
  const auto moved = [&](const Eigen::Vector3d& point) -> Eigen::Vector3d {
    return {0.1 * point.x(), 0.0, b * point.x() * point.x() - a};
  };
  const Eigen::MatrixX3d now = skin.tips_mm(pressed(gel, moved));
  const double lever = 0.7;  // to the middle of the tip
  double farthest = 0.0;
  for (Eigen::Index i = 0; i < now.rows(); ++i) {
    const Eigen::Vector3d foot = skin.rest_mm().row(i).transpose() + lever * Eigen::Vector3d::UnitZ();
    const double tilt = std::atan(2.0 * b * foot.x() / 1.1);
    const Eigen::Vector3d expected = foot + moved(foot) - lever * Eigen::Vector3d(-std::sin(tilt), 0.0, std::cos(tilt));
    EXPECT_LT((now.row(i).transpose() - expected).norm(), 1e-9) << "pin " << i;
    farthest = std::max(farthest, lever * std::abs(std::sin(tilt)));
  }
  EXPECT_GT(farthest, 0.25) << "no pin tilted";
}

TEST(SkinPins, ATooCoarseSurfaceIsRefused) {
  const DeviceSpec device = device_with(pins(1, 1.2, 0.6, 0.75), kPad);
  EXPECT_THAT(message_of([&] {
                SkinPins(device, points_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
              }),
              HasSubstr("a finer mesh"));
}

/// A small flat pad with seven pins before a small camera.
DeviceSpec pinned_pad() {
  return parse_yaml<DeviceSpec>(R"(
name: pinned-pad
gel: {size_x_mm: 10, size_y_mm: 10, thickness_mm: 3, youngs_modulus_MPa: 0.2, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
pins: {rings: 1, first_ring_mm: 1.6, diameter_mm: 0.6, height_mm: 0.8, tip_mm: 0.2}
plate: {thickness_mm: 2, refractive_index: 1.49}
coating: {type: matt, albedo: 0.04}
lamps:
  - {type: led_ring, centre_mm: [0, 0, -6], ring_radius_mm: 6, count: 4, target_mm: [0, 0, 0], power_W: 0.0004}
band_wavelengths_nm: [550]
camera: {type: lens, width: 160, height: 120, frame_rate_Hz: 30, pixel_pitch_um: 6, focal_length_mm: 1.6, f_number: 4,
         focus_distance_mm: 14, lens_position_mm: [0, 0, -15], look_at_mm: [0, 0, 0], exposure_us: 10000,
         full_well_e: 10000}
)",
                                "device.yaml");
}

TEST(SkinPins, AreWhatTheCameraOfAPressedPadSees) {
  const test::TemporaryFolder cache;
  const DeviceSpec device = pinned_pad();
  const VirtualSensor sensor(device, cache.path());
  ASSERT_TRUE(sensor.light().direct) << sensor.light().reason;
  ObjectSpec ball;
  ball.name = "ball";
  ball.shape.radius_mm = 3.0;
  PressSpec order;
  order.place_mm = {0.8, 0.0};
  order.depth_mm = 0.5;
  const TouchObject object = sensor.object(ball);
  const Touch touch = sensor.press(object, order);
  ASSERT_EQ(touch.markers_mm.rows(), 7);
  EXPECT_LT(touch.marker_displacement(0, 2), -0.2);
  EXPECT_GT(touch.marker_displacement.leftCols<2>().cwiseAbs().maxCoeff(), 0.05) << "no pin leans";

  SceneSpec scene = touch_scene(device, {}, object.spec(), sensor.motion_of(object, order));
  scene.outputs = parse_yaml<OutputSpec>("{frames: false, ids: true, flow: true}", "outputs.yaml");
  const SceneView view(scene, make_plan(scene), sensor.gel());
  const SeenGeometry seen = view.geometry(touch.press, view.relief(touch.press));
  const render::Camera camera = camera_of(*device.camera);
  const render::ReadyCamera ready = render::make_ready(camera);
  const LinearImage truth = pixel_truth(seen, camera, scene.outputs);
  const LinearImage still = pixel_truth(view.geometry(at_rest(touch.press), {}), camera, scene.outputs);
  for (int pin = 0; pin < 7; ++pin) {
    const Eigen::Vector3d rest = touch.markers_mm.row(pin);
    const Eigen::Vector3d now = rest + touch.marker_displacement.row(pin).transpose();
    const Eigen::Vector2d at = render::project_through_faces(seen.inside, ready, now).value();
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    double brightness = 0.0;
    int pixels = 0;
    int found_at_rest = 0;
    for (int row = 0; row < truth.image.rows; ++row) {
      for (int column = 0; column < truth.image.cols; ++column) {
        const auto* value = truth.image.ptr<float>(row) + 3 * column;
        if (static_cast<int>(value[0]) != PixelId::kFirstMarker + pin) continue;
        middle += Eigen::Vector2d(column + 0.5, row + 0.5);
        // Where it was at rest this pin was seen, but for what turned into sight and pixels' rims.
        const Eigen::Vector2i was(static_cast<int>(std::floor(column + 0.5 + value[1])),
                                  static_cast<int>(std::floor(row + 0.5 + value[2])));
        if (still.image.ptr<float>(was.y())[3 * was.x()] == value[0]) ++found_at_rest;
        brightness += touch.frame.at<std::uint8_t>(row, column);
        EXPECT_TRUE(std::isnan(touch.height.at<float>(row, column))) << "a pin is no membrane";
        ++pixels;
      }
    }
    ASSERT_GT(pixels, 20) << "pin " << pin;
    EXPECT_LT((middle / pixels - at).norm(), 0.35) << "pin " << pin;
    EXPECT_GT(found_at_rest, 0.8 * pixels) << "pin " << pin;
    EXPECT_GT(brightness / pixels, 3.0 * cv::mean(touch.frame)[0]) << "pin " << pin;
  }
  // At rest nothing moves.
  EXPECT_LT((view.pins.tips_mm(at_rest(touch.press)) - view.pins.rest_mm()).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace touchstone::sim
