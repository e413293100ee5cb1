// Events from pictures that are moved from state to state, against those from pictures that are all drawn in full.

#include "sim/sensor/light_between.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "sim/press/gel_setup.h"
#include "sim/sensor/event_stream.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 72;

/// Event pixels of 0.05 mm behind a coated gel with dots.
constexpr const char* kDevice = R"(name: coated
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.6, coarse_mm: 1.5, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
camera: {type: lens, width: 96, height: 72, pixel_pitch_um: 14, focal_length_mm: 6, f_number: 8, focus_distance_mm: 26.8,
  lens_position_mm: [0, 0, -28], look_at_mm: [0, 0, 0], exposure_us: 100, full_well_e: 100000,
  events: {on_threshold: 0.15, off_threshold: 0.15, dark_e_per_s: 1000}}
coating: {type: matt, albedo: 0.5, print: {grid: [5, 5], spacing_mm: [0.9, 0.9], diameter_mm: 0.4, colour: 0.05}}
lamps:
  - {position_mm: [-9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: 0.03}
  - {position_mm: [9, 3, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: 0.02}
band_wavelengths_nm: [580]
)";
constexpr const char* kPress = "  - {frames: 12, z: {position_mm: 2.5}}\n";
constexpr const char* kSlide = "  - {frames: 8, x: {position_mm: 0.08}}\n";
constexpr const char* kShake = "  - {frames: 20, vibration: {axis: x, amplitude_mm: 0.02, frequency_Hz: 100}}\n";

struct Stream {
  EventStreamReport report;
  std::vector<Event> events;
};

class LightBetweenTest : public testing::Test {
 protected:
  SceneSpec scene(double start_z_mm, const std::string& keys, double reach_px) {
    folder_.write("device.yaml", kDevice);
    folder_.write("ball.yaml", "{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4, friction: 0.5}");
    folder_.write("motion.yaml",
                  fmt::format("start_mm: [0.2, 0.1, {}]\nframe_rate_Hz: 1000\nkeys:\n{}", start_z_mm, keys));
    return read_scene(folder_.write(
        "scene.yaml",
        fmt::format(
            "device: device.yaml\nobject: ball.yaml\nmotion: motion.yaml\noutputs: {{frames: false, events: true}}\n"
            "seed: 4\nlight: {{direct_tolerance: 0.1, event_reach_px: {}}}\n",
            reach_px)));
  }

  Stream watch(const SceneSpec& scene) {
    const auto gel = set_up_gel(scene.device, folder_.path());
    Stream stream;
    stream.report = watch_events(scene, make_plan(scene), *gel, 3, [&](std::span<const Event> some) {
      stream.events.insert(stream.events.end(), some.begin(), some.end());
    });
    return stream;
  }

  const std::filesystem::path& folder() const { return folder_.path(); }

 private:
  test::TemporaryFolder folder_;
};

/// Of each pixel ON less OFF events, or both together, CV_32S.
cv::Mat counts(const std::vector<Event>& events, bool net) {
  cv::Mat out(kHeight, kWidth, CV_32S, cv::Scalar(0));
  for (const Event& event : events) out.at<int>(event.y, event.x) += event.on || !net ? 1 : -1;
  return out;
}

/// The mean time of all events, ms.
double mean_ms(const std::vector<Event>& events) {
  double sum = 0.0;
  for (const Event& event : events) sum += 1e-3 * static_cast<double>(event.t_us);
  return sum / static_cast<double>(events.size());
}

/// Events of each pixel that have no counterpart, of all.
double unmatched(const Stream& moved, const Stream& full) {
  cv::Mat off;
  cv::absdiff(counts(moved.events, false), counts(full.events, false), off);
  return cv::sum(off)[0] / static_cast<double>(full.events.size());
}

TEST_F(LightBetweenTest, APressGivesTheEventsOfPicturesDrawnInFull) {
  const Stream moved = watch(scene(2.97, kPress, 1.0));
  const Stream full = watch(scene(2.97, kPress, 0.0));
  ASSERT_GT(full.events.size(), 500u);
  EXPECT_EQ(full.report.keys, full.report.pictures);
  EXPECT_GE(moved.report.keys, 2);
  EXPECT_LT(moved.report.keys, moved.report.pictures / 2);
  EXPECT_LT(std::abs(double(moved.events.size()) / double(full.events.size()) - 1.0), 0.05);
  EXPECT_LT(unmatched(moved, full), 0.15);
  EXPECT_NEAR(mean_ms(moved.events), mean_ms(full.events), 0.1);
}

TEST_F(LightBetweenTest, ASlideGivesTheEventsOfPicturesDrawnInFull) {
  const Stream moved = watch(scene(2.8, kSlide, 1.0));
  const Stream full = watch(scene(2.8, kSlide, 0.0));
  ASSERT_GT(full.events.size(), 500u);
  EXPECT_LT(std::abs(double(moved.events.size()) / double(full.events.size()) - 1.0), 0.05);
  EXPECT_LT(unmatched(moved, full), 0.15);
  EXPECT_NEAR(mean_ms(moved.events), mean_ms(full.events), 0.1);
}

TEST_F(LightBetweenTest, AVibrationNeedsOneKeyAndComesBackToWhereItBegan) {
  const Stream moved = watch(scene(2.8, kShake, 1.0));
  ASSERT_GT(moved.events.size(), 500u);
  EXPECT_EQ(moved.report.keys, 1);
  EXPECT_GE(moved.report.pictures, 41);
  // After whole periods each pixel has seen its light again: ON and OFF are as many, but for what an event leaves over.
  cv::Mat net = cv::abs(counts(moved.events, true));
  double most = 0.0;
  cv::minMaxLoc(net, nullptr, &most);
  EXPECT_LE(most, 1.0);
}

TEST_F(LightBetweenTest, NothingJumpsWhereAKeyIsMade) {
  // No more pixels fire in the millisecond of a key than a little more than in those beside it.
  const Stream moved = watch(scene(2.8, "  - {frames: 24, x: {position_mm: 0.3}}\n", 1.0));
  EXPECT_GE(moved.report.keys, 3);
  std::vector<int> by_ms(25, 0);
  for (const Event& event : moved.events) ++by_ms[static_cast<std::size_t>((event.t_us - 1) / 1000)];
  for (std::size_t ms = 4; ms + 1 < 24; ++ms) {
    EXPECT_LT(by_ms[ms], 1.5 * 0.5 * (by_ms[ms - 1] + by_ms[ms + 1]) + 20) << ms;
  }
}

TEST_F(LightBetweenTest, AnyNumberOfThreadsGivesTheSameEvents) {
  const SceneSpec shaken = scene(2.8, kSlide, 1.0);
  const Stream many = watch(shaken);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Stream one = watch(shaken);
  ASSERT_EQ(one.events.size(), many.events.size());
  for (std::size_t i = 0; i < one.events.size(); ++i) {
    EXPECT_TRUE(one.events[i].t_us == many.events[i].t_us && one.events[i].x == many.events[i].x &&
                one.events[i].y == many.events[i].y && one.events[i].on == many.events[i].on);
  }
}

TEST_F(LightBetweenTest, AStillSceneGivesNoEvents) {
  const Stream moved = watch(scene(2.8, "  - {frames: 5, x: {position_mm: 0.2}}\n", 1.0));
  EXPECT_EQ(moved.events.size(), 0u);
}

TEST_F(LightBetweenTest, ASensorsPressIsWatchedByIt) {
  const SceneSpec any = scene(2.8, kSlide, 1.0);
  const VirtualSensor sensor(any.device, folder());
  PressSpec press;
  press.place_mm = {0.2, 0.1};
  press.depth_mm = 0.5;
  press.seconds = 0.02;
  const Touch touch = sensor.press(any.object, press, {.truth = false});
  ASSERT_GT(touch.events.size(), 500u);
  EXPECT_LE(touch.events.back().t_us, 20000);
  // What the events add up to is what the light has changed by, but for a threshold, and for outlines of dots, where
  // the sensor's pictures count sixteen rays a pixel.
  const cv::Mat net = counts(touch.events, true);
  int right = 0;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double change =
          std::log(touch.light.at<float>(row, column) / sensor.background_light().at<float>(row, column));
      right += std::abs(0.15 * net.at<int>(row, column) - change) < 0.2 ? 1 : 0;
    }
  }
  EXPECT_GT(right, 0.9 * kWidth * kHeight);
}

TEST_F(LightBetweenTest, WhatIsUnfitIsDrawnInFull) {
  SceneSpec metal = scene(2.8, kSlide, 1.0);
  EXPECT_EQ(unfit_for_light_between(metal, make_plan(metal)), "");
  metal.device.coating->type = CoatingType::metal;
  EXPECT_EQ(unfit_for_light_between(metal, make_plan(metal)), "the coating is of metal");
}

}  // namespace
}  // namespace touchstone::sim
