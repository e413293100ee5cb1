#pragma once
// Where a coating's printed markers are, or the tips of its pins, and where a press takes them: what a marker tracker
// is held against.

#include <Eigen/Core>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "sim/scene/device.h"
#include "sim/view/skin_pins.h"

namespace touchstone::sim {

/// Printed markers whose middle lies on the meshed surface, in the print's order (visible_scene.h, printed_marks); or
/// the tips of all pins.
struct MarkerPlaces {
  Eigen::MatrixX3d rest_mm;            ///< of each middle on the undeformed gel, gel frame
  SkinPins pins;                       ///< none of a print, which has, for each marker:
  std::vector<int> triangle;           ///< of the gel's surface that it lies on
  std::vector<Eigen::Vector3d> share;  ///< barycentric, of the triangle's corners
};

/// None without a printed coating or pins.
MarkerPlaces marker_places(const DeviceSpec& device, const fem::Compliance& gel);

/// mm, a row a marker: how far the material under its middle has gone, or the middle of a pin's tip.
Eigen::MatrixX3d marker_displacement(const MarkerPlaces& places, const fem::Compliance& gel,
                                     const fem::PressState& press);

}  // namespace touchstone::sim
