// The hard cases of a gel whose surface does what no press computes: 34 (it wrinkles under a stiff skin) and 37 (it
// folds). What a good program does with each stands in script/hard_cases_page.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/units.h"
#include "fem/contact/surface_check.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/gel_body.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const RoundedCylinder kPunch{1.0, 0.1, 2.0};

std::vector<std::string> doubts_of(const Compliance& gel, const ContactShape& shape, const PressState& state,
                                   const std::vector<ElasticMaterial>& materials, SurfaceCheck* check = nullptr) {
  const ContactShape* const body = &shape;
  const SurfaceCheck found = check_surface(gel.vertices, gel.triangles, {&body, 1}, state);
  if (check != nullptr) *check = found;
  return surface_doubts(found, materials);
}

TEST(HardCase34, TheCriticalStrainIsTheLeastOverAllWavelengths) {
  // A film of thickness h on the gel bends with E_film' h^3 k^4 / 12 and is held by the gel with k E_body' / (2 M(k
  // H)), H being the gel's thickness; under a compressive stress s it buckles where s h k^2 is their sum.
  const ElasticMaterial body{1.0, 0.49};
  Worst away{0.01};
  for (const double ratio : {10.0, 100.0, 1000.0}) {
    const ElasticMaterial film{ratio, 0.49};
    double least = kInfinity;
    double longest = 0.0;
    for (double q = 1e-3; q < 3.0; q *= 1.001) {                                            // k h
      const double held = 1.0 / (2.0 * closed_forms::bonded_layer_kernel(0.49, q * 50.0));  // H = 50 h
      const double strain = q * q / 12.0 + held / (ratio * q);
      if (strain < least) {
        least = strain;
        longest = 2.0 * kPi / q;
      }
    }
    EXPECT_LT(away(std::abs(wrinkling_strain(film, body) / least - 1.0)), away.bar) << ratio;
    did("a skin {} times as stiff on a gel 50 times as thick wrinkles from a strain of {:.3g} on, in waves of {:.3g} "
        "thicknesses",
        ratio, wrinkling_strain(film, body), longest);
  }
  EXPECT_EQ(wrinkling_strain(body, body), kInfinity);
  did("that differs from the least over all wavelengths by {}", away.text("relative"));
}

TEST(HardCase34, ASkinShortenedBeyondItsCriticalStrainIsSaid) {
  // A skin of 60 um, 60 times as stiff as the gel; a punch that sticks to it is drawn along.
  SlabGel gel{{8.0, 8.0, 2.0, 0.5, 1.2, 2.0, 2.0, 0.5}, {0.06}};
  const std::vector<ElasticMaterial> materials = {{0.2, 0.49}, {12.0, 0.49}};
  const double critical = wrinkling_strain(materials[1], materials[0]);
  const Compliance skinned = compute_compliance(mesh_gel(gel), materials, {}, 2.0);
  Press press(skinned, kPunch, kInfinity);
  SurfaceCheck check;
  press.step(target_at(0, 0, -0.05));
  const double steps[] = {0.01, 0.02, 0.05, 0.1};
  int said = 0;
  int silent = 0;
  for (const double x : steps) {
    const PressState& state = press.step(target_at(x, 0, -0.05));
    const auto doubts = doubts_of(skinned, kPunch, state, materials, &check);
    if (check.shortening > critical) {
      ++said;
      EXPECT_THAT(doubts, ElementsAre(HasSubstr("60 times as stiff as the gel wrinkles")));
      if (said == 1) did("drawn along by {} mm: \"{}\"", x, doubts.empty() ? "" : doubts.front());
    } else {
      ++silent;
      EXPECT_THAT(doubts, IsEmpty());
      did("drawn along by {} mm: shortened by {:.2g}, nothing is said", x, check.shortening);
    }
  }
  EXPECT_GT(said, 0);
  EXPECT_GT(silent, 0);
  // The same shortening says nothing of a gel without a skin.
  EXPECT_THAT(surface_doubts(check, std::span(materials).first(1)), IsEmpty());
}

Compliance plain_gel() {
  const SlabMesh slab{8.0, 8.0, 2.0, 0.5, 1.2, 2.0, 2.0, 0.5};
  return compute_compliance(mesh_slab(slab), {0.33, 0.45}, {}, 2.0);
}

const std::vector<ElasticMaterial> kPlain = {{0.33, 0.45}};

TEST(HardCase37, AGelThatFoldsBeforeADraggedPunchIsSaid) {
  const Compliance gel = plain_gel();
  Press press(gel, kPunch, kInfinity);
  EXPECT_THAT(doubts_of(gel, kPunch, press.step(target_at(0, 0, -0.1)), kPlain), IsEmpty());
  EXPECT_THAT(doubts_of(gel, kPunch, press.step(target_at(0.1, 0, -0.1)), kPlain), IsEmpty());
  did("a punch that sticks to the gel, drawn along by 0.1 mm: nothing is said");
  const auto doubts = doubts_of(gel, kPunch, press.step(target_at(2.0, 0, -0.1)), kPlain);
  EXPECT_THAT(doubts, ElementsAre(HasSubstr("the gel folds")));
  did("drawn along by 2 mm, its radius: \"{}\"", doubts.empty() ? "" : doubts.front());
}

TEST(HardCase37, OrdinaryPressesRaiseNoDoubt) {
  const Compliance gel = plain_gel();
  for (const auto& [what, shape, depth] :
       {std::tuple{"a ball of 3 mm radius", ContactShape(SphereShape{3.0}), 0.3},
        {"a sharp punch of 1 mm radius", ContactShape(RoundedCylinder{1.0, 0.0, 2.0}), 0.2},
        {"a ring", ContactShape(TorusShape{1.2, 0.4}), 0.2},
        {"a cone of 60 degrees to its axis", ContactShape(ConeShape{60.0 * kRadiansPerDegree, 2.0, 0.0}), 0.3},
        {"a cube on its edge", ContactShape(BoxShape{{1.5, 1.5, 1.5}}), 0.3}}) {
    Press press(gel, shape, 0.5);
    const BoundingBall ball = bounding_ball(shape);
    PressTarget target = target_at(0.07, 0.03, 0.0);
    if (std::holds_alternative<BoxShape>(shape)) {
      target.rotation = Eigen::AngleAxisd(0.25 * kPi, Eigen::Vector3d::UnitX()).toRotationMatrix();
      target.axis[2] = AxisControl::at(0.75 * std::sqrt(2.0) - depth);
    } else if (std::holds_alternative<SphereShape>(shape)) {
      target.axis[2] = AxisControl::at(ball.radius - depth);
    } else if (std::holds_alternative<TorusShape>(shape)) {
      target.axis[2] = AxisControl::at(0.4 - depth);
    } else {
      target.axis[2] = AxisControl::at(-depth);
    }
    SurfaceCheck check;
    EXPECT_THAT(doubts_of(gel, shape, press.step(target), kPlain, &check), IsEmpty()) << what;
    did("{} {} mm deep: nothing folds, the free surface lies at most {:.2g} edges within it", what, depth,
        check.into_object > 0.0 ? check.into_object / check.edge : 0.0);
  }
}

TEST(HardCase37, AtFiniteStrainAFoldIsSaidOrThePressRefused) {
  const FiniteGel gel(fixtures::box_mesh({8, 8, 3}, 6, 6, 2), kPlain, {}, 3.0);
  const ContactShape punch = RoundedCylinder{1.6, 0.2, 2.0};
  const ContactShape* const body = &punch;
  FinitePress press(gel, punch, kInfinity);
  const auto doubts = [&](const PressState& state) {
    return surface_doubts(check_surface(gel.rest.vertices, gel.rest.triangles, {&body, 1}, state), kPlain);
  };
  EXPECT_THAT(doubts(press.step(target_at(0, 0, -0.2))), IsEmpty());
  std::string found;
  double reached = 0.0;
  while (reached < 5.0 && found.empty()) {
    reached += 0.6;
    try {
      const auto said = doubts(press.step(target_at(reached, 0, -0.2)));
      if (!said.empty()) found = "it says \"" + said.front() + '"';
    } catch (const Error& error) {
      found = test::refused(error.what());
    }
  }
  EXPECT_NE(found, "");
  EXPECT_GT(reached, 0.6);  // what doesn't fold is answered
  did("at finite strain, a punch of 1.6 mm radius that sticks, drawn along by {:.2g} mm: {}", reached, found);
}

}  // namespace
}  // namespace touchstone::fem
