#include "sensors/numerics/poisson_solver.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

constexpr int kSmallest = 2;
constexpr int kLargest = 8192;

int rounded_up(int value, int step) {
  return (value + step - 1) / step * step;
}

/// The slope between the entries i and i + 1 of a line of n; i = -1 and n - 1 are the border's.
float slope_between(const float* line, long stride, int n, int i, HeightBorder border) {
  const auto at = [&](int j) { return line[j * stride]; };
  if (i < 0 || i == n - 1) return border == HeightBorder::zero ? at(std::max(i, 0)) : 0.0F;
  if (i >= 1 && i <= n - 3) return (13.0F * (at(i) + at(i + 1)) - (at(i - 1) + at(i + 2))) * (1.0F / 24.0F);
  return 0.5F * (at(i) + at(i + 1));
}

float divergence_at(const float* line, long stride, int n, int i, HeightBorder border) {
  return slope_between(line, stride, n, i, border) - slope_between(line, stride, n, i - 1, border);
}

/// The divergence where all slopes between pixels are taken from four: of u along the row, of v across rows.
TS_WIDE_CLONES void inner_divergence(const float* row_u, const float* const* rows_v, int first, int last, float scale,
                                     float* out) {
  const float near = scale * (14.0F / 24.0F);
  const float far = scale * (1.0F / 24.0F);
  const float* const up2 = rows_v[0];
  const float* const up = rows_v[1];
  const float* const down = rows_v[2];
  const float* const down2 = rows_v[3];
#pragma GCC ivdep
  for (int u = first; u < last; ++u) {
    out[u] = near * ((row_u[u + 1] - row_u[u - 1]) + (down[u] - up[u])) -
             far * ((row_u[u + 2] - row_u[u - 2]) + (down2[u] - up2[u]));
  }
}

/// d_u z_u - z_(u-1) - z_(u+1) = -terms, for each term of the transform by itself. factors: 1/pivots.
TS_WIDE_CLONES void solve_tridiagonal(float* terms, const float* factors, int lines, int line) {
  for (int k = 0; k < line; ++k) terms[k] = -terms[k] * factors[k];
  for (int u = 1; u < lines; ++u) {
    float* const here = terms + static_cast<long>(u) * line;
    const float* const before = here - line;
    const float* const factor = factors + static_cast<long>(u) * line;
#pragma GCC ivdep
    for (int k = 0; k < line; ++k) here[k] = (before[k] - here[k]) * factor[k];
  }
  for (int u = lines - 2; u >= 0; --u) {
    float* const here = terms + static_cast<long>(u) * line;
    const float* const after = here + line;
    const float* const factor = factors + static_cast<long>(u) * line;
#pragma GCC ivdep
    for (int k = 0; k < line; ++k) here[k] += factor[k] * after[k];
  }
}

/// to[j][i] = from[i][j] for `rows` x kTransformLanes entries of `from`, in tiles that stay in registers or near them.
TS_WIDE_CLONES void lanes_to_lines(const float* from, int rows, float* to, long to_stride) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < kTransformLanes; ++j) to[j * to_stride + i] = from[static_cast<long>(i) * kTransformLanes + j];
  }
}
TS_WIDE_CLONES void lines_to_lanes(const float* from, long from_stride, int rows, float* to) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < kTransformLanes; ++j) {
      to[static_cast<long>(i) * kTransformLanes + j] = from[j * from_stride + i];
    }
  }
}

TS_WIDE_CLONES void scale_and_shift(const float* from, float scale, float shift, int count, float* to) {
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) to[i] = scale * from[i] + shift;
}

}  // namespace

PoissonSolver::PoissonSolver(int width, int height, HeightBorder border)
    : width_((width < kSmallest || width > kLargest || height < kSmallest || height > kLargest)
                 ? (fail("height map of {} x {}: each side must be {} to {}", width, height, kSmallest, kLargest), 0)
                 : width),
      height_(height),
      border_(border),
      transform_(height),
      row_(rounded_up(width, kTransformLanes)),
      line_(rounded_up(height, kTransformLanes)) {
  const auto padded = static_cast<std::size_t>(row_);
  picture_.assign(static_cast<std::size_t>(height_) * padded, 0.0F);
  terms_.assign(padded * static_cast<std::size_t>(line_), 0.0F);
  factors_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(line_), 0.0F);
  work_.assign(static_cast<std::size_t>(height_) * kTransformLanes, 0.0F);
  block_ = work_;

  const bool zero = border_ == HeightBorder::zero;
  for (int k = 0; k < height_; ++k) {
    // The sine transform by way of the cosine transform leaves its terms in reverse order.
    const double wave = kPi * (zero ? height_ - k : k) / height_;
    const double eigenvalue = 2.0 - 2.0 * std::cos(wave);
    double before = 0.0;
    for (int u = 0; u < width_; ++u) {
      const bool at_border = u == 0 || u == width_ - 1;
      const double diagonal = eigenvalue + (at_border ? (zero ? 3.0 : 1.0) : 2.0);
      // With a free border the mean is open: the last pivot of term 0 is zero, and its solution is pinned there.
      const bool open = !zero && k == 0 && u == width_ - 1;
      const double factor = open ? 0.0 : 1.0 / (diagonal - before);
      factors_[static_cast<std::size_t>(u) * static_cast<std::size_t>(line_) + static_cast<std::size_t>(k)] =
          static_cast<float>(factor);
      before = factor;
    }
  }
}

void PoissonSolver::integrate(const cv::Mat& slope_u, const cv::Mat& slope_v, double pixel, cv::Mat& heights) {
  TS_ASSERT(slope_u.type() == CV_32FC1 && slope_u.rows == height_ && slope_u.cols == width_);
  TS_ASSERT(slope_v.type() == CV_32FC1 && slope_v.rows == height_ && slope_v.cols == width_);
  const auto scale = static_cast<float>(pixel / height_);
  const long stride_v = static_cast<long>(slope_v.step1());
  for (int v = 0; v < height_; ++v) {
    const float* const row_u = slope_u.ptr<float>(v);
    float* const out = picture_.data() + static_cast<long>(v) * row_;
    const float signed_scale = border_ == HeightBorder::zero && v % 2 != 0 ? -scale : scale;
    const auto outer = [&](int u) {
      out[u] = signed_scale * (divergence_at(row_u, 1, width_, u, border_) +
                               divergence_at(slope_v.ptr<float>(0) + u, stride_v, height_, v, border_));
    };
    if (v < 2 || v > height_ - 3 || width_ < 5) {
      for (int u = 0; u < width_; ++u) outer(u);
      continue;
    }
    const float* const rows_v[] = {slope_v.ptr<float>(v - 2), slope_v.ptr<float>(v - 1), slope_v.ptr<float>(v + 1),
                                   slope_v.ptr<float>(v + 2)};
    inner_divergence(row_u, rows_v, 2, width_ - 2, signed_scale, out);
    for (const int u : {0, 1, width_ - 2, width_ - 1}) outer(u);
  }
  solve_loaded(heights);
}

void PoissonSolver::solve(const cv::Mat& divergence, cv::Mat& heights) {
  TS_ASSERT(divergence.type() == CV_32FC1 && divergence.rows == height_ && divergence.cols == width_);
  for (int v = 0; v < height_; ++v) {
    const bool flipped = border_ == HeightBorder::zero && v % 2 != 0;
    const float scale = (flipped ? -1.0F : 1.0F) / static_cast<float>(height_);
    scale_and_shift(divergence.ptr<float>(v), scale, 0.0F, width_, picture_.data() + static_cast<long>(v) * row_);
  }
  solve_loaded(heights);
}

void PoissonSolver::solve_loaded(cv::Mat& heights) {
  // The columns that only fill up a block still hold what the last call left.
  for (int v = 0; v < height_; ++v) {
    float* const row = picture_.data() + static_cast<long>(v) * row_;
    std::fill(row + width_, row + row_, 0.0F);
  }
  for (int u = 0; u < row_; u += kTransformLanes) {
    transform_.forward(picture_.data() + u, row_, work_.data(), block_.data());
    lanes_to_lines(block_.data(), height_, terms_.data() + static_cast<long>(u) * line_, line_);
  }
  solve_tridiagonal(terms_.data(), factors_.data(), width_, line_);
  if (border_ == HeightBorder::free) {  // term 0 of each line is height_ times its mean
    double sum = 0.0;
    for (int u = 0; u < width_; ++u) sum += terms_[static_cast<std::size_t>(u) * static_cast<std::size_t>(line_)];
    const auto mean = static_cast<float>(sum / width_);
    for (int u = 0; u < width_; ++u) terms_[static_cast<std::size_t>(u) * static_cast<std::size_t>(line_)] -= mean;
  }
  for (int u = 0; u < row_; u += kTransformLanes) {
    lines_to_lanes(terms_.data() + static_cast<long>(u) * line_, line_, height_, block_.data());
    transform_.inverse_times_length(block_.data(), work_.data(), picture_.data() + u, row_);
  }
  heights.create(height_, width_, CV_32FC1);
  for (int v = 0; v < height_; ++v) {
    const float sign = border_ == HeightBorder::zero && v % 2 != 0 ? -1.0F : 1.0F;
    scale_and_shift(picture_.data() + static_cast<long>(v) * row_, sign, 0.0F, width_, heights.ptr<float>(v));
  }
}

}  // namespace touchstone::sensors
