// The Mini's gel for tracking: the tracker follows its dots on simulated frames under a known drag.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "render/cameras/first_hits.h"
#include "sensors/markers/marker_tracker.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

TEST(MiniMarkers, ADragIsFollowedDotByDot) {
  // Its gel takes half a minute to set up, once: the Python tests press it, too.
  const std::filesystem::path cache = std::filesystem::path(TOUCHSTONE_BINARY_DIR) / "python" / "cache";
  const sim::DeviceSpec device = sim::read_device(kScenes / "devices" / "gelsight-mini-markers.yaml");
  const sim::VirtualSensor sensor(device, cache);
  const sim::TouchObject ball = sensor.object(sim::read_object(kScenes / "objects" / "ball-8mm.yaml"));
  const render::Scene layers = sim::clear_layers(device);
  const render::ReadyCamera camera = render::make_ready(sim::camera_of(*device.camera));

  sensors::MarkerTracker tracker({});
  Frame frame{sensor.background(1), 0};
  tracker.track(frame);
  ASSERT_EQ(tracker.tracked().rest.size(), 63u);

  double square = 0.0;
  double worst = 0.0;
  double farthest = 0.0;
  int count = 0;
  for (int step = 0; step <= 4; ++step) {
    sim::PressSpec press;
    press.place_mm = {1.0, -1.5};
    press.force_N = 3.0;
    press.drag_mm = 0.125 * step * Eigen::Vector2d(0.8, 0.6);
    const sim::Touch touch = sensor.press(ball, press, {.truth = false, .noise_seed = 10u + step});
    frame = {touch.frame, 40000 * (step + 1)};
    const sensors::TrackedMarkers& seen = tracker.track(frame);
    ASSERT_EQ(seen.found(), 63) << "drag of " << press.drag_mm.norm() << " mm";
    EXPECT_FALSE(seen.jumped);
    for (Eigen::Index i = 0; i < touch.markers_mm.rows(); ++i) {
      const Eigen::Vector3d rest_mm = touch.markers_mm.row(i);
      const Eigen::Vector3d now_mm = rest_mm + touch.marker_displacement.row(i).transpose();
      const Eigen::Vector2d rest = render::project_through_faces(layers, camera, rest_mm).value();
      const Eigen::Vector2d now = render::project_through_faces(layers, camera, now_mm).value();
      const auto nearest = std::min_element(seen.rest.begin(), seen.rest.end(), [&](const auto& a, const auto& b) {
        return (a - rest).norm() < (b - rest).norm();
      });
      EXPECT_LT((*nearest - rest).norm(), 0.2) << "at rest, marker " << i;
      const Eigen::Vector2d moved = seen.displacement(static_cast<std::size_t>(nearest - seen.rest.begin()));
      const double error = (moved - (now - rest)).norm();
      square += error * error;
      worst = std::max(worst, error);
      farthest = std::max(farthest, (now - rest).norm());
      ++count;
    }
  }
  const double rms = std::sqrt(square / count);
  RecordProperty("rms_px", std::to_string(rms));
  RecordProperty("worst_px", std::to_string(worst));
  RecordProperty("farthest_px", std::to_string(farthest));
  EXPECT_GT(farthest, 5.0) << "the dots hardly moved";
  EXPECT_LT(rms, 0.1);
  EXPECT_LT(worst, 0.5);
}

}  // namespace
}  // namespace touchstone::lab
