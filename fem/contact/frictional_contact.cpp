#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/contact/contact_solver.h"
#include "fem/elements/sparse_product.h"

namespace touchstone::fem {
namespace {

constexpr int kMostNewton = 80;
constexpr int kPatience = 3;  // Newton steps without progress before sweeps
constexpr int kSweeps = 30;
constexpr int kFirstSweeps = 10;
constexpr double kFarFromSets = 1e-2;  // residual above which sweeps go first

/// The frictional problem at one iterate, and the pieces of Newton's step.
class FrictionalNewton {
 public:
  FrictionalNewton(const ContactProblem& problem, const Eigen::VectorXd& start, const Eigen::VectorXd& shift,
                   ContactMemory& memory)
      : problem_(problem),
        memory_(memory),
        a_(*problem.compliance),
        m_(static_cast<int>(problem.gap.size())),
        k_(static_cast<int>(problem.border.cols())) {
    answer.z = start.size() == 3 * m_ ? start : Eigen::VectorXd::Zero(3 * m_);
    answer.shift = shift.size() == k_ ? shift : Eigen::VectorXd::Zero(k_);
    answer.state.assign(m_, NodeState::open);
    for (int i = 0; i < m_; ++i) {
      if (!(answer.z[3 * i] > 0.0) || !std::isfinite(problem.gap[i])) answer.z.segment<3>(3 * i).setZero();
    }
    refresh();
  }

  ContactAnswer answer;

  /// Response, states and residual at the current z and shift.
  void refresh() {
    answer.response = times_sparse(a_, answer.z);
    slack_ = answer.response + problem_.border * answer.shift;
    double largest = 0.0;
    for (int i = 0; i < m_; ++i) largest = std::max(largest, answer.z[3 * i]);
    double worst = 0.0;
    for (int i = 0; i < m_; ++i) {
      if (!std::isfinite(problem_.gap[i])) {
        answer.state[i] = NodeState::open;
        continue;
      }
      const double p = answer.z[3 * i];
      const double wanted = std::max(0.0, p - gap_at(i) / a_(3 * i, 3 * i));
      worst = std::max(worst, std::abs(p - wanted));
      if (wanted <= 0.0) {
        answer.state[i] = NodeState::open;
        worst = std::max(worst, answer.z.segment<2>(3 * i + 1).norm());
        continue;
      }
      const Eigen::Vector2d v = predicted(i);
      const double limit = problem_.friction[i] * std::max(0.0, p);
      const Eigen::Vector2d t = answer.z.segment<2>(3 * i + 1);
      if (std::isinf(problem_.friction[i]) || v.norm() <= limit) {
        answer.state[i] = NodeState::stick;
        worst = std::max(worst, (t - v).norm());
      } else {
        answer.state[i] = NodeState::slip;
        worst = std::max(worst, (t - limit * v.normalized()).norm());
      }
    }
    for (int b = 0; b < k_; ++b) {
      const double missing = problem_.border.col(b).dot(answer.z) - held(b) - problem_.force[b];
      worst = std::max(worst, std::abs(missing) / problem_.border.col(b).cwiseAbs().maxCoeff());
    }
    answer.residual = largest > 0.0 ? worst / largest : (worst > 0.0 ? 1.0 : 0.0);
    if (!std::isfinite(answer.residual)) answer.residual = std::numeric_limits<double>::infinity();
  }

  /// One Newton step; with `keep` the last factorised Jacobian serves again if the sets are those it was made for.
  bool step(bool keep) {
    for (int i = 0; i < m_; ++i) {
      if (answer.state[i] == NodeState::open) answer.z.segment<3>(3 * i).setZero();
    }
    answer.response = times_sparse(a_, answer.z);
    slack_ = answer.response + problem_.border * answer.shift;
    if (std::all_of(answer.state.begin(), answer.state.end(), [](NodeState x) { return x == NodeState::open; })) {
      if (k_ > 0) return false;  // nobody carries the force
      refresh();
      return true;
    }
    set_.clear();
    for (int i = 0; i < m_; ++i) {
      if (answer.state[i] == NodeState::open) continue;
      set_.push_back(i);
      // Where the others' tractions, which are gone now, were all that moved it, it has no direction to slide in.
      if (answer.state[i] == NodeState::slip && predicted(i).isZero(0.0)) answer.state[i] = NodeState::stick;
    }
    const bool remembered = answer.state == memory_.state;
    if (!(keep && remembered) && !factorise()) return false;
    const auto size = static_cast<Eigen::Index>(3 * set_.size());
    Eigen::VectorXd right(size + k_);
    for (std::size_t row = 0; row < set_.size(); ++row) {
      const int i = set_[row];
      const auto at = static_cast<Eigen::Index>(3 * row);
      right[at] = -gap_at(i);
      if (answer.state[i] == NodeState::stick) {
        right.segment<2>(at + 1) = -slip_at(i);
      } else {
        const Eigen::Vector2d v = predicted(i);
        const Eigen::Vector2d t = answer.z.segment<2>(3 * i + 1);
        const double limit = problem_.friction[i] * std::max(0.0, answer.z[3 * i]);
        right.segment<2>(at + 1) = -tangential_scale(i) * (t - limit * v.normalized());
      }
    }
    for (Eigen::Index b = 0; b < k_; ++b) {
      right[size + b] = problem_.force[b] + held(b) - problem_.border.col(b).dot(answer.z);
    }
    return take(right);
  }

  /// One step with the remembered sets and Jacobian, whatever the current iterate looks like: what stuck goes on
  /// sticking, what slid goes on sliding in the same direction. False if nothing fitting is remembered.
  bool predict() {
    if (static_cast<int>(memory_.state.size()) != m_) return false;
    for (int i = 0; i < m_; ++i) {
      if (memory_.state[i] != NodeState::open && !std::isfinite(problem_.gap[i])) return false;
    }
    set_.clear();
    for (int i = 0; i < m_; ++i) {
      if (memory_.state[i] != NodeState::open) {
        set_.push_back(i);
      } else {
        answer.z.segment<3>(3 * i).setZero();
      }
    }
    const auto size = static_cast<Eigen::Index>(3 * set_.size());
    if (set_.empty()) return false;
    answer.response = times_sparse(a_, answer.z);
    slack_ = answer.response + problem_.border * answer.shift;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size + k_);
    for (std::size_t row = 0; row < set_.size(); ++row) {
      const int i = set_[row];
      const auto at = static_cast<Eigen::Index>(3 * row);
      right[at] = -gap_at(i);
      if (memory_.state[i] == NodeState::stick) right.segment<2>(at + 1) = -slip_at(i);
    }
    for (Eigen::Index b = 0; b < k_; ++b) {
      right[size + b] = problem_.force[b] + held(b) - problem_.border.col(b).dot(answer.z);
    }
    return take(right);
  }

  /// Block Gauss-Seidel at fixed shift: each vertex in turn gets the traction that its own law asks for.
  void sweep(int sweeps) {
    for (int i = 0; i < m_; ++i) {
      if (!std::isfinite(problem_.gap[i])) answer.z.segment<3>(3 * i).setZero();
    }
    answer.response = times_sparse(a_, answer.z);
    const Eigen::VectorXd rigid = problem_.border * answer.shift;
    for (int count = 0; count < sweeps; ++count) {
      for (int i = 0; i < m_; ++i) {
        if (!std::isfinite(problem_.gap[i])) continue;
        const Eigen::Vector3d before = answer.z.segment<3>(3 * i);
        Eigen::Vector3d now = before;
        const double normal = a_(3 * i, 3 * i);
        now[0] = std::max(0.0, before[0] - (problem_.gap[i] + answer.response[3 * i] + rigid[3 * i]) / normal);
        const double scale = tangential_scale(i);
        const Eigen::Vector2d d = answer.response.segment<2>(3 * i + 1) + rigid.segment<2>(3 * i + 1) -
                                  problem_.drag.segment<2>(2 * i) +
                                  (now[0] - before[0]) * a_.block<2, 1>(3 * i + 1, 3 * i);
        Eigen::Vector2d t = before.tail<2>() - d / scale;
        const double limit = problem_.friction[i] * now[0];
        if (now[0] == 0.0) {
          t.setZero();
        } else if (t.norm() > limit) {
          t *= limit / t.norm();
        }
        now.tail<2>() = t;
        const Eigen::Vector3d change = now - before;
        if (change.isZero(0.0)) continue;
        answer.z.segment<3>(3 * i) = now;
        answer.response.noalias() += a_.middleCols<3>(3 * i) * change;
      }
      ++answer.sweeps;
    }
    refresh();
  }

 private:
  /// Unknowns of the reduced system: three for a sticking vertex, two for a slipping one (pressure, and the traction
  /// across the slip: the one along it follows the pressure), the shifts.
  Eigen::Index reduced_size() const {
    Eigen::Index size = k_;
    for (const int i : set_) size += memory_.state[i] == NodeState::slip ? 2 : 3;
    return size;
  }
  static Eigen::Vector2d across(const Eigen::Vector2d& along) { return {-along.y(), along.x()}; }

  /// Solves for the step with the right-hand side over the vertices of `set_` (three each) and the shifts, by the
  /// remembered factors, and adds it. False if it isn't finite.
  bool take(const Eigen::VectorXd& right) {
    const auto size = static_cast<Eigen::Index>(3 * set_.size());
    // What the slipping vertices' own equations ask for along the slip is known beforehand.
    Eigen::VectorXd known = Eigen::VectorXd::Zero(answer.z.size());
    bool any = false;
    for (std::size_t row = 0; row < set_.size(); ++row) {
      const int i = set_[row];
      if (memory_.state[i] != NodeState::slip) continue;
      const Eigen::Vector2d& along = memory_.slip[i].along;
      const double asked = along.dot(right.segment<2>(static_cast<Eigen::Index>(3 * row) + 1)) / tangential_scale(i);
      known.segment<2>(3 * i + 1) = asked * along;
      any = any || asked != 0.0;
    }
    const Eigen::VectorXd response = any ? times_sparse(a_, known) : Eigen::VectorXd::Zero(answer.z.size());
    Eigen::VectorXd reduced(reduced_size());
    Eigen::Index at = 0;
    for (std::size_t row = 0; row < set_.size(); ++row) {
      const int i = set_[row];
      const auto from = static_cast<Eigen::Index>(3 * row);
      reduced[at++] = right[from] - response[3 * i];
      if (memory_.state[i] == NodeState::slip) {
        const Eigen::Vector2d side = across(memory_.slip[i].along);
        reduced[at++] =
            side.dot(right.segment<2>(from + 1)) - memory_.slip[i].turn * side.dot(response.segment<2>(3 * i + 1));
      } else {
        reduced.segment<2>(at) = right.segment<2>(from + 1) - response.segment<2>(3 * i + 1);
        at += 2;
      }
    }
    for (Eigen::Index b = 0; b < k_; ++b) reduced[at + b] = right[size + b] - problem_.border.col(b).dot(known);
    if (memory_.lu.size() != reduced.size()) return false;
    const Eigen::VectorXd change = memory_.lu.solve(reduced);
    ++answer.iterations;
    if (!change.allFinite()) return false;
    at = 0;
    for (const int i : set_) {
      const double p = change[at++];
      answer.z[3 * i] += p;
      if (memory_.state[i] == NodeState::slip) {
        const SlipFrame& slip = memory_.slip[i];
        answer.z.segment<2>(3 * i + 1) +=
            problem_.friction[i] * p * slip.along + change[at++] * across(slip.along) + known.segment<2>(3 * i + 1);
      } else {
        answer.z.segment<2>(3 * i + 1) += change.segment<2>(at);
        at += 2;
      }
    }
    if (k_ > 0) answer.shift += change.tail(k_);
    refresh();
    return true;
  }

  double held(Eigen::Index b) const { return problem_.hold.size() == k_ ? problem_.hold[b] * answer.shift[b] : 0.0; }
  double gap_at(int i) const { return problem_.gap[i] + slack_[3 * i]; }
  Eigen::Vector2d slip_at(int i) const { return slack_.segment<2>(3 * i + 1) - problem_.drag.segment<2>(2 * i); }
  double tangential_scale(int i) const { return std::max(a_(3 * i + 1, 3 * i + 1), a_(3 * i + 2, 3 * i + 2)); }
  Eigen::Vector2d predicted(int i) const { return answer.z.segment<2>(3 * i + 1) - slip_at(i) / tangential_scale(i); }

  bool factorise() {
    memory_.state = answer.state;
    memory_.slip.assign(m_, {});
    for (const int i : set_) {
      if (answer.state[i] != NodeState::slip) continue;
      const Eigen::Vector2d v = predicted(i);
      const double length = v.norm();
      // At most 1 at the answer; far from it the clamp keeps the step from pointing away [Hueber2008].
      memory_.slip[i] = {v / length, std::min(1.0, problem_.friction[i] * std::max(0.0, answer.z[3 * i]) / length)};
    }
    const Eigen::Index size = reduced_size();
    Eigen::MatrixXd& jacobian = memory_.jacobian;
    jacobian.resize(size, size);
    Eigen::VectorXd response(a_.rows());
    Eigen::Index column = 0;
    // Derivative of t - mu p v/|v| with v = t - d/scale, times scale, across the slip; the rows along it are
    // eliminated.
    const auto add_column = [&](int j, const Eigen::Vector3d& change) {
      response = a_.middleCols<3>(3 * j) * change;
      Eigen::Index row = 0;
      for (const int i : set_) {
        jacobian(row++, column) = response[3 * i];
        if (memory_.state[i] == NodeState::slip) {
          const SlipFrame& slip = memory_.slip[i];
          const Eigen::Vector2d side = across(slip.along);
          jacobian(row, column) = slip.turn * side.dot(response.segment<2>(3 * i + 1));
          if (i == j) jacobian(row, column) += (1.0 - slip.turn) * tangential_scale(i) * side.dot(change.tail<2>());
          ++row;
        } else {
          jacobian.block<2, 1>(row, column) = response.segment<2>(3 * i + 1);
          row += 2;
        }
      }
      for (Eigen::Index b = 0; b < k_; ++b) {
        jacobian(row + b, column) = problem_.border.block<3, 1>(3 * j, b).dot(change);
      }
      ++column;
    };
    for (const int j : set_) {
      if (memory_.state[j] == NodeState::slip) {
        const Eigen::Vector2d& along = memory_.slip[j].along;
        const double friction = problem_.friction[j];
        add_column(j, {1.0, friction * along.x(), friction * along.y()});
        add_column(j, {0.0, across(along).x(), across(along).y()});
      } else {
        for (int a = 0; a < 3; ++a) add_column(j, Eigen::Vector3d::Unit(a));
      }
    }
    for (Eigen::Index b = 0; b < k_; ++b, ++column) {
      Eigen::Index row = 0;
      for (const int i : set_) {
        const Eigen::Vector3d border = problem_.border.block<3, 1>(3 * i, b);
        jacobian(row++, column) = border[0];
        if (memory_.state[i] == NodeState::slip) {
          jacobian(row++, column) = memory_.slip[i].turn * across(memory_.slip[i].along).dot(border.tail<2>());
        } else {
          jacobian.block<2, 1>(row, column) = border.tail<2>();
          row += 2;
        }
      }
      jacobian.block(row, column, k_, 1).setZero();
      if (problem_.hold.size() == k_) jacobian(row + b, column) = -problem_.hold[b];
    }
    ++answer.factorisations;
    if (!memory_.lu.compute(jacobian)) {
      memory_.forget();
      return false;
    }
    return true;
  }

  const ContactProblem& problem_;
  ContactMemory& memory_;
  const Eigen::Ref<const Eigen::MatrixXd>& a_;
  const int m_;
  const int k_;
  Eigen::VectorXd slack_;
  std::vector<int> set_;
};

/// The answer without friction, as (p, 0, 0) per vertex: where Newton starts from nothing.
ContactAnswer frictionless_start(const ContactProblem& problem) {
  const auto m = static_cast<int>(problem.gap.size());
  const auto k = static_cast<int>(problem.border.cols());
  const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
  std::vector<int> columns;
  for (int b = 0; b < k; ++b) {
    const double normal = problem.border.col(b)(normals).cwiseAbs().maxCoeff();
    if (normal > 1e-9 * problem.border.col(b).cwiseAbs().maxCoeff()) columns.push_back(b);
  }
  const Eigen::MatrixXd compliance = (*problem.compliance)(normals, normals);
  const auto pushing = static_cast<Eigen::Index>(columns.size());
  ContactProblem part;
  part.compliance.emplace(compliance);
  part.gap = problem.gap;
  part.border.resize(m, pushing);
  part.force.resize(pushing);
  if (problem.hold.size() == k) part.hold.resize(pushing);
  for (Eigen::Index b = 0; b < pushing; ++b) {
    part.border.col(b) = problem.border.col(columns[b])(normals);
    part.force[b] = problem.force[columns[b]];
    if (problem.hold.size() == k) part.hold[b] = problem.hold[columns[b]];
  }
  ContactMemory none;
  const ContactAnswer found = solve_frictionless(part, {}, none);
  ContactAnswer start;
  start.z = Eigen::VectorXd::Zero(3 * m);
  start.shift = Eigen::VectorXd::Zero(k);
  if (found.converged) {
    start.z(normals) = found.z;
    for (Eigen::Index b = 0; b < pushing; ++b) start.shift[columns[b]] = found.shift[b];
  }
  return start;
}

ContactAnswer newton_with_sweeps(const ContactProblem& problem, const Eigen::VectorXd& start,
                                 const Eigen::VectorXd& shift, double tolerance, ContactMemory& memory) {
  FrictionalNewton newton(problem, start, shift, memory);
  double best = std::numeric_limits<double>::infinity();
  Eigen::VectorXd best_z;
  Eigen::VectorXd best_shift;
  int since_best = 0;
  bool keep = true;
  const bool predicted = newton.predict();
  if (!predicted && problem.border.cols() == 0 && newton.answer.residual > kFarFromSets) newton.sweep(kFirstSweeps);
  for (int iteration = 0; iteration < kMostNewton; ++iteration) {
    double before = newton.answer.residual;
    if (before < best) {
      best = before;
      best_z = newton.answer.z;
      best_shift = newton.answer.shift;
      since_best = 0;
    } else if (++since_best > kPatience) {
      newton.answer.z = best_z;
      newton.answer.shift = best_shift;
      newton.refresh();
      newton.sweep(kSweeps);
      best = before = newton.answer.residual;
      best_z = newton.answer.z;
      since_best = 0;
      keep = false;
    }
    if (before <= tolerance) {
      newton.answer.converged = true;
      break;
    }
    if (!newton.step(keep)) break;
    keep = newton.answer.residual < 0.2 * before;
  }
  return newton.answer;
}

}  // namespace

ContactAnswer solve_frictional(const ContactProblem& problem, const Eigen::VectorXd& start, double tolerance,
                               ContactMemory& memory) {
  TS_ASSERT(problem.components == 3);
  ContactAnswer begin;
  begin.z = start;
  if (start.size() == 0) begin = frictionless_start(problem);
  ContactAnswer answer = newton_with_sweeps(problem, begin.z, begin.shift, tolerance, memory);
  if (answer.converged || start.size() == 0) return answer;
  // Tractions from far off, as of an object that could be led on by a part only, may leave nobody to carry the force.
  begin = frictionless_start(problem);
  memory.forget();
  ContactAnswer again = newton_with_sweeps(problem, begin.z, begin.shift, tolerance, memory);
  again.iterations += answer.iterations;
  again.factorisations += answer.factorisations;
  again.sweeps += answer.sweeps;
  return again;
}

}  // namespace touchstone::fem
