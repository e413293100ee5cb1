#include "sensors/numerics/nonnegative_minimum.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

struct Problem {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
};

Problem random_problem(int n, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  Eigen::MatrixXd root(n, n);
  for (double& entry : root.reshaped()) entry = random.normal();
  Problem problem{root * root.transpose() + 0.01 * Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd(n)};
  for (double& entry : problem.b) entry = random.normal();
  return problem;
}

TEST(NonnegativeMinimum, NoStepThatIsAllowedGoesDown) {
  int held = 0, few = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const int n = 6 + static_cast<int>(seed);
    const Problem problem = random_problem(n, seed);
    std::vector<std::uint8_t> sign(static_cast<std::size_t>(n), 0);
    // All of them, so that many are held; or the first two, so that few are.
    const int signs = seed % 2 == 0 ? n : 2;
    for (int i = 0; i < signs; ++i) sign[static_cast<std::size_t>(i)] = 1;
    const NonnegativeMinimum found = nonnegative_minimum(problem.H, problem.H.llt(), problem.b, sign);
    ASSERT_TRUE(found.converged) << seed;
    const Eigen::VectorXd slope = problem.H * found.x - problem.b;
    for (int i = 0; i < n; ++i) {
      if (!sign[static_cast<std::size_t>(i)] || found.x[i] > 0.0) {
        EXPECT_NEAR(slope[i], 0.0, 1e-7) << seed << " " << i;
      } else {
        EXPECT_EQ(found.x[i], 0.0);
        EXPECT_GT(slope[i], -1e-7);
        ++(signs == n ? held : few);
      }
    }
  }
  EXPECT_GT(held, 50);
  EXPECT_GT(few, 5);
}

TEST(NonnegativeMinimum, WithoutSignsItIsTheSolution) {
  const Problem problem = random_problem(9, 3);
  const NonnegativeMinimum found =
      nonnegative_minimum(problem.H, problem.H.llt(), problem.b, std::vector<std::uint8_t>(9, 0));
  EXPECT_LT((problem.H * found.x - problem.b).norm(), 1e-9);
  EXPECT_EQ(found.factorisations, 0);
}

TEST(NonnegativeMinimum, OfNothingIsNothing) {
  const NonnegativeMinimum found = nonnegative_minimum(Eigen::MatrixXd(0, 0), {}, Eigen::VectorXd(0), {});
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.x.size(), 0);
}

}  // namespace
}  // namespace touchstone::sensors
