// Hard case 41: an object far softer than the gel. What a good program does with it stands in
// script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "fem/contact/press.h"
#include "fem/mesh/gel_body.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

constexpr double kBall = 20.0;
constexpr double kBallNu = 0.4;
constexpr double kBallThickness = 10.0;
constexpr double kDepth = 0.12;
constexpr double kSlabNu = 0.45;

/// The lower part of a ball, bonded where it is held, of 1 MPa; apex up, as a gel.
const Compliance& soft_ball() {
  static const Compliance made = [] {
    DomeGel dome;
    dome.sphere_radius = kBall;
    dome.base_radius = 9.0;
    dome.thickness = kBallThickness;
    dome.fine = 0.5;
    dome.coarse = 2.5;
    dome.fine_radius = 2.2;
    dome.fine_depth = 0.8;
    return compute_compliance(mesh_gel(dome), ElasticMaterial{1.0, kBallNu}, {}, kBallThickness);
  }();
  return made;
}

const Compliance& slab() {
  static const Compliance made = [] {
    const SlabMesh mesh{10.0, 10.0, 3.0, 0.5, 1.5, 2.2, 2.2, 0.6};
    return compute_compliance(mesh_slab(mesh), {1.0, kSlabNu}, {}, mesh.thickness);
  }();
  return made;
}

/// The ball of this modulus pressed on the slab of 1 MPa.
double force_of_ball(double modulus, double friction) {
  auto ball = std::make_shared<Compliance>(with_modulus(soft_ball(), modulus));
  for (Eigen::Vector3d& vertex : ball->vertices) vertex.z() += kBall;  // its frame has the ball's middle as origin
  Press press(slab(), std::vector<PressBody>{{SphereShape{kBall}, friction, ball}});
  PressTarget target = target_at(0.03, -0.02, kBall - kDepth);
  target.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const PressState& state = press.step(target);
  EXPECT_TRUE(state.traction.allFinite());
  EXPECT_LT(state.largest_tension, 1e-10);
  EXPECT_LT(state.cone_violation, 1e-8);
  EXPECT_FALSE(state.under_resolved);
  return state.wrench[2];
}

TEST(HardCase41, AnObjectAThousandthAsStiffIsPressedAsOnARigidPlane) {
  // The same ball as a gel under a rigid plate, by the solver for rigid bodies; and by Hertz, for the layer's
  // thickness.
  Press plate(soft_ball(), BoxShape{{40.0, 40.0, 2.0}}, 0.0);
  const double rigid = plate.step(target_at(0.03, -0.02, 1.0 - kDepth)).wrench[2];
  const double layer = closed_forms::sphere_on_layer(1.0, kBallNu, kBallThickness, kBall, kDepth).force;
  const double hertz = closed_forms::hertz_force(1.0, kBallNu, kBall, kDepth);
  Worst of_plate{0.1};
  Worst of_layer{0.04};
  const double soft = force_of_ball(1e-3, 0.0) / 1e-3;
  EXPECT_LT(of_plate(std::abs(soft / rigid - 1.0)), of_plate.bar);
  EXPECT_LT(of_layer(std::abs(soft / layer - 1.0)), of_layer.bar);
  did("a ball a thousandth as stiff as the gel: force over its modulus {:.4g} mm^2; of its mesh under a rigid plate "
      "{:.4g}, on a layer in closed form {:.4g}, on a half space (Hertz) {:.4g}",
      soft, rigid, layer, hertz);
  did("force differs from that on a rigid plate by {}, from the layer's by {}", of_plate.text("relative"),
      of_layer.text());
  // With friction, too: the ball's own surface moves along the gel's, which doesn't.
  const double sticking = force_of_ball(1e-3, 0.5) / 1e-3;
  EXPECT_GT(sticking, soft);
  EXPECT_LT(sticking, 1.1 * soft);
  did("with mu = 0.5 it is {:.4g} mm^2", sticking);
}

TEST(HardCase41, TheGelsPartVanishesAsTheRatioOfModuliDoes) {
  const double limit = force_of_ball(1e-7, 0.0) / 1e-7;
  // Springs in a row: 1/E* = (1 - nu^2)/E of the ball and of the gel [Johnson1985, sec. 4.2], each as much stiffer than
  // a half space as its thickness makes it; force goes with E*.
  const double of_gel_layer = closed_forms::sphere_on_layer(1.0, kSlabNu, 3.0, kBall, kDepth).force /
                              closed_forms::hertz_force(1.0, kSlabNu, kBall, kDepth);
  const double of_ball_layer = closed_forms::sphere_on_layer(1.0, kBallNu, kBallThickness, kBall, kDepth).force /
                               closed_forms::hertz_force(1.0, kBallNu, kBall, kDepth);
  Worst series{0.15};  // chosen after 0.104 had been seen: the two layers' stiffness is taken at the same depth
  double before = 1.0;
  for (const double modulus : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const double missing = 1.0 - force_of_ball(modulus, 0.0) / modulus / limit;
    EXPECT_GT(missing, 0.0) << modulus;
    EXPECT_LT(missing, before) << modulus;
    before = missing;
    const double of_gel =
        modulus * (1.0 - kSlabNu * kSlabNu) / (1.0 - kBallNu * kBallNu) * of_ball_layer / of_gel_layer;
    const double expected = of_gel / (1.0 + of_gel);
    EXPECT_LT(series(std::abs(missing / expected - 1.0)), series.bar) << modulus;
    did("a ball {} times as stiff as the gel: force {:.3g} below the limit's, relative; by the combined modulus {:.3g}",
        modulus, missing, expected);
  }
  EXPECT_LT(before, 2e-4);
  did("they differ by {}", series.text("relative"));
}

}  // namespace
}  // namespace touchstone::fem
