#include "fem/elements/front_factors.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
void strsv_(const char* half, const char* transposed, const char* unit, const int* size, const float* matrix,
            const int* stride, float* x, const int* step, std::size_t, std::size_t, std::size_t);
void sgemv_(const char* transposed, const int* rows, const int* columns, const float* scale, const float* matrix,
            const int* stride, const float* x, const int* x_step, const float* keep, float* y, const int* y_step,
            std::size_t);
}

namespace touchstone::fem {
namespace {

/// Numbers of a branch from which on it is worth a task.
constexpr double kWorthATask = 1e6;
constexpr int kOne = 1;
constexpr float kNone = 0.0f;
constexpr float kPlus = 1.0f;
constexpr float kMinus = -1.0f;

}  // namespace

void FrontFactors::set_up(const EliminationGroups& plan, int free) {
  place_.assign(plan.place().begin(), plan.place().begin() + free);
  roots_ = plan.roots();
  fronts_.clear();
  for (const EliminationGroup& group : plan.groups()) {  // children come before parents
    Front front;
    front.first = group.first;
    front.positive = group.positive;
    front.pivots = group.positive + group.negative;
    front.stride = std::ssize(group.rows);
    const auto begin = group.rows.begin() + front.pivots;
    front.later.assign(begin, std::lower_bound(begin, group.rows.end(), free));
    front.children = group.children;
    front.numbers = static_cast<double>(front.pivots) * static_cast<double>(front.pivots + front.later.size());
    for (const int child : front.children) {
      const Front& below = fronts_[static_cast<std::size_t>(child)];
      std::vector<int> rows;
      for (const int place : below.later) {
        if (place < front.first + front.pivots) {
          rows.push_back(place - front.first);
        } else {
          const auto at = std::lower_bound(front.later.begin(), front.later.end(), place);
          rows.push_back(front.pivots + static_cast<int>(at - front.later.begin()));
        }
      }
      front.rows_of_child.push_back(std::move(rows));
      front.numbers += below.numbers;
    }
    fronts_.push_back(std::move(front));
  }
}

void FrontFactors::keep(int group, const double* values, bool indefinite) {
  Front& front = fronts_[static_cast<std::size_t>(group)];
  front.indefinite = indefinite;
  const auto rows = static_cast<std::ptrdiff_t>(front.pivots) + std::ssize(front.later);
  front.columns.resize(static_cast<std::size_t>(rows * front.pivots));
  for (std::ptrdiff_t j = 0; j < front.pivots; ++j) {
    const std::ptrdiff_t from = indefinite ? 0 : j;
    std::transform(values + j * front.stride + from, values + j * front.stride + rows,
                   front.columns.begin() + j * rows + from, [](double value) { return static_cast<float>(value); });
  }
}

/// L y = x for a branch: y takes the place of x, but where a front's pivots are indefinite. @returns what it takes from later places
std::vector<float> FrontFactors::forward(int number, std::vector<float>& x) const {
  const Front& front = fronts_[static_cast<std::size_t>(number)];
  std::vector<std::vector<float>> updates(front.children.size());
  const auto child = [&](std::size_t k) { updates[k] = forward(front.children[k], x); };
  if (front.numbers > kWorthATask && updates.size() > 1) {
    tbb::parallel_for(std::size_t{0}, updates.size(), child);
  } else {
    for (std::size_t k = 0; k < updates.size(); ++k) child(k);
  }
  const int pivots = front.pivots;
  const int later = static_cast<int>(front.later.size());
  const int rows = pivots + later;
  float* const own = x.data() + front.first;
  std::vector<float> rest(front.later.size(), 0.0f);
  for (std::size_t k = 0; k < updates.size(); ++k) {
    for (std::size_t i = 0; i < updates[k].size(); ++i) {
      const int row = front.rows_of_child[k][i];
      (row < pivots ? own[row] : rest[static_cast<std::size_t>(row - pivots)]) += updates[k][i];
    }
  }
  if (pivots == 0) return rest;
  if (!front.indefinite) strsv_("L", "N", "N", &pivots, front.columns.data(), &rows, own, &kOne, 1, 1, 1);
  if (later > 0) {
    sgemv_("N", &later, &pivots, &kMinus, front.columns.data() + pivots, &rows, own, &kOne, &kPlus, rest.data(), &kOne,
           1);
  }
  return rest;
}

/// D L^T x = y for a branch whose later places are known.
void FrontFactors::backward(int number, std::vector<float>& x) const {
  const Front& front = fronts_[static_cast<std::size_t>(number)];
  const int pivots = front.pivots;
  const int later = static_cast<int>(front.later.size());
  const int rows = pivots + later;
  if (pivots > 0) {
    float* const own = x.data() + front.first;
    if (front.indefinite) {
      const std::vector<float> right(own, own + pivots);
      sgemv_("N", &pivots, &pivots, &kPlus, front.columns.data(), &rows, right.data(), &kOne, &kNone, own, &kOne, 1);
    } else {
      for (int k = front.positive; k < pivots; ++k) own[k] = -own[k];
    }
    if (later > 0) {
      std::vector<float> known(front.later.size());
      for (std::size_t k = 0; k < known.size(); ++k) known[k] = x[static_cast<std::size_t>(front.later[k])];
      sgemv_("T", &later, &pivots, &kMinus, front.columns.data() + pivots, &rows, known.data(), &kOne, &kPlus, own,
             &kOne, 1);
    }
    if (!front.indefinite) strsv_("L", "T", "N", &pivots, front.columns.data(), &rows, own, &kOne, 1, 1, 1);
  }
  const auto child = [&](std::size_t k) { backward(front.children[k], x); };
  if (front.numbers > kWorthATask && front.children.size() > 1) {
    tbb::parallel_for(std::size_t{0}, front.children.size(), child);
  } else {
    for (std::size_t k = 0; k < front.children.size(); ++k) child(k);
  }
}

Eigen::VectorXd FrontFactors::solve(const Eigen::VectorXd& right) const {
  TS_ASSERT(right.size() == std::ssize(place_));
  // Forces span orders of magnitude that single precision's exponents have; scaled, they stay among them.
  const double scale = right.cwiseAbs().maxCoeff();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  if (scale == 0.0) return Eigen::VectorXd::Zero(right.size());
  std::vector<float> x(place_.size());
  for (std::size_t i = 0; i < place_.size(); ++i) {
    x[static_cast<std::size_t>(place_[i])] = static_cast<float>(right[static_cast<Eigen::Index>(i)] / scale);
  }
  for (const int root : roots_) forward(root, x);
  for (const int root : roots_) backward(root, x);
  Eigen::VectorXd result(right.size());
  for (std::size_t i = 0; i < place_.size(); ++i) {
    result[static_cast<Eigen::Index>(i)] = scale * static_cast<double>(x[static_cast<std::size_t>(place_[i])]);
  }
  return result;
}

}  // namespace touchstone::fem
