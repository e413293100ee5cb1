#include "lab/chroma/chroma_design.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ChromaDesign design(double force, double nu = 0.5, double distance = 15.0) {
  return {{2.0, 0.4, nu}, force, distance};
}

struct BestThickness {
  double thickness_mm = 0.0;
  bool interior = false;  ///< false: it's an end of the range
};
/// The best of 10,001 thicknesses, evenly over the range.
BestThickness best_thickness(ApparentMeasure measure, const ChromaDesign& design, double from_mm, double to_mm) {
  constexpr int kSteps = 10'000;
  int best = 0;
  double largest = -std::numeric_limits<double>::infinity();
  const auto thickness = [&](int k) { return k == kSteps ? to_mm : from_mm + (to_mm - from_mm) * k / kSteps; };
  for (int k = 0; k <= kSteps; ++k) {
    const double here = apparent_measure(measure, design, thickness(k));
    if (here > largest) {
      largest = here;
      best = k;
    }
  }
  return {thickness(best), best > 0 && best < kSteps};
}

TEST(AngleOfView, IsThatOfASensorBehindALens) {
  EXPECT_NEAR(angle_of_view(17.5), 0.5 * kPi, 1e-12);  // as far behind as half the sensor is wide
  EXPECT_NEAR(angle_of_view(24.0) / kRadiansPerDegree, 72.2, 0.05);
  EXPECT_LT(angle_of_view(50.0), angle_of_view(24.0));
}

TEST(DistanceInView, PutsAMarkerIntoItsPartOfTheView) {
  const double theta = angle_of_view(24.0);
  const double distance = distance_in_view(2.0, theta, 10);
  EXPECT_NEAR(std::atan(2.0 / distance), theta / 10.0, 1e-12);
  EXPECT_GT(distance_in_view(2.0, angle_of_view(50.0), 10), distance);
}

TEST(ApparentChange, IsThalesRatioAndItsFirstOrder) {
  EXPECT_DOUBLE_EQ(apparent_change(1.0, 5.0), 5.0 / 4.0 - 1.0);
  EXPECT_EQ(apparent_change(0.0, 5.0), 0.0);
  // What first order leaves out is of second order: a tenth of the displacement, a hundredth of it.
  const auto left_out = [](double dz) { return apparent_change(dz, 10.0) - dz / 10.0; };
  EXPECT_NEAR(left_out(0.1) / left_out(0.01), 100.0, 1.0);
  EXPECT_LT(apparent_change(-1.0, 5.0), 0.0);
}

TEST(Column, MovesInProportionToItsThicknessAndStretchesAllTheSame) {
  const SoftMarker marker;
  EXPECT_DOUBLE_EQ(column_displacement(0.4, marker, 5.0), 0.25 * 5.0);  // 0.4 N / (0.4 MPa 4 mm^2)
  for (const double t : {1.0, 3.0, 12.0}) {
    EXPECT_NEAR(column_stretch(column_displacement(0.4, marker, t), t, 0.5), 1.125, 1e-14);
  }
}

TEST(ApparentMeasure, HasNoOptimumWhereTheMarkerStaysAndTheChangeIsRelative) {
  for (const double nu : {0.0, 0.3, 0.5}) {
    for (const double force : {0.01, 0.3, 1.2}) {
      for (const ApparentMeasure measure :
           {ApparentMeasure::relative_whole_fixed, ApparentMeasure::relative_film_fixed}) {
        double before = 0.0;
        for (double t = 0.1; t < 15.0; t += 0.1) {
          const double change = apparent_measure(measure, design(force, nu), t);
          EXPECT_GT(change, before);
          before = change;
        }
        const BestThickness best = best_thickness(measure, design(force, nu), 0.5, 14.5);
        EXPECT_EQ(best.thickness_mm, 14.5);
        EXPECT_FALSE(best.interior);
      }
    }
  }
}

TEST(ApparentMeasure, FallsWithThicknessForAGivenDisplacement) {
  double before = std::numeric_limits<double>::infinity();
  for (double t = 0.6; t < 10.0; t += 0.2) {
    const double change = stretched_apparent_change(column_stretch(0.5, t, 0.5), 0.5, 15.0);
    EXPECT_LT(change, before);
    before = change;
  }
}

TEST(ApparentMeasure, OfThePictureHasTheOptimumOfItsClosedForm) {
  for (const double force : {1e-7, 0.05, 0.4, 0.8}) {
    const BestThickness best = best_thickness(ApparentMeasure::picture_film_fixed, design(force), 0.1, 60.0);
    EXPECT_TRUE(best.interior);
    EXPECT_NEAR(best.thickness_mm, best_picture_thickness(design(force)), 0.02) << force;
  }
  EXPECT_NEAR(best_picture_thickness(design(0.0)), 15.0 / 3.0, 1e-12);
  EXPECT_NEAR(best_picture_thickness(design(0.0, 0.3)), 15.0 * 0.7 / 1.3, 1e-12);
  EXPECT_NEAR(best_picture_thickness(design(1e-5)), 5.0, 1e-3);
}

TEST(ApparentMeasure, OfAreaAndOfAMarkerThatFillsTheViewHaveOneBelowNuOneHalf) {
  const double expected = 15.0 * (1.0 - 0.6) / (2.0 * 1.3);
  for (const ApparentMeasure measure : {ApparentMeasure::area_film_fixed, ApparentMeasure::relative_fills_view}) {
    const BestThickness best = best_thickness(measure, design(1e-4, 0.3), 0.1, 20.0);
    EXPECT_TRUE(best.interior);
    EXPECT_NEAR(best.thickness_mm, expected, 0.01);
    EXPECT_FALSE(best_thickness(measure, design(1e-4, 0.5), 0.1, 20.0).interior);
    EXPECT_TRUE(best_thickness(measure, design(0.8, 0.5), 0.1, 20.0).interior);
  }
}

TEST(ChromaDesign, RefusesWhatMakesNoSense) {
  EXPECT_THROW(angle_of_view(0.0), Error);
  EXPECT_THROW(angle_of_view(24.0, -1.0), Error);
  EXPECT_THROW(angle_of_view(kNan), Error);
  EXPECT_THROW(distance_in_view(0.0, 1.0, 10), Error);
  EXPECT_THROW(distance_in_view(2.0, kPi, 10), Error);
  EXPECT_THROW(distance_in_view(2.0, 1.0, 0), Error);
  EXPECT_THROW(distance_in_view(2.0, 3.0, 1), Error) << "the last has no such distance: its tangent is negative";
  EXPECT_THROW(apparent_change(5.0, 5.0), Error);
  EXPECT_THROW(apparent_change(0.1, 0.0), Error);
  EXPECT_THROW(apparent_change(kNan, 1.0), Error);
  EXPECT_THROW(column_strain(1.6, {}), Error);
  EXPECT_THROW(column_strain(-0.1, {}), Error);
  EXPECT_THROW(column_strain(0.1, {2.0, 0.4, 0.51}), Error);
  EXPECT_THROW(column_strain(0.1, {2.0, 0.0, 0.5}), Error);
  EXPECT_THROW(column_displacement(0.1, {}, 0.0), Error);
  EXPECT_THROW(column_stretch(1.0, 1.0, 0.5), Error);
  EXPECT_THROW(column_stretch(-0.1, 1.0, 0.5), Error);
  EXPECT_THROW(stretched_apparent_change(0.0, 0.1, 1.0), Error);
  EXPECT_THROW(apparent_measure(ApparentMeasure::relative_whole_fixed, design(0.1), 15.0), Error);
  EXPECT_THROW(best_picture_thickness(design(0.1, 0.5, 0.0)), Error);
}

}  // namespace
}  // namespace touchstone::lab
