#include "sim/sensor/event_stream.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <tuple>

#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/scene.h"
#include "sim/sensor/event_picture.h"
#include "sim/sensor/light_sequence.h"
#include "tests/sim/press/moving_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

SceneSpec event_scene(const std::string& keys) {
  SceneSpec scene = moving_scene(keys);
  scene.outputs = {.frames = false, .ideal = false};
  scene.outputs.events = true;
  return scene;
}

struct Stream {
  EventStreamReport report;
  std::vector<Event> events;
};

Stream watch(const SceneSpec& scene) {
  Stream stream;
  const EventSink sink = [&](std::span<const Event> some) {
    stream.events.insert(stream.events.end(), some.begin(), some.end());
  };
  stream.report = watch_events(scene, make_plan(scene), *moving_gel(), 3, sink);
  return stream;
}

constexpr double kOn = 0.15;  // as in the device
constexpr double kOff = 0.2;
const char* const kPress = "  - {frames: 3, z: {position_mm: 1.85}}\n";
const char* const kStill = "  - {frames: 20, z: {position_mm: 2}}\n";

/// Counts of one polarity, CV_32S.
cv::Mat counts(const std::vector<Event>& events, bool on) {
  cv::Mat out(30, 40, CV_32S, cv::Scalar(0));
  for (const Event& event : events) out.at<int>(event.y, event.x) += event.on == on ? 1 : 0;
  return out;
}

/// Logarithms of the photocurrents at a state, all pixels traced.
cv::Mat whole_log(const SceneSpec& scene, const fem::PressState& press) {
  return LightSequence(scene, make_plan(scene), *moving_gel(), kOn).first(press).log_photocurrent;
}

TEST(EventStream, EventsAddUpToTheChangeOfLogIntensity) {
  const SceneSpec scene = event_scene(kPress);
  const Stream stream = watch(scene);
  const auto truths = play_motion(scene, make_plan(scene), *moving_gel());
  const cv::Mat change = whole_log(scene, truths.back().press) - whole_log(scene, truths.front().press);
  const cv::Mat on = counts(stream.events, true);
  const cv::Mat off = counts(stream.events, false);
  constexpr double kLeftAlone = 0.05 * kOn;  // a pixel may keep its light if it changed by less
  int busy = 0;
  for (int y = 0; y < change.rows; ++y) {
    for (int x = 0; x < change.cols; ++x) {
      const double unreported = change.at<float>(y, x) - (kOn * on.at<int>(y, x) - kOff * off.at<int>(y, x));
      EXPECT_LT(unreported, kOn + kLeftAlone) << "column " << x << ", row " << y;
      EXPECT_GT(unreported, -kOff - kLeftAlone) << "column " << x << ", row " << y;
      busy += std::abs(change.at<float>(y, x)) > kOff ? 1 : 0;
    }
  }
  EXPECT_GT(busy, 30) << "the press can hardly be seen";
  EXPECT_EQ(stream.report.events, static_cast<std::int64_t>(stream.events.size()));
  EXPECT_LT(stream.report.pixels_traced, stream.report.pictures * change.rows * change.cols) << "nothing was saved";
}

TEST(EventStream, EventsComeInOrderOfTimeWithinTheMotion) {
  const Stream stream = watch(event_scene(kPress));
  ASSERT_FALSE(stream.events.empty());
  const auto before = [](const Event& a, const Event& b) {
    return std::tie(a.t_us, a.y, a.x, a.on) < std::tie(b.t_us, b.y, b.x, b.on);
  };
  EXPECT_TRUE(std::is_sorted(stream.events.begin(), stream.events.end(), before));
  EXPECT_GT(stream.events.front().t_us, 0);
  EXPECT_LE(stream.events.back().t_us, 30000);
}

TEST(EventStream, AnyNumberOfThreadsGivesTheSameEvents) {
  SceneSpec scene = event_scene("  - {frames: 1, z: {position_mm: 1.95}}\n");
  scene.device.camera->events->pixels.shot_rate_hz = 500.0;
  scene.device.camera->events->pixels.shot_half_intensity = 1e7;
  const Stream many = watch(scene);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Stream one = watch(scene);
  ASSERT_GT(many.events.size(), 50u);
  ASSERT_EQ(one.events.size(), many.events.size());
  for (std::size_t i = 0; i < one.events.size(); ++i) {
    EXPECT_TRUE(one.events[i].t_us == many.events[i].t_us && one.events[i].x == many.events[i].x &&
                one.events[i].y == many.events[i].y && one.events[i].on == many.events[i].on);
  }
}

TEST(EventStream, AStillSceneGivesNoEvents) {
  const Stream stream = watch(event_scene(kStill));
  EXPECT_EQ(stream.events.size(), 0u);
  EXPECT_EQ(stream.report.pixels_traced, 40 * 30) << "a pixel was traced again";
}

TEST(EventStream, NoiseOfAStillSceneComesAtItsRates) {
  SceneSpec scene = event_scene(kStill);
  render::EventPixelSettings& pixels = scene.device.camera->events->pixels;
  pixels.leak_rate_hz = 10.0;
  pixels.shot_rate_hz = 0.0;
  constexpr double kSeconds = 0.2;
  constexpr double kPixels = 40 * 30;
  // A leak is a clock with a phase of its own in each pixel.
  const Stream leak = watch(scene);
  EXPECT_NEAR(static_cast<double>(leak.events.size()), 10.0 * kSeconds * kPixels, 1.0 * std::sqrt(kPixels));
  for (const Event& event : leak.events) EXPECT_TRUE(event.on);

  pixels.leak_rate_hz = 0.0;
  pixels.shot_rate_hz = 40.0;
  pixels.shot_half_intensity = 1e18;  // so that all pixels are in the dark for it
  const Stream shot = watch(scene);
  const double mean = 40.0 * kSeconds * kPixels;
  EXPECT_NEAR(static_cast<double>(shot.events.size()), mean, 4.0 * std::sqrt(mean));
  const double on = cv::sum(counts(shot.events, true))[0];
  EXPECT_NEAR(on, mean / 2, 4.0 * std::sqrt(mean / 2));
}

TEST(EventStream, ItsPictureIsRedWhereLightGrew) {
  const std::vector<Event> events = {
      {10, 1, 0, true}, {11, 2, 0, false}, {12, 2, 0, false}, {13, 3, 0, true}, {14, 3, 0, false}};
  const cv::Mat picture = event_picture(events, {5, 1});
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 1)[2], 255);
  EXPECT_LT(picture.at<cv::Vec3b>(0, 1)[0], 255);
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 2)[0], 255);
  EXPECT_LT(picture.at<cv::Vec3b>(0, 2)[2], picture.at<cv::Vec3b>(0, 1)[0]) << "two events are more than one";
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 3), cv::Vec3b(128, 128, 128));
}

/// Event pixels behind a coated gel with dots.
constexpr const char* kCoated = R"(name: coated
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
camera: {type: lens, width: 32, height: 24, pixel_pitch_um: 80, focal_length_mm: 6, f_number: 8, focus_distance_mm: 27,
  lens_position_mm: [0, 0, -28], look_at_mm: [0, 0, 0], exposure_us: 100, active_area_um2: 6000, full_well_e: 100000,
  events: {on_threshold: 0.05, off_threshold: 0.05, dark_e_per_s: 1000}}
coating: {type: matt, albedo: 0.5, print: {grid: [4, 4], spacing_mm: [2, 2], diameter_mm: 0.8, colour: 0.05}}
lamps:
  - {position_mm: [-9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: 0.03}
band_wavelengths_nm: [580]
)";

TEST(EventStream, ACoatedGelsEventsByDirectLightAddUpToTheChangeThatPathsSee) {
  const test::TemporaryFolder folder;
  folder.write("device.yaml", kCoated);
  folder.write("ball.yaml", "{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4, friction: 0.5}");
  folder.write("press.yaml",
               "start_mm: [0, 0, 3.05]\nframe_rate_Hz: 100\nkeys:\n  - {frames: 2, z: {position_mm: 2.4}}\n");
  const SceneSpec scene = read_scene(
      folder.write("scene.yaml",
                   "device: device.yaml\nobject: ball.yaml\nmotion: press.yaml\noutputs: {events: true}\nseed: 4\n"
                   "light: {max_samples: 4096, event_reach_px: 0}\n"));
  const Plan plan = make_plan(scene);
  ASSERT_TRUE(plan.direct_light);
  const auto gel = set_up_gel(scene.device, folder.path());
  Stream stream;
  stream.report = watch_events(scene, plan, *gel, 3, [&](std::span<const Event> some) {
    stream.events.insert(stream.events.end(), some.begin(), some.end());
  });
  ASSERT_GT(stream.events.size(), 200u);
  EXPECT_EQ(stream.report.pixels_traced, stream.report.pictures * 32 * 24);

  cv::Mat net(24, 32, CV_32F, cv::Scalar(0));
  for (const Event& event : stream.events) net.at<float>(event.y, event.x) += event.on ? 1.0f : -1.0f;
  constexpr double kThreshold = 0.05;
  const auto truths = play_motion(scene, plan, *gel);
  const LightSequence paths(scene, plan, *gel, kThreshold);
  const cv::Mat change =
      paths.first(truths.back().press).log_photocurrent - paths.first(truths.front().press).log_photocurrent;
  const cv::Mat off = kThreshold * net - change;
  // A pixel's events lag by a threshold at most; paths have noise of 1 %, direct light errs by some percent.
  EXPECT_LT(cv::norm(off, cv::NORM_L2) / std::sqrt(24.0 * 32), kThreshold);
  EXPECT_LT(cv::norm(off, cv::NORM_INF), 4 * kThreshold);
  EXPECT_LT(std::abs(cv::mean(off)[0]), 0.2 * kThreshold);
}

}  // namespace
}  // namespace touchstone::sim
