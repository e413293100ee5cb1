#include "lab/gelsight/gelsight_dome_experiment.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace touchstone::lab {
namespace {

sim::GelSpec dome() {
  sim::GelSpec gel;
  gel.shape = sim::DomeSpec{.sphere_radius_mm = 30.0, .base_radius_mm = 10.0};
  gel.thickness_mm = 4.7;
  gel.youngs_modulus_MPa = 0.15;
  gel.poisson_ratio = 0.49;
  return gel;
}

// The plate behind the gel makes it stiffer, so the same force touches less.
TEST(GelsightDome, ALayerTouchesLessThanAHalfSpaceTheMoreTheDeeper) {
  double before = 0.0;
  for (const double force : {1e-2, 0.1, 0.5}) {
    const double ratio = plate_radius_on_layer(dome(), force) / plate_radius_by_hertz(dome(), force);
    EXPECT_LT(ratio, 1.0) << force;
    EXPECT_GT(1.0 - ratio, before) << force;
    before = 1.0 - ratio;
  }
}

TEST(GelsightDome, AForceThatNoDomeBearsIsRefused) {
  EXPECT_THROW(plate_radius_on_layer(dome(), 1e3), Error);
}

}  // namespace
}  // namespace touchstone::lab
