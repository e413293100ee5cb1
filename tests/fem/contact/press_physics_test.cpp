// Contact on real gels (Taylor-Hood) against closed forms and the layer reference.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "closed_forms/contact_closed_forms.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "fem/mesh/slab.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

constexpr double kModulus = 1.0;

/// 60 mm thick and 120 mm wide, fine in the middle: a half space to 1 % for contacts below 1.2 mm.
const Compliance& thick_gel(double poisson_ratio) {
  const auto make = [](double nu) {
    SlabMesh slab;
    slab.size_x = slab.size_y = 120.0;
    slab.thickness = 60.0;
    slab.fine = 0.2;
    slab.coarse = 14.0;
    slab.fine_half_x = slab.fine_half_y = 1.3;
    slab.fine_depth = 0.3;
    return compute_compliance(mesh_slab(slab), {kModulus, nu}, {}, slab.thickness);
  };
  static const Compliance compressible = make(0.3);
  static const Compliance incompressible = make(0.4999);
  return poisson_ratio < 0.4 ? compressible : incompressible;
}

/// 5 mm thick, half-width 4 thicknesses.
const Compliance& layer_gel(double poisson_ratio) {
  const auto make = [](double nu) {
    SlabMesh slab;
    slab.size_x = slab.size_y = 40.0;
    slab.thickness = 5.0;
    slab.fine = 0.4;
    slab.coarse = 2.5;
    slab.fine_half_x = slab.fine_half_y = 2.4;
    slab.fine_depth = 0.6;
    return compute_compliance(mesh_slab(slab), {kModulus, nu}, {}, slab.thickness);
  };
  static const Compliance compressible = make(0.3);
  static const Compliance soft = make(0.49);
  return poisson_ratio < 0.4 ? compressible : soft;
}

class ThickGel : public testing::TestWithParam<double> {};

TEST_P(ThickGel, ASphereMeetsHertzWithinTwoPercent) {
  const Compliance& gel = thick_gel(GetParam());
  const double radius = 8.0;
  for (const double depth : {0.05, 0.1, 0.15}) {  // a of 0.63 to 1.1 mm: 3 to 5 edges, under a 50th of the thickness
    Press press(gel, SphereShape{radius}, 0.0);
    const PressState& state = press.step(target_at(0.013, 0.021, radius - depth));
    const double hertz = closed_forms::hertz_force(kModulus, GetParam(), radius, depth);
    EXPECT_NEAR(state.wrench[2], hertz, 0.02 * hertz) << depth;
    const double a = closed_forms::hertz_contact_radius(radius, depth);
    EXPECT_NEAR(std::sqrt(state.contact_area / 3.14159265), a, 0.15) << depth;
    const double largest = -state.traction.col(2).minCoeff();
    EXPECT_NEAR(largest, closed_forms::hertz_largest_pressure(hertz, a), 0.05 * largest) << depth;
  }
}

TEST_P(ThickGel, ASphereMeetsTheLayerReferenceWithinHalfAPercent) {
  const Compliance& gel = thick_gel(GetParam());
  const double radius = 8.0;
  for (const double depth : {0.1, 0.15}) {
    Press press(gel, SphereShape{radius}, 0.0);
    const PressState& state = press.step(target_at(0.013, 0.021, radius - depth));
    const double wanted = closed_forms::sphere_on_layer(kModulus, GetParam(), gel.thickness, radius, depth).force;
    EXPECT_NEAR(state.wrench[2], wanted, 0.006 * wanted) << depth;
  }
}

TEST_P(ThickGel, AFlatPunchMeetsItsClosedForm) {
  Press press(thick_gel(GetParam()), RoundedCylinder{1.0, 0.0, 3.0}, 0.0);
  const PressState& state = press.step(target_at(0.013, 0.021, -0.05));
  const double wanted = closed_forms::flat_punch_force(kModulus, GetParam(), 1.0, 0.05);
  EXPECT_NEAR(state.wrench[2], wanted, 0.035 * wanted);
}

// F = 2 E tan(a) d^2 / (pi (1 - nu^2)) for a rigid cone of half angle a, the contact's radius 2 d tan(a) / pi
// [Sneddon1965].
TEST_P(ThickGel, AConeMeetsSneddon) {
  const double half_angle = 80.0 * kRadiansPerDegree;
  const ConeShape cone{half_angle, 3.0, 0.0};
  for (const double depth : {0.2, 0.3}) {
    Press press(thick_gel(GetParam()), cone, 0.0);
    const PressState& state = press.step(target_at(0.013, 0.021, -depth));
    const double wanted = 2.0 * kModulus / (1.0 - GetParam() * GetParam()) * std::tan(half_angle) * depth * depth / kPi;
    EXPECT_NEAR(state.wrench[2], wanted, 0.02 * wanted) << depth;
    RecordProperty(fmt::format("relative_error_{}", depth), fmt::format("{:+.4f}", state.wrench[2] / wanted - 1.0));
  }
}

INSTANTIATE_TEST_SUITE_P(Poisson, ThickGel, testing::Values(0.3, 0.4999));

TEST(ThickGel, NearIncompressibilityDoesNotLock) {
  // F (1 - nu^2) / E is the same for all nu on a half space.
  const double radius = 8.0;
  Press one(thick_gel(0.3), SphereShape{radius}, 0.0);
  Press other(thick_gel(0.4999), SphereShape{radius}, 0.0);
  const double a = one.step(target_at(0, 0, radius - 0.1)).wrench[2] * (1.0 - 0.3 * 0.3);
  const double b = other.step(target_at(0, 0, radius - 0.1)).wrench[2] * (1.0 - 0.4999 * 0.4999);
  EXPECT_NEAR(a / b, 1.0, 0.01);
}

TEST(ThickGel, ASphereShearedFollowsCattaneoAndMindlin) {
  // At nu = 0.5 normal and tangential loads don't couple, which the closed form assumes.
  const Compliance& gel = thick_gel(0.4999);
  const double radius = 8.0;
  const double friction = 0.3;
  const double force = 0.12;
  Press press(gel, SphereShape{radius}, friction);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(force);
  const double depth = radius - press.step(target).gel_from_object.translation.z();
  const double a = closed_forms::hertz_contact_radius(radius, depth);
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.rows());
  for (const double share : {0.3, 0.6, 0.9}) {
    const double shear = share * friction * force;
    target.axis[0] = AxisControl::with_force(-shear);
    const PressState& state = press.step(target);
    const double wanted = closed_forms::mindlin_displacement(kModulus, 0.4999, a, shear, friction, force);
    EXPECT_NEAR(state.gel_from_object.translation.x(), wanted, 0.03 * wanted) << share;
    double stuck = 0.0;
    double all = 0.0;
    for (std::size_t v = 0; v < state.node_state.size(); ++v) {
      if (state.node_state[v] == NodeState::stick) stuck += weight[static_cast<Eigen::Index>(v)];
      if (state.node_state[v] != NodeState::open) all += weight[static_cast<Eigen::Index>(v)];
    }
    EXPECT_NEAR(std::sqrt(stuck / all), closed_forms::mindlin_stick_ratio(shear, friction, force), 0.06) << share;
  }
}

TEST(LayerGel, AFlatPunchMeetsHayes) {
  const double nu = 0.3;
  Press press(layer_gel(nu), RoundedCylinder{2.0, 0.0, 3.0}, 0.0);
  const double force = press.step(target_at(0.013, 0.021, -0.1)).wrench[2];
  const double shear_modulus = kModulus / (2.0 * (1.0 + nu));
  const double wanted = 4.0 * shear_modulus * 2.0 * closed_forms::hayes_kappa(0.4) * 0.1 / (1.0 - nu);
  EXPECT_NEAR(force, wanted, 0.02 * wanted);
}

class LayerGel : public testing::TestWithParam<double> {};

TEST_P(LayerGel, BodiesMeetTheLayerReference) {
  const double nu = GetParam();
  for (const double depth : {0.1, 0.3, 0.5}) {
    Press press(layer_gel(nu), SphereShape{8.0}, 0.0);
    const double force = press.step(target_at(0.013, 0.021, 8.0 - depth)).wrench[2];
    const double wanted = closed_forms::sphere_on_layer(kModulus, nu, 5.0, 8.0, depth).force;
    EXPECT_NEAR(force, wanted, (depth < 0.2 ? 0.02 : 0.006) * wanted) << depth;  // two edges a radius, then more
  }
  Press press(layer_gel(nu), RoundedCylinder{2.0, 0.0, 3.0}, 0.0);
  const double force = press.step(target_at(0.013, 0.021, -0.1)).wrench[2];
  const double wanted = closed_forms::flat_punch_on_layer(kModulus, nu, 5.0, 2.0, 0.1).force;
  EXPECT_NEAR(force, wanted, 0.02 * wanted);
}

TEST_P(LayerGel, ARoundedPunchMeetsTheLayerReference) {
  const double nu = GetParam();
  const RoundedCylinder punch{2.0, 0.8, 3.0};
  const double core = punch.radius - punch.edge_radius;
  const auto slope = [&](double r) {
    const double out = r - core;
    return out <= 0.0 ? 0.0 : out / std::sqrt(std::max(1e-12, punch.edge_radius * punch.edge_radius - out * out));
  };
  Press press(layer_gel(nu), punch, 0.0);
  const double force = press.step(target_at(0.013, 0.021, -0.15)).wrench[2];
  const double wanted = closed_forms::profile_on_layer(kModulus, nu, 5.0, slope, 0.15, punch.radius).force;
  EXPECT_NEAR(force, wanted, 0.03 * wanted);
}

TEST_P(LayerGel, AConeMeetsTheLayerReference) {
  const double nu = GetParam();
  const ConeShape cone{80.0 * kRadiansPerDegree, 3.0, 0.0};
  Press press(layer_gel(nu), cone, 0.0);
  const double force = press.step(target_at(0.013, 0.021, -0.4)).wrench[2];
  const double slope = 1.0 / std::tan(cone.half_angle);
  const double wanted = closed_forms::profile_on_layer(
                            kModulus, nu, 5.0, [&](double) { return slope; }, 0.4, 10.0)
                            .force;
  EXPECT_NEAR(force, wanted, 0.02 * wanted);
  RecordProperty("relative_error", fmt::format("{:+.4f}", force / wanted - 1.0));
}

TEST_P(LayerGel, ShearNeedsAboutAsMuchAsBetweenSlipAndBond) {
  // Stuck: stiffer than a half space's disc, Q = 8 G a d/(2 - nu), as the layer is bonded below.
  const double nu = GetParam();
  const double shear_modulus = kModulus / (2.0 * (1.0 + nu));
  Press press(layer_gel(nu), RoundedCylinder{2.0, 0.0, 3.0}, std::numeric_limits<double>::infinity());
  press.step(target_at(0.013, 0.021, -0.3));
  const double before = press.state().wrench[0];
  const PressState& state = press.step(target_at(0.013 + 0.02, 0.021, -0.3));
  const double half_space = 8.0 * shear_modulus * 2.0 * 0.02 / (2.0 - nu);
  EXPECT_GT(before - state.wrench[0], 1.02 * half_space);
  EXPECT_LT(before - state.wrench[0], 1.6 * half_space);
}

INSTANTIATE_TEST_SUITE_P(Poisson, LayerGel, testing::Values(0.3, 0.49));

}  // namespace
}  // namespace touchstone::fem
