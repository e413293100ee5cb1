#include "core/random.h"
#include "core/random_pairs.h"
#include "core/uniform_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace touchstone {
namespace {

constexpr int kDraws = 200000;

// The first of the known answers that Random123 publishes for philox4x32-10: counter and key 0.
TEST(RandomStream, GivesTheKnownAnswerOfPhilox) {
  RandomStream stream(0, 0, static_cast<Purpose>(0));
  for (const std::uint32_t expected : {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}) {
    EXPECT_EQ(stream(), expected);
  }
}

TEST(RandomStream, IsAPureFunctionOfSeedIndexPurposeAndCount) {
  RandomStream a(5, 7, Purpose::kTest);
  RandomStream b(5, 7, Purpose::kTest);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(a(), b());
  const auto first = [](std::uint64_t seed, std::uint64_t index, Purpose purpose) {
    RandomStream stream(seed, index, purpose);
    return (static_cast<std::uint64_t>(stream()) << 32) | stream();
  };
  std::vector<std::uint64_t> seen = {first(5, 7, Purpose::kTest),
                                     first(6, 7, Purpose::kTest),
                                     first(5, 8, Purpose::kTest),
                                     first(5, 7, Purpose::kMotion),
                                     first(5 + (1ULL << 32), 7, Purpose::kTest),
                                     first(5, 7 + (1ULL << 32), Purpose::kTest)};
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::unique(seen.begin(), seen.end()), seen.end());
}

TEST(RandomStream, NeighbouringStreamsAreUncorrelated) {
  // Means of 12 streams' first draws are sums of independent uniforms: variance n/12.
  double sum_ab = 0.0;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    RandomStream a(1, i, Purpose::kTest);
    RandomStream b(1, i + 1, Purpose::kTest);
    sum_ab += (a.uniform() - 0.5) * (b.uniform() - 0.5) * 12.0;
  }
  EXPECT_LT(std::abs(sum_ab), 4.5 * std::sqrt(static_cast<double>(kDraws)));
}

TEST(RandomStream, UniformIsFlatAndBelowOne) {
  RandomStream stream(3, 0, Purpose::kTest);
  std::array<double, 64> bins{};
  for (int i = 0; i < kDraws; ++i) {
    const double u = stream.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++bins[static_cast<std::size_t>(u * 64.0)];
  }
  double chi2 = 0.0;
  for (const double count : bins) chi2 += (count - kDraws / 64.0) * (count - kDraws / 64.0) / (kDraws / 64.0);
  EXPECT_NEAR(chi2, 63.0, 5.0 * std::sqrt(2.0 * 63.0));
}

TEST(RandomStream, NormalHasTheMomentsOfANormal) {
  RandomStream stream(4, 0, Purpose::kTest);
  std::array<double, 4> moments{};
  for (int i = 0; i < kDraws; ++i) {
    const double x = stream.normal();
    double power = 1.0;
    for (double& moment : moments) moment += (power *= x) / kDraws;
  }
  // Variances of x, x^2, x^3, x^4: 1, 2, 15, 96.
  EXPECT_NEAR(moments[0], 0.0, 4.5 * std::sqrt(1.0 / kDraws));
  EXPECT_NEAR(moments[1], 1.0, 4.5 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(moments[2], 0.0, 4.5 * std::sqrt(15.0 / kDraws));
  EXPECT_NEAR(moments[3], 3.0, 4.5 * std::sqrt(96.0 / kDraws));
}

TEST(RandomStream, PoissonHasItsMeanVarianceAndDistribution) {
  for (const double mean : {0.0, 0.3, 4.0, 11.9, 12.0, 40.0, 900.0, 9999.0, 2e4}) {
    RandomStream stream(5, static_cast<std::uint64_t>(mean * 10), Purpose::kTest);
    std::vector<double> draws(kDraws);
    double sum = 0.0;
    for (double& draw : draws) {
      draw = stream.poisson(mean);
      ASSERT_GE(draw, 0.0);
      ASSERT_EQ(draw, std::floor(draw));
      sum += draw;
    }
    const double average = sum / kDraws;
    double squares = 0.0;
    for (const double draw : draws) squares += (draw - average) * (draw - average);
    const double variance = squares / (kDraws - 1);
    EXPECT_NEAR(average, mean, 4.5 * std::sqrt(mean / kDraws)) << mean;
    // The variance of a variance: (mu4 - sigma^4)/n, mu4 = mean + 3 mean^2.
    EXPECT_NEAR(variance, mean, 4.5 * std::sqrt((mean + 2.0 * mean * mean) / kDraws)) << mean;
    if (mean == 0.0 || mean > 1e3) continue;
    // Chi-squared over the numbers that are expected at least 20 times.
    double chi2 = 0.0;
    int bins = 0;
    for (int k = 0; k < mean + 10.0 * std::sqrt(mean) + 10.0; ++k) {
      const double expected = kDraws * std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
      if (expected < 20.0) continue;
      const auto count = static_cast<double>(std::count(draws.begin(), draws.end(), static_cast<double>(k)));
      chi2 += (count - expected) * (count - expected) / expected;
      ++bins;
    }
    EXPECT_LT(chi2, bins + 5.0 * std::sqrt(2.0 * bins)) << mean;
  }
}

TEST(RandomStream, PoissonRefusesAMeanThatIsNone) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  RandomStream stream(1, 1, Purpose::kTest);
  EXPECT_DEATH(stream.poisson(-1.0), "mean >= 0");
  EXPECT_DEATH(stream.poisson(std::nan("")), "mean >= 0");
}

// Of any number of streams, and where the index runs over into its upper word.
TEST(UniformPairs, AreTheStreamsOwnNumbers) {
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{77}, (std::uint64_t{3} << 32) - 40}) {
    for (const std::size_t count : {std::size_t{1}, std::size_t{63}, std::size_t{64}, std::size_t{333}}) {
      for (const std::uint32_t number : {0u, 1u, 5u}) {
        std::vector<double> one(count), other(count);
        uniform_pairs(0x123456789abcdef0u, first, Purpose::kTest, number, one, other);
        for (std::size_t k = 0; k < count; ++k) {
          RandomStream stream(0x123456789abcdef0u, first + k, Purpose::kTest);
          for (std::uint32_t skipped = 0; skipped < 2 * number; ++skipped) stream.uniform();
          ASSERT_EQ(one[k], stream.uniform()) << first << " " << k;
          ASSERT_EQ(other[k], stream.uniform()) << first << " " << k;
        }
      }
    }
  }
}

TEST(RandomPairs, HaveAFixedOrder) {
  RandomStream one(5, 0, Purpose::kTest), two(5, 0, Purpose::kTest);
  const Eigen::Vector2d normal = normal_pair(one);
  EXPECT_EQ(normal.y(), two.normal());
  EXPECT_EQ(normal.x(), two.normal());
  const Eigen::Vector2d uniform = uniform_pair(one);
  EXPECT_EQ(uniform.y(), two.uniform());
  EXPECT_EQ(uniform.x(), two.uniform());
  const std::uint64_t seed = next_seed(one);
  EXPECT_EQ(seed >> 32, two());
  EXPECT_EQ(seed & 0xffffffffu, two());
}

}  // namespace
}  // namespace touchstone
