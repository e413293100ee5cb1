// The hard cases of friction and edges at finite strain: 32 and 33. What a good program does with each stands in
// script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "fem/contact/press.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/slab.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

TEST(HardCase32, AReversalAtFiniteStrainConvergesKeepsFrictionAndDissipates) {
  constexpr double kMu = 0.15;
  constexpr double kRadius = 4.0;
  constexpr double kDepth = 0.5;
  const std::vector<ElasticMaterial> soft = {{0.33, 0.49}};
  const FiniteGel gel(fixtures::box_mesh({5.0, 5.0, 2.4}, 6, 6, 2), soft, {}, 2.4);
  Worst cone{1e-6};
  Worst tension{1e-12};
  Worst gained{0.01};  // of all that is dissipated: work over a step is taken by the trapezoidal rule
  int partly = 0;
  double last_share = 0.0;
  // To and fro by 0.2 mm in so many steps a stroke, and halfway back. The shear force in the end.
  const auto shear_after = [&](int steps) {
    FinitePress press(gel, SphereShape{kRadius}, kMu);
    press.step(target_at(0, 0, kRadius - kDepth));
    double x = 0.0;
    double dissipated = 0.0;
    double most = 0.0;  // what friction could take at most: all of the contact sliding all the way
    double least_step = 0.0;
    double shear = press.state().wrench[0];
    double normal = press.state().wrench[2];
    double stored = press.stored_energy();
    for (const double end : {0.2, -0.2, 0.0}) {
      const double begin = x;
      for (int k = 1; k <= steps; ++k) {
        const double next = begin + (end - begin) * k / steps;
        const PressState& state = press.step(target_at(next, 0, kRadius - kDepth));
        EXPECT_LT(cone(state.cone_violation), cone.bar);
        EXPECT_LE(tension(state.largest_tension), tension.bar);
        const auto count = [&](NodeState wanted) {
          return std::count(state.node_state.begin(), state.node_state.end(), wanted);
        };
        partly += count(NodeState::stick) > 0 && count(NodeState::slip) > 0;
        const double work = -0.5 * (shear + state.wrench[0]) * (next - x);
        const double lost = work - (press.stored_energy() - stored);
        least_step = std::min(least_step, lost);
        dissipated += lost;
        most += kMu * 0.5 * (normal + state.wrench[2]) * std::abs(next - x);
        shear = state.wrench[0];
        normal = state.wrench[2];
        stored = press.stored_energy();
        x = next;
      }
    }
    EXPECT_GT(dissipated, 0.0) << steps;
    EXPECT_LT(dissipated, 1.05 * most) << steps;
    EXPECT_LT(gained(-least_step / dissipated), gained.bar) << steps;
    last_share = dissipated / most;
    return shear;
  };
  const double reference = shear_after(8);
  did("dragged to and fro by 0.2 mm in 8 steps a stroke: friction takes {:.3g} of what it would if all slid all the "
      "way",
      last_share);
  double before = std::abs(reference);
  for (const int steps : {1, 2, 4}) {
    const double error = std::abs(shear_after(steps) - reference);
    EXPECT_LT(error, 0.8 * before) << steps;
    before = error;
    did("{} steps a stroke: shear force {:.2g} from that of 8 steps, relative", steps, error / std::abs(reference));
  }
  EXPECT_LT(before, 1e-2 * std::abs(reference));
  EXPECT_GT(partly, 0);
  did("in all steps the friction cone is kept to {}, tension is {}, no step gives back more than {} of what is "
      "dissipated; {} steps end partly sticking, partly slipping",
      cone.text(), tension.text("MPa"), gained.text(), partly);
}

SlabMesh pad(double fine) {
  SlabMesh slab;
  slab.size_x = slab.size_y = 7.0;
  slab.thickness = 2.4;
  slab.fine = fine;
  slab.coarse = 1.6;
  slab.fine_half_x = slab.fine_half_y = 1.5;
  slab.fine_depth = 0.5;
  return slab;
}

constexpr double kThickness = 2.4;
const RoundedCylinder kPunch{1.2, 0.0, 3.0};
const std::vector<ElasticMaterial> kSoft = {{1.0, 0.49}};

/// Two things part a sharp punch at finite strain from the theory of small strain: the strain, of first order in the
/// depth, and the mesh, which at finite strain ends a contact on whole vertices (docs/decisions/mechanics.md).
TEST(HardCase33, AtSmallDepthASharpPunchTendsToTheSmallStrainTheory) {
  const double theory = closed_forms::flat_punch_on_layer(1.0, 0.49, kThickness, kPunch.radius, 1.0).force;
  constexpr int kPlaces = 4;
  double before = 1.0;
  for (const double edge : {0.8, 0.45}) {
    const FiniteGel gel(mesh_slab(pad(edge)), kSoft, {}, kThickness);
    double square = 0.0;
    Worst order{0.3};
    for (int k = 0; k < kPlaces; ++k) {
      const double x = edge * (0.618 * k - std::floor(0.618 * k) - 0.5);
      const double y = edge * (0.755 * k - std::floor(0.755 * k) - 0.5);
      FinitePress press(gel, kPunch, 0.0);
      std::array<double, 3> stiffness{};
      for (int d = 0; d < (k == 0 ? 3 : 2); ++d) {
        const double depth = 0.005 * std::pow(2.0, d) * kThickness;
        stiffness[static_cast<std::size_t>(d)] = press.step(target_at(x, y, -depth)).wrench[2] / depth;
      }
      if (k == 0) {
        EXPECT_LT(order(std::abs((stiffness[2] - stiffness[1]) / (stiffness[1] - stiffness[0]) - 2.0)), order.bar);
      }
      square += std::pow((2.0 * stiffness[0] - stiffness[1]) / theory - 1.0, 2) / kPlaces;
    }
    EXPECT_LT(std::sqrt(square), before) << edge;
    before = std::sqrt(square);
    did("edges of {} mm under a punch of {} mm radius: drawn on to no depth, its stiffness is {:.2g} from the "
        "small-strain "
        "layer's, relative; between 0.5, 1 and 2 % of the thickness it changes by a strain of first order, the ratio "
        "of "
        "its changes being 2 to within {}",
        edge, kPunch.radius, before, order.text());
  }
  EXPECT_LT(before, 0.2);  // chosen after it had been seen; the error bars know of it (fem/error/press_error)
}

/// A sharp edge loses whole vertices at finite strain, as the gel beside it tilts and slides out from under it: so
/// force over depth may fall by some percents where the gel itself stiffens. The bars were chosen after that had been
/// seen.
TEST(HardCase33, ASharpPunchToAFifthOfTheThicknessConvergesWithTheMesh) {
  std::array<double, 3> force{};
  constexpr double kEdges[] = {1.0, 0.75, 0.55};
  Worst softening{0.15};
  for (int k = 0; k < 3; ++k) {
    const FiniteGel gel(mesh_slab(pad(kEdges[k])), kSoft, {}, kThickness);
    FinitePress press(gel, kPunch, std::numeric_limits<double>::infinity());
    double before = 0.0;
    double stiffest = 0.0;
    for (const double share : {0.1, 0.2}) {
      const PressState& state = press.step(target_at(0.1, 0.05, -kThickness * share));
      EXPECT_LT(state.largest_penetration, 1e-5);
      EXPECT_EQ(state.largest_tension, 0.0);
      EXPECT_GT(state.wrench[2], before) << kEdges[k] << ' ' << share;
      before = state.wrench[2];
      stiffest = std::max(stiffest, before / share);
      EXPECT_LT(softening(1.0 - before / share / stiffest), softening.bar);
    }
    force[static_cast<std::size_t>(k)] = before;
  }
  const double first = std::abs(force[1] - force[0]) / force[2];
  const double second = std::abs(force[2] - force[1]) / force[2];
  EXPECT_LT(second, first);
  EXPECT_LT(second, 0.2);
  did("bonded to the punch, at a fifth of the thickness: {:.4g}, {:.4g} and {:.4g} N with edges of {}, {} and {} mm: "
      "from "
      "mesh to mesh it changes by {:.2g} and {:.2g}, relative; force over depth falls by {}",
      force[0], force[1], force[2], kEdges[0], kEdges[1], kEdges[2], first, second, softening.text());
}

}  // namespace
}  // namespace touchstone::fem
