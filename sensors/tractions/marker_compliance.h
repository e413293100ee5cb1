#pragma once
// How a gel's markers move when tractions act on its outer surface: the linear map that estimators of force invert. It
// is worked out once for each gel (`touchstone export compliance`), so that nothing here needs finite elements.
//
// Traction is taken to be constant over each of a grid of square patches on the flat outer surface, z = 0 of the gel
// frame (core/transform.h): a press is -z. Patches and markers are numbered row by row, y growing from row to row and x
// along a row. Component a of patch p is column 3 p + a, component a of marker m is row 3 m + a.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sensors/markers/marker_field.h"

namespace touchstone::sensors {

/// The linear map and the grids that it belongs to.
struct MarkerCompliance {
  Eigen::Vector2i marker_grid = Eigen::Vector2i::Zero();  ///< columns, rows
  std::vector<Eigen::Vector3d> marker_rest;               ///< mm, gel frame, undeformed; columns * rows
  Eigen::Vector2i patch_grid = Eigen::Vector2i::Zero();   ///< columns, rows
  double patch_side = 0.0;                                ///< mm; patches touch each other
  Eigen::Vector2d first_patch = Eigen::Vector2d::Zero();  ///< centre of patch 0, mm
  Eigen::MatrixXd displacement;  ///< markers' (mm) per traction on the gel (MPa): 3 markers x 3 patches
  double thickness = 0.0;        ///< of the gel, mm; for the reader
  double youngs_modulus = 0.0;   ///< MPa; for the reader, and the scale of tractions
  double poisson_ratio = 0.0;    ///< for the reader
  std::string gel;               ///< what it was made of; for people

  int markers() const { return marker_grid.prod(); }
  int patches() const { return patch_grid.prod(); }
  double patch_area() const { return patch_side * patch_side; }  ///< mm^2
  /// mm, in the plane z = 0 of the gel frame.
  Eigen::Vector2d patch_centre(int patch) const {
    return first_patch + patch_side * Eigen::Vector2d(patch % patch_grid.x(), patch / patch_grid.x());
  }
};

/// The most markers, and the most patches, that a grid may have.
inline constexpr int kMostMarkers = 10000;
inline constexpr int kMostPatches = 4096;  ///< likewise

/// What makes the map unusable, or "": an empty or too large grid, sizes that don't fit each other, a number that isn't
/// finite, a length or modulus that isn't positive, a Poisson's ratio outside of (-1, 0.5], a matrix of zeros.
std::string fault_of(const MarkerCompliance& compliance);

/// How the markers move under tractions (on the gel, MPa, a column for each patch): all are measured.
/// @pre the compliance is sound and has as many patches
MarkerField displacements_under(const MarkerCompliance& compliance, const Eigen::Matrix3Xd& traction);

}  // namespace touchstone::sensors
