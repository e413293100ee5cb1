#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "fem/elements/elimination_order.h"
#include "fem/elements/hierarchical_matrix.h"
#include "fem/elements/schur_solver.h"

namespace touchstone::fem {

class FrontFactors;

/// The same Schur complement as schur_complement() for a symmetric quasi-definite matrix: unknowns with a positive
/// diagonal make a positive definite block, those with a negative one a negative definite block. A multifrontal
/// elimination along the tree [Duff1983] without pivoting across fronts, whose factor isn't kept; branches of the tree
/// and tiles of the large fronts are shared among oneTBB's threads. The same input gives the same bytes on any number
/// of threads. Nothing if a pivot comes out with the wrong sign: rounding has eaten it, and an elimination with
/// pivoting is needed.
std::optional<Eigen::MatrixXd> quasi_definite_schur(const SymmetricEntries& matrix, int last,
                                                    const EliminationTree& tree, FactorReport* report = nullptr);

/// The same elimination of any symmetric matrix with the factor kept: a group whose pivots have a wrong sign is
/// eliminated with pivoting among them. The factor is in single precision: what is solved with it is good to some 1e-5,
/// enough for the steps of an iteration whose residual is exact.
class FrontalFactor {
 public:
  /// As quasi_definite_schur(); nothing if the pivots of a group are singular.
  static std::optional<FrontalFactor> make(const SymmetricEntries& matrix, int last, const EliminationTree& tree,
                                           FactorReport* report = nullptr);
  FrontalFactor(FrontalFactor&&) noexcept;
  FrontalFactor& operator=(FrontalFactor&&) noexcept;
  ~FrontalFactor();

  /// Of the last unknowns, symmetric.
  const Eigen::MatrixXd& complement() const { return complement_; }
  /// Solutions of the other unknowns' block, one a column. The same input gives the same bytes on any number of
  /// threads.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  FrontalFactor();
  std::unique_ptr<const FrontFactors> fronts_;
  Eigen::MatrixXd complement_;
};

/// A Schur complement of which most rows and columns are compressed.
struct CompressedSchur {
  HierarchicalMatrix compressed;  ///< all but the last `whole` unknowns
  Eigen::MatrixXd whole;          ///< rows of the last `whole`: whole x last
};

/// The same Schur complement, never made whole: as fronts go up the tree, the border's rows in them are replaced by few
/// combinations of them ([Xia2009], without compressing the pivots), and the border's own complement is kept where it
/// arises. What is left out is some 1e-7 of it: measure it by random rows among the last `whole`, whose complement
/// among themselves is exact. No two unknowns of the border may meet in `matrix`.
std::optional<CompressedSchur> compressed_schur(const SymmetricEntries& matrix, int last, int whole,
                                                const EliminationTree& tree, FactorReport* report = nullptr);

}  // namespace touchstone::fem
