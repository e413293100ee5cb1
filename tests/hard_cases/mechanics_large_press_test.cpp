// The hard cases of large presses at finite strain: 1, 8 and 14. What a good program does with each stands in
// script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/slab.h"
#include "tests/hard_cases/hard_case.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::refused;
using test::Worst;

TetMesh small_slab() {
  SlabMesh slab;
  slab.size_x = slab.size_y = 10.0;
  slab.thickness = 4.0;
  slab.fine = 1.0;
  slab.coarse = 2.0;
  slab.fine_half_x = slab.fine_half_y = 3.0;
  return mesh_slab(slab);
}

PressTarget at_height(double z) {
  PressTarget target;
  target.axis[2] = AxisControl::at(z);
  return target;
}

std::string message_of(FinitePress& press, const PressTarget& target) {
  try {
    press.step(target);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

constexpr double kRadius = 5.0;

TEST(HardCase8, ALargePressDeeperThanTheGelIsRefused) {
  const FiniteGel gel(small_slab(), std::vector<ElasticMaterial>{{0.33, 0.49}}, {}, 4.0);
  FinitePress press(gel, SphereShape{kRadius}, 0.0);
  const std::string message = message_of(press, at_height(kRadius - 4.5));
  EXPECT_NE(message.find("into a gel of 4 mm"), std::string::npos);
  did("at finite strain {}", refused(message));
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
}

/// So deep that the gel has nowhere to go: the end is an error that says why, and the press is as before.
TEST(HardCase8, ElementsThatTurnInsideOutEndInAnError) {
  const FiniteGel gel(small_slab(), std::vector<ElasticMaterial>{{0.33, 0.49}}, {}, 4.0);
  PressTolerance tolerance;
  tolerance.most_halvings = 1;
  FinitePress press(gel, BoxShape{{20.0, 20.0, 2.0}}, std::numeric_limits<double>::infinity(), tolerance);
  press.step(at_height(0.9));
  const double force = press.state().wrench[2];
  const std::string message = message_of(press, at_height(1.0 - 3.9));
  EXPECT_NE(message.find("the press doesn't converge"), std::string::npos) << message;
  EXPECT_EQ(press.state().wrench[2], force);
  did("a bonded plate pressed 2.9 mm into 4 mm of gel at finite strain is {}; the press stays as it was, at {:.4g} N",
      refused(message), press.state().wrench[2]);
}

/// nu = 0.5 is legal, and the limit of what is near it.
TEST(HardCase1, ALargePressIntoAnIncompressibleGelEqualsItsNeighbours) {
  const TetMesh mesh = small_slab();
  double force[2];
  double beads[2];
  const double ratios[] = {0.5, 0.5 - 1e-7};
  for (int k = 0; k < 2; ++k) {
    const FiniteGel gel(mesh, std::vector<ElasticMaterial>{{0.33, ratios[k]}},
                        std::vector<Bead>{{{0.0, 0.0, -1.0}, 0.25}}, 4.0);
    FinitePress press(gel, SphereShape{kRadius}, 0.0);
    const PressState& state = press.step(at_height(kRadius - 1.0));
    force[k] = state.wrench[2];
    beads[k] = state.bead_displacement(0, 2);
  }
  Worst of_force{1e-5};
  Worst of_beads{1e-5};
  EXPECT_LT(of_force(std::abs(force[1] / force[0] - 1.0)), of_force.bar);
  EXPECT_LT(of_beads(std::abs(beads[1] - beads[0])), of_beads.bar);
  did("at finite strain, nu = 0.5 against 0.5 - 1e-7: force differs by {}, a bead moves by {} more or less",
      of_force.text("relative"), of_beads.text("mm"));
}

TEST(HardCase14, ALargePressToNotANumberIsRefused) {
  const FiniteGel gel(small_slab(), std::vector<ElasticMaterial>{{0.33, 0.49}}, {}, 4.0);
  FinitePress press(gel, SphereShape{kRadius}, 0.0);
  const std::string of_height = message_of(press, at_height(std::nan("")));
  EXPECT_NE(of_height, "");
  PressTarget target = at_height(kRadius);
  target.rotation(0, 0) = std::nan("");
  const std::string of_rotation = message_of(press, target);
  EXPECT_NE(of_rotation, "");
  did("at finite strain, a height of NaN is {}\na rotation of NaN is {}", refused(of_height), refused(of_rotation));
  target = at_height(kRadius - 0.2);
  target.torque[1] = std::nan("");
  EXPECT_NE(message_of(press, target).find("the torque about y of the press is nan"), std::string::npos);
}

}  // namespace
}  // namespace touchstone::fem
