#include "core/cie_colour.h"

#include <gtest/gtest.h>

#include <cmath>

namespace touchstone {
namespace {

// The pairs and differences that [Sharma2005, table 1] publishes for testing programs: they reach each branch of the
// mean hue and of the rotation.
TEST(Ciede2000, IsWhatSharmaWuAndDalalTabulate) {
  struct Pair {
    Eigen::Vector3d first, second;
    double difference;
  };
  const Pair pairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                        {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                        {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                        {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                        {{50, -1.1848, -84.8006}, {50, 0, -82.7485}, 1.0000},
                        {{50, -0.9009, -85.5211}, {50, 0, -82.7485}, 1.0000},
                        {{50, 0, 0}, {50, -1, 2}, 2.3669},
                        {{50, -1, 2}, {50, 0, 0}, 2.3669},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0010}, 7.1792},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0012}, 7.2195},
                        {{50, -0.0010, 2.4900}, {50, 0.0009, -2.4900}, 4.8045},
                        {{50, -0.0010, 2.4900}, {50, 0.0010, -2.4900}, 4.8045},
                        {{50, -0.0010, 2.4900}, {50, 0.0011, -2.4900}, 4.7461},
                        {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
                        {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                        {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
                        {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
                        {{50, 2.5, 0}, {58, 24, 15}, 19.4535},
                        {{50, 2.5, 0}, {50, 3.1736, 0.5854}, 1.0000},
                        {{50, 2.5, 0}, {50, 3.2972, 0}, 1.0000},
                        {{50, 2.5, 0}, {50, 1.8634, 0.5757}, 1.0000},
                        {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
                        {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                        {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
                        {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
                        {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
                        {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
                        {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
                        {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
                        {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
                        {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
                        {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const Pair& pair : pairs) {
    EXPECT_NEAR(ciede2000(pair.first, pair.second), pair.difference, 6e-5) << pair.first.transpose();
    EXPECT_NEAR(ciede2000(pair.second, pair.first), pair.difference, 6e-5) << pair.first.transpose();
  }
}

TEST(CieColour, WhiteIsD65AndGreyHasNoHue) {
  EXPECT_NEAR((xyz_from_linear_srgb({1, 1, 1}) - kD65White).norm(), 0.0, 1e-12);
  const Eigen::Vector3d grey = lab_from_srgb({0.5, 0.5, 0.5});
  EXPECT_NEAR(grey[0], 53.389, 1e-3);  // 116 cbrt(((0.5 + 0.055) / 1.055)^2.4) - 16
  EXPECT_NEAR(grey.tail<2>().norm(), 0.0, 1e-9);
  EXPECT_NEAR((lab_from_srgb({1, 1, 1}) - Eigen::Vector3d(100, 0, 0)).norm(), 0.0, 1e-9);
}

// The matrix of [IEC61966], which it gives with four digits.
TEST(CieColour, PrimariesAreThoseOfTheStandard) {
  EXPECT_NEAR((xyz_from_linear_srgb({1, 0, 0}) - Eigen::Vector3d(0.4124, 0.2126, 0.0193)).norm(), 0.0, 2e-4);
  EXPECT_NEAR((xyz_from_linear_srgb({0, 1, 0}) - Eigen::Vector3d(0.3576, 0.7152, 0.1192)).norm(), 0.0, 2e-4);
  EXPECT_NEAR((xyz_from_linear_srgb({0, 0, 1}) - Eigen::Vector3d(0.1805, 0.0722, 0.9505)).norm(), 0.0, 3e-4);
}

// [IEC61966]: a line below 0.04045, a power above.
TEST(CieColour, DarkNumbersAreALineAndTheOthersAPower) {
  const Eigen::Vector3d linear = linear_from_srgb({0.02, 0.04046, 0.5});
  EXPECT_NEAR(linear[0], 0.02 / 12.92, 1e-12);
  EXPECT_NEAR(linear[1], 0.04046 / 12.92, 1e-6) << "the two meet";
  EXPECT_NEAR(linear[2], std::pow(0.555 / 1.055, 2.4), 1e-12);
}

TEST(CieColour, HuesOfTheDoubleConeAreTheirCorners) {
  EXPECT_NEAR((srgb_from_hsl(0, 1, 0.5) - Eigen::Vector3d(1, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((srgb_from_hsl(60, 1, 0.5) - Eigen::Vector3d(1, 1, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((srgb_from_hsl(-120, 1, 0.5) - Eigen::Vector3d(0, 0, 1)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((srgb_from_hsl(200, 0, 0.3) - Eigen::Vector3d(0.3, 0.3, 0.3)).norm(), 0.0, 1e-12);
  // Half saturated, three quarters light: from 0.625 to 0.875.
  EXPECT_NEAR((srgb_from_hsl(30, 0.5, 0.75) - Eigen::Vector3d(0.875, 0.75, 0.625)).norm(), 0.0, 1e-12);
}

TEST(CieColour, XyzAndLabAreEachOthersInverse) {
  for (const Eigen::Vector3d& lab :
       {Eigen::Vector3d(0, 0, 0), {5, 1, -2}, {8, 0, 0}, {50, 40, -60}, {100, 0, 0}, {97, -20, 90}}) {
    EXPECT_NEAR((lab_from_xyz(xyz_from_lab(lab)) - lab).norm(), 0.0, 1e-9);
  }
  EXPECT_NEAR((xyz_from_lab({100, 0, 0}) - kD65White).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace touchstone
