#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/contact/contact_solver.h"
#include "fem/elements/sparse_product.h"

namespace touchstone::fem {
namespace {

constexpr int kMostPivots = 500;
constexpr int kBlockTries = 10;

/// Sees to it that each wanted force has a vertex that can carry it: the nearest one. False if there is none.
bool somebody_carries(const ContactProblem& problem, std::vector<char>& active) {
  const auto m = static_cast<int>(problem.gap.size());
  for (Eigen::Index b = 0; b < problem.border.cols(); ++b) {
    int nearest = -1;
    bool carried = problem.hold.size() > b && problem.hold[b] > 0.0;
    for (int i = 0; i < m && !carried; ++i) {
      const double weight = problem.border(i, b);
      if (weight == 0.0 || !std::isfinite(problem.gap[i])) continue;
      carried = active[i] != 0;
      if (nearest < 0 || problem.gap[i] * problem.border(nearest, b) < problem.gap[nearest] * weight) nearest = i;
    }
    if (carried) continue;
    if (nearest < 0) return false;
    active[nearest] = 1;
  }
  return true;
}

}  // namespace

ContactAnswer solve_frictionless(const ContactProblem& problem, const Eigen::VectorXd& start, ContactMemory& memory) {
  TS_ASSERT(problem.components == 1);
  const Eigen::Ref<const Eigen::MatrixXd>& a = *problem.compliance;
  const auto m = static_cast<int>(problem.gap.size());
  const auto k = static_cast<int>(problem.border.cols());
  ContactAnswer answer;
  answer.shift = Eigen::VectorXd::Zero(k);
  std::vector<char> active(m, 0);
  for (int i = 0; i < m; ++i) {
    const bool able = std::isfinite(problem.gap[i]);
    active[i] = able && (start.size() == m ? start[i] > 0.0 : problem.gap[i] < 0.0);
  }
  if (!somebody_carries(problem, active)) return answer;
  int fewest = std::numeric_limits<int>::max();
  int tries = kBlockTries;
  std::vector<int> set;
  for (int pivot = 0; pivot < kMostPivots; ++pivot) {
    set.clear();
    for (int i = 0; i < m; ++i) {
      if (active[i]) set.push_back(i);
    }
    const auto size = static_cast<Eigen::Index>(set.size());
    answer.z = Eigen::VectorXd::Zero(m);
    if (size > 0) {
      std::vector<NodeState> wanted(m, NodeState::open);
      for (const int i : set) wanted[i] = NodeState::slip;
      if (memory.state != wanted) {
        if (!memory.cholesky.compute(a(set, set))) {
          memory.forget();
          answer.residual = std::numeric_limits<double>::infinity();
          return answer;
        }
        memory.state = std::move(wanted);
        ++answer.factorisations;
      }
      Eigen::VectorXd p = memory.cholesky.solve(-problem.gap(set));
      if (k > 0) {
        const Eigen::MatrixXd border = problem.border(set, Eigen::all);
        const Eigen::MatrixXd through = memory.cholesky.solve(border);
        Eigen::MatrixXd schur = border.transpose() * through;
        if (problem.hold.size() == k) schur.diagonal() += problem.hold;
        answer.shift = schur.partialPivLu().solve(border.transpose() * p - problem.force);
        p -= through * answer.shift;
      }
      answer.z(set) = p;
    }
    ++answer.iterations;
    answer.response = times_sparse(a, answer.z);
    if (!answer.z.allFinite()) {
      answer.residual = std::numeric_limits<double>::infinity();
      return answer;
    }
    const Eigen::VectorXd g = problem.gap + answer.response + problem.border * answer.shift;
    const double largest = answer.z.size() > 0 ? answer.z.cwiseAbs().maxCoeff() : 0.0;
    int violated = 0;
    int last = -1;
    double worst = 0.0;
    std::vector<char> flip(m, 0);
    for (int i = 0; i < m; ++i) {
      if (!std::isfinite(problem.gap[i])) continue;
      const double noise = 1e-13 * largest;
      const bool wrong = active[i] ? answer.z[i] < -noise : g[i] / a(i, i) < -noise - 1e-300;
      if (!wrong) continue;
      worst = std::max(worst, active[i] ? -answer.z[i] : -g[i] / a(i, i));
      flip[i] = 1;
      ++violated;
      last = i;
    }
    answer.residual = largest > 0.0 ? worst / largest : worst;
    if (violated == 0) {
      // The exact answer of the last set; tensions within rounding are zero.
      answer.state.assign(m, NodeState::open);
      for (const int i : set) {
        answer.z[i] = std::max(0.0, answer.z[i]);
        answer.state[i] = NodeState::slip;
      }
      answer.converged = true;
      return answer;
    }
    if (violated < fewest) {
      fewest = violated;
      tries = kBlockTries;
    } else if (tries > 0) {
      --tries;
    } else {
      std::fill(flip.begin(), flip.end(), 0);
      flip[last] = 1;
    }
    for (int i = 0; i < m; ++i) {
      if (flip[i]) active[i] = !active[i];
    }
    if (!somebody_carries(problem, active)) return answer;
  }
  return answer;
}

}  // namespace touchstone::fem
