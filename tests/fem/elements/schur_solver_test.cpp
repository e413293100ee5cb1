#include "fem/elements/schur_solver.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <numeric>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// A quasi-definite matrix of some size: a positive and a negative part, coupled; every entry is different.
Eigen::MatrixXd quasi_definite(int size) {
  Eigen::MatrixXd matrix(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      matrix(i, j) = std::sin(1.0 + 3.0 * std::min(i, j) + 7.0 * std::max(i, j)) * (std::abs(i - j) <= 3 ? 1.0 : 0.0);
    }
    matrix(i, i) += i % 3 == 2 ? -8.0 : 8.0;
  }
  return matrix;
}

std::vector<int> rising(int size) {
  std::vector<int> order(size);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

SymmetricEntries upper_entries(const Eigen::MatrixXd& matrix) {
  SymmetricEntries entries;
  entries.size = static_cast<int>(matrix.rows());
  for (int i = 0; i < entries.size; ++i) {
    for (int j = i; j < entries.size; ++j) {
      if (matrix(i, j) != 0.0) {
        entries.add(i, j, 0.25 * matrix(i, j));  // in two parts: entries of one place add up
        entries.add(i, j, 0.75 * matrix(i, j));
      }
    }
  }
  return entries;
}

TEST(SchurSolver, SchurComplementIsWhatDenseAlgebraSays) {
  for (const int last : {1, 5, 20}) {
    const Eigen::MatrixXd matrix = quasi_definite(60);
    const int first = 60 - last;
    const Eigen::MatrixXd expected =
        matrix.bottomRightCorner(last, last) -
        matrix.bottomLeftCorner(last, first) *
            matrix.topLeftCorner(first, first).partialPivLu().solve(matrix.topRightCorner(first, last));
    const Eigen::MatrixXd found = schur_complement(upper_entries(matrix), last, rising(first));
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff()) << last;
    EXPECT_EQ(found, Eigen::MatrixXd(found.transpose()));
  }
}

TEST(SchurSolver, OneFactorisationGivesTheComplementAndSolvesTheInnerBlock) {
  const Eigen::MatrixXd matrix = quasi_definite(60);
  BorderedFactor factor(upper_entries(matrix), 7, rising(53));
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(53, -1.0, 2.0);
  const Eigen::VectorXd expected = matrix.topLeftCorner(53, 53).partialPivLu().solve(right);
  EXPECT_LT((factor.solve(right) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT((factor.solve(2.0 * right) - 2.0 * expected).norm(), 1e-12 * expected.norm());
  const Eigen::MatrixXd complement =
      matrix.bottomRightCorner(7, 7) -
      matrix.bottomLeftCorner(7, 53) * matrix.topLeftCorner(53, 53).partialPivLu().solve(matrix.topRightCorner(53, 7));
  EXPECT_LT((factor.complement() - complement).norm(), 1e-12 * complement.norm());
}

TEST(SchurSolver, SolvesEveryColumn) {
  const Eigen::MatrixXd matrix = quasi_definite(60);
  const Eigen::MatrixXd right = Eigen::MatrixXd::Random(60, 3);
  const Eigen::MatrixXd x = solve_symmetric(upper_entries(matrix), rising(60), right);
  EXPECT_LT((matrix * x - right).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SchurSolver, AFactorServesManyTimesAndOutlivesItsMatrix) {
  const Eigen::MatrixXd matrix = quasi_definite(60);
  auto entries = std::make_unique<SymmetricEntries>(upper_entries(matrix));
  const SymmetricFactor factor(*entries, rising(60));
  entries.reset();
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd right = Eigen::VectorXd::Random(60);
    const Eigen::VectorXd x = factor.solve(right);
    EXPECT_LT((matrix * x - right).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(factor.solve(right), x);
  }
}

TEST(SchurSolver, OrderOfEliminationDoesntChangeTheAnswer) {
  const SymmetricEntries entries = upper_entries(quasi_definite(60));
  std::vector<int> shuffled(50);
  for (int i = 0; i < 50; ++i) {
    shuffled[i] = (i * 7 + 3) % 50;
  }
  const Eigen::MatrixXd plain = schur_complement(entries, 10, rising(50));
  EXPECT_LT((schur_complement(entries, 10, shuffled) - plain).cwiseAbs().maxCoeff(),
            1e-12 * plain.cwiseAbs().maxCoeff());
}

TEST(SchurSolver, ReportsTheInertia) {
  FactorReport report;
  solve_symmetric(upper_entries(quasi_definite(60)), rising(60), Eigen::VectorXd::Ones(60), &report);
  EXPECT_EQ(report.negative_pivots, 20);
  EXPECT_GT(report.factor_entries, 60);
}

TEST(SchurSolver, SingularSystemIsAnError) {
  SymmetricEntries laplace;  // of a line with free ends: constants are in its null space, and all pivots are exact
  laplace.size = 8;
  for (int i = 0; i < 7; ++i) {
    laplace.add(i, i, 1.0);
    laplace.add(i + 1, i + 1, 1.0);
    laplace.add(i, i + 1, -1.0);
  }
  try {
    solve_symmetric(laplace, rising(8), Eigen::VectorXd::Ones(8));
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("singular"), std::string::npos) << error.what();
  }
}

TEST(SchurSolver, SameInputGivesTheSameBytes) {
  const SymmetricEntries entries = upper_entries(quasi_definite(60));
  EXPECT_EQ(schur_complement(entries, 12, rising(48)), schur_complement(entries, 12, rising(48)));
}

}  // namespace
}  // namespace touchstone::fem
