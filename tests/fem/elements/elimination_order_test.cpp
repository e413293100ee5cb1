#include "fem/elements/elimination_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

TEST(EliminationOrder, HoldsEachUnknownOnce) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 5, 4, 3, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  std::vector<int> order = elimination_order(space);
  std::sort(order.begin(), order.end());
  std::vector<int> all(space.unknowns);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(order, all);
}

TEST(EliminationOrder, BranchesOfTheTreeDontMeet) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 6, 5, 3, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const EliminationTree tree = elimination_tree(space);
  ASSERT_EQ(tree.end.size(), tree.parent.size());
  ASSERT_EQ(tree.end.back(), space.unknowns);
  std::vector<int> group(space.unknowns);
  for (std::size_t g = 0, k = 0; g < tree.end.size(); ++g) {
    for (; static_cast<int>(k) < tree.end[g]; ++k) group[tree.order[k]] = static_cast<int>(g);
    EXPECT_TRUE(tree.parent[g] == -1 || tree.parent[g] > static_cast<int>(g));
  }
  const SymmetricEntries matrix = assemble(space, make_scales(mesh, {1.0, 0.49}));
  for (std::size_t k = 0; k < matrix.rows.size(); ++k) {
    const int later = std::max(group[matrix.rows[k]], group[matrix.columns[k]]);
    int above = std::min(group[matrix.rows[k]], group[matrix.columns[k]]);
    while (above >= 0 && above < later) above = tree.parent[above];
    ASSERT_EQ(above, later);  // two unknowns that meet lie on one path to the root
  }
}

TEST(EliminationOrder, FillsLessThanTheMeshsOwnOrder) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 8, 8, 3);
  const TaylorHoodSpace space = make_space(mesh);
  const SymmetricEntries matrix = assemble(space, make_scales(mesh, {1.0, 0.49}));
  std::vector<int> own(space.unknowns);
  std::iota(own.begin(), own.end(), 0);
  FactorReport dissected;
  FactorReport plain;
  solve_symmetric(matrix, elimination_order(space), Eigen::VectorXd::Ones(space.unknowns), &dissected);
  solve_symmetric(matrix, own, Eigen::VectorXd::Ones(space.unknowns), &plain);
  EXPECT_LT(dissected.operations, 0.5 * plain.operations);
}

TEST(EliminationOrder, SurvivesAMeshOnALine) {
  const TetMesh mesh = fixtures::box_mesh({30, 1, 1}, 60, 1, 1);
  const TaylorHoodSpace space = make_space(mesh);
  EXPECT_EQ(static_cast<int>(elimination_order(space).size()), space.unknowns);
}

}  // namespace
}  // namespace touchstone::fem
