// The hard case of 10^4 stick-slip cycles, 40: a ball that is pressed and dragged to and fro. Friction remembers each
// step; what it remembers mustn't drift.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fem/contact/press.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

constexpr double kBallRadius = 3.0, kDepth = 0.06, kFriction = 0.4;

const Compliance& gel() {
  static const Compliance made = test::half_space_gel(0.6, 0.2, {1.0, 0.45}, 5.0);
  return made;
}

/// What a cycle leaves at either end, and the work that friction took where that was added up.
struct Cycle {
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), left = Eigen::Vector3d::Zero();  // force, N
  double work = 0.0;                                                                // N mm
  int stuck = 0, slipping = 0;                                                      // vertices, at the right end
};

struct Laws {
  Worst penetration{1e-5}, tension{1e-10}, cone{1e-8};  // mm, MPa, of mu times the largest pressure

  void take(const PressState& state) {
    EXPECT_LT(penetration(state.largest_penetration), penetration.bar);
    EXPECT_LT(tension(state.largest_tension), tension.bar);
    EXPECT_LT(cone(state.cone_violation), cone.bar);
    EXPECT_TRUE(state.wrench.allFinite());
  }
};

constexpr int kFine = 20;  // the cycle after which forces are compared; it and the last are made in small steps

/// Pressed in the middle and dragged over +-`stroke`, each way in one step.
std::vector<Cycle> drag(double stroke, int cycles, bool outlines, Laws& laws) {
  PressTolerance tolerance;
  tolerance.outlines = outlines;
  Press press(gel(), SphereShape{kBallRadius}, kFriction, tolerance, {}, PressOutput::forces);
  const auto step = [&](double x) -> const PressState& {
    const PressState& state = press.step(target_at(x, 0.0, kBallRadius - kDepth));
    laws.take(state);
    return state;
  };
  step(0.0);
  step(-stroke);
  std::vector<Cycle> all(static_cast<std::size_t>(cycles));
  for (int k = 0; k < cycles && !testing::Test::HasFailure(); ++k) {
    Cycle& cycle = all[static_cast<std::size_t>(k)];
    const int parts = k == kFine || k + 1 == cycles ? 8 : 1;
    const auto go = [&](double from, double to) {
      double force = press.state().wrench[0];
      for (int part = 1; part <= parts; ++part) {
        const double now = step(from + (to - from) * part / parts).wrench[0];
        cycle.work -= 0.5 * (force + now) * (to - from) / parts;
        force = now;
      }
      return Eigen::Vector3d(press.state().wrench.head<3>());
    };
    cycle.right = go(-stroke, stroke);
    for (const NodeState state : press.state().node_state) {
      cycle.stuck += state == NodeState::stick;
      cycle.slipping += state == NodeState::slip;
    }
    cycle.left = go(stroke, -stroke);
  }
  return all;
}

struct Dragging {
  double stroke;  // mm
  const char* name;
  int cycles;
  bool outlines;  // hats are cut by the contact's outline: three times as long
};

TEST(HardCase40, TenThousandStickSlipCyclesDoNotDrift) {
  // Partial slip, in which a core sticks for ever and remembers for ever, and sliding, in which all that sticks lets
  // go.
  for (const Dragging& run : {Dragging{0.009, "in partial slip", 10000, false},
                              {0.04, "until all slides", 10000, false},
                              {0.009, "in partial slip", 200, true},
                              {0.04, "until all slides", 200, true}}) {
    Laws laws;
    const std::vector<Cycle> cycles = drag(run.stroke, run.cycles, run.outlines, laws);
    if (HasFailure()) return;
    const Cycle& last = cycles[cycles.size() - 2];
    const Cycle& fine = cycles.back();
    const double scale = last.right.z();
    ASSERT_GT(scale, 0.01);
    // Where the gap is looked up is met to 1e-6 mm of a depth of 0.06 mm: some 1e-5 of the force may differ, and not
    // more after ten thousand cycles than after two.
    Worst drift{2e-5};
    for (int k = 2; k + 1 < run.cycles; ++k) {
      if (k >= 10 && k < kFine + 10) continue;  // round the cycle that went another way
      const Cycle& one = cycles[static_cast<std::size_t>(k)];
      ASSERT_LT(drift(std::max((one.right - last.right).norm(), (one.left - last.left).norm()) / scale), drift.bar)
          << k;
    }
    Worst work{1e-4};
    EXPECT_LT(work(std::abs(cycles[kFine].work / fine.work - 1.0)), work.bar);
    EXPECT_GT(fine.work, 0.0) << "friction takes energy";
    EXPECT_GT(last.slipping, 0);
    EXPECT_EQ(last.stuck > 0, run.stroke < 0.02);
    // Gel and loads are the same to the left as to the right.
    Worst mirror{1e-4};
    EXPECT_LT(mirror(std::abs(last.right.x() + last.left.x()) / scale), mirror.bar);
    did("a ball dragged to and fro by {} mm {} ({} vertices stick, {} slip at an end), {} cycles{}: from the third on "
        "forces "
        "differ from the last's by {} of the normal force, the work of a cycle by {}; left is the mirror image of "
        "right to "
        "{}; over all steps the ball overlaps by {}, is pulled by {} and friction leaves its cone by {}",
        run.stroke, run.name, last.stuck, last.slipping, run.cycles, run.outlines ? " with cut hats" : "", drift.text(),
        work.text(), mirror.text(), laws.penetration.text("mm"), laws.tension.text("MPa"), laws.cone.text());
  }
}

}  // namespace
}  // namespace touchstone::fem
