#include "fem/elements/hierarchical_matrix.h"

#include <utility>

#include "core/error.h"
#include "fem/elements/dense_product.h"

namespace touchstone::fem {
HierarchicalMatrix::HierarchicalMatrix(Eigen::Index size, std::vector<Node> nodes, std::vector<float> numbers)
    : size_(size), nodes_(std::move(nodes)), numbers_(std::move(numbers)) {
  first_.assign(static_cast<std::size_t>(size) + 1, 0);
  for (const Node& node : nodes_) {
    for (const int unknown : node.unknowns) ++first_[static_cast<std::size_t>(unknown) + 1];
  }
  for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  places_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t t = 0; t < nodes_.size(); ++t) {
    const std::vector<int>& own = nodes_[t].unknowns;
    for (std::size_t k = 0; k < own.size(); ++k) {
      places_[static_cast<std::size_t>(next[static_cast<std::size_t>(own[k])]++)] = {static_cast<int>(t),
                                                                                     static_cast<int>(k)};
    }
  }
}

Eigen::MatrixXd HierarchicalMatrix::columns(std::span<const int> unknowns) const {
  const auto count = std::ssize(unknowns);
  std::vector<Eigen::MatrixXf> at(nodes_.size());  // members x columns; empty: zero
  const auto members_of = [&](int t) -> Eigen::MatrixXf& {
    Eigen::MatrixXf& values = at[static_cast<std::size_t>(t)];
    if (values.size() == 0) values = Eigen::MatrixXf::Zero(nodes_[static_cast<std::size_t>(t)].members, count);
    return values;
  };
  for (std::ptrdiff_t j = 0; j < count; ++j) {
    const int unknown = unknowns[j];
    TS_ASSERT(unknown >= 0 && unknown < size_);
    for (int k = first_[unknown]; k < first_[unknown + 1]; ++k) {
      members_of(places_[k].node)(places_[k].member, j) = 1.0F;
    }
  }
  for (std::size_t t = 0; t < nodes_.size(); ++t) {
    const Node& node = nodes_[t];
    if (at[t].size() == 0 || node.parent < 0) continue;
    const Eigen::MatrixXf others = at[t](node.others, Eigen::all);
    members_of(node.parent).middleRows(node.place, node.rank) =
        at[t](node.kept, Eigen::all) + product_of(from(node), others, Transposed::first);
  }
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size_, count);
  for (std::size_t t = nodes_.size(); t-- > 0;) {
    const Node& node = nodes_[t];
    Eigen::MatrixXf here = Eigen::MatrixXf::Zero(node.members, count);
    if (at[t].size() > 0) here = product_of(core(node), at[t]);
    if (node.parent >= 0) {
      const Eigen::MatrixXf above = at[static_cast<std::size_t>(node.parent)].middleRows(node.place, node.rank);
      const Eigen::MatrixXf others = product_of(from(node), above);
      for (std::size_t k = 0; k < node.kept.size(); ++k) here.row(node.kept[k]) += above.row(k);
      for (std::size_t k = 0; k < node.others.size(); ++k) here.row(node.others[k]) += others.row(k);
    }
    for (std::size_t k = 0; k < node.unknowns.size(); ++k) {
      result.row(node.unknowns[k]) += here.row(static_cast<Eigen::Index>(k)).cast<double>();
    }
    at[t] = std::move(here);
  }
  return result;
}

Eigen::MatrixXd HierarchicalMatrix::by_unknowns(const std::vector<Eigen::MatrixXd>& rows) const {
  TS_ASSERT(rows.size() == nodes_.size() && !rows.empty());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows.front().rows(), size_);
  std::vector<Eigen::MatrixXd> total(rows);
  for (std::size_t t = nodes_.size(); t-- > 0;) {
    const Node& node = nodes_[t];
    if (node.parent >= 0) {
      const Eigen::MatrixXd above = total[static_cast<std::size_t>(node.parent)].middleCols(node.place, node.rank);
      const Eigen::MatrixXd others = above * from(node).cast<double>().transpose();
      for (std::size_t k = 0; k < node.kept.size(); ++k) total[t].col(node.kept[k]) += above.col(k);
      for (std::size_t k = 0; k < node.others.size(); ++k) total[t].col(node.others[k]) += others.col(k);
    }
    for (std::size_t k = 0; k < node.unknowns.size(); ++k) {
      result.col(node.unknowns[k]) += total[t].col(static_cast<Eigen::Index>(k));
    }
  }
  return result;
}

}  // namespace touchstone::fem
