#pragma once
// Marks and pictures in ink on a surface that deforms: markers printed on a membrane stay on it as it stretches, and so
// do the divisions of a rule and the colours of a printed card on what is touched.
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
// Under them there may be one picture, each pixel of it a rectangle of one colour, and under that whole triangles of
// ink. The frames of a sequence change `mesh.vertices` and leave `print` as it is.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// Square and rectangle have their sides along the material's x and y.
enum class MarkShape : std::uint8_t { round, square, rectangle };

/// One mark of a single ink.
struct PrintedMark {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< mm, material coordinates
  double half_width = 0.0;                           ///< mm, above 0: the radius, or half of a side (along x)
  int ink = 0;                                       ///< index into Print::inks
  MarkShape shape = MarkShape::round;                ///< sides run along x and y
  double half_height = 0.0;                          ///< mm, above 0: of a rectangle, half of its side along y
};

/// Half of a mark's size along x and y, mm.
inline Eigen::Vector2d half_size(const PrintedMark& mark) {
  return {mark.half_width, mark.shape == MarkShape::rectangle ? mark.half_height : mark.half_width};
}

/// A picture's pixels as rectangles of ink, without gaps.
struct PrintedPicture {
  int columns = 0, rows = 0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();       ///< mm, material coordinates of the corner at pixel (0, 0)
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Zero();  ///< above 0
  int bands = 0;
  std::vector<float> values;  ///< rows x columns x bands, 0 to 1; rows go along +y

  /// The `bands` values at a material point; null beside the picture. Not finite is beside it.
  const float* at(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d place = (point - low).cwiseQuotient(pixel_mm);
    if (!(place.x() >= 0.0 && place.x() < columns && place.y() >= 0.0 && place.y() < rows)) return nullptr;
    const auto row = static_cast<std::size_t>(place.y());
    const auto column = static_cast<std::size_t>(place.x());
    return values.data() + (row * static_cast<std::size_t>(columns) + column) * static_cast<std::size_t>(bands);
  }
};

/// Ink on one surface, in material coordinates: where the gel was at rest.
struct Print {
  std::vector<Eigen::Vector2d> material_mm;  ///< one for each vertex of the surface's mesh
  std::vector<Spectrum> inks;                ///< take the place of the material's own colour; 0 to 1
  std::vector<PrintedMark> marks;
  std::shared_ptr<const PrintedPicture> picture = nullptr;  ///< under the marks; null for none
  /// By triangle the ink under marks and picture, -1 for the material's own colour; empty: that everywhere.
  std::vector<int> ground = {};
};

/// Finds the mark that a material point lies in; a lookup costs the same for ten marks and for a million of about equal
/// size.
class PrintIndex {
 public:
  PrintIndex() = default;
  /// @pre centres and sizes are finite, sizes above 0
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
