#pragma once
// Sparse symmetric indefinite systems by MUMPS (sequential): the one file that knows it.
// ([Amestoy2001]; the Schur complement: [MUMPS55, sec. 3.18])

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace touchstone::fem {

/// One triangle of a symmetric matrix, as a list of entries; entries of the same place add up. Row and column count
/// from zero.
struct SymmetricEntries {
  int size = 0;
  std::vector<int> rows;
  std::vector<int> columns;
  std::vector<double> values;

  /// Adds `value` to the entry. @pre within the size, in the triangle
  void add(int row, int column, double value) {
    rows.push_back(row);
    columns.push_back(column);
    values.push_back(value);
  }
};

/// What a factorisation took.
struct FactorReport {
  std::int64_t factor_entries = 0;
  double operations = 0.0;  ///< floating-point operations of the elimination
  double memory_mb = 0.0;   ///< working memory; of quasi_definite_schur() on one thread, up to twice that on four
  int negative_pivots = 0;
  int delayed_pivots = 0;
  double analysis_seconds = 0.0;
  double factor_seconds = 0.0;
};

/// The Schur complement A22 - A21 A11^-1 A12 of the last `last` unknowns, symmetric, with no right-hand side solved.
/// `order` lists all unknowns but the last ones, first to be eliminated first (see elimination_order). One thread; the
/// same input gives the same bytes. @throws Error if the matrix is singular or there isn't enough memory
Eigen::MatrixXd schur_complement(const SymmetricEntries& matrix, int last, std::span<const int> order,
                                 FactorReport* report = nullptr);

/// Solves matrix * x = right (each column), with two steps of iterative refinement; `order` lists all unknowns.
/// @throws Error as above
Eigen::MatrixXd solve_symmetric(const SymmetricEntries& matrix, std::span<const int> order,
                                const Eigen::MatrixXd& right, FactorReport* report = nullptr);

/// Both of one factorisation: the Schur complement of the last unknowns, and solutions with the block A11 of the
/// others. MUMPS allows one instance at a time: while this lives, other solutions wait (in the same thread: for ever).
class BorderedFactor {
 public:
  /// As schur_complement. `keep`: the factor, for solve(). @throws Error as there
  BorderedFactor(const SymmetricEntries& matrix, int last, std::span<const int> order, FactorReport* report = nullptr,
                 bool keep = true);
  ~BorderedFactor();
  BorderedFactor(const BorderedFactor&) = delete;
  BorderedFactor& operator=(const BorderedFactor&) = delete;

  /// A22 - A21 A11^-1 A12, symmetric.
  const Eigen::MatrixXd& complement() const { return complement_; }
  Eigen::MatrixXd take_complement() && { return std::move(complement_); }
  /// A11^-1 right, without refinement. `right` has the size of A11.
  Eigen::VectorXd solve(const Eigen::VectorXd& right);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  Eigen::MatrixXd complement_;
};

/// A symmetric matrix factorised once, to be solved with many right-hand sides one after the other. MUMPS has global
/// state: while one lives, every other factorisation of the program waits, so don't make a second in the same thread.
class SymmetricFactor {
 public:
  /// `order` as in solve_symmetric. @throws Error as above
  SymmetricFactor(const SymmetricEntries& matrix, std::span<const int> order, FactorReport* report = nullptr);
  ~SymmetricFactor();
  SymmetricFactor(const SymmetricFactor&) = delete;
  SymmetricFactor& operator=(const SymmetricFactor&) = delete;

  /// Rows of the matrix.
  int size() const;
  /// matrix^-1 * right, without iterative refinement. The same input gives the same bytes.
  Eigen::VectorXd solve(Eigen::VectorXd right) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The kernel that OpenBLAS chose for this processor ("Zen", "Cooperlake"; "Prescott" on a recent processor means that
/// it guessed wrong and runs five times slower: set OPENBLAS_CORETYPE).
std::string blas_core_name();

}  // namespace touchstone::fem
