#pragma once
// Eigen's decompositions of a MatrixXd, compiled once. From Eigen's own headers each file compiles them anew, for one
// to three seconds each. Include this in their place. At the use nothing changes, but an expression given to a
// constructor is made a MatrixXd first, and the right side is a VectorXd or a MatrixXd: other types work, compiled
// where they stand.

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

// NOLINTBEGIN(bugprone-macro-parentheses): a keyword can't stand in any
/// What dense_solvers.cpp defines (`how` empty) and everybody else takes from there (`how` is extern).
#define TS_DENSE_SOLVERS(how)                                                                                          \
  how template Eigen::LLT<Eigen::MatrixXd>& Eigen::LLT<Eigen::MatrixXd>::compute(                                      \
      const Eigen::EigenBase<Eigen::MatrixXd>&);                                                                       \
  how template void Eigen::LLT<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;          \
  how template void Eigen::LLT<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;          \
  how template Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute(                                    \
      const Eigen::EigenBase<Eigen::MatrixXd>&);                                                                       \
  how template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;         \
  how template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;         \
  how template void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::computeInPlace();                                     \
  how template void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) \
      const;                                                                                                           \
  how template void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) \
      const;                                                                                                           \
  how template Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>&                                                         \
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>::compute(const Eigen::EigenBase<Eigen::MatrixXd>&, int)
// NOLINTEND(bugprone-macro-parentheses)

/// @cond
TS_DENSE_SOLVERS(extern);
/// @endcond
