#include "sim/grasp/gripper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/mesh/slab.h"
#include "sim/grasp/arm_lift.h"

namespace touchstone::sim {
namespace {

constexpr double kFrame_s = 1.0 / 30;
constexpr double kFriction = 0.5;

const fem::Compliance& gel() {
  static const fem::Compliance made = [] {
    fem::SlabMesh slab;
    slab.size_x = slab.size_y = 14.0;
    slab.thickness = 3.0;
    slab.fine = 0.6;
    slab.fine_half_x = slab.fine_half_y = 4.5;
    return fem::compute_compliance(fem::mesh_slab(slab), fem::ElasticMaterial{0.15, 0.49}, {}, slab.thickness);
  }();
  return made;
}

GraspedBody ball(double mass_g) {
  GraspedBody body;
  body.shape = fem::SphereShape{12.0};
  body.friction = kFriction;
  body.mass_g = mass_g;
  return body;
}

GripperSettings settings() {
  GripperSettings s;
  s.clearance_mm = 0.1;
  return s;
}

/// Closes by `depth` beyond the first touch, in steps of a frame.
void close_to(Gripper& gripper, double depth) {
  for (int frame = 0; frame < 5; ++frame) gripper.advance((0.1 + depth) / 5, 0.0, kFrame_s);
}

/// The mass (g) of which both fingers' friction, mu N each, bears the weight `share` times.
double mass_for(double normal_force, double share) {
  return 2.0 * kFriction * normal_force / (share * kGravity_mm_s2 * 1e-6);
}

/// One finger's normal force at a depth.
double force_at(double depth) {
  Gripper gripper(gel(), ball(1.0), settings());
  close_to(gripper, depth);
  return gripper.state().normal_force_N;
}

void lift(Gripper& gripper, double seconds = 2.0) {
  ArmLift arm({10.0, 20.0, 100.0});
  for (int frame = 0; frame < static_cast<int>(std::lround(seconds / kFrame_s)); ++frame) {
    gripper.advance(0.0, arm.next(true, kFrame_s), kFrame_s);
  }
}

TEST(ArmLift, RisesByItsHeightAndStands) {
  for (const ArmLiftSettings& s : {ArmLiftSettings{20, 20, 100}, ArmLiftSettings{2, 50, 100}}) {
    ArmLift arm(s);
    double height = 0.0;
    double speed = 0.0;
    double most = 0.0;
    const double dt = 1e-4;
    for (int step = 0; step < 30000; ++step) {
      const double acceleration = arm.next(true, dt);
      EXPECT_LE(std::abs(acceleration), s.acceleration_mm_s2 * 1.0001);
      height += (speed + 0.5 * acceleration * dt) * dt;
      speed += acceleration * dt;
      most = std::max(most, speed);
    }
    EXPECT_TRUE(arm.done());
    EXPECT_NEAR(height, s.height_mm, 1e-3);
    EXPECT_NEAR(speed, 0.0, 1e-9);
    EXPECT_LE(most, s.speed_mm_s + 1e-9);
  }
}

TEST(ArmLift, StopsWhereItIsNoLongerCommandedToLift) {
  ArmLift arm({20, 20, 100});
  EXPECT_EQ(arm.next(false, 0.1), 0.0);  // not begun: nothing to stop
  for (int k = 0; k < 5; ++k) arm.next(true, 0.1);
  EXPECT_EQ(arm.speed_mm_s(), 20.0);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(arm.next(false, 0.1), -100.0, 1e-9);
  EXPECT_EQ(arm.next(true, 0.1), 0.0);
  EXPECT_FALSE(arm.done());
}

TEST(Gripper, TouchesWhenItHasClosedByTheClearance) {
  Gripper gripper(gel(), ball(10.0), settings());
  EXPECT_FALSE(gripper.advance(0.099, 0.0, kFrame_s).touched);
  EXPECT_EQ(gripper.state().normal_force_N, 0.0);
  EXPECT_TRUE(gripper.advance(0.05, 0.0, kFrame_s).touched);
  EXPECT_NEAR(gripper.state().finger_travel_mm, 0.149, 1e-12);
}

TEST(Gripper, FrictionThatSufficesHoldsWithoutSliding) {
  const double normal = force_at(0.4);
  Gripper gripper(gel(), ball(mass_for(normal, 1.2)), settings());
  close_to(gripper, 0.4);
  lift(gripper);
  const GripperState& state = gripper.state();
  EXPECT_FALSE(state.on_table);
  EXPECT_FALSE(state.dropped);
  EXPECT_EQ(state.slid_mm, 0.0);
  EXPECT_EQ(state.sliding_speed_mm_s, 0.0);
  EXPECT_NEAR(2.0 * state.friction_N, mass_for(normal, 1.2) * 1e-6 * kGravity_mm_s2, 2e-3 * state.friction_N);
  EXPECT_NEAR(state.object_height_mm, 10.0, 0.5);  // less what the gel gives way
  EXPECT_GT(state.sunk_mm, 0.0);
}

TEST(Gripper, FrictionThatDoesNotSufficeLeavesItOnTheTable) {
  const double normal = force_at(0.4);
  Gripper gripper(gel(), ball(mass_for(normal, 0.8)), settings());
  close_to(gripper, 0.4);
  lift(gripper, 0.3);
  const GripperState& state = gripper.state();
  EXPECT_TRUE(state.on_table);
  EXPECT_TRUE(state.slipping);
  EXPECT_EQ(state.sliding_speed_mm_s, state.arm_speed_mm_s);
  EXPECT_GT(state.slid_mm, 1.0);
  EXPECT_EQ(state.object_height_mm, 0.0);
  // The table bears what the fingers don't.
  const double weight = mass_for(normal, 0.8) * 1e-6 * kGravity_mm_s2;
  EXPECT_NEAR(state.table_force_N + 2.0 * state.friction_N, weight, 1e-12);
  EXPECT_NEAR(state.table_force_N, weight - 2.0 * kFriction * state.normal_force_N, 0.005 * weight);
  EXPECT_GT(state.table_force_N, 0.19 * weight);  // at the pad's rim the gel bears less
}

TEST(Gripper, ClosingFurtherLiftsWhatSlidesOnTheTable) {
  Gripper gripper(gel(), ball(mass_for(force_at(0.4), 0.9)), settings());
  close_to(gripper, 0.4);
  lift(gripper, 0.2);
  EXPECT_TRUE(gripper.state().slipping);
  EXPECT_GT(gripper.state().sliding_speed_mm_s, 0.0);
  gripper.advance(0.2, 0.0, kFrame_s);
  gripper.advance(0.0, 0.0, kFrame_s);
  EXPECT_FALSE(gripper.state().on_table);
  EXPECT_FALSE(gripper.state().slipping);
  EXPECT_EQ(gripper.state().sliding_speed_mm_s, 0.0);
  EXPECT_GT(gripper.state().object_height_mm, 0.0);
}

TEST(Gripper, WithoutATableItFallsAsFrictionLetsIt) {
  const double share = 0.7;
  const double normal = force_at(0.4);
  const GraspedBody body = ball(mass_for(normal, share));
  Gripper gripper(gel(), body, settings());
  close_to(gripper, 0.4);
  gripper.remove_table();
  gripper.advance(0.0, 0.0, 1e-6);  // the gel is sheared until all slips
  ASSERT_TRUE(gripper.state().slipping);
  const double begin = gripper.state().sunk_mm;
  const double mass = body.mass_g * 1e-6;
  const double dt = 1.0 / 480;
  double expected_speed = gripper.state().sliding_speed_mm_s;
  double friction_work = 0.0;
  for (int step = 0; step < 12; ++step) {
    const GripperState before = gripper.state();
    const GripperState& after = gripper.advance(0.0, 0.0, dt);
    ASSERT_TRUE(after.slipping);
    expected_speed += (1.0 - 2.0 * kFriction * before.normal_force_N / (mass * kGravity_mm_s2)) * kGravity_mm_s2 * dt;
    friction_work += 2.0 * before.friction_N * (after.sunk_mm - before.sunk_mm);
  }
  const double speed = gripper.state().sliding_speed_mm_s;
  EXPECT_GT(speed, 50.0);
  EXPECT_NEAR(speed, expected_speed, 5e-3 * expected_speed);
  EXPECT_NEAR(gripper.state().normal_force_N, normal, 0.1 * normal);  // a ball that slides bears less towards the rim
  // What gravity gave went into motion and friction.
  const double travel = gripper.state().sunk_mm - begin;
  const double given = mass * kGravity_mm_s2 * travel;
  EXPECT_NEAR(0.5 * mass * speed * speed + friction_work, given, 1e-6 * given);
}

TEST(Gripper, ItFallsOutAndThenTheGelIsBare) {
  GripperSettings s = settings();
  s.drop_mm = 3.0;
  Gripper gripper(gel(), ball(mass_for(force_at(0.3), 0.5)), s);
  close_to(gripper, 0.3);
  gripper.remove_table();
  for (int frame = 0; frame < 5 && !gripper.state().dropped; ++frame) gripper.advance(0.0, 0.0, kFrame_s);
  EXPECT_TRUE(gripper.state().dropped);
  EXPECT_EQ(gripper.state().normal_force_N, 0.0);
  EXPECT_EQ(gripper.press().contact_vertices, 0);
  EXPECT_TRUE(gripper.advance(0.1, 0.0, kFrame_s).dropped);  // for good
}

TEST(Gripper, FingersThatSlideOffLeaveTheObjectBehind) {
  Gripper gripper(gel(), ball(mass_for(force_at(0.3), 0.5)), settings());
  close_to(gripper, 0.3);
  lift(gripper);
  EXPECT_TRUE(gripper.state().dropped);
  EXPECT_EQ(gripper.state().object_height_mm, 0.0);
  EXPECT_EQ(gripper.press().contact_vertices, 0);
}

TEST(Gripper, ClosingFurtherCatchesWhatSlides) {
  GripperSettings s = settings();
  Gripper gripper(gel(), ball(mass_for(force_at(0.4), 0.8)), s);
  close_to(gripper, 0.4);
  gripper.remove_table();
  gripper.advance(0.0, 0.0, 0.02);
  EXPECT_TRUE(gripper.state().slipping);
  EXPECT_GT(gripper.state().sliding_speed_mm_s, 0.0);
  gripper.advance(0.2, 0.0, 0.02);
  for (int frame = 0; frame < 4; ++frame) gripper.advance(0.0, 0.0, kFrame_s);
  EXPECT_FALSE(gripper.state().dropped);
  EXPECT_EQ(gripper.state().sliding_speed_mm_s, 0.0);
  const double slid = gripper.state().slid_mm;
  for (int frame = 0; frame < 4; ++frame) gripper.advance(0.0, 0.0, kFrame_s);
  EXPECT_EQ(gripper.state().slid_mm, slid);
}

TEST(Gripper, HalfTheStepMovesTheAnswerLittleAndAQuarterLess) {
  const double mass = mass_for(force_at(0.4), 0.8);
  const auto sunk = [&](double slide_step) {
    GripperSettings s = settings();
    s.slide_step_s = slide_step;
    Gripper gripper(gel(), ball(mass), s);
    close_to(gripper, 0.4);
    gripper.remove_table();
    gripper.advance(0.0, 0.0, 0.02);
    gripper.advance(0.2, 0.0, 0.04);  // brakes it
    return gripper.state().sunk_mm;
  };
  const double coarse = sunk(1.0 / 200);
  const double middle = sunk(1.0 / 400);
  const double fine = sunk(1.0 / 800);
  EXPECT_LT(std::abs(fine - middle), 0.7 * std::abs(middle - coarse));
  EXPECT_LT(std::abs(fine - middle), 0.05 * fine);
}

TEST(Gripper, AnAcceleratingArmNeedsMoreFriction) {
  const double normal = force_at(0.4);
  const auto held = [&](double acceleration) {
    Gripper gripper(gel(), ball(mass_for(normal, 1.2)), settings());
    close_to(gripper, 0.4);
    ArmLift arm({10.0, 20.0, 100.0});
    for (int frame = 0; frame < 30; ++frame) gripper.advance(0.0, arm.next(true, kFrame_s), kFrame_s);
    gripper.advance(0.0, acceleration, kFrame_s);
    return !gripper.state().slipping;
  };
  EXPECT_TRUE(held(0.1 * kGravity_mm_s2));
  EXPECT_FALSE(held(0.4 * kGravity_mm_s2));
}

TEST(Gripper, ForceBeyondWhatTheObjectBearsCrushesIt) {
  GraspedBody body = ball(10.0);
  body.crush_force_N = force_at(0.3);
  Gripper gripper(gel(), body, settings());
  close_to(gripper, 0.25);
  EXPECT_FALSE(gripper.state().crushed);
  gripper.advance(0.1, 0.0, kFrame_s);
  EXPECT_TRUE(gripper.state().crushed);
  gripper.advance(-0.3, 0.0, kFrame_s);
  EXPECT_TRUE(gripper.state().crushed);  // that stays so
}

TEST(Gripper, RefusesWhatMakesNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Gripper(gel(), ball(0.0), settings()), Error);
  EXPECT_THROW(Gripper(gel(), ball(nan), settings()), Error);
  GraspedBody sticky = ball(1.0);
  sticky.friction = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Gripper(gel(), sticky, settings()), Error);
  GripperSettings s = settings();
  s.step_s = 0.0;
  EXPECT_THROW(Gripper(gel(), ball(1.0), s), Error);
  s = settings();
  s.gel_from_object.translation.x() = 100.0;
  EXPECT_THROW(Gripper(gel(), ball(1.0), s), Error);
  Gripper gripper(gel(), ball(1.0), settings());
  EXPECT_THROW(gripper.advance(nan, 0.0, kFrame_s), Error);
  EXPECT_THROW(gripper.advance(0.0, 0.0, 0.0), Error);
}

}  // namespace
}  // namespace touchstone::sim
