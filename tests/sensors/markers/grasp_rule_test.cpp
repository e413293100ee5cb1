#include "sensors/markers/grasp_rule.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

GraspRuleSettings settings() {
  GraspRuleSettings s;
  s.touch_height_mm = 0.1;
  s.touch_frames = 2;
  s.approach_step_mm = 0.02;
  s.longest_approach_mm = 0.1;
  s.slip_step_mm = 0.05;
  s.settle_frames = 3;
  s.most_slip_travel_mm = 0.12;
  s.lost_height_mm = 0.03;
  s.lost_frames = 2;
  return s;
}

GraspReading reading(double height, bool slip = false, bool lifted = false) {
  GraspReading s;
  s.height_max_mm = height;
  s.slip = slip;
  s.lifted = lifted;
  return s;
}

GraspRule lifting(const GraspRuleSettings& s = settings()) {
  GraspRule rule(s);
  for (int frame = 0; frame < s.touch_frames; ++frame) rule.next(reading(0.2));
  EXPECT_EQ(rule.phase(), GraspPhase::lifting);
  return rule;
}

TEST(GraspRule, ClosesStepByStepUntilTouch) {
  GraspRule rule(settings());
  for (int frame = 1; frame <= 3; ++frame) {
    const GraspCommand command = rule.next(reading(0.05));
    EXPECT_EQ(command.phase, GraspPhase::approaching);
    EXPECT_EQ(command.close_by_mm, 0.02);
    EXPECT_FALSE(command.lift);
    EXPECT_NEAR(rule.approach_travel_mm(), 0.02 * frame, 1e-15);
  }
}

TEST(GraspRule, ItTakesSeveralFramesToBelieveATouch) {
  GraspRule rule(settings());
  GraspCommand command = rule.next(reading(0.11));
  EXPECT_EQ(command.phase, GraspPhase::touched);
  EXPECT_EQ(command.close_by_mm, 0.0);
  EXPECT_FALSE(command.lift);
  command = rule.next(reading(0.11));
  EXPECT_EQ(command.phase, GraspPhase::lifting);
  EXPECT_TRUE(command.lift);
}

TEST(GraspRule, AfterAFalseTouchItGoesOnClosing) {
  GraspRule rule(settings());
  EXPECT_EQ(rule.next(reading(0.5)).phase, GraspPhase::touched);
  const GraspCommand command = rule.next(reading(0.0));
  EXPECT_EQ(command.phase, GraspPhase::approaching);
  EXPECT_EQ(command.close_by_mm, 0.02);
  EXPECT_EQ(rule.next(reading(0.5)).phase, GraspPhase::touched);  // and counts anew
}

TEST(GraspRule, TheThresholdItselfIsNoTouch) {
  GraspRule rule(settings());
  EXPECT_EQ(rule.next(reading(0.1)).phase, GraspPhase::approaching);
}

TEST(GraspRule, WithoutTouchItGivesUpAtTheLongestApproach) {
  GraspRule rule(settings());
  for (int frame = 0; frame < 5; ++frame) EXPECT_EQ(rule.next(reading(0.0)).phase, GraspPhase::approaching);
  EXPECT_NEAR(rule.approach_travel_mm(), 0.1, 1e-12);  // all of it
  const GraspCommand command = rule.next(reading(0.0));
  EXPECT_EQ(command.phase, GraspPhase::nothing_there);
  EXPECT_EQ(command.close_by_mm, 0.0);
  EXPECT_EQ(rule.next(reading(0.5)).phase, GraspPhase::nothing_there);  // for good
}

TEST(GraspRule, SlipBeforeTouchMeansNothing) {
  GraspRule rule(settings());
  EXPECT_EQ(rule.next(reading(0.0, true)).close_by_mm, 0.02);
  EXPECT_EQ(rule.slip_reactions(), 0);
}

TEST(GraspRule, WithoutSlipTheWidthStays) {
  GraspRule rule = lifting();
  for (int frame = 0; frame < 20; ++frame) {
    const GraspCommand command = rule.next(reading(0.2));
    EXPECT_EQ(command.close_by_mm, 0.0);
    EXPECT_EQ(command.phase, GraspPhase::lifting);
    EXPECT_TRUE(command.lift);
  }
}

TEST(GraspRule, SlipIsAnsweredOnceAndThenGivenTimeToShow) {
  GraspRule rule = lifting();
  EXPECT_EQ(rule.next(reading(0.2, true)).close_by_mm, 0.05);
  for (int frame = 0; frame < 3; ++frame) EXPECT_EQ(rule.next(reading(0.2, true)).close_by_mm, 0.0);
  EXPECT_EQ(rule.next(reading(0.2, true)).close_by_mm, 0.05);
  EXPECT_EQ(rule.slip_reactions(), 2);
}

TEST(GraspRule, TheLastStepEndsAtTheLimitAndSlipBeyondItIsReported) {
  GraspRuleSettings s = settings();
  s.settle_frames = 0;
  GraspRule rule = lifting(s);
  EXPECT_EQ(rule.next(reading(0.2, true)).close_by_mm, 0.05);
  EXPECT_EQ(rule.next(reading(0.2, true)).close_by_mm, 0.05);
  EXPECT_NEAR(rule.next(reading(0.2, true)).close_by_mm, 0.02, 1e-12);
  const GraspCommand command = rule.next(reading(0.2, true));
  EXPECT_EQ(command.phase, GraspPhase::slipping);
  EXPECT_FALSE(command.lift);
  EXPECT_NEAR(rule.slip_travel_mm(), 0.12, 1e-12);
}

TEST(GraspRule, AForceAtItsLimitForbidsToCloseFurther) {
  GraspRuleSettings s = settings();
  s.most_normal_force_N = 2.0;
  GraspRule rule = lifting(s);
  GraspReading strong = reading(0.2, true);
  strong.normal_force_N = 1.9;
  EXPECT_EQ(rule.next(strong).close_by_mm, 0.05);
  strong.normal_force_N = 2.0;
  for (int frame = 0; frame < 3; ++frame) EXPECT_EQ(rule.next(strong).phase, GraspPhase::lifting);
  EXPECT_EQ(rule.next(strong).phase, GraspPhase::slipping);
}

TEST(GraspRule, AForceAtItsLimitWithoutSlipIsNoHarm) {
  GraspRuleSettings s = settings();
  s.most_normal_force_N = 2.0;
  GraspRule rule = lifting(s);
  GraspReading strong = reading(0.2);
  strong.normal_force_N = 5.0;
  EXPECT_EQ(rule.next(strong).phase, GraspPhase::lifting);
}

TEST(GraspRule, HoldsWhenLiftedAndCalmForTheCamerasLag) {
  GraspRule rule = lifting();
  for (int frame = 0; frame < 3; ++frame) EXPECT_EQ(rule.next(reading(0.2, false, true)).phase, GraspPhase::lifting);
  EXPECT_EQ(rule.next(reading(0.2, false, true)).phase, GraspPhase::holding);
  // What is held may slip yet, and is gripped tighter.
  const GraspCommand command = rule.next(reading(0.2, true, true));
  EXPECT_EQ(command.phase, GraspPhase::lifting);
  EXPECT_EQ(command.close_by_mm, 0.05);
  for (int frame = 0; frame < 3; ++frame) EXPECT_EQ(rule.next(reading(0.2, false, true)).phase, GraspPhase::lifting);
  EXPECT_EQ(rule.next(reading(0.2, false, true)).phase, GraspPhase::holding);
}

TEST(GraspRule, ATouchThatGoesIsAnObjectLost) {
  GraspRule rule = lifting();
  EXPECT_EQ(rule.next(reading(0.0)).phase, GraspPhase::lifting);
  EXPECT_EQ(rule.next(reading(0.05)).phase, GraspPhase::lifting);  // back again
  EXPECT_EQ(rule.next(reading(0.0)).phase, GraspPhase::lifting);
  const GraspCommand command = rule.next(reading(0.0, true));
  EXPECT_EQ(command.phase, GraspPhase::lost);
  EXPECT_FALSE(command.lift);
  EXPECT_TRUE(has_ended_badly(rule.phase()));
}

TEST(GraspRule, WithoutItsSecondStepSlipIsSeenAndLeft) {
  GraspRuleSettings s = settings();
  s.react_to_slip = false;
  GraspRule rule = lifting(s);
  for (int frame = 0; frame < 10; ++frame) EXPECT_EQ(rule.next(reading(0.2, true, true)).close_by_mm, 0.0);
  EXPECT_EQ(rule.phase(), GraspPhase::lifting);  // never held while it slips
}

TEST(GraspRule, RefusesSettingsThatMakeNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto change) {
    GraspRuleSettings s = settings();
    change(s);
    EXPECT_THROW(GraspRule{s}, Error);
  };
  refused([](auto& s) { s.touch_height_mm = 0.0; });
  refused([&](auto& s) { s.touch_height_mm = nan; });
  refused([](auto& s) { s.touch_frames = 0; });
  refused([](auto& s) { s.approach_step_mm = -0.1; });
  refused([](auto& s) { s.longest_approach_mm = 0.0; });
  refused([](auto& s) { s.slip_step_mm = std::numeric_limits<double>::infinity(); });
  refused([](auto& s) { s.settle_frames = -1; });
  refused([](auto& s) { s.most_slip_travel_mm = -1.0; });
  refused([](auto& s) { s.most_normal_force_N = 0.0; });
  refused([](auto& s) { s.lost_height_mm = 0.1; });
  refused([](auto& s) { s.lost_frames = 0; });
}

TEST(GraspRule, RefusesSightsThatAreNoNumbers) {
  GraspRule rule(settings());
  EXPECT_THROW(rule.next(reading(std::numeric_limits<double>::quiet_NaN())), Error);
  GraspReading s = reading(0.1);
  s.normal_force_N = std::numeric_limits<double>::infinity();
  EXPECT_THROW(rule.next(s), Error);
}

}  // namespace
}  // namespace touchstone::sensors
