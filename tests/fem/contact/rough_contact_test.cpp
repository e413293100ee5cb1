#include "fem/contact/rough_contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::fem {
namespace {

TEST(RoughContact, ModuliAddLikeSpringsInARow) {
  const ElasticMaterial silicone{0.25, 0.5};
  EXPECT_DOUBLE_EQ(contact_modulus(silicone), 0.25 / 0.75);
  EXPECT_DOUBLE_EQ(contact_modulus(silicone, silicone), 0.5 * 0.25 / 0.75);
  EXPECT_NEAR(contact_modulus(silicone, ElasticMaterial{2.1e5, 0.3}), contact_modulus(silicone), 1e-6);
  EXPECT_THROW(contact_modulus({0.0, 0.3}), Error);
}

TEST(RoughContact, GrowsLinearlyAtFirstAndFillsTheFace) {
  const double modulus = 0.3;
  const double slope = 0.08;
  // The known factor sqrt(8/pi) of Persson's theory at low load.
  const double low = 1e-6;
  EXPECT_NEAR(real_contact_share(low, modulus, slope) * modulus * slope / low, std::sqrt(8.0 / kPi), 1e-6);
  EXPECT_EQ(real_contact_share(0.0, modulus, slope), 0.0);
  EXPECT_GT(real_contact_share(2.0 * modulus * slope, modulus, slope), 0.9999);
  double last = 0.0;
  for (int k = 1; k < 40; ++k) {
    const double share = real_contact_share(1e-3 * k, modulus, slope);
    EXPECT_GT(share, last);
    EXPECT_LE(share, 1.0);
    last = share;
  }
}

TEST(RoughContact, OnlyTheRatioOfPressureToModulusAndSlopeCounts) {
  EXPECT_DOUBLE_EQ(real_contact_share(0.01, 0.3, 0.1), real_contact_share(0.04, 0.6, 0.2));
  EXPECT_EQ(real_contact_share(1e-9, 0.3, 0.0), 1.0) << "smooth faces touch wholly";
}

}  // namespace
}  // namespace touchstone::fem
