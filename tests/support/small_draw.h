#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace touchstone::test {

/// A coated pad of 8 x 8 x 3 mm, coarsely meshed, lit from three sides, seen by a camera of 40 x 30 pixels.
inline const char* const kDrawDevice = R"(name: small-coated
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.15, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2.5, 2.5], fine_depth_mm: 1}
plate: {thickness_mm: 3, refractive_index: 1.49}
coating: {type: matt, albedo: 0.4}
lamps:
  - {type: led, position_mm: [-8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.02, 0.001, 0.001]}
  - {type: led, position_mm: [8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.001, 0.02, 0.001]}
  - {type: led, position_mm: [0, 11, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.001, 0.001, 0.02]}
camera:
  type: lens
  width: 40
  height: 30
  pixel_pitch_um: 44
  focal_length_mm: 3
  f_number: 4
  focus_distance_mm: 17
  lens_position_mm: [0, 0, -19]
  look_at_mm: [0, 0, 0]
  exposure_us: 60
  full_well_e: 12000
  read_noise_e: 8
)";
inline const char* const kSmallDraw = R"(name: small-draw
licence: CC0-1.0
seed: 3
samples: 10
samples_per_file: 3
membrane_um: 120
draw:
  device: device.yaml
  units:
    count: 2
    vary:
      - {path: gel.youngs_modulus_MPa, times: {uniform: [0.8, 1.2]}}
      - {path: 'lamps[*].power_W', times: {uniform: [0.9, 1.1]}}
  objects:
    - {file: ball.yaml, weight: 2, vary: [{path: shape.radius_mm, set: {uniform: [1, 2]}}]}
    - {file: punch.yaml}
  place_mm: {x: {uniform: [-1.5, 1.5]}, y: {uniform: [-1.5, 1.5]}}
  tilt_deg: {uniform: [0, 5]}
  force_N: {log_uniform: [0.05, 0.3]}
  drag_mm: {uniform: [0, 0.1]}
outputs: [frame, height, contact]
splits: {train: 0.5, test: 0.5, by: unit}
)";

/// Writes job.yaml and all that it names: 10 samples in 4 files. Returns the job file.
inline std::filesystem::path write_small_draw(const TemporaryFolder& folder, const std::string& job = kSmallDraw) {
  folder.write("device.yaml", kDrawDevice);
  std::string bare = kDrawDevice;
  bare.erase(bare.find("coating:"), bare.find("lamps:") - bare.find("coating:"));
  folder.write("bare.yaml", bare);
  folder.write("ball.yaml", "name: ball\nshape: {type: sphere, radius_mm: 1.5}\nfriction: 0.5\n");
  folder.write("punch.yaml",
               "name: punch\nshape: {type: rounded_cylinder, radius_mm: 1.2, edge_radius_mm: 0.2, height_mm: 2}\n"
               "friction: 0.4\n");
  return folder.write("job.yaml", job);
}

}  // namespace touchstone::test
