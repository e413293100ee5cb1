#pragma once
// Discs of ink on a surface that deforms: markers printed on a membrane stay on it as it stretches.
//
//   Print print;
//   print.material_mm = {...};                  // for each vertex of the mesh: where it was on the undeformed surface
//   print.inks = {black, magenta};              // albedo of a Lambertian, reflectance of a RoughConductor
//   print.discs = {{{0, 0}, 0.4, 0}, {{1.5, 0}, 0.4, 1}};
//   scene.surfaces.push_back({membrane, Lambertian{white}, print});
//
// Discs are given in material coordinates, mm on the undeformed surface. A point of the surface has those of its
// triangle's vertices, interpolated; so the edge of a disc is as sharp as the mesh is fine or coarse, follows the
// material under any deformation, and is smoothed by a pixel's samples only. Where discs overlap the last one shows.
// The frames of a sequence change `mesh.vertices` and leave `print` as it is.

#include <Eigen/Core>
#include <vector>

#include "render/spectrum.h"

namespace touchstone::render {

struct PrintedDisc {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< mm, material coordinates
  double radius = 0.0;                               ///< mm, above 0
  int ink = 0;                                       ///< index into Print::inks
};

struct Print {
  std::vector<Eigen::Vector2d> material_mm;  ///< one for each vertex of the surface's mesh
  std::vector<Spectrum> inks;                ///< take the place of the material's own colour; 0 to 1
  std::vector<PrintedDisc> discs;
};

/// Finds the disc that a material point lies in; a lookup costs the same for ten discs and for a million of about equal
/// size.
class PrintIndex {
 public:
  PrintIndex() = default;
  /// @pre centres and radii are finite, radii above 0
  explicit PrintIndex(const std::vector<PrintedDisc>& discs);

  /// The number of the last disc that covers `point`; -1 where there is none. Not finite is nowhere.
  int disc_at(const Eigen::Vector2d& point) const;

 private:
  std::vector<PrintedDisc> discs_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cells_per_mm_ = 0.0;
  int columns_ = 0, rows_ = 0;
  std::vector<int> first_;    // cell -> its first entry in `members_`; one more than there are cells
  std::vector<int> members_;  // disc numbers, rising within a cell
};

}  // namespace touchstone::render
