#include "fem/elements/far_field_matrix.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "fem/elements/dense_product.h"
#include "fem/elements/row_skeleton.h"

namespace touchstone::fem {
namespace {

constexpr int kLeafVertices = 32;
constexpr double kApart = 1.0;  // of the larger cluster's diagonal: clusters farther apart are far

using Cluster = FarFieldMatrix::Cluster;
using Block = FarFieldMatrix::Block;

/// Clusters and blocks, before there are numbers.
struct Layout {
  std::span<const Eigen::Vector3d> vertices;
  FarFieldMatrix::Parts parts;
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<std::vector<int>> far_of;   // clusters far from each, in blocks of either orientation
  std::vector<std::vector<int>> blocks_of;  // by row

  int add(int first, int last) {
    Eigen::AlignedBox3d box;
    std::vector<int>& order = parts.order;
    for (int k = first; k < last; ++k) box.extend(vertices[order[k]]);
    std::array<int, 2> halves{-1, -1};
    if (last - first > kLeafVertices) {
      Eigen::Index axis = 0;
      box.sizes().maxCoeff(&axis);
      const int middle = first + (last - first) / 2;
      std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last, [&](int a, int b) {
        return std::pair(vertices[a][axis], a) < std::pair(vertices[b][axis], b);
      });
      std::sort(order.begin() + first, order.begin() + middle);
      std::sort(order.begin() + middle, order.begin() + last);
      halves = {add(first, middle), add(middle, last)};
    }
    const int number = static_cast<int>(parts.clusters.size());
    for (const int half : halves) {
      if (half >= 0) parts.clusters[half].parent = number;
    }
    parts.clusters.push_back({-1, halves, first, last, 0, 0});
    boxes.push_back(box);
    return number;
  }

  void pair(int a, int b) {
    if (a < b) std::swap(a, b);
    const Cluster& one = parts.clusters[a];
    const Cluster& other = parts.clusters[b];
    const double larger = std::max(boxes[a].diagonal().norm(), boxes[b].diagonal().norm());
    const bool far = boxes[a].exteriorDistance(boxes[b]) > kApart * larger;
    if (far || (one.halves[0] < 0 && other.halves[0] < 0)) {
      blocks_of[a].push_back(static_cast<int>(parts.blocks.size()));
      parts.blocks.push_back({a, b, far, 0});
      if (far) {
        far_of[a].push_back(b);
        far_of[b].push_back(a);
      }
      return;
    }
    const auto halves_of = [](const Cluster& c, int itself) {
      return c.halves[0] < 0 ? std::array<int, 2>{itself, -1} : c.halves;
    };
    const std::array<int, 2> left = halves_of(one, a);
    const std::array<int, 2> right = halves_of(other, b);
    if (a == b) {
      pair(left[0], left[0]);
      pair(left[1], left[0]);
      pair(left[1], left[1]);
      return;
    }
    for (const int p : left) {
      for (const int q : right) {
        if (p >= 0 && q >= 0) pair(p, q);
      }
    }
  }
};

/// What is known of a cluster's far field: its skeleton's rows of the matrix, by the clusters that are far.
struct FarRows {
  std::vector<std::pair<int, Eigen::Index>> columns;  ///< cluster, its first column in `rows`
  Eigen::MatrixXd rows;

  Eigen::Index at(int cluster) const {
    const auto found = std::find_if(columns.begin(), columns.end(), [&](const auto& c) { return c.first == cluster; });
    TS_ASSERT(found != columns.end());
    return found->second;
  }
};

class Builder {
 public:
  Builder(Layout& layout, const std::function<Eigen::MatrixXd(std::span<const int>)>& columns_of, double tolerance)
      : layout_(layout), columns_of_(columns_of), skeleton_(layout.parts.clusters.size()) {
    for (std::size_t c = 0; c < layout.parts.clusters.size(); ++c) {
      if (layout.parts.clusters[c].halves[0] < 0) leaves_.push_back(static_cast<int>(c));
    }
    int levels = 1;
    for (int c = static_cast<int>(layout.parts.clusters.size()) - 1; layout.parts.clusters[c].halves[0] >= 0;
         c = layout.parts.clusters[c].halves[0]) {
      ++levels;
    }
    // Each cluster leaves out its share, and both sides of a block do.
    share_ = tolerance / std::sqrt(2.0 * levels * static_cast<double>(layout.parts.order.size()));
  }

  std::vector<double> take_numbers() && { return std::move(numbers_); }

  FarRows build(int number, const std::vector<int>& far_above) {
    Cluster& cluster = layout_.parts.clusters[number];
    std::vector<int> far = far_above;
    far.insert(far.end(), layout_.far_of[number].begin(), layout_.far_of[number].end());
    FarRows wide;  // before they are made few
    const bool leaf = cluster.halves[0] < 0;
    Eigen::Index columns = 0;
    for (const int c : far) {
      wide.columns.emplace_back(c, columns);
      columns += size(c);
    }
    Eigen::MatrixXd all;
    if (leaf) {
      all = next_columns();
      wide.rows.resize(size(number), columns);
      for (const auto& [c, first] : wide.columns) {
        const Cluster& other = layout_.parts.clusters[c];
        for (int k = other.first; k < other.last; ++k) {
          wide.rows.middleCols<3>(first + 3 * (k - other.first)) =
              all.middleRows<3>(3 * layout_.parts.order[k]).transpose();
        }
      }
    } else {
      const std::array<FarRows, 2> half = {build(cluster.halves[0], far), build(cluster.halves[1], far)};
      wide.rows.resize(half[0].rows.rows() + half[1].rows.rows(), columns);
      for (const auto& [c, first] : wide.columns) {
        wide.rows.middleCols(first, size(c)) << half[0].rows.middleCols(half[0].at(c), size(c)),
            half[1].rows.middleCols(half[1].at(c), size(c));
      }
    }
    const RowSkeleton found = row_skeleton(wide.rows, Eigen::VectorXd::Ones(columns),
                                           share_ * std::sqrt(static_cast<double>(cluster.last - cluster.first)));
    cluster.rank = static_cast<int>(found.kept.size());
    Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(wide.rows.rows(), cluster.rank);
    for (int k = 0; k < cluster.rank; ++k) basis(found.kept[k], k) = 1.0;
    for (std::size_t i = 0; i < found.others.size(); ++i) basis.row(found.others[i]) = found.from.row(i);
    cluster.basis = keep(basis);
    wide.rows = Eigen::MatrixXd(wide.rows(found.kept, Eigen::all));
    for (const int k : found.kept) {
      if (leaf) {
        skeleton_[number].push_back(k);
        continue;
      }
      const std::vector<int>& low = skeleton_[cluster.halves[0]];
      const std::vector<int>& high = skeleton_[cluster.halves[1]];
      const int first = static_cast<int>(size(cluster.halves[0]));
      skeleton_[number].push_back(k < std::ssize(low) ? low[k] : first + high[k - std::ssize(low)]);
    }
    for (const int b : layout_.blocks_of[number]) {
      Block& block = layout_.parts.blocks[b];
      if (block.far) {
        const auto other = wide.rows.middleCols(wide.at(block.column), size(block.column));
        block.numbers = keep(other(Eigen::all, skeleton_[block.column]));
        continue;
      }
      const Cluster& other = layout_.parts.clusters[block.column];
      Eigen::MatrixXd whole(size(number), size(block.column));
      for (int k = other.first; k < other.last; ++k) {
        whole.middleCols<3>(3 * (k - other.first)) = all.middleRows<3>(3 * layout_.parts.order[k]).transpose();
      }
      block.numbers = keep(whole);
    }
    return wide;
  }

 private:
  /// The columns of the next leaf: leaves come in their order. They are asked for several at once, in parallel.
  Eigen::MatrixXd next_columns() {
    constexpr std::size_t kAtOnce = 8;
    if (waiting_.empty()) {
      waiting_.resize(std::min(kAtOnce, leaves_.size() - next_leaf_));
      tbb::parallel_for(std::size_t{0}, waiting_.size(), [&](std::size_t k) {
        const Cluster& leaf = layout_.parts.clusters[leaves_[next_leaf_ + waiting_.size() - 1 - k]];
        waiting_[k] = columns_of_(std::span<const int>(layout_.parts.order.data() + leaf.first,
                                                       static_cast<std::size_t>(leaf.last - leaf.first)));
      });
      next_leaf_ += waiting_.size();
    }
    Eigen::MatrixXd next = std::move(waiting_.back());
    waiting_.pop_back();
    return next;
  }
  Eigen::Index size(int cluster) const {
    const Cluster& c = layout_.parts.clusters[cluster];
    return 3 * static_cast<Eigen::Index>(c.last - c.first);
  }
  std::size_t keep(const Eigen::MatrixXd& block) {
    const std::size_t at = numbers_.size();
    numbers_.insert(numbers_.end(), block.data(), block.data() + block.size());
    return at;
  }

  Layout& layout_;
  const std::function<Eigen::MatrixXd(std::span<const int>)>& columns_of_;
  std::vector<int> leaves_;
  std::size_t next_leaf_ = 0;
  std::vector<Eigen::MatrixXd> waiting_;   // columns of leaves, the next one last
  std::vector<std::vector<int>> skeleton_;  // of each cluster: those of its unknowns that stand for it
  std::vector<double> numbers_;
  double share_ = 0.0;
};

}  // namespace

FarFieldMatrix::FarFieldMatrix(Parts parts, double factor) : parts_(std::move(parts)), factor_(factor) {
  const int n = static_cast<int>(parts_.order.size());
  const int count = static_cast<int>(parts_.clusters.size());
  const auto check = [](bool fits) {
    if (!fits) fail("its compressed parts don't fit together");
  };
  place_.assign(parts_.order.size(), -1);
  for (int k = 0; k < n; ++k) {
    const int v = parts_.order[k];
    check(v >= 0 && v < n && place_[v] < 0);
    place_[v] = k;
  }
  const auto within = [&](std::size_t first, Eigen::Index rows, Eigen::Index columns) {
    const auto all = static_cast<std::size_t>(parts_.numbers.size());
    check(first <= all && static_cast<std::size_t>(rows * columns) <= all - first);
  };
  for (int c = 0; c < count; ++c) {
    const Cluster& cluster = parts_.clusters[c];
    check(cluster.first >= 0 && cluster.first < cluster.last && cluster.last <= n && cluster.rank >= 0);
    check((cluster.halves[0] < 0) == (cluster.halves[1] < 0) && std::max(cluster.halves[0], cluster.halves[1]) < c);
    if (cluster.halves[0] >= 0) {
      const Cluster& low = parts_.clusters[cluster.halves[0]];
      const Cluster& high = parts_.clusters[cluster.halves[1]];
      check(low.first == cluster.first && low.last == high.first && high.last == cluster.last);
    }
    check(cluster.rank <= basis_rows(cluster));
    within(cluster.basis, basis_rows(cluster), cluster.rank);
  }
  for (const Block& block : parts_.blocks) {
    check(block.row >= 0 && block.row < count && block.column >= 0 && block.column <= block.row);
    within(block.numbers, numbers(block).rows(), numbers(block).cols());
  }
}

FarFieldMatrix::FarFieldMatrix(std::span<const Eigen::Vector3d> vertices,
                               const std::function<Eigen::MatrixXd(std::span<const int>)>& columns_of,
                               double tolerance) {
  Layout layout;
  layout.vertices = vertices;
  layout.parts.order.resize(vertices.size());
  std::iota(layout.parts.order.begin(), layout.parts.order.end(), 0);
  const int root = layout.add(0, static_cast<int>(vertices.size()));
  layout.far_of.resize(layout.parts.clusters.size());
  layout.blocks_of.resize(layout.parts.clusters.size());
  layout.pair(root, root);
  Builder builder(layout, columns_of, tolerance);
  builder.build(root, {});
  auto numbers = std::make_shared<std::vector<double>>(std::move(builder).take_numbers());
  numbers->shrink_to_fit();
  const auto count = std::ssize(*numbers);
  layout.parts.numbers = SharedMatrix(std::shared_ptr<const double>(numbers, numbers->data()), count, 1);
  *this = FarFieldMatrix(std::move(layout.parts));
}

int FarFieldMatrix::basis_rows(const Cluster& cluster) const {
  if (cluster.halves[0] < 0) return 3 * (cluster.last - cluster.first);
  return parts_.clusters[cluster.halves[0]].rank + parts_.clusters[cluster.halves[1]].rank;
}

FarFieldMatrix::View FarFieldMatrix::numbers(const Block& block) const {
  const Cluster& row = parts_.clusters[block.row];
  const Cluster& column = parts_.clusters[block.column];
  const double* const first = parts_.numbers.view().data() + block.numbers;
  if (block.far) return {first, row.rank, column.rank};
  return {first, 3 * (row.last - row.first), 3 * (column.last - column.first)};
}

FarFieldMatrix FarFieldMatrix::mirrored(const Eigen::Vector3d& signs) const {
  const auto count = parts_.numbers.rows();
  auto numbers = std::make_shared<std::vector<double>>(parts_.numbers.view().data(), parts_.numbers.view().data() + count);
  const auto turn = [&](std::size_t first, Eigen::Index rows, Eigen::Index columns, bool columns_too) {
    Eigen::Map<Eigen::MatrixXd> block(numbers->data() + first, rows, columns);
    for (Eigen::Index j = 0; j < columns; ++j) {
      for (Eigen::Index i = 0; i < rows; ++i) block(i, j) *= signs[i % 3] * (columns_too ? signs[j % 3] : 1.0);
    }
  };
  for (const Cluster& cluster : parts_.clusters) {
    if (cluster.halves[0] < 0) turn(cluster.basis, basis_rows(cluster), cluster.rank, false);
  }
  for (const Block& block : parts_.blocks) {
    if (!block.far) turn(block.numbers, this->numbers(block).rows(), this->numbers(block).cols(), true);
  }
  Parts parts = parts_;
  parts.numbers = SharedMatrix(std::shared_ptr<const double>(numbers, numbers->data()), count, 1);
  return FarFieldMatrix(std::move(parts), factor_);
}

Eigen::VectorXd FarFieldMatrix::times(const Eigen::Ref<const Eigen::VectorXd>& vector) const {
  TS_ASSERT(vector.size() == rows());
  Eigen::VectorXd in(rows());
  for (std::size_t k = 0; k < parts_.order.size(); ++k) {
    in.segment<3>(3 * static_cast<Eigen::Index>(k)) = vector.segment<3>(3 * parts_.order[k]);
  }
  const std::vector<Cluster>& clusters = parts_.clusters;
  std::vector<Eigen::VectorXd> up(clusters.size());
  std::vector<Eigen::VectorXd> down(clusters.size());
  std::vector<char> empty(clusters.size());
  const auto own = [](Eigen::VectorXd& all, const Cluster& c) { return all.segment(3 * c.first, 3 * (c.last - c.first)); };
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Cluster& cluster = clusters[c];
    down[c] = Eigen::VectorXd::Zero(cluster.rank);
    empty[c] = cluster.halves[0] < 0 ? own(in, cluster).isZero(0.0)
                                     : empty[cluster.halves[0]] != 0 && empty[cluster.halves[1]] != 0;
    if (empty[c] != 0) continue;
    if (cluster.halves[0] < 0) {
      up[c].noalias() = basis(cluster).transpose() * own(in, cluster);
      continue;
    }
    up[c] = Eigen::VectorXd::Zero(cluster.rank);
    Eigen::Index first = 0;
    for (const int half : cluster.halves) {
      const Eigen::Index rank = clusters[half].rank;
      if (empty[half] == 0) up[c].noalias() += basis(cluster).middleRows(first, rank).transpose() * up[half];
      first += rank;
    }
  }
  Eigen::VectorXd out = Eigen::VectorXd::Zero(rows());
  for (const Block& block : parts_.blocks) {
    const View values = numbers(block);
    const bool both = block.row != block.column;
    if (block.far) {
      if (empty[block.column] == 0) down[block.row].noalias() += values * up[block.column];
      if (both && empty[block.row] == 0) down[block.column].noalias() += values.transpose() * up[block.row];
      continue;
    }
    const Cluster& row = clusters[block.row];
    const Cluster& column = clusters[block.column];
    if (empty[block.column] == 0) own(out, row).noalias() += values * own(in, column);
    if (both && empty[block.row] == 0) own(out, column).noalias() += values.transpose() * own(in, row);
  }
  for (std::size_t c = clusters.size(); c-- > 0;) {
    const Cluster& cluster = clusters[c];
    if (cluster.rank == 0) continue;
    const Eigen::VectorXd here = basis(cluster) * down[c];
    if (cluster.halves[0] < 0) {
      own(out, cluster) += here;
      continue;
    }
    Eigen::Index first = 0;
    for (const int half : cluster.halves) {
      const Eigen::Index rank = clusters[half].rank;
      down[half] += here.segment(first, rank);
      first += rank;
    }
  }
  Eigen::VectorXd result(rows());
  for (std::size_t k = 0; k < parts_.order.size(); ++k) {
    result.segment<3>(3 * parts_.order[k]) = factor_ * out.segment<3>(3 * static_cast<Eigen::Index>(k));
  }
  return result;
}

namespace {

/// The vertices asked for that lie in a cluster: places in the list asked for, and in the cluster.
struct Asked {
  std::vector<int> who;
  std::vector<int> place;
  Eigen::MatrixXd rows;  ///< of its basis: 3 |who| x rank
};

}  // namespace

Eigen::MatrixXd FarFieldMatrix::block(std::span<const int> rows, std::span<const int> columns) const {
  const bool same = std::equal(rows.begin(), rows.end(), columns.begin(), columns.end());
  const std::vector<Cluster>& clusters = parts_.clusters;
  const auto ask = [&](std::span<const int> vertices) {
    std::vector<std::pair<int, int>> by_place;  // place in the order, in the list
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      TS_ASSERT(vertices[i] >= 0 && vertices[i] < std::ssize(place_));
      by_place.emplace_back(place_[vertices[i]], static_cast<int>(i));
    }
    std::sort(by_place.begin(), by_place.end());
    std::vector<Asked> asked(clusters.size());
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      const Cluster& cluster = clusters[c];
      Asked& here = asked[c];
      const auto from = std::lower_bound(by_place.begin(), by_place.end(), std::pair(cluster.first, -1));
      for (auto it = from; it != by_place.end() && it->first < cluster.last; ++it) {
        here.place.push_back(it->first - cluster.first);
        here.who.push_back(it->second);
      }
      if (here.who.empty() || cluster.rank == 0) continue;
      const View all = basis(cluster);
      here.rows.resize(3 * std::ssize(here.who), cluster.rank);
      if (cluster.halves[0] < 0) {
        for (std::size_t k = 0; k < here.who.size(); ++k) {
          here.rows.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = all.middleRows<3>(3 * here.place[k]);
        }
        continue;
      }
      Eigen::Index first = 0;
      Eigen::Index row = 0;
      for (const int half : cluster.halves) {
        const Asked& below = asked[half];
        const Eigen::Index count = 3 * std::ssize(below.who);
        const Eigen::Index rank = clusters[half].rank;
        if (count > 0) here.rows.middleRows(row, count) = product_of(below.rows, all.middleRows(first, rank));
        row += count;
        first += rank;
      }
    }
    return asked;
  };
  const std::vector<Asked> left = ask(rows);
  const std::vector<Asked> right = same ? std::vector<Asked>() : ask(columns);
  const std::vector<Asked>& other = same ? left : right;
  Eigen::MatrixXd result(3 * std::ssize(rows), 3 * std::ssize(columns));
  const auto put = [&](const Asked& at, const Asked& by, const auto& value) {
    for (std::size_t j = 0; j < by.who.size(); ++j) {
      for (std::size_t i = 0; i < at.who.size(); ++i) {
        result.block<3, 3>(3 * at.who[i], 3 * by.who[j]) = factor_ * value(i, j);
      }
    }
  };
  for (const Block& block : parts_.blocks) {
    for (const bool turned : {false, true}) {
      if (turned && block.row == block.column) continue;
      const Asked& at = left[turned ? block.column : block.row];
      const Asked& by = other[turned ? block.row : block.column];
      if (at.who.empty() || by.who.empty()) continue;
      const View values = numbers(block);
      if (!block.far) {
        put(at, by, [&](std::size_t i, std::size_t j) -> Eigen::Matrix3d {
          return turned ? Eigen::Matrix3d(values.block<3, 3>(3 * by.place[j], 3 * at.place[i]).transpose())
                        : Eigen::Matrix3d(values.block<3, 3>(3 * at.place[i], 3 * by.place[j]));
        });
        continue;
      }
      const Eigen::MatrixXd coupled =
          product_of(product_of(at.rows, values, turned ? Transposed::second : Transposed::none), by.rows,
                     Transposed::second);
      put(at, by, [&](std::size_t i, std::size_t j) -> Eigen::Matrix3d {
        return coupled.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
      });
    }
  }
  return result;
}

}  // namespace touchstone::fem
