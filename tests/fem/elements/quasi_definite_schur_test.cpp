#include "fem/elements/quasi_definite_schur.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/LU>
#include <cmath>

#include "fem/elements/front.h"
#include "fem/elements/taylor_hood.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

/// A dense quasi-definite matrix whose first `positive` unknowns are positive and whose next `negative` are negative;
/// the rest, a border, has zero on its diagonal. No two entries are alike.
Eigen::MatrixXd dense(int positive, int negative, int border) {
  const int size = positive + negative + border;
  Eigen::MatrixXd matrix(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      matrix(i, j) = std::sin(1.0 + 3.0 * std::min(i, j) + 7.0 * std::max(i, j));
    }
    matrix(i, i) += i < positive ? size : i < positive + negative ? -size : 0.0;
  }
  return matrix;
}

Eigen::MatrixXd schur_of(const Eigen::MatrixXd& matrix, Eigen::Index last) {
  const Eigen::Index first = matrix.rows() - last;
  return matrix.bottomRightCorner(last, last) -
         matrix.bottomLeftCorner(last, first) *
             matrix.topLeftCorner(first, first).partialPivLu().solve(matrix.topRightCorner(first, last));
}

SymmetricEntries entries_of(const Eigen::MatrixXd& matrix) {
  SymmetricEntries entries;
  entries.size = static_cast<int>(matrix.rows());
  for (int i = 0; i < entries.size; ++i) {
    for (int j = 0; j <= i; ++j) {
      if (matrix(i, j) != 0.0) {
        entries.add(j, i, 0.25 * matrix(i, j));  // in two parts: entries of one place add up
        entries.add(i, j, 0.75 * matrix(i, j));
      }
    }
  }
  return entries;
}

/// Two trees of 30 unknowns, one of them with a group that has none of its own.
std::vector<EliminationTree> trees_of_thirty() {
  EliminationTree chain;
  for (int k = 0; k < 30; ++k) chain.order.push_back((7 * k) % 30);
  chain.end = {1, 12, 12, 30};
  chain.parent = {1, 2, 3, -1};
  EliminationTree whole = chain;
  whole.end = {30};
  whole.parent = {-1};
  return {chain, whole};
}

/// A gel's system with a border of its outer surface's vertical displacements.
struct Gel {
  TetMesh mesh;
  TaylorHoodSpace space;
  SymmetricEntries matrix;
  int last = 0;

  explicit Gel(double poisson_ratio, int cells = 6)
      : mesh(fixtures::box_mesh({3, 3, 1}, cells, cells, 3, 0.05)), space(make_space(mesh)) {
    matrix = assemble(space, make_scales(mesh, {1.0, poisson_ratio}));
    for (int vertex = 0; vertex < space.vertices; ++vertex) {
      if (space.clamped[vertex] || std::abs(mesh.vertices[vertex].z()) > 1e-9) continue;
      matrix.add(space.displacement[vertex] + 2, space.unknowns + last++, 1.0);
    }
    matrix.size = space.unknowns + last;
  }
};

TEST(Front, IsEliminatedAsDenseAlgebraSays) {
  // Sizes on both sides of where panels and tiles end.
  for (const auto& [positive, negative, rest] :
       {std::array{3, 2, 4}, {0, 5, 3}, {7, 0, 1}, {5, 3, 0}, {191, 1, 10}, {193, 30, 400}, {500, 200, 385}}) {
    const Eigen::MatrixXd matrix = dense(positive, negative, rest);
    Eigen::MatrixXd front = matrix.triangularView<Eigen::Lower>();
    ASSERT_TRUE(eliminate_front(front.data(), static_cast<int>(front.rows()), positive, negative));
    if (rest == 0) continue;
    const Eigen::MatrixXd expected = schur_of(matrix, rest);
    const Eigen::MatrixXd found = front.bottomRightCorner(rest, rest);
    const Eigen::MatrixXd difference = (found - expected).triangularView<Eigen::Lower>();
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff()) << positive;
  }
}

TEST(Front, WrongSignIsNoticed) {
  Eigen::MatrixXd matrix = dense(10, 5, 5);
  matrix(4, 4) = -20.0;
  EXPECT_FALSE(eliminate_front(matrix.data(), 20, 10, 5));
  matrix = dense(10, 5, 5);
  matrix(12, 12) = 20.0;
  EXPECT_FALSE(eliminate_front(matrix.data(), 20, 10, 5));
}

TEST(QuasiDefiniteSchur, IsWhatDenseAlgebraSaysForAnyTree) {
  const Eigen::MatrixXd matrix = dense(20, 10, 7);
  const Eigen::MatrixXd expected = schur_of(matrix, 7);
  for (const EliminationTree& tree : trees_of_thirty()) {
    FactorReport report;
    const auto found = quasi_definite_schur(entries_of(matrix), 7, tree, &report);
    ASSERT_TRUE(found);
    EXPECT_LT((*found - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
    EXPECT_EQ(*found, Eigen::MatrixXd(found->transpose()));
    EXPECT_EQ(report.negative_pivots, 10);
  }
}

TEST(QuasiDefiniteSchur, BranchesThatDontMeetAddUp) {
  Eigen::MatrixXd matrix = dense(8, 0, 3);
  matrix.block(4, 0, 4, 4).setZero();
  matrix.block(0, 4, 4, 4).setZero();
  EliminationTree forest;
  forest.order = {0, 1, 2, 3, 4, 5, 6, 7};
  forest.end = {4, 8};
  forest.parent = {-1, -1};
  const auto found = quasi_definite_schur(entries_of(matrix), 3, forest);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - schur_of(matrix, 3)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(QuasiDefiniteSchur, AgreesWithAnEliminationThatPivots) {
  for (const double nu : {0.0, 0.3, 0.49, 0.499999, 0.5}) {
    const Gel gel(nu);
    const auto found = quasi_definite_schur(gel.matrix, gel.last, elimination_tree(gel.space));
    ASSERT_TRUE(found) << nu;
    const Eigen::MatrixXd other = schur_complement(gel.matrix, gel.last, elimination_order(gel.space));
    EXPECT_LT((*found - other).cwiseAbs().maxCoeff(), 1e-11 * other.cwiseAbs().maxCoeff()) << nu;
  }
}

TEST(QuasiDefiniteSchur, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Gel gel(0.49, 12);
  const EliminationTree tree = elimination_tree(gel.space);
  std::optional<Eigen::MatrixXd> first;
  for (const int threads : {4, 1, 2, 3}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto found = quasi_definite_schur(gel.matrix, gel.last, tree);
    ASSERT_TRUE(found);
    if (!first) first = found;
    EXPECT_TRUE(*found == *first) << threads;
  }
}

TEST(QuasiDefiniteSchur, SingularOnesHaveNoAnswer) {
  Gel gel(0.49);
  // A mechanism: one displacement has neither stiffness nor neighbours.
  const int loose = gel.space.displacement[gel.space.nodes - 1];
  for (std::size_t k = 0; k < gel.matrix.rows.size(); ++k) {
    if (gel.matrix.rows[k] == loose || gel.matrix.columns[k] == loose) gel.matrix.values[k] = 0.0;
  }
  EXPECT_FALSE(quasi_definite_schur(gel.matrix, gel.last, elimination_tree(gel.space)));
}

void expect_factorises(const Eigen::MatrixXd& matrix, const EliminationTree& tree) {
  const auto factor = FrontalFactor::make(entries_of(matrix), 7, tree);
  ASSERT_TRUE(factor);
  const Eigen::MatrixXd expected = schur_of(matrix, 7);
  EXPECT_LT((factor->complement() - expected).cwiseAbs().maxCoeff(), 1e-5 * expected.cwiseAbs().maxCoeff());
  const Eigen::MatrixXd right = matrix.topRightCorner(30, 4) * 1e12;
  const Eigen::MatrixXd solution = matrix.topLeftCorner(30, 30).partialPivLu().solve(right);
  EXPECT_LT((factor->solve(right) - solution).norm(), 1e-5 * solution.norm());
  EXPECT_LT((factor->solve(right.col(1)) - solution.col(1)).norm(), 1e-5 * solution.col(1).norm());
  EXPECT_EQ(factor->solve(Eigen::MatrixXd::Zero(30, 1)).norm(), 0.0);
}

TEST(FrontalFactor, SolvesAsDenseAlgebraForAnyTree) {
  for (const EliminationTree& tree : trees_of_thirty()) expect_factorises(dense(20, 10, 7), tree);
}

TEST(FrontalFactor, PivotsWhereASignIsWrong) {
  Eigen::MatrixXd matrix = dense(20, 10, 7);
  // Indefinite together, though each diagonal entry is positive.
  matrix(3, 10) = matrix(10, 3) = 200.0;
  matrix(17, 24) = matrix(24, 17) = -300.0;
  for (const EliminationTree& tree : trees_of_thirty()) {
    EXPECT_FALSE(quasi_definite_schur(entries_of(matrix), 7, tree));
    expect_factorises(matrix, tree);
  }
}

TEST(FrontalFactor, SolvesAGelsSystemToSinglePrecisionOnAnyNumberOfThreads) {
  const Gel gel(0.49, 12);
  const EliminationTree tree = elimination_tree(gel.space);
  SymmetricEntries inner;
  inner.size = gel.space.unknowns;
  for (std::size_t k = 0; k < gel.matrix.rows.size(); ++k) {
    if (std::max(gel.matrix.rows[k], gel.matrix.columns[k]) >= inner.size) continue;
    inner.add(gel.matrix.rows[k], gel.matrix.columns[k], gel.matrix.values[k]);
  }
  Eigen::VectorXd right(inner.size);
  for (Eigen::Index k = 0; k < right.size(); ++k) right[k] = std::sin(0.37 * static_cast<double>(k));
  const Eigen::VectorXd expected = solve_symmetric(inner, tree.order, right);
  std::optional<Eigen::MatrixXd> complement, solution;
  for (const int threads : {4, 1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto factor = FrontalFactor::make(gel.matrix, gel.last, tree);
    ASSERT_TRUE(factor);
    const Eigen::MatrixXd found = factor->solve(right);
    EXPECT_LT((found - expected).norm(), 1e-4 * expected.norm());
    if (!complement) complement = factor->complement();
    if (!solution) solution = found;
    EXPECT_TRUE(factor->complement() == *complement) << threads;
    EXPECT_TRUE(found == *solution) << threads;
  }
}

TEST(FrontalFactor, SingularOnesHaveNoAnswer) {
  Eigen::MatrixXd matrix = dense(20, 10, 7);
  matrix.row(4).setZero();
  matrix.col(4).setZero();
  for (const EliminationTree& tree : trees_of_thirty()) {
    EXPECT_FALSE(FrontalFactor::make(entries_of(matrix), 7, tree));
  }
}

}  // namespace
}  // namespace touchstone::fem
