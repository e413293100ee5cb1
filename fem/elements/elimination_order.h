#pragma once

#include <vector>

#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

/// An order of elimination with little fill: nested dissection of the nodes by planes across the axes, each separator
/// thinned to the fewest nodes that cover the edges it cuts ([George1973]; a minimum cover of a bipartite graph:
/// Koenig's theorem). A function of the space alone, with no random choice, unlike SCOTCH's. Returns all unknowns,
/// first to be eliminated first; those of a node stay together.
std::vector<int> elimination_order(const TaylorHoodSpace& space);

/// The same order with the parts that it was made of: each separator is a group, and so is each part that wasn't cut
/// any further. Groups are numbered in the order of their elimination.
struct EliminationTree {
  std::vector<int> order;   ///< all unknowns
  std::vector<int> end;     ///< group g eliminates order[end[g-1]] up to order[end[g]-1]
  std::vector<int> parent;  ///< the group of the separator that cut it off, which is a later one; -1: none
};
/// As elimination_order, with its groups.
EliminationTree elimination_tree(const TaylorHoodSpace& space);

}  // namespace touchstone::fem
