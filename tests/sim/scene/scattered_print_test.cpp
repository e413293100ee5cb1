#include "sim/scene/scattered_print.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

PrintSpec dots() {
  PrintSpec print;
  print.pattern = PrintPattern::scattered;
  print.spacing_mm = {2, 2};
  print.radius_mm = 30;
  print.width_mm = 1;
  print.seed = 7;
  return print;
}

TEST(ScatteredPrint, IsAsDenseAsItsSpacingTellsAndNoDotsTouch) {
  const PrintSpec print = dots();
  const std::vector<render::PrintedMark> marks = scattered_marks(print);
  EXPECT_EQ(marks.size(), 707U);  // pi 30^2 / 2^2
  int inside = 0;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    EXPECT_LE(marks[i].centre.norm(), 30.0);
    EXPECT_EQ(marks[i].half_width, 0.5);
    if (marks[i].centre.norm() < 15.0) ++inside;
    for (std::size_t k = 0; k < i; ++k) EXPECT_GE((marks[i].centre - marks[k].centre).norm(), 1.5);
  }
  // A quarter of the area. Dots that keep their distance scatter less than a Poisson process' 13.
  EXPECT_NEAR(inside, 177, 13);
}

TEST(ScatteredPrint, IsNoGrid) {
  // Of a grid each dot's nearest neighbour is a spacing away; here these distances differ.
  const std::vector<render::PrintedMark> marks = scattered_marks(dots());
  double sum = 0.0;
  double squares = 0.0;
  for (const render::PrintedMark& mark : marks) {
    double nearest = 1e9;
    for (const render::PrintedMark& other : marks) {
      const double distance = (mark.centre - other.centre).norm();
      if (distance > 0.0) nearest = std::min(nearest, distance);
    }
    sum += nearest;
    squares += nearest * nearest;
  }
  const double mean = sum / static_cast<double>(marks.size());
  EXPECT_GT(std::sqrt(squares / static_cast<double>(marks.size()) - mean * mean), 0.1);
}

TEST(ScatteredPrint, TheSeedChoosesTheDots) {
  PrintSpec print = dots();
  const auto first = scattered_marks(print);
  const auto again = scattered_marks(print);
  print.seed = 8;
  const auto other = scattered_marks(print);
  EXPECT_EQ(first[3].centre, again[3].centre);
  EXPECT_NE(first[3].centre, other[3].centre);
  print.diameter_spread = 0.2;
  const auto sized = scattered_marks(print);
  double least = 1;
  double most = 0;
  for (std::size_t i = 0; i < sized.size(); ++i) {
    EXPECT_EQ(sized[i].centre, other[i].centre);
    least = std::min(least, sized[i].half_width);
    most = std::max(most, sized[i].half_width);
  }
  EXPECT_GE(least, 0.4);
  EXPECT_LT(least, 0.41);
  EXPECT_LE(most, 0.6);
  EXPECT_GT(most, 0.59);
}

TEST(ScatteredPrint, ATinyDiscHoldsWhatFits) {
  PrintSpec print = dots();
  print.radius_mm = 1.4;  // two dots by area, but the first one may take the middle
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    print.seed = seed;
    const auto marks = scattered_marks(print);
    EXPECT_GE(marks.size(), 1U);
    EXPECT_LE(marks.size(), 2U);
  }
}

TEST(AlongSurface, KeepsAreasOfAFingertip) {
  GelSpec gel;
  gel.shape = FingertipSpec{.radius_mm = 8, .length_mm = 10};
  // Area of the plane's disc is that of the surface above the point: of the cap, the hemisphere, and part of the side.
  for (const double angle : {0.2, 0.8, kPi / 2}) {
    const Eigen::Vector3d point(0, 8 * std::sin(angle), 8 * std::cos(angle) - 8);
    const Eigen::Vector2d flat = along_surface(gel, point);
    EXPECT_NEAR(flat.x(), 0.0, 1e-12);
    EXPECT_NEAR(kPi * flat.squaredNorm(), 2 * kPi * 64 * (1 - std::cos(angle)), 1e-9);
  }
  const Eigen::Vector2d side = along_surface(gel, {-8, 0, -11});
  EXPECT_NEAR(kPi * side.squaredNorm(), 2 * kPi * 64 + 2 * kPi * 8 * 3, 1e-9);
  EXPECT_LT(side.x(), 0.0);
  EXPECT_EQ(along_surface(gel, {0, 0, 0}), Eigen::Vector2d(0, 0));
  // Near the apex lengths are kept as well.
  EXPECT_NEAR((along_surface(gel, {0.1, 0.05, std::sqrt(64 - 0.0125) - 8}) - Eigen::Vector2d(0.1, 0.05)).norm(), 0.0,
              1e-5);
  gel.shape = SlabSpec{};
  EXPECT_EQ(along_surface(gel, {3, 4, 0}), Eigen::Vector2d(3, 4));
}

std::string error_of_print(const std::string& print) {
  try {
    parse_yaml<DeviceSpec>(
        "name: d\n"
        "gel: {size_x_mm: 10, size_y_mm: 10, thickness_mm: 4, youngs_modulus_MPa: 0.3}\n"
        "plate: {thickness_mm: 1, refractive_index: 1.5}\n"
        "coating: {type: matt, albedo: 0.1, print: {" +
            print + "}}\n",
        "device.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ScatteredPrint, IsReadStrictly) {
  const std::string good = "pattern: scattered, spacing_mm: 2, diameter_mm: 1, radius_mm: 10";
  EXPECT_EQ(error_of_print(good + ", diameter_spread: 0.1, seed: 3, colour: 0.8"), "");
  EXPECT_THAT(error_of_print(good + ", grid: [2, 2]"), HasSubstr("grid"));
  EXPECT_THAT(error_of_print(good + ", jitter_mm: 0.1"), HasSubstr("jitter_mm"));
  EXPECT_THAT(error_of_print(good + ", diameter_spread: 0.6"), HasSubstr("diameter_spread"));
  EXPECT_THAT(error_of_print("pattern: scattered, spacing_mm: 2, diameter_mm: 1.6, radius_mm: 10"),
              HasSubstr("diameter_mm"));  // dots could touch
  EXPECT_THAT(error_of_print("pattern: scattered, spacing_mm: 2, diameter_mm: 1, radius_mm: 300"),
              HasSubstr("radius_mm"));
  EXPECT_THAT(error_of_print("pattern: scattered, spacing_mm: 2, diameter_mm: 1"), HasSubstr("radius_mm"));
  EXPECT_THAT(error_of_print("pattern: hexagons"), HasSubstr("scattered"));
}

}  // namespace
}  // namespace touchstone::sim
