#include "core/gauss_rule.h"

#include <gtest/gtest.h>

#include <cmath>

namespace touchstone {
namespace {

TEST(GaussRule, IntegratesPolynomialsUpToItsDegreeAndNoFurther) {
  for (const int count : {1, 2, 5, 12, 40}) {
    const GaussRule rule = gauss_rule(count);
    ASSERT_EQ(rule.nodes.size(), count);
    for (int power = 0; power < 2 * count; ++power) {
      const double sum = (rule.nodes.array().pow(power) * rule.weights.array()).sum();
      EXPECT_NEAR(sum, 1.0 / (power + 1), 1e-14) << count << " nodes, power " << power;
    }
  }
  const GaussRule two = gauss_rule(2);  // of x^4 it misses 1/180
  EXPECT_NEAR((two.nodes.array().pow(4) * two.weights.array()).sum(), 0.2 - 1.0 / 180.0, 1e-14);
}

TEST(GaussRule, NodesRiseAndMirrorEachOther) {
  const GaussRule rule = gauss_rule(24);
  for (int i = 0; i < 24; ++i) {
    EXPECT_GT(rule.nodes[i], i > 0 ? rule.nodes[i - 1] : 0.0);
    EXPECT_NEAR(rule.nodes[i] + rule.nodes[23 - i], 1.0, 1e-15);
    EXPECT_NEAR(rule.weights[i], rule.weights[23 - i], 1e-14);
  }
}

}  // namespace
}  // namespace touchstone
