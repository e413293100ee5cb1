#include "touchstone/testing.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "core/error.h"
#include "core/transform.h"
#include "core/units.h"
#include "sim/press/first_touch.h"
#include "tests/support/small_job.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Made once: its gel and light take longest.
const VirtualSensor& coated() {
  static const test::TemporaryFolder cache;
  static const VirtualSensor one(test::small_coated_device(), cache.path());
  return one;
}

const Touch& held_ball() {
  static const Touch held = coated().press(ball(8), {.place_mm = {0.5, -0.3}, .force_N = 0.3}, {.noise_seed = 7});
  return held;
}

/// What a matcher says of something that doesn't match; "matches" of what does.
template <typename Matcher, typename Estimate>
std::string complaint(const Matcher& matcher, const Estimate& estimate) {
  ::testing::StringMatchResultListener listener;
  return ::testing::ExplainMatchResult(matcher, estimate, &listener) ? "matches" : listener.str();
}

template <typename Act>
std::string error_of(const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(VirtualSensor, AHeldForceIsThatForceWithAnErrorBar) {
  const Touch& held = held_ball();
  EXPECT_NEAR(held.force_N().z(), 0.3, 1e-5);
  EXPECT_GT(held.error.force.z(), 0.0);
  EXPECT_LT(held.error.force.z(), 0.1 * 0.3);
  // A ball's pressure is symmetric about its middle, so its force goes through there.
  EXPECT_NEAR(-held.torque_Nmm().y() / held.force_N().z(), 0.5, 0.02);
  EXPECT_NEAR(held.torque_Nmm().x() / held.force_N().z(), -0.3, 0.02);
  EXPECT_GT(cv::countNonZero(held.contact), 20);
  EXPECT_EQ(held.what, "small-coated, ball of 8 mm at (0.5, -0.3) mm with 0.3 N");
}

TEST(VirtualSensor, TheDepthThatAForceTookGivesThatForce) {
  const TouchObject object = coated().object(ball(8));
  const Touch by_force = coated().press(object, {.place_mm = {0.5, -0.3}, .force_N = 0.3}, {.picture = false});
  const double depth = 4.0 - by_force.press.gel_from_object.translation.z();
  EXPECT_GT(depth, 0.05);
  const Touch by_depth = coated().press(object, {.place_mm = {0.5, -0.3}, .depth_mm = depth}, {.picture = false});
  EXPECT_NEAR(by_depth.force_N().z(), 0.3, 1e-3);
  EXPECT_TRUE(by_depth.frame.empty()) << "no picture was asked for";
}

TEST(VirtualSensor, ADragShearsAlongIt) {
  const Touch held =
      coated().press(coated().object(ball(8, 0.8)), {.force_N = 0.3, .drag_mm = {0.05, 0}}, {.picture = false});
  EXPECT_GT(held.force_N().x(), -0.8 * 0.3 - 1e-6);
  EXPECT_LT(held.force_N().x(), -0.01) << "the gel holds the object back";
  EXPECT_NEAR(held.force_N().z(), 0.3, 1e-5);
}

TEST(VirtualSensor, FramesAreAPureFunctionOfHoldAndNoise) {
  const PressSpec hold{.place_mm = {0.5, -0.3}, .force_N = 0.3};
  const Touch again = coated().press(ball(8), hold, {.noise_seed = 7});
  const Touch other = coated().press(ball(8), hold, {.noise_seed = 8});
  EXPECT_EQ(cv::norm(again.frame, held_ball().frame, cv::NORM_INF), 0.0);
  EXPECT_NE(cv::norm(other.frame, held_ball().frame, cv::NORM_INF), 0.0);
  EXPECT_NE(cv::norm(again.background, coated().rest(7).frame, cv::NORM_INF), 0.0) << "noise of its own";
  EXPECT_EQ(cv::countNonZero(coated().rest().contact), 0);
}

TEST(VirtualSensor, AnObjectTouchesWhereItsLowestPointIs) {
  const sim::GelSpec& gel = coated().device().gel;
  const auto turned = [](double x, double y, double z) {
    return rotation_from_xyz(Eigen::Vector3d(x, y, z) * kRadiansPerDegree);
  };
  EXPECT_NEAR(sim::first_touch(gel, fem::SphereShape{1.5}, {0.21, 0.4}, turned(0, 0, 0)), 1.5, 1e-4);
  const double tilt = 10 * kRadiansPerDegree;
  EXPECT_NEAR(sim::first_touch(gel, fem::RoundedCylinder{1.0, 0.0, 5.0}, {0, 0}, turned(10, 0, 0)), std::sin(tilt),
              1e-3);
  // Over the pad's edge (6 mm) the ball touches with its flank.
  EXPECT_NEAR(sim::first_touch(gel, fem::SphereShape{1.5}, {6.9, 0}, turned(0, 0, 0)), std::sqrt(1.5 * 1.5 - 0.81),
              1e-3);
}

TEST(VirtualSensor, HoldsThatCannotBeAreRefusedByName) {
  const TouchObject object = coated().object(ball(8));
  const auto refused = [&](const PressSpec& hold) { return error_of([&] { coated().press(object, hold); }); };
  EXPECT_THAT(refused({}), AllOf(HasSubstr("small-coated, ball of 8 mm at (0, 0) mm"), HasSubstr("none of force_N")));
  EXPECT_THAT(refused({.force_N = 1, .depth_mm = 1}), HasSubstr("several of force_N"));
  EXPECT_THAT(refused({.force_N = -1}), HasSubstr("force_N is -1"));
  EXPECT_THAT(refused({.depth_mm = std::numeric_limits<double>::quiet_NaN()}), HasSubstr("depth_mm is nan"));
  EXPECT_THAT(refused({.place_mm = {40, 0}, .force_N = 1}), HasSubstr("isn't over the gel"));
  EXPECT_THAT(refused({.depth_mm = 9}), HasSubstr("9 mm deep: "));
  sim::ObjectSpec soft = ball(8);
  soft.elastic = sim::ElasticSpec{1.0, 0.49, 0.5, {}, {}, {}};
  EXPECT_THAT(error_of([&] { coated().session(coated().object(soft)); }), HasSubstr("is elastic"));
  sim::DeviceSpec blind = test::small_coated_device();
  blind.camera.reset();
  EXPECT_THAT(error_of([&] { VirtualSensor(blind, "/nowhere").rest(); }), HasSubstr("has no camera"));
}

TEST(VirtualSensor, AClearDeviceShowsWhatPressesItsBeads) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("clear.yaml", std::string(test::kSmallDevice) + test::kSmallCamera);
  const std::string cache = (folder.path() / "cache").string();
  setenv("TOUCHSTONE_CACHE", cache.c_str(), 1);
  const VirtualSensor& clear = device(file.string());
  unsetenv("TOUCHSTONE_CACHE");
  EXPECT_EQ(&clear, &device(file.string())) << "kept";
  const Touch held = clear.press(ball(4), {.force_N = 0.2}, {.noise_seed = 3});
  EXPECT_NEAR(held.force_N().z(), 0.2, 1e-5);
  EXPECT_TRUE(held.height.empty());
  EXPECT_GT(cv::countNonZero(held.contact), 5);
  EXPECT_NE(cv::norm(held.frame, held.background, cv::NORM_INF), 0.0);
  EXPECT_THAT(held.press.bead_displacement, AreBeadsOf(held, {}));
  EXPECT_LT(held.press.bead_displacement(0, 2), 0.0) << "pressed in";
  Eigen::MatrixX3d wrong = held.press.bead_displacement;
  wrong(2, 1) += 1.0;
  EXPECT_THAT(complaint(AreBeadsOf(held, {.absolute = 0.5}), wrong), HasSubstr("bead 2 went"));
  EXPECT_THAT(error_of([&] { lab::compare_heights(cv::Mat(), held, {}); }), HasSubstr("has no height"));
  EXPECT_EQ(clear.rest().frame.size(), held.frame.size());
}

TEST(Matchers, AllowTheToleranceAndTheTruthsErrorBar) {
  const Touch& held = held_ball();
  const double sigma = held.error.force.z();
  const Eigen::Vector3d z(0, 0, 1);
  EXPECT_THAT(held.force_N(), IsForceOf(held, {}));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() + 1.9 * sigma * z), IsForceOf(held, {}));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() - 2.1 * sigma * z), Not(IsForceOf(held, {})));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() - 2.1 * sigma * z), IsForceOf(held, {.standard_errors = 2.2}));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() + 0.04 * z), IsForceOf(held, {.absolute = 0.05}));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() + 0.04 * z), IsForceOf(held, {.relative = 0.15}));
  EXPECT_THAT(Eigen::Vector3d(held.force_N() + 0.06 * z),
              Not(IsForceOf(held, {.absolute = 0.01, .standard_errors = 0})));
  EXPECT_THAT((cv::Vec3d(0, 0, 0.3)), IsForceOf(held, {.absolute = 0.02}));
  EXPECT_THAT((std::array<double, 3>{0, 0, 0.3}), IsForceOf(held, {.absolute = 0.02}));
  EXPECT_THAT(0.3, IsNormalForceOf(held, {.absolute = 0.001}));
  EXPECT_THAT(0.4, Not(IsNormalForceOf(held, {.absolute = 0.01})));
  const Eigen::Vector3d unknown(0, std::numeric_limits<double>::quiet_NaN(), 0.3);
  EXPECT_THAT(complaint(IsForceOf(held, {.absolute = 1e9}), unknown), HasSubstr("y is off by +nan"));
}

TEST(Matchers, SayWhatIsOffByHowMuchAndWhatIsAllowed) {
  const Touch& held = held_ball();
  const std::string says = complaint(IsForceOf(held, {.absolute = 0.1}), cv::Vec3d(0, 0, 0.61));
  EXPECT_THAT(says, HasSubstr("force (0.000, 0.000, 0.610) N against ("));
  EXPECT_THAT(says, HasSubstr("of small-coated, ball of 8 mm at (0.5, -0.3) mm with 0.3 N: z is off by +0.310 N"));
  EXPECT_THAT(says, HasSubstr("(0.1 + 2 x "));
  EXPECT_THAT(error_of([&] { lab::compare_force({0, 0, 0}, held, {.absolute = -1}); }), HasSubstr("absolute -1"));
}

TEST(Matchers, HoldHeightsAndContactsAgainstTheTruth) {
  const Touch& held = held_ball();
  EXPECT_THAT(held.height, IsHeightOf(held, {}));
  const cv::Mat shifted = held.height + 0.05;
  EXPECT_THAT(shifted, IsHeightOf(held, {.absolute = 0.0501}));
  EXPECT_THAT(complaint(IsHeightOf(held, {.absolute = 0.02}), shifted), HasSubstr("off by 0.0500 mm in the mean"));
  cv::Mat doubles;
  held.height.convertTo(doubles, CV_64F);
  EXPECT_THAT(doubles, IsHeightOf(held, {}));
  cv::Mat holed = held.height.clone();
  holed.at<float>(30, 40) = std::numeric_limits<float>::infinity();
  EXPECT_THAT(complaint(IsHeightOf(held, {.absolute = 1}), holed), HasSubstr("; 1 of "));
  const cv::Mat small = cv::Mat::zeros(3, 4, CV_32F);
  EXPECT_THAT(error_of([&] { lab::compare_heights(small, held, {}); }), HasSubstr("has 4 x 3 pixels"));

  EXPECT_THAT(held.contact, IsContactOf(held, 1.0));
  const cv::Mat none = cv::Mat::zeros(held.contact.size(), CV_8U);
  EXPECT_THAT(none, Not(IsContactOf(held, 0.01)));
  EXPECT_THAT(complaint(IsContactOf(held, 0.5), none), HasSubstr("overlap by 0.000, wanted is 0.5 or more"));
  EXPECT_THAT(none, IsContactOf(coated().rest(), 1.0)) << "nothing and nothing agree";
}

TEST(Matchers, KeepTheFramesThatFailedWhereAsked) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(keep_frames(held_ball()), "");
  setenv("TOUCHSTONE_FAILED_FRAMES", (folder.path() / "failed").c_str(), 1);
  const std::string says = complaint(IsNormalForceOf(held_ball(), {}), 9.0);
  unsetenv("TOUCHSTONE_FAILED_FRAMES");
  const auto file = folder.path() / "failed" / "Matchers.KeepTheFramesThatFailedWhereAsked-1.png";
  EXPECT_THAT(says, HasSubstr("; its frame is " + file.string()));
  EXPECT_GT(std::filesystem::file_size(file), 1000u);
}

TEST(Matchers, PicturesArePrintedByTheirSize) {
  EXPECT_EQ(::testing::PrintToString(held_ball().frame), "80 x 60 pixels of CV_8UC1");
}

TEST(ShippedThings, AreFoundByNameOrListed) {
  EXPECT_EQ(object("ball-8mm").shape.radius_mm, 4.0);
  EXPECT_THAT(error_of([] { object("ball-8m"); }),
              AllOf(HasSubstr("did you mean 'ball-8mm'?"), HasSubstr("probe-6mm")));
  EXPECT_THAT(error_of([] { device("gelsight"); }), HasSubstr("gelsight-flat"));
  EXPECT_THAT(error_of([] { ball(0); }), HasSubstr("diameter is 0"));
}

}  // namespace
}  // namespace touchstone::testing
