#pragma once
// From a gel's compliance to what sensors/tractions/marker_compliance.h needs of it.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "fem/elements/compliance.h"
#include "sensors/tractions/marker_compliance.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// A marker printed on the outer surface: a square along x and y, or a disc. mm, undeformed, gel frame.
struct SurfaceMarker {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double half_width = 0.0;  ///< half of a side, or the radius
  bool square = true;
};

/// A grid of markers, row by row: y grows from row to row and x along a row.
struct SurfaceMarkers {
  Eigen::Vector2i grid = Eigen::Vector2i::Zero();
  std::vector<SurfaceMarker> markers;
};

/// Where tractions are sought.
struct PatchGrid {
  Eigen::Vector2i grid = Eigen::Vector2i::Zero();
  double side = 0.0;                                ///< mm
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< centre of the first, mm
};

/// Patches that reach two thirds of a spacing (the mean over x and y of that between neighbours) beyond the outermost
/// markers' centres, or as far as the gel's face does, centred on the markers. @throws Error unless `side` is positive
/// and finite and there are 1 to sensors::kMostPatches of them
PatchGrid patches_over(const fem::Compliance& gel, const SurfaceMarkers& markers, double side);

/// Markers on the surface. A marker moves as the mean over its area of the surface displacement, which is the
/// projection on the hats that PressState gives; a patch's uniform traction acts as its projection on the hats, which
/// has the same force and the same work on all hats. With v the hats' integrals over an area and M the mass matrix,
/// both come to M^-1 v, and marker against patch is (M^-1 v)^T surface (M^-1 w) over the marker's area: where marker
/// and patch change places the numbers stay. Discs are taken as polygons of 64 corners with the disc's area.
/// @throws Error if the outer surface isn't flat, if a marker or patch isn't wholly on it, or for a grid of the wrong
/// size
sensors::MarkerCompliance marker_compliance(const fem::Compliance& gel, const SurfaceMarkers& markers,
                                            const PatchGrid& patches);

/// Beads inside of the gel, those that the compliance has: a square grid. @throws Error likewise, or if there are none
sensors::MarkerCompliance bead_compliance(const fem::Compliance& gel, const std::vector<Eigen::Vector3d>& rest,
                                          const PatchGrid& patches);

/// Of the displacement of the surface (n x 3, mm; PressState::surface_displacement) what each marker does: mean over
/// its area. @throws Error as marker_compliance
class MarkerMeans {
 public:
  /// Where the markers lie on this gel.
  MarkerMeans(const fem::Compliance& gel, const SurfaceMarkers& markers);
  /// mm, gel frame, by marker.
  std::vector<Eigen::Vector3d> of(const Eigen::MatrixX3d& surface_displacement) const;

 private:
  Eigen::SparseMatrix<double> weights_;  ///< n x markers; columns sum to one
};

/// The markers that a device's coating bears. @throws Error for a device without a print, or with a jittered one
SurfaceMarkers printed_markers(const sim::DeviceSpec& device);

/// Whether a device has such a map, without setting it up. @throws Error for a gel that isn't a slab, for a device with
/// neither printed markers nor beads, or with jittered markers
void check_marker_compliance(const sim::DeviceSpec& device);

/// All of it for a device: its printed markers, or else its beads. `patch_side_mm`: half a spacing without it.
/// @throws Error as check_marker_compliance, patches_over and marker_compliance
sensors::MarkerCompliance export_marker_compliance(const sim::DeviceSpec& device, const fem::Compliance& gel,
                                                   std::optional<double> patch_side_mm = {});

}  // namespace touchstone::lab
