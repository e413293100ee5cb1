// A camera that sets itself, from frame to frame of a motion and at the end of a press.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "sim/press/play_motion.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/sim/press/moving_scene.h"
#include "tests/support/small_scene.h"

namespace touchstone::sim {
namespace {

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

constexpr double kTime_s = 0.08;  // some eight frames

constexpr double kLevel = 0.05;           // a lamp's reflection is 13 times as bright as the mean: nothing clips
constexpr double kMean = 255.0 * kLevel;  // of the delivered numbers

/// A ball that comes down into a clear gel and makes the picture a sixth darker.
SceneSpec automatic_scene() {
  SceneSpec scene = moving_scene("  - {frames: 6, z: {position_mm: 1.5}}\n  - {frames: 6, z: {position_mm: 1.5}}\n");
  scene.device.camera->auto_exposure =
      render::AutoExposure{.time_constant_s = kTime_s, .mean_level = kLevel, .lowest = 1e-3, .highest = 20.0};
  scene.device.camera->full_well_e = 1e7;
  scene.effects.motion_blur = Switch::off;
  return scene;
}

struct Played {
  SceneSpec scene = automatic_scene();
  Plan plan = make_plan(scene);
  std::vector<Truth> truths = play_motion(scene, plan, *moving_gel());
};

const Played& played() {
  static const Played one;
  return one;
}

// The first frame has watched its own light for long: its mean is 0.05 of full scale. Each later one is set
// by the light of those before: log(f_k) goes to log(f*) of light k - 1 by 1 - exp(-dt / 0.08 s).
TEST(AutomaticCamera, CarriesItsStateFromFrameToFrame) {
  const Played& p = played();
  ASSERT_TRUE(p.plan.auto_exposure);
  SceneSpec scene = p.scene;
  scene.outputs.radiance = true;
  const VirtualCamera camera(scene, make_plan(scene), *moving_gel(), p.truths);
  const render::Imager imager = sim::imager(scene.device, p.plan.bands, true);
  render::ControlState expected;
  cv::Mat before;
  double first = 0.0, last = 0.0;
  for (std::size_t k = 0; k < p.truths.size(); ++k) {
    const Capture capture = camera.capture(p.truths[k]);
    if (k == 0) {
      expected = render::settled(imager, render::metering_of(capture.radiance, imager));
      EXPECT_NEAR(cv::mean(capture.frame)[0], kMean, 0.4);
      first = expected.exposure;
    } else {
      const double seconds = 1e-6 * static_cast<double>(p.truths[k].t_us - p.truths[k - 1].t_us);
      expected = render::next_state(imager, expected, render::metering_of(before, imager), seconds);
    }
    // The meter's preview has noise of its own: 0.6 % of its mean.
    EXPECT_NEAR(capture.control.exposure, expected.exposure, 0.03 * expected.exposure) << k;
    last = capture.control.exposure;
    before = capture.radiance;
  }
  EXPECT_GT(std::log(last / first), 0.06) << "the light has become less, and the exposure longer";
}

TEST(AutomaticCamera, GivesTheSameBytesInAnyOrderWholeOrInPartsOnAnyThreads) {
  const Played& p = played();
  const VirtualCamera whole(p.scene, p.plan, *moving_gel(), p.truths);
  std::vector<cv::Mat> frames;
  for (const Truth& truth : p.truths) frames.push_back(whole.capture(truth).frame);
  // Backwards, as another machine may take what is left; the frame's number is another's in a data set.
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const VirtualCamera again(p.scene, p.plan, *moving_gel(), p.truths);
  for (std::size_t k = p.truths.size(); k-- > 0;) {
    EXPECT_TRUE(same(again.capture(p.truths[k]).frame, frames[k])) << k;
    Truth renumbered = p.truths[k];
    renumbered.frame += 1000;
    EXPECT_EQ(again.capture(renumbered).control.exposure, whole.capture(p.truths[k]).control.exposure) << k;
  }
  // With the motion's beginning alone the states up to there are the same.
  const VirtualCamera begun(p.scene, p.plan, *moving_gel(), std::span(p.truths).first(5));
  EXPECT_EQ(begun.capture(p.truths[4]).control.exposure, whole.capture(p.truths[4]).control.exposure);
}

TEST(AutomaticCamera, AStateWithoutAPastIsWatchedForLong) {
  const Played& p = played();
  const VirtualCamera camera(p.scene, p.plan, *moving_gel(), std::span<const Truth>());
  EXPECT_NEAR(cv::mean(camera.capture(p.truths.back()).frame)[0], kMean, 0.2);
}

TEST(AutomaticCamera, WithoutItFramesAreWhatTheyAreWithoutTheField) {
  const Played& p = played();
  SceneSpec fixed = p.scene;
  fixed.device.camera->auto_exposure.reset();
  const VirtualCamera plain(fixed, make_plan(fixed), *moving_gel(), p.truths);
  // A camera whose limits leave it no choice, but for a millionth, has the fixed exposure.
  SceneSpec held = p.scene;
  held.device.camera->auto_exposure->lowest = 1.0;
  held.device.camera->auto_exposure->highest = 1.0 + 1e-9;
  const VirtualCamera bound(held, make_plan(held), *moving_gel(), p.truths);
  EXPECT_EQ(plain.capture(p.truths.back()).control.exposure, 1.0);
  EXPECT_TRUE(same(plain.capture(p.truths.back()).frame, bound.capture(p.truths.back()).frame));
}

/// A coated device whose camera sets its exposure within 0.5 s.
const VirtualSensor& sensor() {
  static const test::TemporaryFolder cache;
  static const VirtualSensor one = [] {
    DeviceSpec device = test::small_coated_device();
    device.camera->auto_exposure =
        render::AutoExposure{.time_constant_s = 0.5, .mean_level = 0.2, .lowest = 0.01, .highest = 100.0};
    return VirtualSensor(device, cache.path());
  }();
  return one;
}

ObjectSpec ball() {
  ObjectSpec object;
  object.name = "ball";
  object.shape.radius_mm = 3.0;
  return object;
}

Touch pressed(std::optional<double> seconds) {
  PressSpec press;
  press.depth_mm = 0.8;
  press.seconds = seconds;
  return sensor().press(ball(), press);
}

// The untouched device is shown with a mean of 51. So is a press that has lasted for 60 time constants. After one of
// them, the exposure's logarithm has gone 1 - 1/e of the way; after a frame without `seconds`, 1 - exp(-1/15).
TEST(AutomaticSensor, APressShowsWhatTheCameraHasSetSinceTheTouch) {
  const double rest = sensor().rest().control.exposure;
  EXPECT_NEAR(cv::mean(sensor().background(1))[0], 51.0, 1.0);
  const Touch held = pressed(30.0);
  EXPECT_NEAR(cv::mean(held.frame)[0], 51.0, 1.0);
  const double way = std::log(held.control.exposure / rest);
  ASSERT_GT(std::abs(way), 1e-3) << "the press changes the light";
  EXPECT_NEAR(std::log(pressed(0.5).control.exposure / rest), (1.0 - std::exp(-1.0)) * way, 0.02 * std::abs(way));
  EXPECT_NEAR(std::log(pressed({}).control.exposure / rest), (1.0 - std::exp(-1.0 / 15.0)) * way, 0.02 * std::abs(way));
  EXPECT_TRUE(same(held.frame, pressed(30.0).frame));
  EXPECT_EQ(sensor().rest().control.exposure, rest);
}

TEST(AutomaticSensor, CaptureAndIdealAreOfTheSameExposure) {
  const TouchObject object = sensor().object(ball());
  PressSpec press;
  press.depth_mm = 0.8;
  const Touch touch = sensor().press(object, press);
  const Touch held = sensor().capture(object, touch.press, 1);
  EXPECT_NEAR(cv::mean(held.frame)[0], 51.0, 1.0);
  cv::Mat noise;
  cv::subtract(sensor().ideal(object, touch), touch.frame, noise, {}, CV_64F);
  EXPECT_NEAR(cv::mean(noise)[0], 0.0, 0.3) << "the frame but for its noise";
}

}  // namespace
}  // namespace touchstone::sim
