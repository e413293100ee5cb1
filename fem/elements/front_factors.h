#pragma once
// What is kept of a multifrontal elimination to solve with.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "fem/elements/elimination_groups.h"

namespace touchstone::fem {

/// L and D of L D L^T front by front, in single precision; of a front whose pivots are indefinite the inverse of their
/// block. Filled by an elimination, then only read.
class FrontFactors {
 public:
  /// For these groups; the first `free` places are eliminated.
  void set_up(const EliminationGroups& plan, int free);
  /// Takes a group's front as eliminate_front() leaves it, or eliminate_indefinite_front(). Different groups may be
  /// kept at once by several threads.
  void keep(int group, const float* front, bool indefinite);
  /// The solutions of what was eliminated, one a column, by branches of the tree that threads share. @pre all groups
  /// are kept
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  struct Front {
    int first = 0;
    int positive = 0;
    int pivots = 0;
    bool indefinite = false;
    std::ptrdiff_t stride = 0;  ///< rows of the whole front
    std::vector<int> later;     ///< places that it meets after its pivots, without the border
    std::vector<int> children;
    std::vector<std::vector<int>> rows_of_child;  ///< where each child's `later` are in this front
    std::vector<float> columns;                   ///< (pivots + later) x pivots
    double numbers = 0.0;                         ///< of `columns`, with its branch
  };
  Eigen::MatrixXf forward(int number, Eigen::MatrixXf& x) const;
  void backward(int number, Eigen::MatrixXf& x) const;

  std::vector<Front> fronts_;
  std::vector<int> roots_;
  std::vector<int> place_;
};

}  // namespace touchstone::fem
