// Domes, fingertips and layered gels against closed forms and references that don't use the finite elements.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

#include "closed_forms/contact_closed_forms.h"
#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "tests/fem/elements/gaussian_work.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

PressTarget at(const Vector3d& place) {
  PressTarget target;
  for (int a = 0; a < 3; ++a) target.axis[a] = AxisControl::at(place[a]);
  return target;
}

Compliance gel_of(const GelBody& body, const std::vector<ElasticMaterial>& materials) {
  return compute_compliance(mesh_gel(body), materials, {}, thickness_of(body));
}

/// Work of the pressure exp(-r^2 / (2 s^2)) over the displacement it causes on endless layers.
double gaussian_work_on(const std::vector<closed_forms::ElasticLayer>& layers, double s) {
  const double nu = layers[0].poisson_ratio;
  const int steps = 3000;
  const double end = 8.0 / s;
  double integral = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double k = end * (i + 0.5) / steps;
    integral += closed_forms::layered_kernel(layers, k) * std::exp(-k * k * s * s) * end / steps;
  }
  return 4.0 * kPi * (1.0 - nu * nu) / layers[0].youngs_modulus * std::pow(s, 4) * integral;
}

struct Coating {
  double thickness;
  ElasticMaterial material;
};

class CoatedSlab : public testing::TestWithParam<Coating> {
 protected:
  static constexpr ElasticMaterial kBody{1.0, 0.3};
  static SlabGel slab() {
    SlabGel gel{{24.0, 24.0, 5.0, 0.5, 2.0, 2.6, 2.6, 1.0}, {}};
    if (GetParam().thickness > 0.0) gel.layers = {GetParam().thickness};
    return gel;
  }
  static const Compliance& gel() {
    static std::map<double, Compliance> made;
    const double key = GetParam().thickness + 1e3 * GetParam().material.youngs_modulus;
    if (!made.contains(key)) {
      std::vector<ElasticMaterial> materials = {kBody};
      if (GetParam().thickness > 0.0) materials.push_back(GetParam().material);
      made[key] = gel_of(slab(), materials);
    }
    return made[key];
  }
  static std::vector<closed_forms::ElasticLayer> reference() {
    if (GetParam().thickness == 0.0) return {{5.0, kBody.youngs_modulus, kBody.poisson_ratio}};
    return {{GetParam().thickness, GetParam().material.youngs_modulus, GetParam().material.poisson_ratio},
            {5.0 - GetParam().thickness, kBody.youngs_modulus, kBody.poisson_ratio}};
  }
};

TEST_P(CoatedSlab, MeetsTheKernelOfALayeredHalfSpaceUnderAGaussianPressure) {
  const double wanted = gaussian_work_on(reference(), 1.0);
  EXPECT_NEAR(fixtures::gaussian_work(gel(), 1.0), wanted, 0.003 * wanted);
}

INSTANTIATE_TEST_SUITE_P(Coatings, CoatedSlab,
                         testing::Values(Coating{0.0, {1.0, 0.3}}, Coating{0.01, {100.0, 0.3}},
                                         Coating{0.03, {20.0, 0.45}}, Coating{0.2, {0.1, 0.49}},
                                         Coating{0.2, {10.0, 0.3}}, Coating{1.5, {3.0, 0.2}}));

/// For thinner coatings the reference would take minutes.
class ThickCoating : public CoatedSlab {};

TEST_P(ThickCoating, MeetsTheLayeredReferenceUnderASphere) {
  const double depth = 0.4;
  Press press(gel(), SphereShape{8.0}, 0.0);
  const double force = press.step(at({0.013, 0.021, 8.0 - depth})).wrench[2];
  const double wanted = closed_forms::sphere_on_layers(reference(), 8.0, depth).force;
  EXPECT_NEAR(force, wanted, 0.015 * wanted);
}

INSTANTIATE_TEST_SUITE_P(Coatings, ThickCoating,
                         testing::Values(Coating{0.0, {1.0, 0.3}}, Coating{0.2, {0.1, 0.49}}, Coating{0.2, {10.0, 0.3}},
                                         Coating{1.5, {3.0, 0.2}}));

TEST(CoatedGels, AStiffCoatingMakesThemStifferAndASoftOneSofter) {
  SlabGel slab{{10.0, 10.0, 3.0, 0.5, 1.5, 2.0, 2.0, 0.5}, {0.05}};
  DomeGel dome;
  dome.layers = {0.05};
  FingertipGel tip;
  tip.layers = {0.05};
  for (const GelBody& body : std::vector<GelBody>{slab, dome, tip}) {
    double before = 0.0;
    for (const double modulus : {0.01, 0.33, 100.0}) {
      const Compliance gel = gel_of(body, {{0.33, 0.45}, {modulus, 0.45}});
      Press press(gel, SphereShape{4.0}, 0.0);
      const double force = press.step(at({0.0, 0.0, 4.0 - 0.3})).wrench[2];
      EXPECT_GT(force, 1.02 * before) << body.index() << ' ' << modulus;
      before = force;
    }
  }
}

TEST(CoatedGels, ALayerLikeTheBodyChangesNothing) {
  DomeGel dome;
  dome.layers = {0.2};
  TetMesh mesh = mesh_gel(dome);
  const ElasticMaterial material{0.33, 0.49};
  const Compliance layered = compute_compliance(mesh, std::vector{material, material}, {}, 1.0);
  mesh.region.clear();
  const Compliance plain = compute_compliance(mesh, material, {}, 1.0);
  EXPECT_LT((layered.surface.view() - plain.surface.view()).norm(), 1e-13 * plain.surface.view().norm());
}

TEST(Domes, AVeryLargeSphereIsAFlatLayer) {
  DomeGel dome;
  dome.sphere_radius = 1e4;
  dome.base_radius = 20.0;
  dome.thickness = 5.0;
  dome.fine = 0.4;
  dome.coarse = 2.5;
  dome.fine_radius = 2.6;
  dome.fine_depth = 0.6;
  const Compliance gel = gel_of(dome, {{1.0, 0.49}});
  for (const double depth : {0.3, 0.5}) {
    Press press(gel, SphereShape{8.0}, 0.0);
    const double force = press.step(at({0.013, 0.021, 8.0 - depth})).wrench[2];
    const double wanted = closed_forms::sphere_on_layer(1.0, 0.49, 5.0, 8.0, depth).force;
    EXPECT_NEAR(force, wanted, 0.01 * wanted) << depth;
  }
}

/// A thick dome: contacts of 1 mm on a hemisphere of 80 mm, the far side 80 times as far away.
TEST(Domes, ASphereOnADomeMeetsHertzWithBothCurvatures) {
  DomeGel dome;
  dome.sphere_radius = dome.base_radius = 80.0;
  dome.fine = 0.25;
  dome.coarse = 25.0;
  dome.fine_radius = 1.6;
  dome.fine_depth = 0.5;
  for (const double nu : {0.3, 0.49}) {
    const Compliance gel = gel_of(dome, {{1.0, nu}});
    for (const double radius : {20.0, 40.0, 160.0}) {
      const double together = 1.0 / (1.0 / radius + 1.0 / 80.0);
      const double depth = 1.1 / together;  // a contact radius of 1.05 mm
      Press press(gel, SphereShape{radius}, 0.0);
      const double force = press.step(at({0.013, 0.021, radius - depth})).wrench[2];
      const double wanted = closed_forms::hertz_force(1.0, nu, together, depth);
      EXPECT_NEAR(force, wanted, 0.02 * wanted) << nu << ' ' << radius;
      // What the dome's own curvature is worth is far more than the tolerance.
      const double flat = closed_forms::hertz_force(1.0, nu, radius, depth);
      EXPECT_GT(flat / wanted, 1.1);
    }
  }
}

TEST(Fingertips, ASlantedPressIsTheSameAllRound) {
  FingertipGel tip;
  tip.fine = 0.6;
  tip.fine_radius = 7.0;
  tip.layers = {0.3};
  const Compliance gel = gel_of(tip, {{0.3, 0.49}, {1.0, 0.49}});
  const double slant = 0.5;
  std::vector<double> along;
  std::vector<double> down;
  for (const double azimuth : {0.0, 0.2, kPi / 3.0, 2.0, 4.0}) {
    const Vector3d out(std::sin(slant) * std::cos(azimuth), std::sin(slant) * std::sin(azimuth), std::cos(slant));
    Press press(gel, SphereShape{6.0}, 0.0);
    const Vector3d force = press.step(at(Vector3d(0, 0, -8) + (8.0 + 6.0 - 0.6) * out)).wrench.head<3>();
    const Vector3d across(-std::sin(azimuth), std::cos(azimuth), 0.0);
    EXPECT_LT(std::abs(force.dot(across)), 0.01 * force.norm()) << azimuth;
    along.push_back(force.dot(out));
    down.push_back(force.z());
  }
  for (std::size_t k = 1; k < along.size(); ++k) {
    EXPECT_NEAR(along[k], along[0], 0.02 * along[0]);
    EXPECT_NEAR(down[k], down[0], 0.02 * std::abs(down[0]));
  }
  // Turned by 60 degrees the outer surface is the same; what is left is TetGen's inside.
  EXPECT_NEAR(along[2], along[0], 0.003 * along[0]);
}

TEST(Fingertips, ABallAtTheirSideTouchesThereAndNotThroughTheGel) {
  // The lines through points on the other side leave the gel under the ball.
  FingertipGel tip;
  tip.fine = 0.7;
  tip.fine_radius = 15.0;
  tip.sleeve = 4.0;
  const Compliance gel = gel_of(tip, {{0.3, 0.49}});
  for (const double slant : {0.0, 1.1, 1.5}) {
    const Vector3d out(std::sin(slant), 0.0, std::cos(slant));
    Press press(gel, SphereShape{6.0}, 0.0);
    const PressState& state = press.step(at(Vector3d(0, 0, -8) + (8.0 + 6.0 - 0.5) * out));
    const Vector3d force = state.wrench.head<3>();
    EXPECT_GT(force.norm(), 0.05) << slant;
    EXPECT_NEAR(force.dot(out), force.norm(), 0.003 * force.norm()) << slant;
    for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
      if (state.node_state[v] == NodeState::open) continue;
      EXPECT_GT((gel.vertices[v] - Vector3d(0, 0, -8)).dot(out), 7.0) << slant;
    }
  }
}

TEST(Fingertips, ALongerSleeveHoldsThemStiffer) {
  double before = 0.0;
  for (const double sleeve : {0.0, 3.0, 6.0, 8.0}) {
    FingertipGel tip;
    tip.sleeve = sleeve;
    const Compliance gel = gel_of(tip, {{0.3, 0.49}});
    Press press(gel, BoxShape{{60, 60, 10}}, 0.0);
    const double force = press.step(at({0.0, 0.0, 5.0 - 1.0})).wrench[2];
    EXPECT_GT(force, before) << sleeve;
    before = force;
  }
}

TEST(Solids, ABoxFromTrianglesIsTheSlab) {
  const SlabMesh slab{10.0, 10.0, 3.0, 0.4, 1.5, 2.0, 2.0, 0.6};
  SolidGel box;
  for (int corner = 0; corner < 8; ++corner) {
    box.surface.vertices.emplace_back((corner & 1) ? 5.0 : -5.0, (corner & 2) ? 5.0 : -5.0, (corner & 4) ? 0.0 : -3.0);
  }
  box.surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  box.faces.assign(12, FaceKind::side);
  box.faces[0] = box.faces[1] = FaceKind::bonded;
  box.faces[2] = box.faces[3] = FaceKind::outer;
  box.fine = 0.4;
  box.fine_half_x = box.fine_half_y = 2.0;
  box.fine_depth = 0.6;
  const Compliance one = gel_of(SlabGel{slab, {}}, {{1.0, 0.49}});
  const Compliance other = gel_of(box, {{1.0, 0.49}});
  Press a(one, SphereShape{8.0}, 0.0);
  Press b(other, SphereShape{8.0}, 0.0);
  const double wanted = a.step(at({0.013, 0.021, 8.0 - 0.3})).wrench[2];
  EXPECT_NEAR(b.step(at({0.013, 0.021, 8.0 - 0.3})).wrench[2], wanted, 0.01 * wanted);
}

}  // namespace
}  // namespace touchstone::fem
