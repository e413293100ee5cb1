// Hard case 31: a layer much thinner than its contact is wide, up to a Poisson's ratio of 0.5. What a good program does
// with it stands in script/hard_cases_page.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "fem/mesh/gel_body.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/message_of.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

constexpr double kThickness = 0.2;
constexpr double kRadius = 2.0;
constexpr double kDepth = 0.01;

const SlabMesh kLayer{5.6, 5.6, kThickness, 0.2, 0.2, 2.4, 2.4, kThickness};

const Compliance& layer_of(double nu) {
  static std::vector<std::pair<double, Compliance>> made;
  for (const auto& [ratio, gel] : made) {
    if (ratio == nu) return gel;
  }
  made.reserve(8);
  made.emplace_back(nu, compute_compliance(mesh_slab(kLayer), {1.0, nu}, {}, kThickness));
  return made.back().second;
}

/// Force of a flat punch without friction on a thin bonded layer, first order in thickness over radius. What is pushed
/// out of the way flows aside under the pressure's slope (Poiseuille's parabola, at rest on the base and free under the
/// punch) or is compressed: -h^3 / (3 G) lap p + h p / (lambda + 2 G) = depth, p = 0 at the rim. Both ends are in
/// [Johnson1985, sec. 5.8]: uniform pressure where the layer is compressible, 3 pi G a^4 depth / (8 h^3) where it
/// isn't.
double thin_punch_force(double nu, double thickness, double radius, double depth) {
  const double g = 1.0 / (2.0 * (1.0 + nu));
  if (nu == 0.5) return 3.0 * kPi * g * std::pow(radius, 4) * depth / (8.0 * std::pow(thickness, 3));
  const double oedometric = 2.0 * g * (1.0 - nu) / (1.0 - 2.0 * nu);
  const double x = radius / thickness * std::sqrt(3.0 * g / oedometric);
  return kPi * radius * radius * oedometric * depth / thickness *
         (1.0 - 2.0 * std::cyl_bessel_i(1.0, x) / (x * std::cyl_bessel_i(0.0, x)));
}

/// The thin layer's formula is the limit of the integral equation, to first order in thickness over radius.
TEST(HardCase31, TheThinLayersFormulaIsTheLimitOfTheIntegralEquation) {
  for (const double nu : {0.45, 0.49, 0.499, 0.5}) {
    std::array<double, 2> away{};
    for (int k = 0; k < 2; ++k) {
      const double thickness = kRadius * (k == 0 ? 0.1 : 0.05);
      const double exact = closed_forms::flat_punch_on_layer(1.0, nu, thickness, kRadius, kDepth).force;
      away[static_cast<std::size_t>(k)] = exact / thin_punch_force(nu, thickness, kRadius, kDepth) - 1.0;
    }
    // With half the thickness half as much, and less where the second order adds to the first.
    EXPECT_GT(away[1], 0.0) << nu;
    EXPECT_LT(away[1], 0.55 * away[0]) << nu;
    did("nu = {}: the integral equation's force is above the thin layer's formula by {:.3g} at a thickness of a tenth "
        "of "
        "the punch's radius, by {:.3g} at a twentieth",
        nu, away[0], away[1]);
  }
}

TEST(HardCase31, APunchMeetsTheLayersTheoryAndItsPressureDoesNotOscillate) {
  double before = 0.0;
  Worst away{0.03};
  Worst rise{0.02};
  for (const double nu : {0.45, 0.49, 0.499, 0.5}) {
    Press press(layer_of(nu), RoundedCylinder{kRadius, 0.0, 3.0}, 0.0);
    const PressState& state = press.step(target_at(0.013, 0.021, -kDepth));
    const double expected = closed_forms::flat_punch_on_layer(1.0, nu, kThickness, kRadius, kDepth).force;
    const double force = state.wrench[2];
    EXPECT_LT(away(std::abs(force / expected - 1.0)), away.bar) << nu;
    EXPECT_GT(force, before) << nu;
    before = force;
    // Three quarters of the radius in, where the rim's peak is gone: pressure only falls from the middle outwards.
    const Compliance& gel = layer_of(nu);
    std::vector<std::pair<double, double>> at;
    double highest = 0.0;
    for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
      const double r = (gel.vertices[v].head<2>() - Eigen::Vector2d(0.013, 0.021)).norm();
      if (r > 0.75 * kRadius) continue;
      at.emplace_back(r, -state.traction(static_cast<Eigen::Index>(v), 2));
      highest = std::max(highest, at.back().second);
    }
    std::sort(at.begin(), at.end());
    double lowest = std::numeric_limits<double>::infinity();
    for (const auto& [r, pressure] : at) {
      rise((pressure - lowest) / highest);
      lowest = std::min(lowest, pressure);
    }
    EXPECT_LT(rise.seen, rise.bar) << nu;
    did("nu = {}: {:.4g} N under a punch ten thicknesses in radius, {:.4g} N by the integral equation, {:.4g} N by the "
        "thin layer's formula",
        nu, force, expected, thin_punch_force(nu, kThickness, kRadius, kDepth));
  }
  did("force differs from the integral equation's by {}; pressure rises outwards by {} of its highest", away.text(),
      rise.text());
}

TEST(HardCase31, AtAHalfThePressureIsTheParabolaOfAThinFilm) {
  const Compliance& gel = layer_of(0.5);
  Press press(gel, RoundedCylinder{kRadius, 0.0, 3.0}, 0.0);
  const PressState& state = press.step(target_at(0.013, 0.021, -kDepth));
  std::vector<std::array<double, 2>> at;
  for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
    const double r2 = (gel.vertices[v].head<2>() - Eigen::Vector2d(0.013, 0.021)).squaredNorm();
    if (r2 < std::pow(0.75 * kRadius, 2)) at.push_back({r2, -state.traction(static_cast<Eigen::Index>(v), 2)});
  }
  Eigen::MatrixX2d basis(static_cast<Eigen::Index>(at.size()), 2);
  Eigen::VectorXd pressure(static_cast<Eigen::Index>(at.size()));
  for (Eigen::Index k = 0; k < pressure.size(); ++k) {
    basis.row(k) << 1.0, at[static_cast<std::size_t>(k)][0];
    pressure[k] = at[static_cast<std::size_t>(k)][1];
  }
  const Eigen::Vector2d fit = basis.colPivHouseholderQr().solve(pressure);
  Worst curve{0.03};
  Worst scatter{0.01};
  // p = 3 G depth (a^2 - r^2) / (4 h^3): its curvature doesn't depend on where the contact is taken to end.
  const double expected = -3.0 / 3.0 * kDepth / (4.0 * std::pow(kThickness, 3));
  EXPECT_LT(curve(std::abs(fit[1] / expected - 1.0)), curve.bar);
  EXPECT_LT(scatter((basis * fit - pressure).norm() / std::sqrt(static_cast<double>(at.size())) / pressure.maxCoeff()),
            scatter.bar);
  did("nu = 0.5: pressure at {} vertices lies off a parabola by {} of its highest (root mean square), whose curvature "
      "differs from the thin layer's by {}",
      at.size(), scatter.text(), curve.text("relative"));
}

/// Bonded to the punch, too, what flows aside is at rest on both faces: 3 pi G a^4 depth / (2 h^3), four times as much
/// ([Gent1959] in the limit of thin discs). The rim adds a part in proportion to thickness over radius.
TEST(HardCase31, ABondedPunchTendsToTheBondedFilm) {
  constexpr double kRadii[] = {1.0, 4.0 / 3.0, 2.0};
  for (const double friction : {0.0, std::numeric_limits<double>::infinity()}) {
    const double factor = friction == 0.0 ? 3.0 / 8.0 : 3.0 / 2.0;
    Eigen::Matrix3d basis;
    Eigen::Vector3d ratio;
    for (int k = 0; k < 3; ++k) {
      Press press(layer_of(0.5), RoundedCylinder{kRadii[k], 0.0, 3.0}, friction);
      const double force = press.step(target_at(0.013, 0.021, -kDepth)).wrench[2];
      const double x = kThickness / kRadii[k];
      basis.row(k) << 1.0, x, x * x;
      ratio[k] = force / (factor * kPi / 3.0 * std::pow(kRadii[k], 4) * kDepth / std::pow(kThickness, 3));
    }
    Worst away{0.05};
    EXPECT_LT(away(std::abs(basis.colPivHouseholderQr().solve(ratio)[0] - 1.0)), away.bar);
    did("nu = 0.5, {}: force over {} pi G a^4 depth / h^3 is {:.4g}, {:.4g} and {:.4g} where the thickness is 1/5, "
        "3/20 "
        "and 1/10 of the radius; drawn on to none it differs from 1 by {}",
        friction == 0.0 ? "without friction" : "bonded to the punch", factor, ratio[0], ratio[1], ratio[2],
        away.text());
  }
}

TEST(HardCase31, ABallMeetsTheLayersTheory) {
  Worst away{0.02};
  for (const auto& [nu, depth] : {std::pair{0.45, 0.03}, {0.49, 0.024}, {0.499, 0.018}, {0.5, 0.016}}) {
    Press press(layer_of(nu), SphereShape{60.0}, 0.0);
    const PressState& state = press.step(target_at(0.013, 0.021, 60.0 - depth));
    const auto slope = [](double r) { return r / std::sqrt(3600.0 - r * r); };
    const closed_forms::LayerContact wanted = closed_forms::profile_on_layer(1.0, nu, kThickness, slope, depth, 4.0);
    EXPECT_LT(away(std::abs(state.wrench[2] / wanted.force - 1.0)), away.bar) << nu;
    did("nu = {}, a layer {:.2g} of the contact's radius thick under a ball: {:.4g} N, by the integral equation {:.4g} "
        "N",
        nu, kThickness / wanted.contact_radius, state.wrench[2], wanted.force);
  }
  did("they differ by {}", away.text("relative"));
}

TEST(HardCase31, ALayerTooThinForAMeshIsRefusedBeforeItIsMeshed) {
  SlabGel film{kLayer, {}};
  film.mesh.thickness = film.mesh.fine = film.mesh.coarse = film.mesh.fine_depth = kRadius / 60.0;
  const std::string said = test::message_of([&] { mesh_gel(film); });
  EXPECT_THAT(said, ::testing::HasSubstr("are allowed"));
  did("a layer a sixtieth of the contact's radius thick, on edges of its thickness: refused, \"{}\"", said);
}

}  // namespace
}  // namespace touchstone::fem
