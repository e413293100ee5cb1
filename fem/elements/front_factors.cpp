#include "fem/elements/front_factors.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/error.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
void strsv_(const char* half, const char* transposed, const char* unit, const int* size, const float* matrix,
            const int* stride, float* x, const int* step, std::size_t, std::size_t, std::size_t);
void strsm_(const char* side, const char* half, const char* transposed, const char* unit, const int* rows,
            const int* columns, const float* scale, const float* triangle, const int* triangle_stride, float* right,
            const int* stride, std::size_t, std::size_t, std::size_t, std::size_t);
void sgemv_(const char* transposed, const int* rows, const int* columns, const float* scale, const float* matrix,
            const int* stride, const float* x, const int* x_step, const float* keep, float* y, const int* y_step,
            std::size_t);
void sgemm_(const char* transposed_a, const char* transposed_b, const int* rows, const int* columns, const int* inner,
            const float* scale, const float* a, const int* a_stride, const float* b, const int* b_stride,
            const float* keep, float* c, const int* c_stride, std::size_t, std::size_t);
}

namespace touchstone::fem {
namespace {

/// Numbers of a branch from which on it is worth a task.
constexpr double kWorthATask = 1e6;
constexpr int kOne = 1;
constexpr float kPlus = 1.0f;

/// Some columns of right-hand sides, and the rows from one on.
struct RightSides {
  float* data;
  int columns;
  int stride;
};

/// x = L^-1 x, or L^-T x. One column goes by matrix and vector, which packs nothing.
void solve_triangle(bool transposed, int size, const float* matrix, int stride, const RightSides& x) {
  const char* t = transposed ? "T" : "N";
  if (x.columns == 1) {
    strsv_("L", t, "N", &size, matrix, &stride, x.data, &kOne, 1, 1, 1);
  } else {
    strsm_("L", "L", t, "N", &size, &x.columns, &kPlus, matrix, &stride, x.data, &x.stride, 1, 1, 1, 1);
  }
}

/// y = keep y + scale A x, or A^T x, A being rows x columns.
void multiply(bool transposed, int rows, int columns, float scale, const float* matrix, int stride, const RightSides& x,
              float keep, const RightSides& y) {
  const char* t = transposed ? "T" : "N";
  if (x.columns == 1) {
    sgemv_(t, &rows, &columns, &scale, matrix, &stride, x.data, &kOne, &keep, y.data, &kOne, 1);
  } else {
    const int from = transposed ? rows : columns;
    const int to = transposed ? columns : rows;
    sgemm_(t, "N", &to, &x.columns, &from, &scale, matrix, &stride, x.data, &x.stride, &keep, y.data, &y.stride, 1, 1);
  }
}

RightSides right_sides(Eigen::MatrixXf& x, int first = 0) {
  return {x.data() + first, static_cast<int>(x.cols()), static_cast<int>(x.rows())};
}

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

void FrontFactors::keep(int group, const float* values, bool indefinite) {
  Front& front = fronts_[static_cast<std::size_t>(group)];
  front.indefinite = indefinite;
  const auto rows = static_cast<std::ptrdiff_t>(front.pivots) + std::ssize(front.later);
  front.columns.resize(static_cast<std::size_t>(rows * front.pivots));
  for (std::ptrdiff_t j = 0; j < front.pivots; ++j) {
    const std::ptrdiff_t from = indefinite ? 0 : j;
    std::copy(values + j * front.stride + from, values + j * front.stride + rows,
              front.columns.begin() + j * rows + from);
  }
}

/// L y = x for a branch: y takes the place of x, but where a front's pivots are indefinite. @returns what it takes from
/// later places
Eigen::MatrixXf FrontFactors::forward(int number, Eigen::MatrixXf& x) const {
  const Front& front = fronts_[static_cast<std::size_t>(number)];
  std::vector<Eigen::MatrixXf> updates(front.children.size());
  const auto child = [&](std::size_t k) { updates[k] = forward(front.children[k], x); };
  if (front.numbers > kWorthATask && updates.size() > 1) {
    tbb::parallel_for(std::size_t{0}, updates.size(), child);
  } else {
    for (std::size_t k = 0; k < updates.size(); ++k) child(k);
  }
  const int pivots = front.pivots;
  const int later = static_cast<int>(front.later.size());
  Eigen::MatrixXf rest = Eigen::MatrixXf::Zero(later, x.cols());
  for (std::size_t k = 0; k < updates.size(); ++k) {
    for (Eigen::Index i = 0; i < updates[k].rows(); ++i) {
      const int row = front.rows_of_child[k][static_cast<std::size_t>(i)];
      if (row < pivots) {
        x.row(front.first + row) += updates[k].row(i);
      } else {
        rest.row(row - pivots) += updates[k].row(i);
      }
    }
  }
  if (pivots == 0) return rest;
  const RightSides own = right_sides(x, front.first);
  if (!front.indefinite) solve_triangle(false, pivots, front.columns.data(), pivots + later, own);
  if (later > 0) {
    multiply(false, later, pivots, -1.0f, front.columns.data() + pivots, pivots + later, own, 1.0f, right_sides(rest));
  }
  return rest;
}

/// D L^T x = y for a branch whose later places are known.
void FrontFactors::backward(int number, Eigen::MatrixXf& x) const {
  const Front& front = fronts_[static_cast<std::size_t>(number)];
  const int pivots = front.pivots;
  const int later = static_cast<int>(front.later.size());
  if (pivots > 0) {
    const RightSides own = right_sides(x, front.first);
    const float* const columns = front.columns.data();
    if (front.indefinite) {
      Eigen::MatrixXf right = x.middleRows(front.first, pivots);
      multiply(false, pivots, pivots, 1.0f, columns, pivots + later, right_sides(right), 0.0f, own);
    } else {
      x.middleRows(front.first + front.positive, pivots - front.positive) *= -1.0f;
    }
    if (later > 0) {
      Eigen::MatrixXf known(later, x.cols());
      for (int k = 0; k < later; ++k) known.row(k) = x.row(front.later[static_cast<std::size_t>(k)]);
      multiply(true, later, pivots, -1.0f, columns + pivots, pivots + later, right_sides(known), 1.0f, own);
    }
    if (!front.indefinite) solve_triangle(true, pivots, columns, pivots + later, own);
  }
  const auto child = [&](std::size_t k) { backward(front.children[k], x); };
  if (front.numbers > kWorthATask && front.children.size() > 1) {
    tbb::parallel_for(std::size_t{0}, front.children.size(), child);
  } else {
    for (std::size_t k = 0; k < front.children.size(); ++k) child(k);
  }
}

Eigen::MatrixXd FrontFactors::solve(const Eigen::MatrixXd& right) const {
  TS_ASSERT(right.rows() == std::ssize(place_));
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  // Scaled, so that single precision's exponents have them.
  Eigen::VectorXd scale = right.cwiseAbs().colwise().maxCoeff().transpose();
  for (double& one : scale) one = one > 0.0 ? one : 1.0;
  Eigen::MatrixXf x(right.rows(), right.cols());
  for (Eigen::Index i = 0; i < right.rows(); ++i) {
    x.row(place_[static_cast<std::size_t>(i)]) = right.row(i).cwiseQuotient(scale.transpose()).cast<float>();
  }
  for (const int root : roots_) forward(root, x);
  for (const int root : roots_) backward(root, x);
  Eigen::MatrixXd result(right.rows(), right.cols());
  for (Eigen::Index i = 0; i < right.rows(); ++i) {
    result.row(i) = x.row(place_[static_cast<std::size_t>(i)]).cast<double>().cwiseProduct(scale.transpose());
  }
  return result;
}

}  // namespace touchstone::fem
