#include "sensors/numerics/nonnegative_minimum.h"

#include <algorithm>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kMostSteps = 200;
constexpr int kBlockTries = 5;  // of changing the whole set, without fewer entries that break the laws
constexpr double kSlack = 1e-10;
constexpr Eigen::Index kFewHeld = 12;  // a twelfth of all: then solving for them is cheaper than factorising the rest

/// The minimum with x zero at `held`: x = H^-1 (b + forces there).
Eigen::VectorXd with_few_held(const Eigen::LLT<Eigen::MatrixXd>& factor, const Eigen::VectorXd& unheld,
                              const std::vector<Eigen::Index>& held) {
  if (held.empty()) return unheld;
  const auto count = static_cast<Eigen::Index>(held.size());
  Eigen::MatrixXd answer = Eigen::MatrixXd::Zero(unheld.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) answer(held[static_cast<std::size_t>(k)], k) = 1.0;
  factor.solveInPlace(answer);
  const Eigen::MatrixXd among = answer(held, Eigen::all);
  const Eigen::VectorXd there = unheld(held);
  Eigen::VectorXd x = unheld - answer * Eigen::LLT<Eigen::MatrixXd>(among).solve(there);
  for (const Eigen::Index i : held) x[i] = 0.0;
  return x;
}

/// The same by a factor of the free rows.
Eigen::VectorXd with_few_free(const Eigen::MatrixXd& H, const Eigen::VectorXd& b,
                              const std::vector<Eigen::Index>& free) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k) part[static_cast<Eigen::Index>(k)] = b[free[k]];
  const Eigen::VectorXd solved = Eigen::LLT<Eigen::MatrixXd>(Eigen::MatrixXd(H(free, free))).solve(part);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  for (std::size_t k = 0; k < free.size(); ++k) x[free[k]] = solved[static_cast<Eigen::Index>(k)];
  return x;
}

}  // namespace

NonnegativeMinimum nonnegative_minimum(const Eigen::MatrixXd& H, const Eigen::LLT<Eigen::MatrixXd>& factor,
                                       const Eigen::VectorXd& b, const std::vector<std::uint8_t>& sign) {
  const Eigen::Index n = b.size();
  TS_ASSERT(H.rows() == n && H.cols() == n && sign.size() == static_cast<std::size_t>(n));
  NonnegativeMinimum result;
  result.x = Eigen::VectorXd::Zero(n);
  if (n == 0) {
    result.converged = true;
    return result;
  }
  TS_ASSERT(factor.rows() == n);
  std::vector<std::uint8_t> held(static_cast<std::size_t>(n), 0);
  const double slack = kSlack * b.cwiseAbs().maxCoeff();
  std::size_t fewest = static_cast<std::size_t>(n) + 1;
  int tries = kBlockTries;
  const Eigen::VectorXd unheld = factor.solve(b);
  std::vector<Eigen::Index> free, held_rows, wrong;
  for (int step = 0; step < kMostSteps; ++step) {
    free.clear();
    held_rows.clear();
    for (Eigen::Index i = 0; i < n; ++i) (held[static_cast<std::size_t>(i)] ? held_rows : free).push_back(i);
    if (kFewHeld * static_cast<Eigen::Index>(held_rows.size()) <= n) {
      result.x = with_few_held(factor, unheld, held_rows);
    } else {
      result.x = with_few_free(H, b, free);
      ++result.factorisations;
    }
    const Eigen::VectorXd slope = H * result.x - b;
    wrong.clear();
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (sign[k] && (held[k] ? slope[i] < -slack : result.x[i] < 0.0)) wrong.push_back(i);
    }
    if (wrong.empty()) {
      result.converged = true;
      return result;
    }
    if (wrong.size() < fewest) {
      fewest = wrong.size();
      tries = kBlockTries;
    } else if (--tries < 0) {
      wrong = {wrong.back()};  // one at a time can't cycle (Murty's rule)
    }
    for (const Eigen::Index i : wrong) held[static_cast<std::size_t>(i)] ^= 1;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (sign[static_cast<std::size_t>(i)]) result.x[i] = std::max(result.x[i], 0.0);
  }
  return result;
}

}  // namespace touchstone::sensors
