#include "fem/fine_relief/pixel_contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "fem/fine_relief/layer_kernel.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const ElasticMaterial kGel{0.33, 0.49};
const double kPlaneModulus = 0.33 / (1.0 - 0.49 * 0.49);

PixelGrid centred(int nx, int ny, double pitch) {
  return {nx, ny, pitch, -0.5 * pitch * Eigen::Vector2d(nx - 1, ny - 1)};
}

template <typename Gap>
std::vector<double> gap_of(const PixelGrid& grid, const Gap& gap) {
  std::vector<double> values(grid.size());
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) values[grid.at(i, j)] = gap(grid.centre(i, j));
  }
  return values;
}

/// Share of the pixels in contact under cos waves (one-dimensional) on a half space, and the largest pressure.
struct Wavy {
  double share;
  double largest;
};
Wavy press_wave(int pixels, double amplitude, double mean_pressure) {
  const PixelGrid grid{pixels, 1, 1.0 / pixels, {0.5 / pixels, 0.0}};
  const LayerResponse layer(kGel, 50.0, grid, GridEdges::periodic);
  const auto gap = gap_of(grid, [&](const Eigen::Vector2d& x) { return -amplitude * std::cos(2.0 * kPi * x.x()); });
  const auto answer = solve_pixel_contact(layer, {gap, mean_pressure * grid.pitch}, {1e-8 * amplitude, 4000});
  EXPECT_TRUE(answer.converged);
  double largest = 0.0;
  for (const double p : answer.pressure) largest = std::max(largest, p);
  return {static_cast<double>(answer.pixels_in_contact) / pixels, largest};
}

// [Westergaard1939]; [Johnson1985, eq. 13.9]: p_mean = p* sin^2(pi a / lambda), p* = pi E* amplitude / lambda, a the
// half width of contact; the largest pressure is 2 p* sin(pi a / lambda).
TEST(PixelContact, AWavySurfaceIsWestergaards) {
  const double amplitude = 0.01;
  const double full = kPi * kPlaneModulus * amplitude;
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const Wavy wavy = press_wave(1024, amplitude, share * full);
    EXPECT_NEAR(wavy.share, 2.0 / kPi * std::asin(std::sqrt(share)), 2.0 / 1024) << share;
    EXPECT_NEAR(wavy.largest, 2.0 * full * std::sqrt(share), 1e-4 * full) << share;
  }
}

TEST(PixelContact, AWavySurfaceIsFilledAtTheCriticalPressureAndNotBefore) {
  const double amplitude = 0.01;
  const double full = kPi * kPlaneModulus * amplitude;
  EXPECT_LT(press_wave(512, amplitude, 0.995 * full).share, 1.0);
  EXPECT_EQ(press_wave(512, amplitude, 1.001 * full).share, 1.0);
}

TEST(PixelContact, TheWavySurfacesErrorFallsWithThePixel) {
  const double full = kPi * kPlaneModulus * 0.01;
  double before = kInfinity;
  for (const int pixels : {64, 128, 256}) {
    const double error = std::abs(press_wave(pixels, 0.01, 0.5 * full).largest / (2.0 * full * std::sqrt(0.5)) - 1.0);
    EXPECT_LT(error, before / 3.0) << pixels;  // second order
    before = error;
  }
}

// The isotropic wave h = amplitude (cos x + cos y) of [Johnson1985b]: it is filled when both cosines are, each of which
// alone takes pi E* amplitude / lambda; under light loads each crest is Hertz' sphere of curvature 4 pi^2 amplitude /
// lambda^2.
TEST(PixelContact, AnIsotropicWaveMeetsBothLimits) {
  const double amplitude = 0.01;
  const PixelGrid grid{256, 256, 1.0 / 256, {0, 0}};
  const LayerResponse layer(kGel, 50.0, grid, GridEdges::periodic);
  const auto gap = gap_of(grid, [&](const Eigen::Vector2d& x) {
    return -amplitude * (std::cos(2.0 * kPi * x.x()) + std::cos(2.0 * kPi * x.y()));
  });
  const double full = 2.0 * kPi * kPlaneModulus * amplitude;
  const PixelTolerance fine{1e-8, 4000};
  EXPECT_EQ(solve_pixel_contact(layer, {gap, 1.001 * full}, fine).pixels_in_contact, 256 * 256);
  EXPECT_LT(solve_pixel_contact(layer, {gap, 0.98 * full}, fine).pixels_in_contact, 256 * 256);
  const double load = 0.001 * full;
  const auto light = solve_pixel_contact(layer, {gap, load}, fine);
  const double radius = 1.0 / (amplitude * 4.0 * kPi * kPi);
  const double hertz = kPi * std::pow(0.75 * load * radius / kPlaneModulus, 2.0 / 3.0);
  EXPECT_NEAR(light.pixels_in_contact * grid.pixel_area(), hertz, 0.05 * hertz);
}

TEST(PixelContact, ASphereOnAThickLayerIsHertz) {
  const double radius = 10.0;
  const double depth = 0.02;
  const PixelGrid grid = centred(160, 160, 0.008);
  const LayerResponse layer(kGel, 1e4, grid, GridEdges::free);
  const auto gap = gap_of(grid, [&](const Eigen::Vector2d& x) { return x.squaredNorm() / (2.0 * radius) - depth; });
  const auto answer = solve_pixel_contact(layer, {gap, {}}, {1e-8, 1000});
  const double force = 4.0 / 3.0 * kPlaneModulus * std::sqrt(radius) * std::pow(depth, 1.5);
  EXPECT_NEAR(answer.force, force, 2e-3 * force);
  EXPECT_NEAR(answer.pixels_in_contact * grid.pixel_area(), kPi * radius * depth, 0.01 * kPi * radius * depth);
  const double largest = 1.5 * force / (kPi * radius * depth);
  EXPECT_NEAR(answer.pressure[grid.at(80, 80)], largest, 5e-3 * largest);
  // The same by force: the body ends where it was held.
  const auto forced = solve_pixel_contact(layer, {gap, answer.force}, {1e-8, 1000});
  EXPECT_NEAR(forced.shift, 0.0, 1e-7);
  EXPECT_NEAR(forced.force, answer.force, 1e-12);
  EXPECT_LT(forced.force_residual, 1e-12);
}

/// As soft as the layer or four times as stiff: Hertz with the two's common modulus.
TEST(PixelContact, AnElasticSphereOnAThickLayerIsHertz) {
  const double radius = 10.0;
  const double approach = 0.02;
  const PixelGrid grid = centred(160, 160, 0.008);
  for (const double softer : {1.0, 0.25}) {
    const LayerResponse both(kGel, 1e4, grid, GridEdges::free, softer / kPlaneModulus);
    const auto gap =
        gap_of(grid, [&](const Eigen::Vector2d& x) { return x.squaredNorm() / (2.0 * radius) - approach; });
    const auto answer = solve_pixel_contact(both, {gap, {}}, {1e-8, 1000});
    const double force = 4.0 / 3.0 * kPlaneModulus / (1.0 + softer) * std::sqrt(radius) * std::pow(approach, 1.5);
    EXPECT_NEAR(answer.force, force, 2e-3 * force) << softer;
    EXPECT_NEAR(answer.pixels_in_contact * grid.pixel_area(), kPi * radius * approach, 0.01 * kPi * radius * approach);
  }
  EXPECT_THROW(LayerResponse(kGel, 1.0, grid, GridEdges::free, -1.0), Error);
}

// A groove of width w between flats needs, at its middle, about the pressure that pushes the gel in by its depth.
TEST(PixelContact, ANarrowGrooveIsBridgedAndAWideOneFilled) {
  const PixelGrid grid = centred(256, 64, 0.01);
  const LayerResponse layer(kGel, 2.0, grid, GridEdges::free);
  const double depth = 0.04;
  const auto touched_in_groove = [&](double width) {
    const auto gap =
        gap_of(grid, [&](const Eigen::Vector2d& x) { return std::abs(x.x()) < 0.5 * width ? depth - 0.2 : -0.2; });
    const auto answer = solve_pixel_contact(layer, {gap, {}}, {1e-6, 2000});
    EXPECT_TRUE(answer.converged);
    return answer.pressure[grid.at(128, 32)] > 0.0;
  };
  EXPECT_FALSE(touched_in_groove(0.1));
  EXPECT_TRUE(touched_in_groove(1.2));
}

TEST(PixelContact, TheLawsOfContactHold) {
  const PixelGrid grid = centred(90, 70, 0.02);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  const auto gap = gap_of(grid, [](const Eigen::Vector2d& x) {
    return x.squaredNorm() / 6.0 + 0.01 * std::cos(40.0 * x.x()) * std::cos(37.0 * x.y());
  });
  const PixelTolerance tolerance{1e-7, 2000};
  const auto answer = solve_pixel_contact(layer, {gap, 0.05}, tolerance);
  ASSERT_TRUE(answer.converged);
  std::vector<double> u(grid.size());
  layer.apply(answer.pressure, u, *layer.make_scratch());
  double force = 0.0;
  int open = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    const double g = gap[k] + u[k] + answer.shift;
    EXPECT_GE(answer.pressure[k], 0.0);
    EXPECT_GE(g, -1.01e-7);
    if (answer.pressure[k] > 0.0) {
      EXPECT_LE(g, 1.01e-7);
    }
    open += answer.pressure[k] == 0.0;
    force += answer.pressure[k] * grid.pixel_area();
    EXPECT_NEAR(answer.displacement[k], u[k], 1e-9);
  }
  EXPECT_NEAR(force, 0.05, 1e-12);
  EXPECT_GT(open, 100);
  EXPECT_GT(answer.pixels_in_contact, 100);
}

TEST(PixelContact, SharesWeighTheForceAndTheMotion) {
  const PixelGrid grid = centred(80, 70, 0.02);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  const auto gap = gap_of(grid, [](const Eigen::Vector2d& x) { return x.squaredNorm() / 6.0; });
  const auto share = gap_of(grid, [](const Eigen::Vector2d& x) { return 0.7 + 0.4 * x.x() - 0.2 * x.y(); });
  const auto answer = solve_pixel_contact(layer, {gap, 0.03, share}, {1e-8, 2000});
  ASSERT_TRUE(answer.converged);
  double force = 0.0;
  for (std::size_t k = 0; k < gap.size(); ++k) {
    const double g = gap[k] + answer.displacement[k] + share[k] * answer.shift;
    EXPECT_GE(g, -1.01e-8);
    if (answer.pressure[k] > 0.0) {
      EXPECT_LE(g, 1.01e-8);
    }
    force += share[k] * answer.pressure[k] * grid.pixel_area();
  }
  EXPECT_NEAR(force, 0.03, 1e-12);
  EXPECT_NEAR(answer.force, 0.03, 1e-12);
  EXPECT_GT(answer.pixels_in_contact, 100);
  // Ones change nothing.
  const std::vector<double> ones(grid.size(), 1.0);
  EXPECT_EQ(solve_pixel_contact(layer, {gap, 0.03, ones}).pressure, solve_pixel_contact(layer, {gap, 0.03}).pressure);
  std::vector<double> none = ones;
  none[7] = 0.0;
  EXPECT_THROW(solve_pixel_contact(layer, {gap, 0.03, none}), Error);
}

TEST(PixelContact, MovingTheBodyByAPixelMovesTheAnswer) {
  const PixelGrid grid = centred(64, 64, 0.02);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  const auto body = [](const Eigen::Vector2d& x) { return x.squaredNorm() / 2.0 + 0.004 * std::sin(30.0 * x.x()); };
  const auto here = solve_pixel_contact(layer, {gap_of(grid, body), 0.004}, {1e-9, 2000});
  const auto there = solve_pixel_contact(
      layer, {gap_of(grid, [&](const Eigen::Vector2d& x) { return body(x - Eigen::Vector2d(0.02, -0.04)); }), 0.004},
      {1e-9, 2000});
  EXPECT_NEAR(here.shift, there.shift, 1e-9);
  const double largest = *std::max_element(here.pressure.begin(), here.pressure.end());
  for (int j = 4; j < 60; ++j) {
    for (int i = 4; i < 60; ++i) {
      EXPECT_NEAR(there.pressure[grid.at(i + 1, j - 2)], here.pressure[grid.at(i, j)], 1e-5 * largest);
    }
  }
}

TEST(PixelContact, AWarmStartIsQuickerAndEndsAtTheSame) {
  const PixelGrid grid = centred(128, 128, 0.02);
  const LayerResponse layer(kGel, 2.0, grid, GridEdges::free);
  const auto gap = gap_of(grid, [](const Eigen::Vector2d& x) {
    return x.squaredNorm() / 8.0 + 0.01 * std::cos(30.0 * x.x() + 20.0 * x.y());
  });
  const auto cold = solve_pixel_contact(layer, {gap, 0.2}, {1e-7, 2000});
  const auto near = solve_pixel_contact(layer, {gap, 0.199}, {1e-7, 2000});
  const auto warm = solve_pixel_contact(layer, {gap, 0.2}, {1e-7, 2000}, near.pressure);
  EXPECT_LT(warm.iterations, cold.iterations);
  EXPECT_NEAR(warm.shift, cold.shift, 1e-6);
}

TEST(PixelContact, NoForceAndNoBodyAreZero) {
  const PixelGrid grid = centred(16, 16, 0.1);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  const std::vector<double> flat(grid.size(), -0.3);
  const auto none = solve_pixel_contact(layer, {flat, 0.0});
  EXPECT_EQ(none.force, 0.0);
  EXPECT_EQ(none.pixels_in_contact, 0);
  EXPECT_NEAR(none.shift, 0.3, 1e-12) << "it is lifted until it just touches";
  EXPECT_TRUE(none.converged);
  const std::vector<double> far(grid.size(), kInfinity);
  EXPECT_EQ(solve_pixel_contact(layer, {far, {}}).force, 0.0);
  const std::vector<double> above(grid.size(), 0.1);
  const auto miss = solve_pixel_contact(layer, {above, {}});
  EXPECT_EQ(miss.force, 0.0);
  EXPECT_TRUE(miss.converged);
  EXPECT_EQ(miss.iterations, 0);
}

TEST(PixelContact, OnePixelIsEnough) {
  const PixelGrid grid = centred(17, 17, 0.1);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  std::vector<double> gap(grid.size(), kInfinity);
  gap[grid.at(8, 8)] = -0.1;
  const auto held = solve_pixel_contact(layer, {gap, {}}, {1e-9, 100});
  EXPECT_TRUE(held.converged);
  EXPECT_NEAR(held.displacement[grid.at(8, 8)], 0.1, 1e-9);
  const auto forced = solve_pixel_contact(layer, {gap, held.force}, {1e-9, 100});
  EXPECT_NEAR(forced.shift, 0.0, 1e-8);
}

TEST(PixelContact, EndsAndSaysSoWhereItMayNotGoOn) {
  const PixelGrid grid = centred(64, 64, 0.02);
  const LayerResponse layer(kGel, 2.0, grid, GridEdges::free);
  const auto gap =
      gap_of(grid, [](const Eigen::Vector2d& x) { return x.squaredNorm() + 0.05 * std::sin(50.0 * x.y()); });
  const auto answer = solve_pixel_contact(layer, {gap, 0.1}, {1e-12, 3});
  EXPECT_FALSE(answer.converged);
  EXPECT_EQ(answer.iterations, 3);
  EXPECT_GT(std::max(answer.largest_gap, answer.largest_overlap), 1e-12);
  EXPECT_NEAR(answer.force, 0.1, 1e-12);
}

TEST(PixelContact, TheNumberOfThreadsChangesNoBit) {
  const PixelGrid grid = centred(75, 64, 0.02);
  const LayerResponse layer(kGel, 2.0, grid, GridEdges::free);
  const auto gap =
      gap_of(grid, [](const Eigen::Vector2d& x) { return x.squaredNorm() + 0.01 * std::sin(50.0 * x.y()); });
  std::vector<double> one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = solve_pixel_contact(layer, {gap, 0.1}).pressure;
  }
  EXPECT_EQ(one, solve_pixel_contact(layer, {gap, 0.1}).pressure);
}

TEST(PixelContact, RefusesWhatIsntANumber) {
  const PixelGrid grid = centred(8, 8, 0.1);
  const LayerResponse layer(kGel, 1.0, grid, GridEdges::free);
  const auto error_of = [&](std::vector<double> gap, std::optional<double> force, std::vector<double> start) {
    try {
      solve_pixel_contact(layer, {gap, force}, {}, start);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  std::vector<double> flat(grid.size(), 0.0);
  std::vector<double> holed = flat;
  holed[5] = std::nan("");
  std::vector<double> endless = flat;
  endless[7] = -kInfinity;
  EXPECT_THAT(error_of(holed, {}, {}), HasSubstr("pixel 5 is nan"));
  EXPECT_THAT(error_of(endless, {}, {}), HasSubstr("pixel 7 is -inf"));
  EXPECT_THAT(error_of(flat, {}, holed), HasSubstr("to begin with"));
  EXPECT_THAT(error_of(flat, std::nan(""), {}), HasSubstr("force of nan"));
  EXPECT_THAT(error_of(flat, -1.0, {}), HasSubstr("force of -1"));
  EXPECT_THAT(error_of(std::vector<double>(grid.size(), kInfinity), 1.0, {}), HasSubstr("no body"));
}

}  // namespace
}  // namespace touchstone::fem
