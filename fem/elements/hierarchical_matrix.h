#pragma once
// A symmetric matrix whose far parts are smooth, kept in far less memory than its entries take.

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace touchstone::fem {

/// A symmetric matrix as a tree of small dense blocks with nested bases, known as hierarchically semi-separable
/// [Chandrasekaran2006, sec. 2]. A node has members: unknowns of its own, then each child's basis vectors. With U_t the
/// matrix that takes unknowns to the members of node t (for a child's vectors its members' times its basis), the matrix
/// is the sum of U_t core_t U_t^T over all nodes. A node's basis vectors are some of its members, each with its
/// share in the others. An unknown may belong to several nodes. Numbers are of single precision.
class HierarchicalMatrix {
 public:
  /// Children stand before their parents.
  struct Node {
    int parent = -1;            ///< -1: none
    int place = 0;              ///< its first basis vector among the parent's members
    int members = 0;            ///< its own unknowns, then its children's basis vectors
    int rank = 0;               ///< basis vectors; 0 without a parent
    std::size_t core = 0;       ///< members x members numbers from here on, by columns, symmetric
    std::size_t from = 0;       ///< others x rank numbers from here on, by columns
    std::vector<int> kept;      ///< members that are basis vectors
    std::vector<int> others;    ///< the rest
    std::vector<int> unknowns;  ///< its own
  };

  /// Of size 0.
  HierarchicalMatrix() = default;
  /// `numbers`: what the nodes' offsets point to.
  HierarchicalMatrix(Eigen::Index size, std::vector<Node> nodes, std::vector<float> numbers);

  Eigen::Index size() const { return size_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<float>& numbers() const { return numbers_; }
  /// Some of its columns.
  Eigen::MatrixXd columns(std::span<const int> unknowns) const;

  /// For rows that are known by each node's members (rows x members): the same by unknowns.
  Eigen::MatrixXd by_unknowns(const std::vector<Eigen::MatrixXd>& rows) const;

 private:
  using View = Eigen::Map<const Eigen::MatrixXf>;
  View core(const Node& node) const { return {numbers_.data() + node.core, node.members, node.members}; }
  View from(const Node& node) const { return {numbers_.data() + node.from, node.members - node.rank, node.rank}; }
  struct Place {
    int node = 0;
    int member = 0;
  };

  Eigen::Index size_ = 0;
  std::vector<Node> nodes_;
  std::vector<float> numbers_;
  std::vector<int> first_;     // of each unknown in `places_`
  std::vector<Place> places_;  // where each unknown is a member
};

}  // namespace touchstone::fem
