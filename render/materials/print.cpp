#include "render/materials/print.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace touchstone::render {

PrintIndex::PrintIndex(const std::vector<PrintedMark>& marks) : marks_(marks) {
  if (marks_.empty()) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  low_.setConstant(kInfinity);
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-kInfinity);
  for (const PrintedMark& mark : marks_) {
    low_ = low_.cwiseMin(mark.centre - half_size(mark));
    high = high.cwiseMax(mark.centre + half_size(mark));
  }
  // About one cell a mark, square, and not more than a thousand along either axis.
  const Eigen::Vector2d size = high - low_;
  const double cell =
      std::max(std::sqrt(size.x() * size.y() / static_cast<double>(marks_.size())), size.maxCoeff() / 1000.0);
  cells_per_mm_ = 1.0 / cell;
  columns_ = static_cast<int>(size.x() * cells_per_mm_) + 1;
  rows_ = static_cast<int>(size.y() * cells_per_mm_) + 1;

  const auto for_each_cell = [&](const PrintedMark& mark, const auto& visit) {
    const auto place = [&](double at, int axis, int count) {
      return std::clamp(static_cast<int>((at - low_[axis]) * cells_per_mm_), 0, count - 1);
    };
    const Eigen::Vector2d from = mark.centre - half_size(mark);
    const Eigen::Vector2d to = mark.centre + half_size(mark);
    const int right = place(to.x(), 0, columns_);
    const int top = place(to.y(), 1, rows_);
    for (int row = place(from.y(), 1, rows_); row <= top; ++row) {
      for (int column = place(from.x(), 0, columns_); column <= right; ++column) {
        visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column));
      }
    }
  };
  first_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  for (const PrintedMark& mark : marks_) for_each_cell(mark, [&](std::size_t c) { ++first_[c + 1]; });
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  members_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (int i = 0; i < static_cast<int>(marks_.size()); ++i) {
    for_each_cell(marks_[i], [&](std::size_t c) { members_[next[c]++] = i; });
  }
}

int PrintIndex::mark_at(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d place = (point - low_) * cells_per_mm_;
  if (!(place.x() >= 0.0 && place.x() < columns_ && place.y() >= 0.0 && place.y() < rows_)) return -1;
  const int cell = static_cast<int>(place.y()) * columns_ + static_cast<int>(place.x());
  for (int k = first_[cell + 1] - 1; k >= first_[cell]; --k) {
    const PrintedMark& mark = marks_[members_[k]];
    const Eigen::Vector2d off = point - mark.centre;
    const bool covers = mark.shape == MarkShape::round ? off.squaredNorm() <= mark.half_width * mark.half_width
                                                       : (off.cwiseAbs().array() <= half_size(mark).array()).all();
    if (covers) return members_[k];
  }
  return -1;
}

}  // namespace touchstone::render
