#include "sensors/numerics/wide_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "sensors/numerics/wide_product.h"

namespace touchstone::sensors {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns) {
  RandomStream random(5, static_cast<std::uint64_t>(rows * 1000 + columns), Purpose::kTest);
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = 2.0 * random.uniform() - 1.0;
  return matrix;
}

Eigen::MatrixXd positive_matrix(Eigen::Index size) {
  const Eigen::MatrixXd root = random_matrix(size, size);
  Eigen::MatrixXd matrix = root * root.transpose() / static_cast<double>(size);
  matrix.diagonal().array() += 0.1;
  return matrix;
}

// Sums of products in one order, as a plain loop makes them: the very same bits, whatever the processor.
TEST(WideProduct, HasTheBitsOfThePlainSumInEveryBlock) {
  for (const auto& [rows, columns, depth] :
       {std::tuple{1, 1, 1}, {5, 3, 2}, {24, 8, 256}, {25, 9, 257}, {250, 200, 40}, {241, 193, 300}, {7, 300, 600}}) {
    const Eigen::MatrixXd a = random_matrix(rows, depth);
    const Eigen::MatrixXd b = random_matrix(columns, depth);
    Eigen::MatrixXd c = random_matrix(rows, columns);
    Eigen::MatrixXd expected = c;
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < columns; ++j) {
        for (Eigen::Index first = 0; first < depth; first += 256) {
          double sum = 0.0;
          for (Eigen::Index p = first; p < std::min<Eigen::Index>(first + 256, depth); ++p) sum += a(i, p) * b(j, p);
          expected(i, j) -= sum;
        }
      }
    }
    subtract_product(c, a, b);
    EXPECT_EQ(c, expected) << rows << " x " << columns << " x " << depth;
  }
}

TEST(WideProduct, TheLowerPartIsThatOfTheWholeAndBlocksOfLargerMatricesWork) {
  const Eigen::MatrixXd a = random_matrix(430, 70);
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(430, 430);
  Eigen::MatrixXd lower = whole;
  subtract_product(whole, a, a);
  subtract_product(lower, a, a, ProductPart::kLower);
  for (Eigen::Index j = 0; j < 430; ++j) EXPECT_EQ(lower.col(j).tail(430 - j), whole.col(j).tail(430 - j));
  Eigen::MatrixXd framed = Eigen::MatrixXd::Zero(50, 40);
  subtract_product(framed.block(3, 5, 30, 20), a.block(7, 2, 30, 60), a.block(100, 2, 20, 60));
  EXPECT_LT((framed.block(3, 5, 30, 20) + a.block(7, 2, 30, 60) * a.block(100, 2, 20, 60).transpose()).norm(), 1e-12);
  EXPECT_EQ(framed.topRows(3), Eigen::MatrixXd::Zero(3, 40));
  EXPECT_EQ(framed.rightCols(15), Eigen::MatrixXd::Zero(50, 15));
  EXPECT_EQ(framed.bottomRows(17), Eigen::MatrixXd::Zero(17, 40));
}

TEST(WideCholesky, FactorSolutionInverseAndDeterminant) {
  for (const Eigen::Index size : {1, 2, 95, 96, 97, 130, 400}) {
    const Eigen::MatrixXd matrix = positive_matrix(size);
    Eigen::MatrixXd factor = matrix;
    factor.triangularView<Eigen::StrictlyUpper>().setConstant(std::nan(""));  // it isn't read
    ASSERT_TRUE(factorise_in_place(factor));
    EXPECT_LT((factor * factor.transpose() - matrix).cwiseAbs().maxCoeff(), 1e-14 * static_cast<double>(size)) << size;
    const Eigen::LLT<Eigen::MatrixXd> reference(matrix);
    const Eigen::VectorXd right = random_matrix(size, 1);
    EXPECT_LT((solve_by_factor(factor, right) - reference.solve(right)).norm(), 1e-10);
    const Eigen::MatrixXd inverse = inverse_by_factor(factor).selfadjointView<Eigen::Lower>();
    EXPECT_LT((inverse * matrix - Eigen::MatrixXd::Identity(size, size)).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_NEAR(half_log_determinant(factor), reference.matrixLLT().diagonal().array().log().sum(), 1e-10);
  }
}

TEST(WideCholesky, TinyEntriesAreZerosAndTheThreadIsLeftAsItWas) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(300, 300);
  matrix.row(200).head(200).setConstant(1e-160);  // products of two of them are below the least normal number
  matrix.row(299).head(200).setConstant(1e-160);
  ASSERT_TRUE(factorise_in_place(matrix));
  EXPECT_EQ(matrix(299, 200), 0.0);
  EXPECT_EQ(matrix(299, 0), 1e-160);
  volatile double small = 1e-160;
  EXPECT_GT(small * small, 0.0);
}

TEST(WideCholesky, SaysWhereThereIsNoFactor) {
  for (const Eigen::Index bad : {0, 95, 96, 150}) {
    Eigen::MatrixXd matrix = positive_matrix(200);
    matrix(bad, bad) = -1.0;
    EXPECT_FALSE(factorise_in_place(matrix)) << bad;
    matrix = positive_matrix(200);
    matrix(bad, bad) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(factorise_in_place(matrix)) << bad;
  }
}

}  // namespace
}  // namespace touchstone::sensors
