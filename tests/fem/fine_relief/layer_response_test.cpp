#include "fem/fine_relief/layer_response.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "fem/fine_relief/layer_kernel.h"
#include "tests/fem/fine_relief/layer_kernel.h"
#include "tests/support/message_of.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kPi = std::numbers::pi;

PixelGrid centred(int nx, int ny, double pitch) {
  return {nx, ny, pitch, -0.5 * pitch * Eigen::Vector2d(nx - 1, ny - 1)};
}

std::vector<double> answer(const LayerResponse& layer, const std::vector<double>& pressure) {
  std::vector<double> displacement(pressure.size());
  layer.apply(pressure, displacement, *layer.make_scratch());
  return displacement;
}

TEST(LayerKernel, EqualsItsFormulaWhereThatIsStable) {
  for (const double nu : {0.0, 0.2, 0.3, 0.45, 0.49}) {
    for (const double q : {0.3, 0.9, 1.0, 1.1, 2.0, 5.0, 15.0}) {
      const double expected = fixtures::layer_kernel(q, nu);
      EXPECT_NEAR(layer_over_half_space(nu, q), expected, 1e-12) << nu << " " << q;
      EXPECT_NEAR(layer_less_half_space(nu, q), expected - 1.0, 1e-12) << nu << " " << q;
    }
  }
}

TEST(LayerKernel, NeitherOverflowsNorCancels) {
  EXPECT_EQ(layer_over_half_space(0.49, 1e6), 1.0);
  EXPECT_EQ(layer_over_half_space(0.3, 0.0), 0.0);
  EXPECT_EQ(layer_less_half_space(0.49, 1e6), 0.0);
  // M/q = (1-2nu)/(2(1-nu)^2) + O(q^2); at nu = 0.5 the next term leads: sinh 2q - 2q = 4q^3/3 over 2.
  EXPECT_NEAR(layer_over_half_space(0.3, 1e-6) / 1e-6, 0.4 / (2.0 * 0.49), 1e-9);
  EXPECT_NEAR(layer_over_half_space(0.5, 1e-2) / 1e-6, 2.0 / 3.0, 1e-3);
  const ElasticMaterial rubber{0.33, 0.5};
  EXPECT_GT(layer_compliance(rubber, 5.0, 0.0), 0.0);
}

TEST(LayerKernel, UniformPressureMeetsTheConfinedModulus) {
  const ElasticMaterial m{0.5, 0.4};
  const double modulus = 0.5 * 0.6 / (1.4 * 0.2);
  EXPECT_NEAR(layer_compliance(m, 3.0, 0.0), 3.0 / modulus, 1e-12);
}

// The point force's displacement, summed over the plane, is the uniform pressure's.
TEST(LayerKernel, ThePointForcesAnswerSumsToTheConfinedModulus) {
  for (const double nu : {0.2, 0.4, 0.49}) {
    const LayerCorrection correction(nu, LayerCorrection::kReach);
    double sum = 0.0;
    const double step = 0.005;
    for (int i = 0; (i + 1) * step <= LayerCorrection::kReach; ++i) {
      const double rho = (i + 0.5) * step;
      sum += 2.0 * kPi * (1.0 + rho * correction.value(rho)) * step;
    }
    // (1-nu^2)/(pi E h) * sum * h^2 = h (1+nu)(1-2nu)/(E(1-nu))
    const double expected = kPi * (1.0 - 2.0 * nu) / ((1.0 - nu) * (1.0 - nu));
    EXPECT_NEAR(sum, expected, 2e-4) << nu;
  }
}

TEST(LayerKernel, TheCorrectionsLaplacianIsItsOwn) {
  const LayerCorrection correction(0.45, 6.0);
  for (const double rho : {0.5, 1.3, 3.1}) {
    const double d = 0.02;
    const double before = correction.value(rho - d);
    const double here = correction.value(rho);
    const double after = correction.value(rho + d);
    const double expected = (before - 2.0 * here + after) / (d * d) + (after - before) / (2.0 * d * rho);
    EXPECT_NEAR(correction.laplacian(rho), expected, 2e-3 * std::abs(expected) + 1e-4);
  }
}

TEST(LayerKernel, ThePointForcesAnswerDecaysWithinTenThicknesses) {
  const LayerCorrection correction(0.5, LayerCorrection::kReach);
  EXPECT_NEAR(1.0 / 10.0 + correction.value(10.0), 0.0, 1e-4);
  EXPECT_NEAR(1.0 / LayerCorrection::kReach + correction.value(LayerCorrection::kReach), 0.0, 1e-9);
}

TEST(LayerResponse, AWaveIsAnsweredByTheKernel) {
  const ElasticMaterial m{0.33, 0.49};
  const PixelGrid grid{32, 24, 0.1, {0, 0}};
  const LayerResponse layer(m, 0.7, grid, GridEdges::periodic);
  std::vector<double> wave(grid.size());
  const double kx = 2.0 * kPi * 3 / 3.2;
  const double ky = 2.0 * kPi * 2 / 2.4;
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) wave[grid.at(i, j)] = std::cos(kx * 0.1 * i + ky * 0.1 * j);
  }
  const auto u = answer(layer, wave);
  const double expected = layer_compliance(m, 0.7, std::hypot(kx, ky));
  for (std::size_t k = 0; k < u.size(); ++k) EXPECT_NEAR(u[k], expected * wave[k], 1e-12);
}

// Love's rectangle [Love1929] on the half space, at its centre: u = 8 (1 - nu^2) p a asinh(1) / (pi E) for the square
// of half side a.
TEST(LayerResponse, OnAThickLayerASquareSinksAsLoveSays) {
  const ElasticMaterial m{1.0, 0.3};
  const PixelGrid grid = centred(33, 33, 0.01);
  std::vector<double> pressure(grid.size(), 0.0);
  for (int j = 12; j < 21; ++j) {
    for (int i = 12; i < 21; ++i) pressure[grid.at(i, j)] = 2.0;
  }
  const auto u = answer(LayerResponse(m, 1e8, grid, GridEdges::free), pressure);
  const double expected = 8.0 * 0.91 * 2.0 * 0.045 * std::asinh(1.0) / kPi;
  EXPECT_NEAR(u[grid.at(16, 16)], expected, 1e-6 * expected);
}

TEST(LayerResponse, AFreeGridFeelsNothingOfItsSize) {
  const ElasticMaterial m{0.33, 0.49};
  const PixelGrid small = centred(20, 16, 0.1);
  const PixelGrid large = centred(60, 50, 0.1);
  std::vector<double> p_small(small.size(), 0.0);
  std::vector<double> p_large(large.size(), 0.0);
  for (int j = 0; j < small.ny; ++j) {
    for (int i = 0; i < small.nx; ++i) {
      p_small[small.at(i, j)] = p_large[large.at(i + 20, j + 17)] = std::sin(0.7 * i) + 0.1 * j;
    }
  }
  const auto u_small = answer(LayerResponse(m, 1.0, small, GridEdges::free), p_small);
  const auto u_large = answer(LayerResponse(m, 1.0, large, GridEdges::free), p_large);
  for (int j = 0; j < small.ny; ++j) {
    for (int i = 0; i < small.nx; ++i) {
      EXPECT_NEAR(u_small[small.at(i, j)], u_large[large.at(i + 20, j + 17)], 1e-12);
    }
  }
}

// Far from its edges a loaded field many thicknesses wide sinks as under uniform pressure.
TEST(LayerResponse, AWideLoadMeetsTheConfinedModulus) {
  const ElasticMaterial m{0.33, 0.45};
  const PixelGrid grid = centred(301, 301, 0.1);
  const std::vector<double> pressure(grid.size(), 0.01);
  const auto u = answer(LayerResponse(m, 1.0, grid, GridEdges::free), pressure);
  const double expected = 0.01 * layer_compliance(m, 1.0, 0.0);
  EXPECT_NEAR(u[grid.at(150, 150)], expected, 1e-3 * expected);
}

// A periodic cell much wider than the load and the layer is as good as a free grid.
TEST(LayerResponse, FreeAndPeriodicAgreeForASmallLoadInAWideCell) {
  const ElasticMaterial m{0.33, 0.49};
  const PixelGrid grid = centred(400, 400, 0.05);
  std::vector<double> pressure(grid.size(), 0.0);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) pressure[grid.at(i, j)] = std::exp(-grid.centre(i, j).squaredNorm() / 0.18);
  }
  const auto free = answer(LayerResponse(m, 1.0, grid, GridEdges::free), pressure);
  const auto periodic = answer(LayerResponse(m, 1.0, grid, GridEdges::periodic), pressure);
  const double largest = free[grid.at(200, 200)];
  for (int i = 100; i < 300; ++i) {
    EXPECT_NEAR(free[grid.at(i, 190)], periodic[grid.at(i, 190)], 2e-3 * largest) << i;
  }
}

TEST(LayerResponse, IsSymmetricAndPositive) {
  const ElasticMaterial m{0.33, 0.5};
  const PixelGrid grid = centred(24, 18, 0.1);
  const LayerResponse layer(m, 0.6, grid, GridEdges::free);
  std::vector<double> p(grid.size());
  std::vector<double> q(grid.size());
  for (std::size_t k = 0; k < p.size(); ++k) {
    p[k] = std::sin(1.7 * static_cast<double>(k * k % 101));
    q[k] = std::cos(0.9 * static_cast<double>(k * k % 67));
  }
  const auto up = answer(layer, p);
  const auto uq = answer(layer, q);
  double pq = 0.0, qp = 0.0, pp = 0.0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    pq += p[k] * uq[k];
    qp += q[k] * up[k];
    pp += p[k] * up[k];
  }
  EXPECT_NEAR(pq, qp, 1e-12 * std::abs(pp));
  EXPECT_GT(pp, 0.0);
}

TEST(LayerResponse, TheNumberOfThreadsChangesNoBit) {
  const ElasticMaterial m{0.33, 0.49};
  const PixelGrid grid = centred(97, 61, 0.05);
  std::vector<double> p(grid.size());
  for (std::size_t k = 0; k < p.size(); ++k) p[k] = std::sin(static_cast<double>(k));
  std::vector<double> one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = answer(LayerResponse(m, 1.0, grid, GridEdges::free), p);
  }
  EXPECT_EQ(one, answer(LayerResponse(m, 1.0, grid, GridEdges::free), p));
}

// Each first one makes the inverse by loops, while the others wait for it. That no thread takes another's step
// meanwhile, and waits for itself, tests/core/locked_work_test.cpp shows without chance.
TEST(LayerResponse, StepsOfALoopMayAskForTheInverseAtOnce) {
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const ElasticMaterial m{0.33, 0.49};
  for (int round = 0; round < 20; ++round) {
    const LayerResponse layer(m, 1.0, centred(48, 48, 0.05), GridEdges::free);
    std::vector<const LayerResponse*> inverses(32, nullptr);
    tbb::parallel_for(std::size_t{0}, inverses.size(), [&](std::size_t i) { inverses[i] = &layer.rough_inverse(); });
    for (const LayerResponse* inverse : inverses) ASSERT_EQ(inverse, &layer.rough_inverse());
  }
}

TEST(LayerResponse, RefusesWhatItCantDo) {
  const ElasticMaterial m{0.33, 0.49};
  const auto make = [&](double thickness, const PixelGrid& grid) {
    return message_of([&] { LayerResponse(m, thickness, grid, GridEdges::free); });
  };
  EXPECT_THAT(make(1.0, {0, 4, 0.1, {0, 0}}), HasSubstr("0 x 4 pixels"));
  EXPECT_THAT(make(1.0, {kMostPixelsASide + 1, 4, 0.1, {0, 0}}), HasSubstr("1 to 2048"));
  EXPECT_THAT(make(1.0, {4, 4, std::nan(""), {0, 0}}), HasSubstr("pitch is nan"));
  EXPECT_THAT(make(1.0, {4, 4, 0.1, {std::nan(""), 0}}), HasSubstr("stands at"));
  EXPECT_THAT(make(0.0, {4, 4, 0.1, {0, 0}}), HasSubstr("thickness is 0 mm"));
  EXPECT_THAT(make(0.3, {4, 4, 0.1, {0, 0}}), HasSubstr("too wide for a layer"));
}

}  // namespace
}  // namespace touchstone::fem
