#pragma once
// Where a device's pins stand on the undeformed gel.

#include <Eigen/Core>
#include <vector>

#include "core/error.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// 2791 pins.
inline constexpr int kMostPinRings = 30;

/// A pin of the undeformed gel, gel frame, mm.
struct PinPlace {
  Eigen::Vector3d skin;    ///< on the outer surface, over the pin's middle
  Eigen::Vector3d inward;  ///< unit, from there along the pin
};

/// From the outer surface to the end of a pin: skin and height, mm. @pre the device has pins
double pin_reach_mm(const DeviceSpec& device);

/// The pin in the middle, then ring by ring; a ring begins on the y axis and goes on towards x. None without pins.
std::vector<PinPlace> pin_places(const DeviceSpec& device);

/// That pins can stand so, and be seen. @pre the gel is checked, the device has pins
/// @throws Error at `where`, naming the field, for a device without a coating, with a print, or whose gel is a mesh;
/// for rings beyond the skin's rim, pins longer than the gel is thick, and pins that touch each other
void check_pins(const DeviceSpec& device, const SourceLocation& where);

}  // namespace touchstone::sim
