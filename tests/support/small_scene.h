#pragma once

#include <string>

#include "sim/scene/scene.h"

namespace touchstone::test {

/// What differs between the tests' small devices.
struct SmallDevice {
  int width = 96;
  int height = 72;
  double pixel_pitch_um = 30;
  double bead_spacing_mm = 2;
};

/// A pad of 12 x 12 x 4 mm with 2 x 2 beads and one lamp, seen straight up through its plate by a pinhole camera.
inline sim::DeviceSpec small_device(const SmallDevice& of = {}) {
  const std::string text = fmt::format(R"(
name: small
gel: {{size_x_mm: 12, size_y_mm: 12, thickness_mm: 4, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.45}}
mesh: {{fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}}
beads: {{grid: 2, spacing_mm: {}, diameter_mm: 0.6, depth_mm: 0.8}}
plate: {{thickness_mm: 1, refractive_index: 1.5}}
lamps:
  - {{position_mm: [0, -10, -16], target_mm: [0, 0, -2], lens_radius_mm: 1, half_angle_deg: 25, power_W: [3, 3, 3]}}
room_radiance: 0.1
camera:
  width: {}
  height: {}
  pixel_pitch_um: {}
  hole_diameter_um: 100
  foil_thickness_um: 50
  hole_to_sensor_mm: 5
  hole_position_mm: [0, 0, -18]
  look_at_mm: [0, 0, 0]
  exposure_us: 500
  full_well_e: 50000
  read_noise_e: 5
)",
                                       of.bead_spacing_mm, of.width, of.height, of.pixel_pitch_um);
  return parse_yaml<sim::DeviceSpec>(text, "small.yaml");
}

/// A pad of 12 x 12 x 3 mm with a grey coating, lit from three sides in the plate, seen by a lens.
inline sim::DeviceSpec small_coated_device() {
  return parse_yaml<sim::DeviceSpec>(R"(
name: small-coated
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.15, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.6, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 3, refractive_index: 1.49}
coating: {type: matt, albedo: 0.4}
lamps:
  - {type: led, position_mm: [-8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.02, 0, 0]}
  - {type: led, position_mm: [8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0, 0.02, 0]}
  - {type: led, position_mm: [0, 11, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0, 0, 0.02]}
camera:
  type: lens
  width: 80
  height: 60
  pixel_pitch_um: 22
  focal_length_mm: 3
  f_number: 4
  focus_distance_mm: 17
  lens_position_mm: [0, 0, -19]
  look_at_mm: [0, 0, 0]
  exposure_us: 10
  full_well_e: 12000
  read_noise_e: 8
)",
                                     "small-coated.yaml");
}

}  // namespace touchstone::test
