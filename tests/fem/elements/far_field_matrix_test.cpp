#include "fem/elements/far_field_matrix.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// Points of a dome, in no order.
std::vector<Eigen::Vector3d> dome(int count) {
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < count; ++k) {
    const double radius = std::sqrt((k + 0.5) / count);
    const double angle = 2.399963229728653 * ((7 * k) % count);
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                        0.5 * std::sqrt(1.0 - 0.9 * radius * radius));
  }
  return points;
}

/// As the gel's: some (I + e e^T) / r, blunt where points are as near as neighbours are.
struct Kernel {
  std::vector<Eigen::Vector3d> points;

  double blunt() const { return 1.0 / std::sqrt(static_cast<double>(points.size())); }
  Eigen::Matrix3d between(int i, int j) const {
    const Eigen::Vector3d d = points[i] - points[j];
    const double r = std::sqrt(d.squaredNorm() + blunt() * blunt());
    return Eigen::Matrix3d::Identity() / r + d * d.transpose() / (r * r * r);
  }
  Eigen::MatrixXd columns(std::span<const int> of) const {
    Eigen::MatrixXd result(3 * std::ssize(points), 3 * std::ssize(of));
    for (std::size_t j = 0; j < of.size(); ++j) {
      for (int i = 0; i < std::ssize(points); ++i)
        result.block<3, 3>(3 * i, 3 * static_cast<int>(j)) = between(i, of[j]);
    }
    return result;
  }
  double diagonal() const { return 1.0 / blunt(); }
  FarFieldMatrix compressed(double tolerance) const {
    return {points, [&](std::span<const int> of) { return columns(of); }, tolerance * diagonal()};
  }
  Eigen::MatrixXd whole() const {
    std::vector<int> all(points.size());
    std::iota(all.begin(), all.end(), 0);
    return columns(all);
  }
};

TEST(FarFieldMatrix, LeavesOutNoMoreThanItMay) {
  const Kernel kernel{dome(900)};
  const Eigen::MatrixXd whole = kernel.whole();
  std::vector<int> all(kernel.points.size());
  std::iota(all.begin(), all.end(), 0);
  for (const double tolerance : {1e-1, 1e-3, 1e-4}) {  // 1e-5 is below what products of rows can tell
    const FarFieldMatrix matrix = kernel.compressed(tolerance);
    ASSERT_EQ(matrix.rows(), 2700);
    const Eigen::MatrixXd found = matrix.block(all, all);
    const double off = (found - whole).norm() / kernel.diagonal();
    EXPECT_LT(off, tolerance);
    EXPECT_GT(off, 0.01 * tolerance);  // numbers that nobody asked for cost memory
    EXPECT_LT((found - found.transpose()).cwiseAbs().maxCoeff(), 1e-13 * kernel.diagonal());
  }
}

TEST(FarFieldMatrix, BlocksAndProductsAreOfOneMatrix) {
  const Kernel kernel{dome(500)};
  const FarFieldMatrix matrix = kernel.compressed(1e-3).scaled(2.5);
  std::vector<int> all(kernel.points.size());
  std::iota(all.begin(), all.end(), 0);
  const Eigen::MatrixXd whole = matrix.block(all, all);
  const std::vector<int> rows{499, 3, 17, 250, 251};
  const std::vector<int> columns{3, 0, 480, 77};
  const Eigen::MatrixXd block = matrix.block(rows, columns);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 4; ++j) {
      EXPECT_LT((block.block<3, 3>(3 * i, 3 * j) - whole.block<3, 3>(3 * rows[i], 3 * columns[j])).norm(),
                1e-13 * whole.norm());
    }
  }
  EXPECT_EQ(matrix.block({}, columns).rows(), 0);
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(1500);
  EXPECT_EQ(matrix.times(traction), traction);
  for (const int v : rows) traction.segment<3>(3 * v) = Eigen::Vector3d(1.0, -0.3, std::sin(v));
  EXPECT_LT((matrix.times(traction) - whole * traction).norm(), 1e-13 * whole.norm());
  for (Eigen::Index k = 0; k < 1500; ++k) traction[k] = std::cos(3.0 * static_cast<double>(k));
  EXPECT_LT((matrix.times(traction) - whole * traction).norm(), 1e-12 * whole.norm());
  const Eigen::Vector3d signs(1.0, -1.0, -1.0);
  const Eigen::VectorXd turn = signs.replicate(500, 1);
  EXPECT_LT(
      (matrix.mirrored(signs).block(all, all) - Eigen::MatrixXd(turn.asDiagonal() * whole * turn.asDiagonal())).norm(),
      1e-13 * whole.norm());
}

TEST(FarFieldMatrix, GrowsNearlyWithTheSurface) {
  // Four times the points, the same shape: sixteen times the numbers if it were whole, 6.6 when this was written.
  const auto numbers = [](int points) {
    return static_cast<double>(Kernel{dome(points)}.compressed(1e-3).parts().numbers.size());
  };
  const double few = numbers(1000);
  const double many = numbers(4000);
  EXPECT_LT(few, 0.6 * 9e6);
  EXPECT_LT(many, 0.25 * 144e6);
  EXPECT_LT(many, 7.0 * few);
}

TEST(FarFieldMatrix, OfFewPointsIsWhole) {
  const Kernel kernel{dome(5)};
  const FarFieldMatrix matrix = kernel.compressed(1e-3);
  EXPECT_LT((matrix.block(std::vector{0, 1, 2, 3, 4}, std::vector{0, 1, 2, 3, 4}) - kernel.whole()).norm(), 1e-12);
}

TEST(FarFieldMatrix, PartsThatDontFitAreRefused) {
  const FarFieldMatrix::Parts good = Kernel{dome(300)}.compressed(1e-2).parts();
  ASSERT_NO_THROW(FarFieldMatrix{good});
  const auto refused = [&](const std::function<void(FarFieldMatrix::Parts&)>& spoil) {
    FarFieldMatrix::Parts parts = good;
    spoil(parts);
    EXPECT_THROW(FarFieldMatrix{parts}, Error);
  };
  refused([](auto& parts) { parts.order[7] = parts.order[8]; });
  refused([](auto& parts) { parts.order[0] = 300; });
  refused([](auto& parts) { parts.order[0] = -1; });
  refused([](auto& parts) { parts.clusters.front().last = 301; });
  refused([](auto& parts) { parts.clusters.front().rank = -2; });
  refused([](auto& parts) { parts.clusters.front().rank = 1000; });
  refused([](auto& parts) { parts.clusters.back().halves[1] = static_cast<int>(parts.clusters.size()) - 1; });
  refused([](auto& parts) { parts.clusters.back().halves[0] = -1; });
  refused([](auto& parts) { parts.clusters.front().basis = static_cast<std::size_t>(-8); });
  refused([](auto& parts) { parts.blocks.back().row = static_cast<int>(parts.clusters.size()); });
  refused([](auto& parts) { parts.blocks.pop_back(); });
  refused([](auto& parts) { parts.blocks.back().numbers = static_cast<std::size_t>(parts.numbers.size()); });
}

}  // namespace
}  // namespace touchstone::fem
