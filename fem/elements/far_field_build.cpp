// How a matrix that is known by its columns gets clusters, blocks and bases.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "fem/elements/far_field_matrix.h"
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
  std::vector<std::vector<int>> far_of;     // clusters far from each, in blocks of either orientation
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
      std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last,
                       [&](int a, int b) { return std::pair(vertices[a][axis], a) < std::pair(vertices[b][axis], b); });
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
  std::vector<Eigen::MatrixXd> waiting_;    // columns of leaves, the next one last
  std::vector<std::vector<int>> skeleton_;  // of each cluster: those of its unknowns that stand for it
  std::vector<double> numbers_;
  double share_ = 0.0;
};

}  // namespace

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

}  // namespace touchstone::fem
