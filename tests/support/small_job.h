#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/sha256.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::test {

/// A pad of 8 x 8 x 3 mm with 2 x 2 beads, seen by a camera of 48 x 36 pixels.
inline const char* const kSmallDevice = R"(name: small
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.45}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2, 2], fine_depth_mm: 1}
beads: {grid: 2, spacing_mm: 2, diameter_mm: 0.6, depth_mm: 0.8}
plate: {thickness_mm: 1, refractive_index: 1.5}
lamps:
  - {position_mm: [0, -10, -16], target_mm: [0, 0, -2], lens_radius_mm: 1, half_angle_deg: 25, power_W: [3, 3, 3]}
room_radiance: 0.1
)";
inline const char* const kSmallCamera = R"(camera:
  width: 48
  height: 36
  pixel_pitch_um: 60
  hole_diameter_um: 100
  foil_thickness_um: 50
  hole_to_sensor_mm: 5
  hole_position_mm: [0, 0, -18]
  look_at_mm: [0, 0, 0]
  exposure_us: 500
  full_well_e: 50000
  read_noise_e: 5
)";
inline const char* const kSmallObject =
    "name: ball\nshape: {type: sphere, radius_mm: 2}\nalbedo: [0.6, 0.5, 0.4]\nfriction: 0.5\n";
inline const char* const kSmallMotion =
    "start_mm: [0, 0, 2.2]\nkeys:\n  - {frames: 3, z: {position_mm: 1.7}}\n  - {frames: 2, x: {position_mm: 0.05}}\n";
inline const char* const kSmallScene =
    "device: device.yaml\nobject: object.yaml\nmotion: motion.yaml\n"
    "light: {min_samples: 4, max_samples: 8}\noutputs: {frames: true, radiance: true}\n";
inline const char* const kSmallJob =
    "name: small-job\nseed: 11\nscenes:\n"
    "  - {name: middle, scene: scene.yaml, split: train}\n"
    "  - {name: beside, scene: scene.yaml, start_mm: [0.5, 0.2, 2.2], split: validate}\n";

/// Writes job.yaml and all that it names; 2 scenes of 6 samples. Returns the job file.
inline std::filesystem::path write_small_job(const TemporaryFolder& folder) {
  folder.write("device.yaml", std::string(kSmallDevice) + kSmallCamera);
  folder.write("object.yaml", kSmallObject);
  folder.write("motion.yaml", kSmallMotion);
  folder.write("scene.yaml", kSmallScene);
  return folder.write("job.yaml", kSmallJob);
}

/// Names and checksums of all files below a folder, hidden ones too.
inline std::map<std::string, std::string> contents_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    contents[entry.path().lexically_relative(folder).string()] = sha256_of_file(entry.path());
  }
  return contents;
}

}  // namespace touchstone::test
