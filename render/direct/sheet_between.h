#pragma once
// A picture of a printed sheet after it has moved a little, from the points of a picture that was drawn in full.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "render/direct/sheet_points.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// How far points of a sheet have moved, on a lattice of the material: node (i, j) stands at first + pitch (i, j).
struct SheetMove {
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< mm, material coordinates
  double pitch = 1.0;                               ///< mm
  int nx = 0, ny = 0;
  std::vector<float> moved;  ///< 3 a node, mm, x fastest
};

/// What may be left out where a sheet has moved: first order is off by the products of these.
struct SheetReach {
  double pixels = 0.0;  ///< the farthest that something seen has moved in the picture
  double slope = 0.0;   ///< the most that the sheet's slope has changed by at a point of the material
};

/// Moves a matt sheet's points: print and slopes go with the material, slopes change by the move's gradient, and the
/// light of lamps and surroundings with the shadows in it goes with the material as it fell before. The cosine law is
/// exact. A mark covers the share of a ray's square that lies within its outline, taken as straight.
///
/// Left out, all of second order: what the move changes of the light's direction, of shadows and of the bounced light;
/// how strongly the sheet is bent, times how far it moved.
class SheetBetween {
 public:
  /// `sheet`: as the points were made of. @pre it is Lambertian and its print, if any, has no picture
  SheetBetween(SheetPoints points, const Surface& sheet);

  /// The radiance of each point after the move, [band][point] as the renderer spreads it
  /// (DirectRenderer::picture_of), into `radiance`. Its own memory apart, a pure function for any number of threads.
  SheetReach radiance(const SheetMove& move, std::vector<float>& radiance) const;

  /// How far the move goes, alone.
  SheetReach reach(const SheetMove& move) const;

 private:
  /// A corner of the picture's squares of kSquare points: from the move to the picture.
  struct Corner {
    Eigen::Vector2f material = Eigen::Vector2f::Zero();                             // mm
    Eigen::Matrix2f material_per_point = Eigen::Matrix2f::Zero();                   // mm
    Eigen::Matrix<float, 2, 3> points_per_mm = Eigen::Matrix<float, 2, 3>::Zero();  // in the picture, of a move
    Eigen::Matrix2f material_from_space = Eigen::Matrix2f::Zero();  // (dx / dX)^-T of the sheet as it was
    Eigen::Vector2f slope = Eigen::Vector2f::Zero();
  };
  /// What a move does at a corner, interpolated between corners: the shift in the picture (2 numbers, points), what is
  /// added to the slope (2), and the matrix that slopes are less by, row by row, times themselves (4).
  static constexpr int kNumbers = 8;
  using Change = std::array<float, kNumbers>;
  struct RowChange;
  struct Mark {
    Eigen::Vector2f centre, half;
    bool round = true;
    std::array<float, kMaxBands> colour{};
  };

  void find_corners();
  void find_marks(const Print& print);
  void find_plain_squares();
  void find_still();
  const Mark* mark_of(std::size_t point) const {
    const std::int32_t mark = mark_near_.empty() ? -1 : mark_near_[point];
    return mark < 0 ? nullptr : &marks_[mark];
  }
  template <typename Value>
  void shade(const Value& value, const float* change, const Mark* mark, float covered, float* out,
             std::size_t apart) const;
  void shade_in_place(const RowChange& change, std::size_t first, int count, float* out) const;
  void shade_moved(const RowChange& change, const Corner& corner, int row, int column, int count, float* out) const;
  std::vector<Change> changes(const SheetMove& move, SheetReach& reach) const;
  float cover(const Mark& mark, float x, float y, const Eigen::Matrix2f& material_per_point) const;

  SheetPoints points_;
  std::array<float, kMaxBands> plain_{};  // the sheet's own colour
  std::vector<Mark> marks_;
  std::vector<std::int32_t> mark_near_;  // by point: the mark whose outline is nearest to it, or that it lies in; -1
  int corner_columns_ = 0, corner_rows_ = 0;
  std::vector<Corner> corners_;
  std::vector<char> plain_square_;  // by its first corner: 1 where all of it is sheet, away from marks
  std::vector<float> still_;        // [band][point]: the radiance without a move
};

}  // namespace touchstone::render
