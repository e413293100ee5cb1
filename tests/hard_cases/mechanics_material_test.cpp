// The hard cases that concern the material, the mesh and the units: 1, 2, 5 and 12. What a good program does with each
// stands in script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "fem/contact/press.h"
#include "fem/error/press_error.h"
#include "fem/mesh/slab.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

/// 5 mm thick, half-width 4 thicknesses; all lengths times `unit`.
SlabMesh layer(double fine, double unit = 1.0) {
  SlabMesh slab;
  slab.size_x = slab.size_y = 40.0 * unit;
  slab.thickness = 5.0 * unit;
  slab.fine = fine * unit;
  slab.coarse = 2.5 * unit;
  slab.fine_half_x = slab.fine_half_y = 2.4 * unit;
  slab.fine_depth = 0.6 * unit;
  return slab;
}

Compliance gel_of(const SlabMesh& slab, double modulus, double poisson_ratio) {
  return compute_compliance(mesh_slab(slab), {modulus, poisson_ratio}, {}, slab.thickness);
}

double sphere_force(const Compliance& gel, double depth) {
  return Press(gel, SphereShape{8.0}, 0.0).step(target_at(0.013, 0.021, 8.0 - depth)).wrench[2];
}

TEST(HardCase1, APoissonsRatioOfAHalfIsThatOfNearlyAHalf) {
  const double at_half = sphere_force(gel_of(layer(0.6), 1.0, 0.5), 0.3);
  EXPECT_GT(at_half, 0.1);
  const auto layers_force = [](double nu) { return closed_forms::sphere_on_layer(1.0, nu, 5.0, 8.0, 0.3).force; };
  const double slope = (layers_force(0.5) / layers_force(0.49) - 1.0) / 0.01;
  for (const double less : {1e-8, 1e-7, 1e-6}) {
    const double below = sphere_force(gel_of(layer(0.6), 1.0, 0.5 - less), 0.3);
    // What the solver leaves, and what nu is short of times the slope of the layer's force there: twice that of the
    // last hundredth, as it still grows.
    Worst away{1e-6 + 2.0 * less * slope};
    EXPECT_LT(away(std::abs(at_half / below - 1.0)), away.bar);
    did("force under a ball at nu = 0.5 differs from that at 0.5 - {} by {}", less, away.text("relative"));
  }
}

TEST(HardCase2, FromPoissonsRatio03To05NothingStiffensThatShouldNot) {
  double before = 0.0;
  Worst away{0.01};
  std::string forces;
  for (const double nu : {0.3, 0.4, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.5}) {
    const double force = sphere_force(gel_of(layer(0.5), 1.0, nu), 0.4);
    const double expected = closed_forms::sphere_on_layer(1.0, nu, 5.0, 8.0, 0.4).force;
    EXPECT_LT(away(std::abs(force / expected - 1.0)), away.bar) << nu;
    EXPECT_GT(force, before) << nu;  // confinement alone: it rises with nu
    before = force;
    forces += fmt::format("{}{:.4g} N at {}", forces.empty() ? "" : ", ", force, nu);
  }
  did("force under a ball: {}\nit differs from an elastic layer's in closed form by {}", forces, away.text("relative"));
}

TEST(HardCase5, UnderASharpPunchTheForceConvergesAndThePeakPressureDoesNot) {
  const double expected = closed_forms::flat_punch_on_layer(1.0, 0.45, 5.0, 1.9, 0.1).force;
  double before = 1.0;
  double peak_before = 0.0;
  for (const double fine : {0.8, 0.4, 0.27}) {
    const Compliance gel = gel_of(layer(fine), 1.0, 0.45);
    // Over several places: where the rim lies among the vertices makes most of the error.
    double square = 0.0;
    double peak = 0.0;
    constexpr int kPlaces = 12;
    for (int k = 0; k < kPlaces; ++k) {
      Press press(gel, RoundedCylinder{1.9, 0.0, 3.0}, 0.0);
      const PressState& state = press.step(target_at(fine * (0.618 * k - std::floor(0.618 * k) - 0.5),
                                                     fine * (0.755 * k - std::floor(0.755 * k) - 0.5), -0.1));
      square += std::pow(state.wrench[2] / expected - 1.0, 2) / kPlaces;
      peak += -state.traction.col(2).minCoeff() / kPlaces;
    }
    EXPECT_LT(std::sqrt(square), 0.9 * before) << fine;
    EXPECT_GT(peak, 1.1 * peak_before) << fine;  // towards infinity
    before = std::sqrt(square);
    peak_before = peak;
    did("edges of {} mm under a punch of 1.9 mm radius: force {:.2g} from the theory's, relative; highest pressure "
        "{:.3g} "
        "MPa, without a limit",
        fine, before, peak);
  }
  EXPECT_LT(before, 0.03);  // seven edges a radius
}

TEST(HardCase12, OtherUnitsGiveTheSameAnswerAfterScaling) {
  // In mm and MPa, in m and Pa, and with a nanometre as the unit of length: set-up, and a press with friction that is
  // sheared. The same mesh gives the same digits; a mesh made anew in other units is another one, by TetGen's rounding
  // among lattice points on common spheres, and gives the same to a mesh's error.
  struct Units {
    double length;
    double stress;
  };
  std::vector<Eigen::Vector3d> forces;
  std::vector<Eigen::Vector3d> remeshed;
  for (const Units& unit : {Units{1.0, 1.0}, Units{1e-3, 1e6}, Units{1e6, 1e-6}}) {
    const auto force = [&](const Compliance& gel) -> Eigen::Vector3d {
      PressTolerance tolerance;
      tolerance.lookup_mm = 1e-8 * unit.length;
      tolerance.force = 1e-9;
      Press press(gel, SphereShape{8.0 * unit.length}, 0.4, tolerance);
      press.step(target_at(0.013 * unit.length, 0.021 * unit.length, (8.0 - 0.3) * unit.length));
      const PressState& state =
          press.step(target_at(0.063 * unit.length, 0.021 * unit.length, (8.0 - 0.3) * unit.length));
      return state.wrench.head<3>() / (unit.stress * unit.length * unit.length);
    };
    TetMesh mesh = mesh_slab(layer(0.6));
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= unit.length;
    forces.push_back(force(compute_compliance(mesh, {unit.stress, 0.49}, {}, 5.0 * unit.length)));
    remeshed.push_back(force(gel_of(layer(0.6, unit.length), unit.stress, 0.49)));
  }
  EXPECT_GT(forces[0].z(), 0.1);
  Worst same{1e-7};
  Worst anew{1e-3};
  const auto away = [&](const Eigen::Vector3d& force) { return (force - forces[0]).norm() / forces[0].norm(); };
  for (const Eigen::Vector3d& force : forces) EXPECT_LT(same(away(force)), same.bar);
  for (const Eigen::Vector3d& force : remeshed) EXPECT_LT(anew(away(force)), anew.bar);
  did("a sheared press in mm and MPa, in m and Pa, and in nm and TPa: force differs by {} on the same mesh, by {} "
      "where the mesh is made anew in those units",
      same.text("relative"), anew.text());
}

}  // namespace
}  // namespace touchstone::fem
