#include "fem/elements/elastic_material.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"

namespace touchstone::fem {
namespace {

TEST(ElasticMaterial, ModuliFollowFromYoungAndPoisson) {
  const ElasticMaterial material{2.6, 0.3};
  EXPECT_DOUBLE_EQ(shear_modulus(material), 1.0);
  EXPECT_DOUBLE_EQ(lame_ratio(material), 1.5);
  EXPECT_EQ(lame_ratio({1.0, 0.0}), 0.0);
}

TEST(ElasticMaterial, IncompressibleIsLegalAndFinite) {
  EXPECT_NO_THROW(check(ElasticMaterial{1.0, 0.5}));
  EXPECT_EQ(lame_ratio({1.0, 0.5}), lame_ratio({1.0, kLargestPoissonRatio}));
  EXPECT_LT(lame_ratio({1.0, 0.5}), 1e8);
}

TEST(ElasticMaterial, WhatNoGelCanBeIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const ElasticMaterial& bad : {ElasticMaterial{0.0, 0.3}, ElasticMaterial{-1.0, 0.3}, ElasticMaterial{nan, 0.3},
                                     ElasticMaterial{infinity, 0.3}, ElasticMaterial{1.0, nan},
                                     ElasticMaterial{1.0, -0.1}, ElasticMaterial{1.0, 0.5000001}}) {
    EXPECT_THROW(check(bad), Error) << bad.youngs_modulus << ' ' << bad.poisson_ratio;
  }
}

}  // namespace
}  // namespace touchstone::fem
