#pragma once

#include <string>

#include "sim/scene.h"

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

}  // namespace touchstone::test
