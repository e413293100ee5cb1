// The TacTip: the marker tracker finds its pins on simulated frames, and follows them under a press and a shear.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "render/cameras/first_hits.h"
#include "sensors/markers/marker_tracker.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

struct Errors {
  double rms = 0.0, worst = 0.0, farthest = 0.0;
};

TEST(TacTip, APressAndAShearAreFollowedPinByPin) {
  const std::filesystem::path cache = std::filesystem::path(TOUCHSTONE_BINARY_DIR) / "python" / "cache";
  const sim::DeviceSpec device = sim::read_device(kScenes / "devices" / "tactip.yaml");
  const sim::VirtualSensor sensor(device, cache);
  const sim::TouchObject ball = sensor.object(sim::read_object(kScenes / "objects" / "ball-8mm.yaml"));
  const render::Scene layers = sim::clear_layers(device);
  const render::ReadyCamera camera = render::make_ready(sim::camera_of(*device.camera));
  const auto seen_at = [&](const Eigen::Vector3d& point) {
    return render::project_through_faces(layers, camera, point).value();
  };

  sensors::MarkerTracker tracker({});
  tracker.track({sensor.background(1), 0});
  EXPECT_EQ(tracker.appearance()->polarity, sensors::MarkerPolarity::kBright);
  const std::size_t pins = static_cast<std::size_t>(sensor.marker_places_mm().rows());
  ASSERT_EQ(pins, 217U);
  ASSERT_EQ(tracker.tracked().rest.size(), pins) << "each pin is found at rest, and nothing else";
  // Which of the tracker's markers a pin is.
  std::vector<std::size_t> marker_of(pins);
  double farthest_at_rest = 0.0;
  for (std::size_t i = 0; i < pins; ++i) {
    const Eigen::Vector2d rest = seen_at(sensor.marker_places_mm().row(static_cast<Eigen::Index>(i)).transpose());
    const auto& all = tracker.tracked().rest;
    const auto nearest = std::min_element(
        all.begin(), all.end(), [&](const auto& a, const auto& b) { return (a - rest).norm() < (b - rest).norm(); });
    farthest_at_rest = std::max(farthest_at_rest, (*nearest - rest).norm());
    marker_of[i] = static_cast<std::size_t>(nearest - all.begin());
  }
  RecordProperty("farthest_at_rest_px", std::to_string(farthest_at_rest));
  std::vector<std::size_t> sorted = marker_of;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_EQ(std::unique(sorted.begin(), sorted.end()), sorted.end()) << "two pins are one blob";
  EXPECT_LT(farthest_at_rest, 1.0);

  std::int64_t t_us = 0;
  const auto follow = [&](const sim::PressSpec& press, Errors& errors) {
    const sim::Touch touch =
        sensor.press(ball, press, {.truth = false, .noise_seed = 10u + static_cast<unsigned>(t_us)});
    t_us += 40000;
    const sensors::TrackedMarkers& seen = tracker.track({touch.frame, t_us});
    EXPECT_EQ(seen.found(), 217) << touch.what;
    EXPECT_FALSE(seen.jumped);
    double square = 0.0;
    for (std::size_t i = 0; i < pins; ++i) {
      const Eigen::Vector3d rest_mm = touch.markers_mm.row(static_cast<Eigen::Index>(i));
      const Eigen::Vector3d now_mm = rest_mm + touch.marker_displacement.row(static_cast<Eigen::Index>(i)).transpose();
      const Eigen::Vector2d moved = seen_at(now_mm) - seen_at(rest_mm);
      const double error = (seen.displacement(marker_of[i]) - moved).norm();
      square += error * error;
      errors.worst = std::max(errors.worst, error);
      errors.farthest = std::max(errors.farthest, moved.norm());
    }
    errors.rms = std::max(errors.rms, std::sqrt(square / static_cast<double>(pins)));
  };
  Errors pressed, sheared;
  sim::PressSpec press;
  press.place_mm = {1.0, -1.5};
  for (const double depth_mm : {0.4, 0.8, 1.2}) {
    press.depth_mm = depth_mm;
    follow(press, pressed);
  }
  for (const double drag_mm : {0.15, 0.3, 0.45}) {
    press.drag_mm = drag_mm * Eigen::Vector2d(0.8, 0.6);
    follow(press, sheared);
  }
  for (const auto& [name, errors] : {std::pair{"press", pressed}, {"shear", sheared}}) {
    RecordProperty(std::string(name) + "_rms_px", std::to_string(errors.rms));
    RecordProperty(std::string(name) + "_worst_px", std::to_string(errors.worst));
    RecordProperty(std::string(name) + "_farthest_px", std::to_string(errors.farthest));
    EXPECT_GT(errors.farthest, 5.0) << name << ": the pins hardly moved";
    EXPECT_LT(errors.rms, 0.2) << name;
    EXPECT_LT(errors.worst, 1.0) << name;
  }
}

}  // namespace
}  // namespace touchstone::lab
