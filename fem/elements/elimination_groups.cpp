#include "fem/elements/elimination_groups.h"

#include <algorithm>

#include "core/error.h"

namespace touchstone::fem {

EliminationGroups::EliminationGroups(const SymmetricEntries& matrix, int last, const EliminationTree& tree)
    : matrix_(matrix), free_(matrix.size - last), groups_(tree.parent.size()) {
  place_unknowns(tree);
  sort_entries();
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (tree.parent[g] < 0) {
      roots_.push_back(static_cast<int>(g));
    } else {
      TS_ASSERT(tree.parent[g] > static_cast<int>(g));
      groups_[tree.parent[g]].children.push_back(static_cast<int>(g));
    }
  }
  for (EliminationGroup& group : groups_) find_rows(group);
}

void EliminationGroups::place_unknowns(const EliminationTree& tree) {
  std::vector<double> diagonal(matrix_.size, 0.0);
  for (std::size_t k = 0; k < matrix_.rows.size(); ++k) {
    if (matrix_.rows[k] == matrix_.columns[k]) diagonal[matrix_.rows[k]] += matrix_.values[k];
  }
  TS_ASSERT(static_cast<int>(tree.order.size()) == free_);
  place_.assign(matrix_.size, -1);
  group_of_.resize(free_);
  int next = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    EliminationGroup& group = groups_[g];
    group.first = next;
    const int end = tree.end[g];
    const int begin = next;
    for (const bool positive : {true, false}) {
      for (int k = begin; k < end; ++k) {
        const int unknown = tree.order[k];
        if ((diagonal[unknown] > 0.0) != positive) continue;
        TS_ASSERT(unknown < free_ && place_[unknown] < 0);
        group_of_[next] = static_cast<int>(g);
        place_[unknown] = next++;
        ++(positive ? group.positive : group.negative);
      }
    }
  }
  TS_ASSERT(next == free_);
  for (int border = free_; border < matrix_.size; ++border) place_[border] = border;
}

void EliminationGroups::sort_entries() {
  const std::size_t none = groups_.size();
  std::vector<std::size_t> count(none + 2, 0);
  const auto owner = [&](std::size_t entry) {
    const auto [row, column] = places_of(entry);
    const int earlier = std::min(row, column);
    return earlier < free_ ? static_cast<std::size_t>(group_of_[earlier]) : none;
  };
  for (std::size_t k = 0; k < matrix_.rows.size(); ++k) ++count[owner(k) + 1];
  for (std::size_t g = 0; g <= none; ++g) count[g + 1] += count[g];
  for (std::size_t g = 0; g < none; ++g) {
    groups_[g].entries = count[g];
    groups_[g].entries_end = count[g + 1];
  }
  border_entries_ = count[none];
  sorted_.resize(matrix_.rows.size());
  for (std::size_t k = 0; k < sorted_.size(); ++k) sorted_[count[owner(k)]++] = k;
}

/// Children come before parents.
void EliminationGroups::find_rows(EliminationGroup& group) const {
  std::vector<int> later;
  for (const int child : group.children) {
    const EliminationGroup& below = groups_[child];
    later.insert(later.end(), below.rows.begin() + below.positive + below.negative, below.rows.end());
    group.work += below.work;
  }
  set_rows(group, std::move(later));
  const int pivots = group.positive + group.negative;
  const double n = static_cast<double>(group.rows.size());
  const double rest = n - pivots;
  group.work += (n * n * n - rest * rest * rest) / 3.0;
  group.size = std::ssize(group.rows);
  group.left = group.size - pivots;
}

void EliminationGroups::set_rows(EliminationGroup& group, std::vector<int> later) const {
  const int pivots = group.positive + group.negative;
  for (const std::size_t entry : entries_of(group)) {
    const auto [row, column] = places_of(entry);
    later.push_back(std::max(row, column));
  }
  std::erase_if(later, [end = group.first + pivots](int place) { return place < end; });
  std::sort(later.begin(), later.end());
  later.erase(std::unique(later.begin(), later.end()), later.end());
  group.rows.resize(static_cast<std::size_t>(pivots));
  for (int k = 0; k < pivots; ++k) group.rows[static_cast<std::size_t>(k)] = group.first + k;
  group.rows.insert(group.rows.end(), later.begin(), later.end());
}

}  // namespace touchstone::fem
