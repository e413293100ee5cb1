#pragma once
// Which unknowns and entries each front of a multifrontal elimination has, before there are any numbers.

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "fem/elements/elimination_order.h"
#include "fem/elements/schur_solver.h"

namespace touchstone::fem {

/// Unknowns that one front eliminates together.
struct EliminationGroup {
  int first = 0;     ///< its pivots' places are first .. first + positive + negative - 1
  int positive = 0;  ///< come before the negative ones
  int negative = 0;
  std::vector<int> children;
  std::vector<int> rows;    ///< places of its front: the pivots, then what they meet later, rising
  std::size_t entries = 0;  ///< its part of the entries sorted by group
  std::size_t entries_end = 0;
  double work = 0.0;        ///< operations of its branch
  std::ptrdiff_t size = 0;  ///< of its front
  std::ptrdiff_t left = 0;  ///< rows of what it leaves to its parent
};

/// The groups of a tree, children before parents, with a place for each unknown in the order of elimination: within a
/// group those of a positive diagonal come first, the last unknowns (the border) keep their own numbers.
class EliminationGroups {
 public:
  /// The last `last` unknowns aren't eliminated.
  EliminationGroups(const SymmetricEntries& matrix, int last, const EliminationTree& tree);

  std::vector<EliminationGroup>& groups() { return groups_; }
  const std::vector<EliminationGroup>& groups() const { return groups_; }
  const std::vector<int>& roots() const { return roots_; }
  /// Of each unknown, its place in the order of elimination.
  const std::vector<int>& place() const { return place_; }
  /// Row and column of an entry by place.
  std::pair<int, int> places_of(std::size_t entry) const {
    return {place_[matrix_.rows[entry]], place_[matrix_.columns[entry]]};
  }
  /// Each entry belongs to the group that eliminates the earlier of its two unknowns.
  std::span<const std::size_t> entries_of(const EliminationGroup& group) const {
    return std::span(sorted_).subspan(group.entries, group.entries_end - group.entries);
  }
  /// Those between unknowns of the border.
  std::span<const std::size_t> border_entries() const { return std::span(sorted_).subspan(border_entries_); }
  /// A group's rows are its pivots, what its entries meet, and what of `later` comes after its pivots.
  void set_rows(EliminationGroup& group, std::vector<int> later) const;

 private:
  void place_unknowns(const EliminationTree& tree);
  void sort_entries();
  void find_rows(EliminationGroup& group) const;

  const SymmetricEntries& matrix_;
  int free_;
  std::vector<EliminationGroup> groups_;
  std::vector<int> roots_;
  std::vector<int> place_;     // of each unknown in the order of elimination
  std::vector<int> group_of_;  // of each place
  std::vector<std::size_t> sorted_;
  std::size_t border_entries_ = 0;  // from here on in `sorted_`
};

}  // namespace touchstone::fem
