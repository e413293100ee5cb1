#include "render/imager/automatic_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "tests/render/imager/imager_laws.h"

namespace touchstone::render {
namespace {

constexpr double kTime_s = 0.4;

/// Three bands, each seen by one channel alone; a level of 1 is the full well.
Imager colour_imager() {
  Imager imager;
  imager.bits = 10;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency = Eigen::Matrix3d::Identity() * 0.5;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 600.0, 550.0, 450.0;
  imager.full_well_e = 20000.0;
  imager.read_noise_e = 3.0;
  imager.bayer = BayerPattern::rggb;
  imager.black_level_DN = 23.0;
  imager.gain_DN_per_e = (1023.0 - 23.0) / 20000.0;
  return imager;
}

Imager automatic_imager() {
  Imager imager = colour_imager();
  imager.auto_exposure = AutoExposure{.time_constant_s = kTime_s, .mean_level = 0.2, .lowest = 0.01, .highest = 100.0};
  imager.auto_white_balance = AutoWhiteBalance{.time_constant_s = kTime_s, .lowest = 0.1, .highest = 10.0};
  return imager;
}

/// Light that gives the channels these levels, R, G, B, from half of it on the left to one and a half on the right, in
/// 20 steps of two columns: each colour of a mosaic sees the same.
cv::Mat light_of(const Imager& imager, const Eigen::Vector3d& levels) {
  const QuantumEfficiency per_light = response_of(imager).electrons_per_irradiance;
  cv::Mat light(30, 40, CV_32FC3);
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        light.at<cv::Vec3f>(y, x)[c] =
            static_cast<float>((0.5 + x / 2 / 19.0) * levels[c] * imager.full_well_e / per_light(c, c));
      }
    }
  }
  return light;
}

TEST(Metering, ReadsTheMeanLevelsAndHowTheyClip) {
  const Imager imager = colour_imager();
  const Metering metering = metering_of(light_of(imager, {0.1, 0.2, 0.4}), imager);
  EXPECT_NEAR(metering.mean(0, 1.0), 0.1, 1e-6);
  EXPECT_NEAR(metering.mean(1, 1.0), 0.2, 1e-6);
  EXPECT_NEAR(metering.mean(2, 1.0), 0.4, 1e-6);
  EXPECT_NEAR(metering.mean(1.0), (0.1 + 2.0 * 0.2 + 0.4) / 4.0, 1e-6);
  // Blue at 2.5 times the exposure is 0.5 + k / 19: its first ten steps have a mean of 0.7368, the others clip at 1.
  EXPECT_NEAR(metering.mean(2, 2.5), 0.5 * (0.7368 + 1.0), 1e-4);
  EXPECT_NEAR(metering.mean(2, 1e6), 1.0, 1e-12);
}

// A mean of (0.1 + 0.2 + 0.2 + 0.4) / 4 = 0.225 is to be 0.2: the factor is 0.889. Grey world: red's gain makes 0.1 to
// green's 0.2, 2; blue's 0.5.
TEST(AutomaticControl, SettlesWhereTheMeanIsAskedForAndGrey) {
  const Imager imager = automatic_imager();
  const cv::Mat light = light_of(imager, {0.1, 0.2, 0.4});
  const ControlState state = settled(imager, metering_of(light, imager));
  EXPECT_NEAR(state.exposure, 0.2 / 0.225, 1e-6);
  EXPECT_NEAR(state.gains[0], 2.0, 1e-5);
  EXPECT_EQ(state.gains[1], 1.0);
  EXPECT_NEAR(state.gains[2], 0.5, 1e-5);
  // And that is what the picture shows: a mean of 0.2 x 2^10 in the raw numbers, grey in the developed ones.
  const Imager set = controlled(imager, state);
  const cv::Mat raw = expose(light, set, 3, 1);
  EXPECT_NEAR(cv::mean(raw)[0], 23.0 + 0.2 * 1000.0, 1.0);
  const cv::Mat even(light.size(), light.type(), cv::mean(light));  // no slope for the filling in to see
  const cv::Scalar shown = cv::mean(develop(expose(even, set, 3, 1), set));
  EXPECT_NEAR(shown[0], shown[1], 0.5);
  EXPECT_NEAR(shown[2], shown[1], 0.5);
}

TEST(AutomaticControl, GreyWorldIsOnTopOfTheFixedGains) {
  Imager imager = automatic_imager();
  imager.white_balance = {1.6, 1.0, 1.3};
  const ControlState state = settled(imager, metering_of(light_of(imager, {0.1, 0.2, 0.4}), imager));
  EXPECT_NEAR(state.gains[0], 2.0 / 1.6, 1e-5);
  EXPECT_NEAR(state.gains[2], 0.5 / 1.3, 1e-5);
  EXPECT_NEAR(controlled(imager, state).white_balance[0], 2.0, 1e-5);
}

// The light becomes twice as much at t = 0. The exposure's factor goes from f to f / 2 along
// log(factor) = log(f / 2) + log(2) exp(-t / 0.4 s), whatever the frames' times.
TEST(AutomaticControl, FollowsAStepOfLightAlongAnExponential) {
  const Imager imager = automatic_imager();
  const ControlState before = settled(imager, metering_of(light_of(imager, {0.05, 0.1, 0.15}), imager));
  const Metering after = metering_of(light_of(imager, {0.1, 0.2, 0.3}), imager);  // at f up to 0.9: nothing clips
  for (const double interval_s : {1.0 / 30.0, 0.1}) {
    ControlState state = before;
    for (int frame = 1; frame * interval_s < 2.0; ++frame) {
      state = next_state(imager, state, after, interval_s);
      const double wanted = before.exposure / 2.0 * std::pow(2.0, std::exp(-frame * interval_s / kTime_s));
      ASSERT_NEAR(state.exposure, wanted, 2e-5 * wanted) << frame;
      EXPECT_NEAR(state.gains[0], before.gains[0], 1e-4) << "its colour is the same";
    }
  }
}

// Red and blue change places: the gains of 2 and 2/3 go to 2/3 and 2.
TEST(AutomaticControl, FollowsAStepOfColourAlongAnExponential) {
  const Imager imager = automatic_imager();
  const ControlState before = settled(imager, metering_of(light_of(imager, {0.05, 0.1, 0.15}), imager));
  const Metering after = metering_of(light_of(imager, {0.15, 0.1, 0.05}), imager);
  ControlState state = before;
  for (int frame = 1; frame < 60; ++frame) {
    state = next_state(imager, state, after, 1.0 / 30.0);
    const double left = std::exp(-frame / 30.0 / kTime_s);
    EXPECT_NEAR(state.gains[0], 2.0 / 3.0 * std::pow(3.0, left), 1e-4);
    EXPECT_NEAR(state.gains[2], 2.0 * std::pow(1.0 / 3.0, left), 1e-4);
    EXPECT_NEAR(state.exposure, before.exposure, 1e-4);
  }
}

// A picture that is all white reads 1 whatever the light, so the first steps are those to 0.2 of the exposure only; the
// camera gets there later than the exponential, but gets there: to the factor 0.2 / 50.
TEST(AutomaticControl, IsSlowerWhereThePictureIsWhite) {
  Imager imager = automatic_imager();
  imager.auto_exposure->lowest = 0.001;
  const Metering white = metering_of(light_of(imager, {50.0, 50.0, 50.0}), imager);
  ControlState state;
  state = next_state(imager, state, white, kTime_s);
  EXPECT_NEAR(state.exposure, std::pow(0.2, 1.0 - std::exp(-1.0)), 1e-6);
  for (int frame = 0; frame < 400; ++frame) state = next_state(imager, state, white, 0.1);
  EXPECT_NEAR(state.exposure, 0.2 / 50.0, 1e-4 * state.exposure);
  EXPECT_NEAR(settled(imager, white).exposure, state.exposure, 1e-4 * state.exposure);
}

TEST(AutomaticControl, StaysWithinItsLimits) {
  Imager imager = automatic_imager();
  imager.auto_exposure->lowest = 0.5;
  imager.auto_exposure->highest = 2.0;
  imager.auto_white_balance->lowest = 0.8;
  imager.auto_white_balance->highest = 1.25;
  const ControlState dark = settled(imager, metering_of(light_of(imager, {0.0, 0.0, 0.0}), imager));
  EXPECT_EQ(dark.exposure, 2.0);
  EXPECT_EQ(dark.gains, Eigen::Vector3d::Ones()) << "no light has no colour";
  EXPECT_EQ(settled(imager, metering_of(light_of(imager, {5.0, 5.0, 5.0}), imager)).exposure, 0.5);
  const ControlState tinted = settled(imager, metering_of(light_of(imager, {0.1, 0.2, 0.4}), imager));
  EXPECT_EQ(tinted.gains[0], 1.25);
  EXPECT_EQ(tinted.gains[2], 0.8);
}

TEST(AutomaticControl, WithoutItNothingIsSet) {
  const Imager imager = colour_imager();
  EXPECT_FALSE(is_automatic(imager));
  const cv::Mat light = light_of(imager, {0.1, 0.2, 0.4});
  const ControlState state = settled(imager, metering_of(light, imager));
  EXPECT_EQ(state.exposure, 1.0);
  EXPECT_EQ(state.gains, Eigen::Vector3d::Ones());
  EXPECT_TRUE(same_bytes(expose(light, controlled(imager, state), 1, 1), expose(light, imager, 1, 1)));
}

}  // namespace
}  // namespace touchstone::render
