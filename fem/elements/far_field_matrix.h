#pragma once
// A symmetric matrix between the vertices of a surface whose far parts are smooth: near blocks whole, far blocks by few
// numbers.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "fem/elements/shared_matrix.h"

namespace touchstone::fem {

/// A symmetric matrix, three rows a vertex, in the form called H^2 ([Hackbusch2002]; [Boerm2010, ch. 3]): vertices are
/// halved to clusters; blocks between clusters that are near are kept whole, blocks between clusters that are farther
/// from each other than they are large are basis x coupling x basis^T; a cluster's basis is made of its halves'.
class FarFieldMatrix {
 public:
  /// A cluster of vertices; halves stand before the whole.
  struct Cluster {
    int parent = -1;
    std::array<int, 2> halves{-1, -1};  ///< -1: none
    int first = 0;                      ///< its vertices, in the order of `order`: first .. last - 1
    int last = 0;
    int rank = 0;
    std::size_t basis = 0;  ///< rows x rank numbers from here on: its unknowns, or its halves' basis vectors
  };
  /// Stands for its transpose, too. Far: rank x rank numbers from here on, else unknowns x unknowns.
  struct Block {
    int row = 0;     ///< cluster
    int column = 0;  ///< cluster, not after `row`
    bool far = false;
    std::size_t numbers = 0;
  };
  /// What can be stored of it.
  struct Parts {
    std::vector<int> order;  ///< vertices, cluster after cluster
    std::vector<Cluster> clusters;
    std::vector<Block> blocks;
    SharedMatrix numbers;  ///< one column
  };

  /// Of size 0.
  FarFieldMatrix() = default;
  /// From what was stored. @throws Error if the parts don't fit together
  explicit FarFieldMatrix(Parts parts, double factor = 1.0);
  /// `columns_of(vertices)`: three columns of the matrix for each vertex; it is called from several threads. What far
  /// blocks leave out is, all in all, about `tolerance` (Frobenius), as far as row_skeleton() tells.
  FarFieldMatrix(std::span<const Eigen::Vector3d> vertices,
                 const std::function<Eigen::MatrixXd(std::span<const int>)>& columns_of, double tolerance);

  Eigen::Index rows() const { return 3 * std::ssize(parts_.order); }
  const Parts& parts() const { return parts_; }
  double factor() const { return factor_; }  ///< all that `parts` stands for is multiplied by it
  /// The same times a number; no numbers are copied.
  FarFieldMatrix scaled(double factor) const { return FarFieldMatrix(parts_, factor * factor_); }

  /// Rows and columns of each vertex' three components times these signs.
  FarFieldMatrix mirrored(const Eigen::Vector3d& signs) const;

  /// The matrix times a vector.
  Eigen::VectorXd times(const Eigen::Ref<const Eigen::VectorXd>& vector) const;
  /// Three rows and columns for each of these vertices; each list without repeats.
  Eigen::MatrixXd block(std::span<const int> rows, std::span<const int> columns) const;

 private:
  using View = Eigen::Map<const Eigen::MatrixXd>;
  int basis_rows(const Cluster& cluster) const;
  View basis(const Cluster& cluster) const {
    return {parts_.numbers.view().data() + cluster.basis, basis_rows(cluster), cluster.rank};
  }
  View numbers(const Block& block) const;

  Parts parts_;
  double factor_ = 1.0;
  std::vector<int> place_;  // of each vertex in `order`
};

}  // namespace touchstone::fem
