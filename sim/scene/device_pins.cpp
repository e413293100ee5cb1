#include "sim/scene/device_pins.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/units.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr int kSides = 6;  // of the pattern: so many more pins stand in each ring than in the last

double skin_mm(const GelSpec& gel) {
  return gel.layers.empty() ? 0.0 : gel.layers.front().thickness_mm;
}

/// Radius of the skin's inner face, of a round gel.
double inner_radius_mm(const RoundFace& face, const GelSpec& gel) {
  return face.sphere_radius_mm - skin_mm(gel);
}

/// Of a round gel, from one ring to the next. @pre the first ring is on the inner face
double ring_angle(const DeviceSpec& device, const RoundFace& face) {
  return std::asin(device.pins->first_ring_mm / inner_radius_mm(face, device.gel));
}

void check_rings_are_on_the_skin(const DeviceSpec& device, const SourceLocation& where) {
  const PinSpec& pins = *device.pins;
  const double radius = 0.5 * pins.diameter_mm;
  const std::optional<RoundFace> face = round_face(device.gel);
  if (!face) {
    const SlabSpec& slab = *device.gel.slab();
    const double half = 0.5 * std::min(slab.size_x_mm, slab.size_y_mm);
    const double reach = pins.rings * pins.first_ring_mm + radius;
    if (reach > half) {
      fail_at(where,
              "pins.rings: {} rings {} mm apart, of pins of {} mm, reach to {:.4g} mm from the middle of a gel of {} x "
              "{} mm; allowed is up to {:.4g} mm",
              pins.rings, pins.first_ring_mm, pins.diameter_mm, reach, slab.size_x_mm, slab.size_y_mm, half);
    }
    return;
  }
  const double inner = inner_radius_mm(*face, device.gel);
  if (pins.first_ring_mm >= inner || radius >= inner) {
    fail_at(where,
            "pins: a first ring at {} mm of pins of {} mm is beside the skin's inner face, a sphere of {:.4g} mm",
            pins.first_ring_mm, pins.diameter_mm, inner);
  }
  const double angle = ring_angle(device, *face);
  const double rim = std::asin(std::min(1.0, face->radius_mm / face->sphere_radius_mm));
  const double reach = pins.rings * angle + std::asin(radius / inner);
  if (reach > rim) {
    fail_at(where,
            "pins.rings: {} rings, {:.4g} degrees apart, reach to {:.4g} degrees from the apex; allowed is up to the "
            "dome's rim at {:.4g} degrees",
            pins.rings, angle / kRadiansPerDegree, reach / kRadiansPerDegree, rim / kRadiansPerDegree);
  }
}

void check_pins_end_in_the_gel(const DeviceSpec& device, const SourceLocation& where) {
  const double reach = pin_reach_mm(device);
  double room = std::numeric_limits<double>::infinity();  // along a pin, to the back or to where pins would meet
  for (const PinPlace& pin : pin_places(device)) {
    if (pin.inward.z() < 0.0) room = std::min(room, (device.gel.thickness_mm + pin.skin.z()) / -pin.inward.z());
  }
  if (const auto face = round_face(device.gel)) room = std::min(room, face->sphere_radius_mm);
  if (reach >= room) {
    fail_at(where, "pins.height_mm: {} is longer than the gel is thick behind the skin: allowed is below {:.4g}",
            device.pins->height_mm, room - skin_mm(device.gel));
  }
}

/// Nearest are neighbours of one ring, or those of the first one and the middle; at the ends, as pins of a dome lean
/// towards each other.
void check_pins_are_apart(const DeviceSpec& device, const SourceLocation& where) {
  const PinSpec& pins = *device.pins;
  if (pins.rings == 0) return;
  const std::vector<PinPlace> places = pin_places(device);
  const double reach = pin_reach_mm(device);
  const auto end = [&](std::size_t pin) -> Eigen::Vector3d { return places[pin].skin + reach * places[pin].inward; };
  double nearest = (end(1) - end(0)).norm();
  std::size_t first = 1;
  for (int ring = 1; ring <= pins.rings; ++ring) {
    nearest = std::min(nearest, (end(first + 1) - end(first)).norm());
    first += static_cast<std::size_t>(kSides * ring);
  }
  if (nearest <= pins.diameter_mm) {
    fail_at(where, "pins.diameter_mm: {} lets pins overlap, whose ends are {:.4g} mm apart; allowed is below that",
            pins.diameter_mm, nearest);
  }
}

}  // namespace

double pin_reach_mm(const DeviceSpec& device) {
  TS_ASSERT(device.pins);
  return skin_mm(device.gel) + device.pins->height_mm;
}

std::vector<PinPlace> pin_places(const DeviceSpec& device) {
  std::vector<PinPlace> places;
  if (!device.pins) return places;
  const PinSpec& pins = *device.pins;
  const std::optional<RoundFace> face = round_face(device.gel);
  places.push_back({Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitZ()});
  for (int ring = 1; ring <= pins.rings; ++ring) {
    for (int k = 0; k < kSides * ring; ++k) {
      const double turn = 2.0 * kPi * k / (kSides * ring);
      const Eigen::Vector3d aside(std::sin(turn), std::cos(turn), 0.0);
      if (!face) {
        places.push_back({ring * pins.first_ring_mm * aside, -Eigen::Vector3d::UnitZ()});
        continue;
      }
      const double angle = ring * ring_angle(device, *face);
      const Eigen::Vector3d out = std::sin(angle) * aside + std::cos(angle) * Eigen::Vector3d::UnitZ();
      places.push_back({face->sphere_radius_mm * (out - Eigen::Vector3d::UnitZ()), -out});
    }
  }
  return places;
}

void check_pins(const DeviceSpec& device, const SourceLocation& where) {
  if (!device.coating)
    fail_at(where, "pins: stand on the inside of a coated gel's skin, and the device has no coating");
  if (device.coating->print) fail_at(where, "pins: the coating has a print; a device has pins or a print");
  if (device.gel.mesh() != nullptr)
    fail_at(where, "pins: the gel is a mesh; slabs, domes and fingertips can have pins");
  check_rings_are_on_the_skin(device, where);
  check_pins_end_in_the_gel(device, where);
  check_pins_are_apart(device, where);
}

}  // namespace touchstone::sim
