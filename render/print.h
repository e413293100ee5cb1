#pragma once
// Discs and squares of ink on a surface that deforms: markers printed on a membrane stay on it as it stretches.
//
//   Print print;
//   print.material_mm = {...};                  // for each vertex of the mesh: where it was on the undeformed surface
//   print.inks = {black, magenta};              // albedo of a Lambertian, reflectance of a RoughConductor
//   print.marks = {{{0, 0}, 0.4, 0}, {{1.5, 0}, 0.4, 1, MarkShape::square}};
//   scene.surfaces.push_back({membrane, Lambertian{white}, print});
//
// Marks are given in material coordinates, mm on the undeformed surface. A point of the surface has those of its
// triangle's vertices, interpolated; so the edge of a mark is as sharp as the mesh is fine or coarse, follows the
// material under any deformation, and is smoothed by a pixel's samples only. Where marks overlap the last one shows.
// The frames of a sequence change `mesh.vertices` and leave `print` as it is.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "render/spectrum.h"

namespace touchstone::render {

enum class MarkShape : std::uint8_t { round, square };

struct PrintedMark {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< mm, material coordinates
  double half_width = 0.0;                           ///< mm, above 0: the radius, or half of a side
  int ink = 0;                                       ///< index into Print::inks
  MarkShape shape = MarkShape::round;                ///< a square's sides run along x and y
};

struct Print {
  std::vector<Eigen::Vector2d> material_mm;  ///< one for each vertex of the surface's mesh
  std::vector<Spectrum> inks;                ///< take the place of the material's own colour; 0 to 1
  std::vector<PrintedMark> marks;
};

/// Finds the mark that a material point lies in; a lookup costs the same for ten marks and for a million of about equal
/// size.
class PrintIndex {
 public:
  PrintIndex() = default;
  /// @pre centres and half widths are finite, half widths above 0
  explicit PrintIndex(const std::vector<PrintedMark>& marks);

  /// The number of the last mark that covers `point`; -1 where there is none. Not finite is nowhere.
  int mark_at(const Eigen::Vector2d& point) const;

 private:
  std::vector<PrintedMark> marks_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cells_per_mm_ = 0.0;
  int columns_ = 0, rows_ = 0;
  std::vector<int> first_;    // cell -> its first entry in `members_`; one more than there are cells
  std::vector<int> members_;  // mark numbers, rising within a cell
};

}  // namespace touchstone::render
