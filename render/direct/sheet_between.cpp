#include "render/direct/sheet_between.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr int kSquare = 4;  // points a side: the gel's elements are some ten points wide
constexpr int kRowsATask = 8;
constexpr int kApart = 2;          // points on each side, of a corner's differences
constexpr float kNearMark = 2.0f;  // points from a mark's outline at which it is looked for
constexpr float kHardlyMoved =
    0.05f;  // points, where nothing is printed: light and slope change by some percent a point
constexpr float kStillMark = 0.001f;  // points, at a mark's outline: its light changes by some hundred percent a point
constexpr float kStillSlope = 2e-4f;  // the light changes by about as much
constexpr int kShiftSteps = 2;        // a point is looked for where it came from
constexpr double kLeastTurn = 1e-6;   // of determinants: rays along the sheet

/// The share of the unit square round the origin in which a.x + b.y + distance > 0, for a unit vector (a, b).
float half_plane_share(float distance, float a, float b) {
  a = std::abs(a);
  b = std::abs(b);
  if (a < b) std::swap(a, b);
  const float d = std::abs(distance);
  // Of the part beyond the line on its far side: a corner's triangle, then a trapezium.
  const float end = 0.5f * (a + b);
  float beyond = 0.0f;
  if (d < end) {
    const float bend = 0.5f * (a - b);
    beyond = d >= bend ? 0.5f * (end - d) * (end - d) / std::max(a * b, 1e-12f) : 0.5f - d / a;
  }
  return distance > 0.0f ? 1.0f - beyond : beyond;
}

}  // namespace

SheetBetween::SheetBetween(SheetPoints points, const Surface& sheet) : points_(std::move(points)) {
  const auto* matt = std::get_if<Lambertian>(&sheet.material);
  TS_ASSERT(matt != nullptr && points_.bands <= kMaxBands);
  for (int band = 0; band < points_.bands; ++band) plain_[band] = static_cast<float>(matt->albedo[band]);
  find_corners();
  if (sheet.print) find_marks(*sheet.print);
  find_plain_squares();
  find_still();
}

void SheetBetween::find_plain_squares() {
  plain_square_.assign(corners_.size(), 1);
  for (int row = 0; row < points_.grid.rows; ++row) {
    for (int column = 0; column < points_.grid.columns; ++column) {
      const std::size_t point = static_cast<std::size_t>(row) * points_.grid.columns + column;
      if (points_.on_sheet[point] != 0 && mark_of(point) == nullptr) continue;
      const int corner_row = std::clamp(row / kSquare, 0, std::max(0, corner_rows_ - 2));
      plain_square_[static_cast<std::size_t>(corner_row) * corner_columns_ + column / kSquare] = 0;
    }
  }
}

void SheetBetween::find_corners() {
  const int columns = points_.grid.columns;
  const int rows = points_.grid.rows;
  const int stride = points_.stride();
  corner_columns_ = (columns - 1 + kSquare - 1) / kSquare + 1;
  corner_rows_ = (rows - 1 + kSquare - 1) / kSquare + 1;
  corners_.resize(static_cast<std::size_t>(corner_columns_) * corner_rows_);
  tbb::parallel_for(0, corner_rows_, [&](int corner_row) {
    for (int corner_column = 0; corner_column < corner_columns_; ++corner_column) {
      Corner& corner = corners_[static_cast<std::size_t>(corner_row) * corner_columns_ + corner_column];
      const int row = std::min(corner_row * kSquare, rows - 1);
      const int column = std::min(corner_column * kSquare, columns - 1);
      const auto index = [&](int i, int j) { return static_cast<std::size_t>(j) * columns + i; };
      const int i0 = std::max(column - kApart, 0);
      const int i1 = std::min(column + kApart, columns - 1);
      const int j0 = std::max(row - kApart, 0);
      const int j1 = std::min(row + kApart, rows - 1);
      const std::size_t here = index(column, row);
      const std::size_t left = index(i0, row), right = index(i1, row), up = index(column, j0), down = index(column, j1);
      bool whole = true;
      for (const std::size_t point : {here, left, right, up, down}) whole = whole && points_.on_sheet[point] != 0;
      if (!whole || i1 == i0 || j1 == j0) continue;  // it stands still
      const auto value = [&](std::size_t point, int k) { return points_.values[point * stride + k]; };
      const auto place = [&](std::size_t point) { return Eigen::Vector3f(points_.places.data() + 3 * point); };
      const auto per_column = static_cast<float>(1.0 / (i1 - i0));
      const auto per_row = static_cast<float>(1.0 / (j1 - j0));
      corner.material = {value(here, 0), value(here, 1)};
      corner.slope = {value(here, 2), value(here, 3)};
      corner.material_per_point << per_column * (value(right, 0) - value(left, 0)),
          per_row * (value(down, 0) - value(up, 0)), per_column * (value(right, 1) - value(left, 1)),
          per_row * (value(down, 1) - value(up, 1));
      Eigen::Matrix3d sight;  // a move is a way along the sheet's picture and one along the ray
      sight.col(0) = (per_column * (place(right) - place(left))).cast<double>();
      sight.col(1) = (per_row * (place(down) - place(up))).cast<double>();
      sight.col(2) = Eigen::Vector3f(points_.directions.data() + 3 * here).cast<double>();
      const Eigen::Matrix2d along = sight.topLeftCorner<2, 2>();
      const double size = sight.col(0).norm() * sight.col(1).norm();
      const Eigen::Matrix2d material = corner.material_per_point.cast<double>();
      if (!(std::abs(sight.determinant()) > kLeastTurn * size) ||
          !(std::abs(material.determinant()) > kLeastTurn * material.squaredNorm()) ||
          !(std::abs(along.determinant()) > kLeastTurn * size)) {
        corner = {};
        continue;
      }
      corner.points_per_mm = sight.inverse().topRows<2>().cast<float>();
      corner.material_from_space = (material * along.inverse()).transpose().cast<float>();
    }
  });
}

void SheetBetween::find_marks(const Print& print) {
  TS_ASSERT(print.picture == nullptr);
  float largest = 0.0f;
  Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector2f high = -low;
  for (const PrintedMark& mark : print.marks) {
    Mark& made = marks_.emplace_back();
    made.centre = mark.centre.cast<float>();
    made.half = half_size(mark).cast<float>();
    made.round = mark.shape == MarkShape::round;
    for (int band = 0; band < points_.bands; ++band) {
      made.colour[band] = static_cast<float>(print.inks[mark.ink][band]);
    }
    largest = std::max(largest, made.half.maxCoeff());
    low = low.cwiseMin(made.centre);
    high = high.cwiseMax(made.centre);
  }
  mark_near_.assign(points_.count(), -1);
  if (marks_.empty()) return;
  // Marks by cells as wide as the largest of them: a point asks its own cell and those round it.
  const float cell = 2.0f * largest;
  const int nx = 1 + static_cast<int>((high.x() - low.x()) / cell);
  const int ny = 1 + static_cast<int>((high.y() - low.y()) / cell);
  std::vector<std::vector<std::int32_t>> cells(static_cast<std::size_t>(nx) * ny);
  for (std::size_t k = 0; k < marks_.size(); ++k) {
    const auto i = static_cast<int>((marks_[k].centre.x() - low.x()) / cell);
    const auto j = static_cast<int>((marks_[k].centre.y() - low.y()) / cell);
    cells[static_cast<std::size_t>(j) * nx + i].push_back(static_cast<std::int32_t>(k));
  }
  const int stride = points_.stride();
  tbb::parallel_for(0, points_.grid.rows, [&](int row) {
    for (int column = 0; column < points_.grid.columns; ++column) {
      const std::size_t point = static_cast<std::size_t>(row) * points_.grid.columns + column;
      if (points_.on_sheet[point] == 0) continue;
      const Corner& corner = corners_[static_cast<std::size_t>(row / kSquare) * corner_columns_ + column / kSquare];
      const float near = kNearMark * corner.material_per_point.norm();
      const float x = points_.values[point * stride];
      const float y = points_.values[point * stride + 1];
      const float fi = std::floor((x - low.x()) / cell);
      const float fj = std::floor((y - low.y()) / cell);
      if (!(fi >= -1.0f && fj >= -1.0f && fi <= static_cast<float>(nx) && fj <= static_cast<float>(ny))) continue;
      float best = near;
      for (int j = std::max(0, static_cast<int>(fj) - 1); j <= std::min(ny - 1, static_cast<int>(fj) + 1); ++j) {
        for (int i = std::max(0, static_cast<int>(fi) - 1); i <= std::min(nx - 1, static_cast<int>(fi) + 1); ++i) {
          for (const std::int32_t k : cells[static_cast<std::size_t>(j) * nx + i]) {
            const Mark& mark = marks_[k];
            const float dx = std::abs(x - mark.centre.x());
            const float dy = std::abs(y - mark.centre.y());
            const float outside =
                mark.round ? std::hypot(dx, dy) - mark.half.x() : std::max(dx - mark.half.x(), dy - mark.half.y());
            // Within several marks the last one shows.
            if (outside < best || (outside <= 0.0f && best <= 0.0f)) {
              best = outside;
              mark_near_[point] = k;
            }
          }
        }
      }
    }
  });
}

std::vector<SheetBetween::Change> SheetBetween::changes(const SheetMove& move, SheetReach& reach) const {
  std::vector<Change> all(corners_.size());
  std::vector<SheetReach> by_row(static_cast<std::size_t>(corner_rows_));
  const auto per_pitch = static_cast<float>(1.0 / move.pitch);
  const Eigen::Vector2f first = move.first.cast<float>();
  const auto spacing = static_cast<float>(points_.grid.spacing);
  // The move and its gradient at a place of the material, bilinearly.
  const auto at = [&](const Eigen::Vector2f& material, Eigen::Vector3f& moved, Eigen::Matrix<float, 3, 2>& gradient) {
    const Eigen::Vector2f place = (material - first) * per_pitch;
    const float x = std::clamp(place.x(), 1.0f, static_cast<float>(move.nx) - 2.001f);
    const float y = std::clamp(place.y(), 1.0f, static_cast<float>(move.ny) - 2.001f);
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const float u = x - static_cast<float>(i);
    const float v = y - static_cast<float>(j);
    const auto node = [&](int a, int b) {
      return Eigen::Map<const Eigen::Vector3f>(move.moved.data() +
                                               3 * (static_cast<std::size_t>(j + b) * move.nx + (i + a)));
    };
    const auto bilinear = [&](int a, int b) -> Eigen::Vector3f {
      return (1.0f - v) * ((1.0f - u) * node(a, b) + u * node(a + 1, b)) +
             v * ((1.0f - u) * node(a, b + 1) + u * node(a + 1, b + 1));
    };
    moved = bilinear(0, 0);
    gradient.col(0) = 0.5f * per_pitch * (bilinear(1, 0) - bilinear(-1, 0));
    gradient.col(1) = 0.5f * per_pitch * (bilinear(0, 1) - bilinear(0, -1));
  };
  tbb::parallel_for(0, corner_rows_, [&](int row) {
    SheetReach& farthest = by_row[static_cast<std::size_t>(row)];
    for (int column = 0; column < corner_columns_; ++column) {
      const std::size_t number = static_cast<std::size_t>(row) * corner_columns_ + column;
      const Corner& corner = corners_[number];
      Change& change = all[number];
      Eigen::Vector3f moved;
      Eigen::Matrix<float, 3, 2> gradient;
      Eigen::Vector2f shift = Eigen::Vector2f::Zero();
      for (int step = 0; step < kShiftSteps; ++step) {
        at(corner.material - corner.material_per_point * shift, moved, gradient);
        shift = corner.points_per_mm * moved;
      }
      const Eigen::Vector2f added = corner.material_from_space * gradient.row(2).transpose();
      const Eigen::Matrix2f turned = corner.material_from_space * gradient.topRows<2>().transpose();
      change = {shift.x(), shift.y(), added.x(), added.y(), turned(0, 0), turned(0, 1), turned(1, 0), turned(1, 1)};
      farthest.pixels = std::max(farthest.pixels, double(spacing * shift.norm()));
      farthest.slope = std::max(farthest.slope, double((added - turned * corner.slope).norm()));
    }
  });
  for (const SheetReach& one : by_row) {
    reach.pixels = std::max(reach.pixels, one.pixels);
    reach.slope = std::max(reach.slope, one.slope);
  }
  return all;
}

SheetReach SheetBetween::reach(const SheetMove& move) const {
  SheetReach reach;
  changes(move, reach);
  return reach;
}

float SheetBetween::cover(const Mark& mark, float x, float y, const Eigen::Matrix2f& material_per_point) const {
  const float dx = x - mark.centre.x();
  const float dy = y - mark.centre.y();
  Eigen::Vector2f inwards;
  float inside = 0.0f;  // mm from the outline
  if (mark.round) {
    const float r = std::sqrt(dx * dx + dy * dy);
    inside = mark.half.x() - r;
    inwards = r > 0.0f ? Eigen::Vector2f(-dx / r, -dy / r) : Eigen::Vector2f(1.0f, 0.0f);
  } else {
    const float along_x = mark.half.x() - std::abs(dx);
    const float along_y = mark.half.y() - std::abs(dy);
    inside = std::min(along_x, along_y);
    inwards = along_x < along_y ? Eigen::Vector2f(dx > 0.0f ? -1.0f : 1.0f, 0.0f)
                                : Eigen::Vector2f(0.0f, dy > 0.0f ? -1.0f : 1.0f);
  }
  const Eigen::Vector2f per_point = material_per_point.transpose() * inwards;
  const float length = per_point.norm();
  if (!(length > 0.0f)) return inside > 0.0f ? 1.0f : 0.0f;
  return half_plane_share(inside / length, per_point.x() / length, per_point.y() / length);
}

/// A move's change over a row of one square of points.
struct SheetBetween::RowChange {
  float left[kNumbers];
  float step[kNumbers];  // from point to point
};

/// What a point of the sheet shows where its light and slope are these: `values` as SheetPoints has them.
template <typename Value>
void SheetBetween::shade(const Value& value, const float* change, const Mark* mark, float covered, float* out,
                         std::size_t apart) const {
  const float was_x = value(2);
  const float was_y = value(3);
  const float slope_x = was_x + change[2] - change[4] * was_x - change[5] * was_y;
  const float slope_y = was_y + change[3] - change[6] * was_x - change[7] * was_y;
  const float per_length = 1.0f / std::sqrt(1.0f + slope_x * slope_x + slope_y * slope_y);
  for (int band = 0; band < points_.bands; ++band) {
    const int first = SheetPoints::kGeometry + SheetPoints::kLight * band;
    const float lamps = per_length * (slope_x * value(first) + slope_y * value(first + 1) - value(first + 2));
    const float white = std::max(0.0f, lamps + value(first + 3));
    const float ink = mark == nullptr ? plain_[band] : mark->colour[band];
    out[band * apart] = white * (plain_[band] + covered * (ink - plain_[band]));
  }
}

/// A row of a square where it hardly moves, without marks: the light that fell on each point, by its new slope.
void SheetBetween::shade_in_place(const RowChange& change, std::size_t first, int count, float* out) const {
  const int stride = points_.stride();
  for (int k = 0; k < count; ++k) {
    float now[kNumbers];
    for (int n = 0; n < kNumbers; ++n) now[n] = change.left[n] + static_cast<float>(k) * change.step[n];
    const float* values = points_.values.data() + (first + k) * stride;
    shade([&](int n) { return values[n]; }, now, nullptr, 0.0f, out + first + k, points_.count());
  }
}

/// A row of a square: each point shows what has come to it.
void SheetBetween::shade_moved(const RowChange& change, const Corner& corner, int row, int column, int count,
                               float* out) const {
  const int columns = points_.grid.columns;
  const int rows = points_.grid.rows;
  const int stride = points_.stride();
  const std::size_t right = columns > 1 ? 1 : 0;
  const std::size_t below = rows > 1 ? static_cast<std::size_t>(columns) : 0;
  for (int k = 0; k < count; ++k) {
    const std::size_t point = static_cast<std::size_t>(row) * columns + column + k;
    if (points_.on_sheet[point] == 0) {
      for (int band = 0; band < points_.bands; ++band) {
        out[band * points_.count() + point] = points_.others[band * points_.count() + point];
      }
      continue;
    }
    float now[kNumbers];
    for (int n = 0; n < kNumbers; ++n) now[n] = change.left[n] + static_cast<float>(k) * change.step[n];
    const float x = std::clamp(static_cast<float>(column + k) - now[0], 0.0f, static_cast<float>(columns - 1));
    const float y = std::clamp(static_cast<float>(row) - now[1], 0.0f, static_cast<float>(rows - 1));
    const int i = std::min(static_cast<int>(x), std::max(columns - 2, 0));
    const int j = std::min(static_cast<int>(y), std::max(rows - 2, 0));
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const std::size_t from = static_cast<std::size_t>(j) * columns + i;
    const bool whole = (points_.on_sheet[from] & points_.on_sheet[from + right] & points_.on_sheet[from + below] &
                        points_.on_sheet[from + below + right]) != 0;
    const float* const all = points_.values.data();
    if (!whole) {  // at the sheet's border: as it was
      const float* const here = all + point * stride;
      const Mark* const mark = mark_of(point);
      const float covered = mark == nullptr ? 0.0f : cover(*mark, here[0], here[1], corner.material_per_point);
      shade([&](int n) { return here[n]; }, now, mark, covered, out + point, points_.count());
      continue;
    }
    const float* const values[4] = {all + from * stride, all + (from + right) * stride, all + (from + below) * stride,
                                    all + (from + below + right) * stride};
    const float weight[4] = {(1.0f - fx) * (1.0f - fy), fx * (1.0f - fy), (1.0f - fx) * fy, fx * fy};
    const auto value = [&](int n) {
      return weight[0] * values[0][n] + weight[1] * values[1][n] + weight[2] * values[2][n] + weight[3] * values[3][n];
    };
    const Mark* const mark = mark_of(from + (fx >= 0.5f ? right : 0) + (fy >= 0.5f ? below : 0));
    const float covered = mark == nullptr ? 0.0f : cover(*mark, value(0), value(1), corner.material_per_point);
    shade(value, now, mark, covered, out + point, points_.count());
  }
}

void SheetBetween::find_still() {
  still_.resize(points_.count() * points_.bands);
  tbb::parallel_for(0, points_.grid.rows, [&](int row) {
    for (int square = 0; square * kSquare < points_.grid.columns; ++square) {
      const int count = std::min(kSquare, points_.grid.columns - square * kSquare);
      const Corner& corner = corners_[static_cast<std::size_t>(row / kSquare) * corner_columns_ + square];
      shade_moved(RowChange{}, corner, row, square * kSquare, count, still_.data());
    }
  });
}

SheetReach SheetBetween::radiance(const SheetMove& move, std::vector<float>& radiance) const {
  SheetReach reach;
  const std::vector<Change> change = changes(move, reach);
  const int columns = points_.grid.columns;
  const int rows = points_.grid.rows;
  radiance.resize(points_.count() * points_.bands);
  const int tasks = (rows + kRowsATask - 1) / kRowsATask;
  tbb::parallel_for(0, tasks, [&](int task) {
    for (int row = task * kRowsATask; row < std::min(rows, (task + 1) * kRowsATask); ++row) {
      const int corner_row = std::clamp(row / kSquare, 0, std::max(0, corner_rows_ - 2));
      const int height = std::max(1, std::min((corner_row + 1) * kSquare, rows - 1) - corner_row * kSquare);
      const float v = static_cast<float>(row - corner_row * kSquare) / static_cast<float>(height);
      const Change* const upper = change.data() + static_cast<std::size_t>(corner_row) * corner_columns_;
      const Change* const lower = corner_row + 1 < corner_rows_ ? upper + corner_columns_ : upper;
      for (int square = 0; square * kSquare < columns; ++square) {
        const int next = std::min(square + 1, corner_columns_ - 1);
        const int width = std::max(1, std::min((square + 1) * kSquare, columns - 1) - square * kSquare);
        RowChange here;
        float most[kNumbers];
        for (int n = 0; n < kNumbers; ++n) {
          here.left[n] = (1.0f - v) * upper[square][n] + v * lower[square][n];
          const float end = (1.0f - v) * upper[next][n] + v * lower[next][n];
          here.step[n] = (end - here.left[n]) / static_cast<float>(width);
          most[n] = std::max(std::abs(here.left[n]), std::abs(end));
        }
        const std::size_t number = static_cast<std::size_t>(corner_row) * corner_columns_ + square;
        const int count = std::min(kSquare, columns - square * kSquare);
        const std::size_t first = static_cast<std::size_t>(row) * columns + square * kSquare;
        const float shift = std::max(most[0], most[1]);
        const float slope = std::max(most[2], most[3]) + std::max({most[4], most[5], most[6], most[7]});
        const bool plain = plain_square_[number] != 0;
        if (shift <= (plain ? kHardlyMoved : kStillMark) && slope <= kStillSlope) {
          for (int band = 0; band < points_.bands; ++band) {
            const std::size_t from = band * points_.count() + first;
            std::copy_n(still_.data() + from, count, radiance.data() + from);
          }
        } else if (plain && shift <= kHardlyMoved) {
          shade_in_place(here, first, count, radiance.data());
        } else {
          shade_moved(here, corners_[number], row, square * kSquare, count, radiance.data());
        }
      }
    }
  });
  return reach;
}

}  // namespace touchstone::render
