#include "lab/reflex/reflex_presses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/error.h"
#include "fem/mesh/gel_body.h"
#include "sim/press/gel_setup.h"
#include "tests/support/message_of.h"

namespace touchstone::lab {
namespace {

using ::touchstone::test::message_of;

sim::DeviceSpec device() {
  return sim::read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/reflex.yaml");
}

/// The device with edges so much longer.
sim::DeviceSpec coarse(double factor) {
  sim::DeviceSpec coarse = device();
  coarse.mesh.fine_mm *= factor;
  coarse.mesh.coarse_mm *= factor;
  return coarse;
}

/// [Knoop2013, eq. 1] to its own error, from the device's shape and moduli alone, on a mesh of edges 1.6 times as long.
TEST(ReflexPresses, ThePlatesForceIsTheTextsLaw) {
  const auto gel = sim::set_up_finite_gel(coarse(1.6));
  ReflexPress press;
  press.step_mm = 0.5;
  press.friction = 0.0;  // it adds 0.02 N at most and makes it three times as expensive
  const sim::PlayedPath played = sim::play_path(*gel, press_down(press));
  ASSERT_EQ(played.stopped, "");
  const sim::ForceLaw law = reflex_law(press, played);
  EXPECT_NEAR(law.error(5.0), 0.01 * law.force(5.0), 1e-12);
  EXPECT_EQ(law.error(0.5), 0.02);
  const double rms = reflex_law_rms(law, 11);
  RecordProperty("rms_N", std::to_string(rms));
  EXPECT_LT(rms, kReflexLawRms_N);
}

TEST(ReflexPresses, DeeperThanTheFingertipIsRefused) {
  const auto gel = sim::set_up_finite_gel(coarse(2.0));
  ReflexPress press;
  press.deepest_mm = 20.0;
  press.step_mm = 20.0;
  const sim::PlayedPath played = sim::play_path(*gel, press_down(press));
  EXPECT_EQ(played.states.size(), 1u) << "the touch itself";
  EXPECT_NE(played.stopped.find("into a gel of 14 mm"), std::string::npos) << played.stopped;
  // A ball that would be behind the fingertip has gone through it.
  press.object = ReflexObject::ball;
  press.deepest_mm = press.step_mm = 30.0;
  const sim::PlayedPath through = sim::play_path(*gel, press_down(press));
  EXPECT_EQ(through.states.size(), 1u);
  EXPECT_NE(through.stopped.find("goes through the gel"), std::string::npos) << through.stopped;
}

TEST(ReflexPresses, EachObjectTouchesWhereItStands) {
  const auto gel = sim::set_up_finite_gel(coarse(2.0));
  for (const ReflexObject object :
       {ReflexObject::plate, ReflexObject::ball, ReflexObject::cylinder, ReflexObject::probe}) {
    ReflexPress press;
    press.object = object;
    press.deepest_mm = 0.5;
    press.step_mm = 0.5;
    press.friction = 0.0;
    const sim::PlayedPath played = sim::play_path(*gel, press_down(press));
    ASSERT_EQ(played.stopped, "") << name_of(object);
    ASSERT_EQ(played.states.size(), 2u);
    const fem::PressState& state = played.states.back();
    EXPECT_NEAR(played.states.front().wrench[2], 0.0, 1e-6) << name_of(object);
    EXPECT_GT(state.wrench[2], 0.02) << name_of(object);
    // The middle of what is touched is the apex: no torque about it, forces along z.
    EXPECT_LT(state.wrench.head<2>().norm(), 0.05 * state.wrench[2]) << name_of(object);
    EXPECT_LT(state.wrench.segment<2>(3).norm(), 0.1 * state.wrench[2]) << name_of(object);
    EXPECT_LT(state.contact_area, 30.0) << name_of(object);
  }
}

/// A plate whose axis leans towards +x has its face lowest there.
TEST(ReflexPresses, ATiltedPlateTouchesBesideTheApex) {
  const auto gel = sim::set_up_finite_gel(coarse(2.0));
  ReflexPress press;
  press.tilt_deg = 15.0;
  press.deepest_mm = 1.5;
  press.step_mm = 0.75;
  const sim::PlayedPath played = sim::play_path(*gel, press_down(press));
  ASSERT_EQ(played.stopped, "");
  const fem::PressState& state = played.states.back();
  double x = 0.0;
  double sum = 0.0;
  for (Eigen::Index v = 0; v < state.traction.rows(); ++v) {
    const double push = -state.traction(v, 2);
    x += push * gel->rest.vertices[static_cast<std::size_t>(v)].x();
    sum += push;
  }
  // On a ball of 8 mm under 15 degrees the touch is 8 sin(15) = 2.1 mm beside the apex.
  EXPECT_NEAR(x / sum, 8.0 * std::sin(15.0 * 3.14159265 / 180.0), 1.0);
}

TEST(ReflexPresses, WaysAreWhatTheySay) {
  ReflexPress press;
  press.deepest_mm = 1.0;
  press.step_mm = 0.3;
  const sim::PressPath down = press_down(press);
  ASSERT_EQ(down.points.size(), 5u);
  EXPECT_EQ(down.points.front().shift_mm, Eigen::Vector3d::Zero());
  EXPECT_EQ(down.points.back().shift_mm, Eigen::Vector3d(0, 0, -1.0));
  EXPECT_NEAR(down.points[1].at, 0.25, 1e-12);
  ReflexShear shear;
  shear.towards_deg = 90.0;
  shear.shear_step_mm = 1.0;
  const sim::PressPath sheared = press_and_shear(press, shear);
  ASSERT_EQ(sheared.points.size(), 5u + 8u);
  EXPECT_NEAR(sheared.points[6].shift_mm.y(), 2.0, 1e-12);
  EXPECT_NEAR(sheared.points[10].shift_mm.y(), -2.0, 1e-12);
  EXPECT_LT((sheared.points.back().shift_mm - down.points.back().shift_mm).norm(), 1e-12);
  EXPECT_NEAR(sheared.points.back().at, 1.0 + 8.0, 1e-12);
}

TEST(ReflexPresses, WhatMakesNoSenseIsRefused) {
  const auto message = [](const auto& change) {
    ReflexPress press;
    ReflexShear shear;
    change(press, shear);
    return message_of([&] { press_and_shear(press, shear); });
  };
  EXPECT_NE(message([](auto& p, auto&) { p.deepest_mm = 0.0; }).find("depth"), std::string::npos);
  EXPECT_NE(message([](auto& p, auto&) { p.step_mm = NAN; }).find("step"), std::string::npos);
  EXPECT_NE(message([](auto& p, auto&) { p.tilt_deg = 40.0; }).find("0 to 30"), std::string::npos);
  EXPECT_NE(message([](auto& p, auto&) { p.tilt_towards_deg = NAN; }).find("0 to 30"), std::string::npos);
  EXPECT_NE(message([](auto&, auto& s) { s.reach_mm = -1.0; }).find("shear"), std::string::npos);
  EXPECT_NE(message([](auto&, auto& s) { s.shear_step_mm = 0.0; }).find("step of shear"), std::string::npos);
  EXPECT_NE(message([](auto&, auto& s) { s.towards_deg = NAN; }).find("towards"), std::string::npos);
}

TEST(ReflexPresses, ThePublishedLawIsItself) {
  EXPECT_EQ(published_reflex_force(-1.0), 0.0);
  EXPECT_NEAR(published_reflex_force(5.0), 10.577, 1e-3);
  sim::ForceLaw law;
  for (int k = 0; k <= 50; ++k) {
    law.depth_mm.push_back(0.1 * k);
    law.force_N.push_back(published_reflex_force(0.1 * k) + (k > 0 ? 0.1 : 0.0));
  }
  EXPECT_NEAR(reflex_law_rms(law), 0.1 * std::sqrt(50.0 / 51.0), 1e-9);
  law.depth_mm.pop_back();
  law.force_N.pop_back();
  EXPECT_THROW(reflex_law_rms(law), Error);
}

}  // namespace
}  // namespace touchstone::lab
