#include "closed_forms/contact_closed_forms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::closed_forms {
namespace {

TEST(LayerReference, MeetsHayesTable) {
  for (const double ratio : {0.2, 0.4, 1.0, 2.0}) {
    const double nu = 0.3;
    const double g = 1.0 / (2.0 * (1.0 + nu));
    const LayerContact found = flat_punch_on_layer(1.0, nu, 1.0 / ratio, 1.0, 0.01);
    EXPECT_NEAR(found.force * (1.0 - nu) / (4.0 * g * 0.01), hayes_kappa(ratio), 1e-5 * hayes_kappa(ratio)) << ratio;
  }
}

TEST(LayerReference, ThickLayerIsAHalfSpace) {
  const double thickness = 1e5;
  EXPECT_NEAR(flat_punch_on_layer(2.0, 0.45, thickness, 1.5, 0.1).force, flat_punch_force(2.0, 0.45, 1.5, 0.1), 1e-4);
  const LayerContact sphere = sphere_on_layer(2.0, 0.45, thickness, 4.0, 0.5);
  EXPECT_NEAR(sneddon_sphere_depth(4.0, sphere.contact_radius), 0.5, 1e-5);
  EXPECT_NEAR(sphere.force, sneddon_sphere_force(2.0, 0.45, 4.0, sphere.contact_radius), 1e-4);
}

TEST(LayerReference, VeryThinIncompressibleLayerSqueezesLikeAFilm) {
  // F = pi E a^6 / (96 R h^3) in the limit a/h -> infinity. The film's edge makes it act as if wider by some multiple c
  // of its thickness, F = pi E (a + c h)^6 / (96 R h^3): the limit holds if c is the same for all thin layers.
  const double radius = 100.0;
  const double depth = 1.0 / (4.0 * radius);
  double edge[2];
  for (int k = 0; k < 2; ++k) {
    const double h = k == 0 ? 0.16 : 0.08;
    const LayerContact found = sphere_on_layer(1.0, 0.5, h, radius, depth);
    const double a = found.contact_radius;
    const double ratio = found.force * 96.0 * radius * h * h * h / (kPi * std::pow(a, 6.0));
    edge[k] = (std::pow(ratio, 1.0 / 6.0) - 1.0) * a / h;
  }
  EXPECT_GT(edge[0], 0.0);
  EXPECT_NEAR(edge[1], edge[0], 0.15 * edge[0]);
}

TEST(LayerReference, ThinCompressibleLayerHasTheConfinedModulus) {
  const double nu = 0.3;
  const double confined = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
  EXPECT_NEAR(bonded_layer_kernel(nu, 1e-4) * 2.0 * (1.0 - nu * nu) / 1e-4, 1.0 / confined, 1e-6);
  EXPECT_NEAR(bonded_layer_kernel(nu, 1e-3 * (1.0 - 1e-9)), bonded_layer_kernel(nu, 1e-3 * (1.0 + 1e-9)), 1e-9);
  EXPECT_NEAR(bonded_layer_kernel(nu, 40.0), 1.0, 1e-12);
}

TEST(LayeredKernel, OfLayersThatAreAlikeIsTheOneLayers) {
  for (const double nu : {0.0, 0.3, 0.49, 0.5}) {
    const std::vector<ElasticLayer> one = {{5.0, 1.0, nu}};
    const std::vector<ElasticLayer> three = {{0.7, 1.0, nu}, {1.3, 1.0, nu}, {3.0, 1.0, nu}};
    for (const double q : {0.05, 0.3, 1.0, 3.0, 10.0, 40.0}) {
      const double wanted = bonded_layer_kernel(nu, q);
      EXPECT_NEAR(layered_kernel(one, q / 5.0), wanted, 1e-10 * wanted) << nu << ' ' << q;
      EXPECT_NEAR(layered_kernel(three, q / 5.0), wanted, 1e-10 * wanted) << nu << ' ' << q;
    }
  }
}

TEST(LayeredKernel, HasTheRightLimits) {
  const std::vector<ElasticLayer> layers = {{0.5, 10.0, 0.3}, {2.0, 1.0, 0.4}};
  const auto half_space = [](const ElasticLayer& m) {
    return 2.0 * (1.0 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus;
  };
  EXPECT_NEAR(layered_kernel(layers, 60.0), 1.0, 1e-9) << "short waves see the coating only";
  // Long waves squeeze the layers between two plates.
  double soft = 0.0;
  for (const ElasticLayer& m : layers) {
    const double nu = m.poisson_ratio;
    soft += m.thickness * (1.0 + nu) * (1.0 - 2.0 * nu) / ((1.0 - nu) * m.youngs_modulus);
  }
  const double k = 1e-4;
  EXPECT_NEAR(layered_kernel(layers, k) * half_space(layers[0]) / k, soft, 1e-5 * soft);
  // A coating that is nothing leaves the body's own kernel.
  const std::vector<ElasticLayer> bare = {{1e-7, 10.0, 0.3}, {2.0, 1.0, 0.4}};
  for (const double wave : {0.2, 1.0, 5.0}) {
    const double body = bonded_layer_kernel(0.4, 2.0 * wave) * half_space(bare[1]);
    EXPECT_NEAR(layered_kernel(bare, wave) * half_space(bare[0]), body, 1e-4 * body) << wave;
  }
}

TEST(LayeredKernel, ASphereOnLayersThatAreAlikeIsOnOne) {
  const std::vector<ElasticLayer> layers = {{1.0, 1.0, 0.45}, {4.0, 1.0, 0.45}};
  const double wanted = sphere_on_layer(1.0, 0.45, 5.0, 8.0, 0.3).force;
  EXPECT_NEAR(sphere_on_layers(layers, 8.0, 0.3).force, wanted, 1e-7 * wanted);
}

TEST(SneddonSphere, IsHertzWhenShallow) {
  const double a = 0.05, radius = 10.0;
  const double depth = sneddon_sphere_depth(radius, a);
  EXPECT_NEAR(depth, a * a / radius, 1e-5 * depth);
  EXPECT_NEAR(sneddon_sphere_force(1.0, 0.3, radius, a), hertz_force(1.0, 0.3, radius, depth), 1e-8);
}

TEST(PointForces, ObeyBettiReciprocity) {
  // Work of a push at A through Cerruti's sinking there, against work of the shear at B through Boussinesq's drift.
  const double x = 0.7, y = -0.4;
  const Eigen::Vector3d at_push = cerruti_displacement(2.0, 0.37, 1.0, x, y);
  const Eigen::Vector3d at_shear = boussinesq_displacement(2.0, 0.37, 1.0, -x, -y);
  EXPECT_NEAR(-at_push.z(), at_shear.x(), 1e-14);
  EXPECT_LT(boussinesq_displacement(2.0, 0.37, 1.0, x, y).z(), 0.0);
}

TEST(Mindlin, SlipsAsAWholeAtTheLimit) {
  EXPECT_DOUBLE_EQ(mindlin_stick_ratio(0.5, 0.5, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(mindlin_stick_ratio(0.0, 0.5, 1.0), 1.0);
  const double small = 1e-6;  // bonded disc: Q = 16 G a d / (2 (2 - nu))... the linear limit of the displacement
  const double g = 1.0 / 2.6;
  EXPECT_NEAR(mindlin_displacement(1.0, 0.3, 2.0, small, 0.5, 1.0), (2.0 - 0.3) * small / (8.0 * g * 2.0), 1e-11);
}

TEST(Dimitriadis, IsHertzOnAThickLayerAndMeetsIntegralEquationsOnAThinnerOne) {
  EXPECT_NEAR(dimitriadis_force(2.0, 5.0, 1e9, 0.01) / hertz_force(2.0, 0.5, 5.0, 0.01), 1.0, 1e-9);
  const double radius = 200.0;  // so flat that sphere and paraboloid are one
  double before = 1e-4;
  for (const double chi : {0.05, 0.1, 0.2}) {
    const double depth = std::pow(chi * 5.0, 2) / radius;
    const double exact = sphere_on_layer(1.0, 0.5, 5.0, radius, depth).force;
    const double error = 1.0 - dimitriadis_force(1.0, radius, 5.0, depth) / exact;
    EXPECT_GT(error, before) << "the series is cut: the farther, the more is missing";
    EXPECT_LT(error, 0.3 * chi * chi);
    before = error;
  }
}

TEST(ThinLayer, FormulaIsApproachedFromBelowAsTheContactWidens) {
  double before = 1.0;
  for (const double ratio : {5.0, 10.0, 20.0}) {
    const double radius = 100.0 * ratio * ratio;
    const double depth = 1.0 / 400.0;  // a = 2 sqrt(R d) is `ratio` thicknesses
    const double exact = sphere_on_layer(1.0, 0.5, 1.0, radius, depth).force;
    const double error = 1.0 - thin_layer_force(1.0, radius, 1.0, depth) / exact;
    EXPECT_GT(error, 0.0);
    EXPECT_LT(error, 0.5 * before);
    before = error;
  }
}

TEST(Hayes, RefusesWhatIsNotTabulated) {
  EXPECT_THROW(hayes_kappa(0.3), Error);
}

}  // namespace
}  // namespace touchstone::closed_forms
