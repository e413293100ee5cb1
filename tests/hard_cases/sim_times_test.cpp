// The hard case of time stamps, 44, of what presses in time: steps of a press and of a control loop's session that take
// no time or a negative one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "fem/contact/press.h"
#include "sim/press/touch_session.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/message_of.h"
#include "tests/support/press_steps.h"
#include "tests/support/small_scene.h"

namespace touchstone::sim {
namespace {

using test::did;
using test::message_of;
using test::refused;
using ::testing::HasSubstr;

constexpr double kRadius = 3.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const fem::Compliance& gel() {
  static const fem::Compliance made = test::half_space_gel(1.5, 0.25, {0.3, 0.45}, 5.0);
  return made;
}

RigidTransform at(double x, double depth) {
  RigidTransform pose;
  pose.translation = {x, 0.0, kRadius - depth};
  return pose;
}

TEST(HardCase44Sim, ASessionRefusesStepsWithoutTimeAndGoesOn) {
  GelSpec material = test::small_device().gel;
  material.relaxation = {{0.3, 0.05}};
  const fem::PressBody ball{fem::SphereShape{kRadius}, 0.4, nullptr};
  TouchSession session(gel(), material, ball);
  TouchSession other(gel(), material, ball);
  std::string said;
  double x = 0.0;
  for (int k = 0; k < 5; ++k) {
    const TouchReading wanted = other.step(at(x, 0.1), 0.01);
    const TouchReading& found = session.step(at(x, 0.1), 0.01);
    EXPECT_EQ(found.wrench, wanted.wrench);
    EXPECT_EQ(found.t_s, wanted.t_s);
    EXPECT_EQ(found.step, k + 1);
    x += 0.01;
    for (const double seconds : {kNan, kInfinity, -kInfinity, -1e-9, 0.0}) {
      said = message_of([&] { session.step(at(x, 0.15), seconds); });
      EXPECT_THAT(said,
                  HasSubstr(fmt::format("a step of a session takes {} s; allowed is a finite time above 0", seconds)));
      EXPECT_EQ(session.reading().wrench, wanted.wrench);
      EXPECT_EQ(session.reading().t_s, wanted.t_s);
      EXPECT_EQ(session.press().traction, other.press().traction);
    }
  }
  did("a session on a gel that relaxes: {}; then both sessions have the same bits", refused(said));
}

TEST(HardCase44Sim, APressTakesASuddenStepAndRefusesABackwardOne) {
  fem::Press press(gel(), fem::SphereShape{kRadius}, 0.0, {}, fem::PronySeries{{0.3, 0.05}});
  fem::PressTarget target = test::target_at(0.0, 0.0, kRadius - 0.1);
  press.step(target);
  target.seconds = 1.0;
  const double relaxed_N = press.step(target).wrench[2];
  std::string said;
  for (const double seconds : {-1e-300, -1.0, kNan, kInfinity}) {
    target.seconds = seconds;
    said = message_of([&] { press.step(target); });
    EXPECT_NE(said, "no error") << seconds;
    EXPECT_EQ(press.state().wrench[2], relaxed_N);
  }
  target.seconds = -1.0;
  said = message_of([&] { press.step(target); });
  // Two steps of one time stamp: the second one is sudden, and where nothing moves nothing changes.
  target.seconds = 0.0;
  const double again_N = press.step(target).wrench[2];
  EXPECT_NEAR(again_N, relaxed_N, 1e-9 * relaxed_N);
  did("a press on a gel that relaxes: a step of -1 s is {}; one of 0 s is sudden, its force differs by {:.1g} N where "
      "nothing moves",
      refused(said), std::abs(again_N - relaxed_N));
}

}  // namespace
}  // namespace touchstone::sim
