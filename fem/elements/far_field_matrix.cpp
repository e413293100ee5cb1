#include "fem/elements/far_field_matrix.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/error.h"
#include "fem/elements/dense_product.h"

namespace touchstone::fem {

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
  double entries = 0.0;  // that the blocks stand for
  const auto vertices_of = [&](int c) {
    return static_cast<double>(parts_.clusters[c].last - parts_.clusters[c].first);
  };
  for (const Block& block : parts_.blocks) {
    check(block.row >= 0 && block.row < count && block.column >= 0 && block.column <= block.row);
    // Not by numbers(block): a view that begins far beyond the file's end mustn't be made.
    const Cluster& row = parts_.clusters[block.row];
    const Cluster& column = parts_.clusters[block.column];
    within(block.numbers, block.far ? row.rank : 3 * (row.last - row.first),
           block.far ? column.rank : 3 * (column.last - column.first));
    entries += (block.row == block.column ? 1.0 : 2.0) * vertices_of(block.row) * vertices_of(block.column);
  }
  check(entries == static_cast<double>(n) * n);
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
  auto numbers =
      std::make_shared<std::vector<double>>(parts_.numbers.view().data(), parts_.numbers.view().data() + count);
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
  const auto own = [](Eigen::VectorXd& all, const Cluster& c) {
    return all.segment(3 * c.first, 3 * (c.last - c.first));
  };
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
      const Eigen::MatrixXd coupled = product_of(
          product_of(at.rows, values, turned ? Transposed::second : Transposed::none), by.rows, Transposed::second);
      put(at, by, [&](std::size_t i, std::size_t j) -> Eigen::Matrix3d {
        return coupled.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
      });
    }
  }
  return result;
}

}  // namespace touchstone::fem
