#include "sensors/heights/slope_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/random.h"
#include "sensors/heights/height_map.h"
#include "sensors/heights/lamp_model.h"

namespace touchstone::sensors {
namespace {

Eigen::Matrix3d some_lamps() {
  Eigen::Matrix3d a;
  a << 95, 30, 60, -4, -70, 65, -90, 32, 58;
  return a;
}

Eigen::Vector3d shade(const Eigen::Matrix3d& a, const Eigen::Vector2d& slope) {
  return a * (normal_of(slope) - Eigen::Vector3d::UnitZ());
}

/// Samples of matt shading with random slopes up to `steepest`.
std::vector<ColourSample> shaded_samples(int count, double steepest, double noise, const LampModel& lamps) {
  RandomStream random(5, 0, Purpose::kTest);
  std::vector<ColourSample> samples;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d place(lamps.width * random.uniform(), lamps.height * random.uniform());
    const double angle = 6.283185 * random.uniform();
    const Eigen::Vector2d slope =
        steepest * std::sqrt(random.uniform()) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector3d error = noise * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    samples.push_back(
        {place.cast<float>(), (shade(lamps.at(place), slope) + error).cast<float>(), slope.cast<float>()});
  }
  return samples;
}

LampModel even_lamps() {
  return {320, 240, 1, 1, {some_lamps()}};
}

/// Stronger to the right and weaker downwards.
LampModel uneven_lamps() {
  LampModel lamps{320, 240, 4, 3, {}};
  Eigen::Matrix3d tilt = 0.15 * some_lamps();
  tilt(0, 2) -= 8.0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      lamps.nodes.push_back(some_lamps() + (0.5 * column - 0.75) * tilt - 0.1 * (row - 1) * some_lamps());
    }
  }
  return lamps;
}

/// Presses in some places: samples nowhere else.
std::vector<ColourSample> near_places(std::vector<ColourSample> samples, const std::vector<Eigen::Vector2f>& places) {
  std::erase_if(samples, [&](const ColourSample& sample) {
    return std::none_of(places.begin(), places.end(),
                        [&](const Eigen::Vector2f& place) { return (sample.place - place).norm() < 20.0F; });
  });
  return samples;
}

TEST(LampModel, LampsAreInterpolatedBetweenNodesAndHeldBeyond) {
  const LampModel lamps = uneven_lamps();
  EXPECT_LT((lamps.at({40, 40}) - lamps.nodes[0]).norm(), 1e-9);
  EXPECT_LT((lamps.at({0, 0}) - lamps.nodes[0]).norm(), 1e-9);
  EXPECT_LT((lamps.at({319, 239}) - lamps.nodes[11]).norm(), 1e-9);
  EXPECT_LT((lamps.at({80, 80}) - 0.25 * (lamps.nodes[0] + lamps.nodes[1] + lamps.nodes[4] + lamps.nodes[5])).norm(),
            1e-9);
}

TEST(LampModel, FitFindsEvenLampsAtAllNodes) {
  const LampModel fitted = fit_lamps(shaded_samples(4000, 0.5, 0.0, even_lamps()), {320, 240}, {});
  ASSERT_EQ(fitted.nodes.size(), 48U);
  for (const Eigen::Matrix3d& node : fitted.nodes) EXPECT_LT((node - some_lamps()).norm(), 1e-3);
}

TEST(LampModel, FitFollowsUnevenLampsTheCloserTheShorterItsReach) {
  const LampModel truth = uneven_lamps();
  const auto samples = shaded_samples(20000, 0.5, 0.0, truth);
  const auto error = [&](double reach) {
    const LampModel fitted = fit_lamps(samples, {320, 240}, {.reach = reach, .prior = 1e-4});
    double worst = 0.0;
    for (const Eigen::Vector2d& place : {Eigen::Vector2d(60, 60), {160, 120}, {260, 180}}) {
      worst = std::max(worst, (fitted.at(place) - truth.at(place)).norm() / truth.at(place).norm());
    }
    return worst;
  };
  EXPECT_LT(error(0.05), 0.03);
  EXPECT_LT(error(0.05), error(0.25));
  EXPECT_LT(error(0.25), error(10.0));
}

TEST(LampModel, BeyondThePressesNothingIsExtrapolated) {
  const LampModel truth = uneven_lamps();
  const auto samples = near_places(shaded_samples(60000, 0.5, 0.0, truth), {{110, 120}, {160, 120}, {210, 120}});
  const LampModel fitted = fit_lamps(samples, {320, 240}, {});
  const double least = truth.at({90, 120}).norm();
  const double most = truth.at({230, 120}).norm();
  for (const Eigen::Matrix3d& node : fitted.nodes) {
    EXPECT_GT(node.norm(), 0.95 * least);
    EXPECT_LT(node.norm(), 1.05 * most);
  }
  EXPECT_GT(fitted.at({319, 120}).norm(), fitted.at({0, 120}).norm());
}

TEST(LampModel, TooFewOrOneSidedSamplesAreRefused) {
  auto samples = shaded_samples(20, 0.5, 0.0, even_lamps());
  EXPECT_THROW(fit_lamps(samples, {320, 240}, {}), Error);
  samples = shaded_samples(4000, 0.5, 0.0, even_lamps());
  EXPECT_THROW(fit_lamps(samples, {320, 240}, {.reach = 0.0}), Error);
  for (ColourSample& sample : samples) sample.slope.y() = 0.0F;
  EXPECT_THROW(fit_lamps(samples, {320, 240}, {}), Error);
}

TEST(LampModel, SlopeByLampsInvertsShading) {
  for (const Eigen::Vector2d& slope : {Eigen::Vector2d(0, 0), {0.3, -0.1}, {-0.8, 0.6}, {0.1, 1.2}}) {
    const Eigen::Vector2d found = slope_by_lamps(some_lamps(), shade(some_lamps(), slope), 4.0);
    EXPECT_LT((found - slope).norm(), 0.02) << slope.transpose();
  }
  EXPECT_LE(slope_by_lamps(some_lamps(), {-900, 500, 800}, 2.0).norm(), 2.0 + 1e-9);
}

TEST(LampModel, CorrectionLeadsBackToTheMiddle) {
  const LampModel lamps = uneven_lamps();
  const cv::Mat even(240, 320, CV_32FC3, cv::Scalar(90, 100, 80));  // scales by one
  const ColourCorrection correction = ColourCorrection::by_lamps(even, lamps);
  const Eigen::Vector2d slope(0.4, -0.7);
  const Eigen::Vector3d middle = shade(lamps.at({160, 120}), slope);
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), {300, 20}, {40, 230}}) {
    EXPECT_LT((correction.at(place) * shade(lamps.at(place), slope) - middle).norm(), 0.03 * middle.norm());
  }
}

TEST(LampModel, CorrectionStaysBoundedWhereLampsTellLittle) {
  LampModel lamps = uneven_lamps();
  for (int row = 0; row < 3; ++row) lamps.nodes[static_cast<std::size_t>(4 * row + 3)].col(1).setConstant(1e-6);
  const cv::Mat even(240, 320, CV_32FC3, cv::Scalar(90, 100, 80));
  const ColourCorrection correction = ColourCorrection::by_lamps(even, lamps);
  for (double u = 0.0; u <= 320.0; u += 20.0) EXPECT_LT(correction.at({u, 120}).norm(), 10.0) << u;
}

TEST(ColourCorrection, DarkCornersAreMadeStrongerToABoundAndSaidSo) {
  cv::Mat background(240, 320, CV_32FC3, cv::Scalar(90, 100, 80));
  EXPECT_EQ(ColourCorrection::by_background(background).bounded_share(), 0.0);
  background.colRange(0, 80) = cv::Scalar(0.5, 10, 10);
  LampModel lamps = uneven_lamps();
  for (Eigen::Matrix3d& node : lamps.nodes) node.row(0) *= 0.1;
  lamps.nodes[5] = some_lamps();  // the middle, which all others are led to
  for (const ColourCorrection& correction :
       {ColourCorrection::by_background(background), ColourCorrection::by_lamps(background, lamps)}) {
    for (double u = 0.5; u < 320.0; u += 9.0) {
      const Eigen::Matrix3d matrix = correction.at({u, 120});
      ASSERT_TRUE(matrix.allFinite());
      EXPECT_LE(matrix.cwiseAbs().rowwise().sum().maxCoeff(), ColourCorrection::kLargestGain + 1e-9);
    }
    EXPECT_GT(correction.bounded_share(), 0.2);
    EXPECT_LT(correction.bounded_share(), 1.0);
  }
}

TEST(SlopeTable, MattShadingComesBack) {
  const auto samples = shaded_samples(20000, 1.0, 0.5, even_lamps());
  const SlopeTable table = build_slope_table(samples, some_lamps(), {.most_cells = 1U << 18U});
  for (const ColourSample& test : shaded_samples(500, 0.9, 0.0, even_lamps())) {
    // Half a step of 2 DN on lamps of some 90 DN a unit of slope, and where it's steep a third of that.
    EXPECT_LT((table.slopes[table.index_of(test.colour)] - test.slope).norm(), 0.06F);
  }
}

TEST(SlopeTable, DeviationsFromMattShadingAreLearnt) {
  auto samples = shaded_samples(20000, 1.0, 0.5, even_lamps());
  for (ColourSample& sample : samples) sample.slope *= 1.3F;  // as if the coating weren't matt
  const SlopeTable table = build_slope_table(samples, some_lamps(), {.most_cells = 1U << 18U});
  double sum = 0.0;
  double count = 0.0;
  for (const ColourSample& test : shaded_samples(2000, 0.9, 0.0, even_lamps())) {
    if (test.slope.norm() < 0.4F) continue;
    sum += table.slopes[table.index_of(test.colour)].norm() / test.slope.norm();
    count += 1.0;
  }
  EXPECT_NEAR(sum / count, 1.3, 0.01);
}

TEST(SlopeTable, GapsAreBridged) {
  // No sample has a slope between 0.4 and 0.6, and all deviate alike: the gap does so too.
  auto samples = shaded_samples(20000, 1.0, 0.0, even_lamps());
  std::erase_if(samples, [](const ColourSample& sample) { return std::abs(sample.slope.norm() - 0.5F) < 0.1F; });
  for (ColourSample& sample : samples) sample.slope.x() += 0.1F;
  const SlopeTable table = build_slope_table(samples, some_lamps(), {.most_cells = 1U << 18U});
  double sum = 0.0;
  double count = 0.0;
  for (const ColourSample& test : shaded_samples(2000, 0.55, 0.0, even_lamps())) {
    if (test.slope.norm() < 0.45F) continue;
    sum += static_cast<double>(table.slopes[table.index_of(test.colour)].x() - test.slope.x());
    count += 1.0;
  }
  EXPECT_NEAR(sum / count, 0.1, 0.015);
}

TEST(SlopeTable, RestIsFlatAndNothingIsSteeperThanTheLimit) {
  const auto samples = shaded_samples(5000, 2.0, 1.0, even_lamps());
  const SlopeTable table = build_slope_table(samples, some_lamps(), {.most_cells = 1U << 17U, .steepest = 1.5});
  EXPECT_LT(table.slopes[table.index_of(Eigen::Vector3f::Zero())].norm(), 0.01F);
  for (const Eigen::Vector2f& slope : table.slopes) ASSERT_LE(slope.norm(), 1.5001F);
  // Colours far outside are taken to the nearest cell.
  EXPECT_EQ(table.index_of({1e4F, 1e4F, 1e4F}), table.slopes.size() - 1);
  EXPECT_EQ(table.index_of({-1e4F, -1e4F, -1e4F}), 0U);
}

TEST(SlopeTable, StepGrowsUntilTheTableFits) {
  const auto samples = shaded_samples(2000, 1.0, 0.5, even_lamps());
  const SlopeTable small = build_slope_table(samples, some_lamps(), {.most_cells = 5000});
  EXPECT_LE(small.slopes.size(), 5000U);
  EXPECT_GT(small.step, 2.0F);
  const TableCoverage coverage = coverage_of(small, samples);
  EXPECT_EQ(coverage.cells, small.slopes.size());
  EXPECT_GT(coverage.cells_hit, 100U);
  EXPECT_NEAR(coverage.steepest_slope, 0.995, 0.01);
}

}  // namespace
}  // namespace touchstone::sensors
