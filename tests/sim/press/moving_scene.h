#pragma once
// A scene for tests of what a camera makes of motion: small and bright.

#include <memory>
#include <string>
#include <vector>

#include "sim/press/gel_setup.h"
#include "sim/scene/scene.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {

/// A pad of 8 x 8 x 3 mm with four beads, a grey camera of 40 x 30 pixels with event pixels and no noise.
inline const std::string kMovingDevice = std::string(test::kSmallDevice) + R"(camera:
  width: 40
  height: 30
  pixel_pitch_um: 60
  hole_diameter_um: 80
  hole_to_sensor_mm: 5
  hole_position_mm: [0, 0, -18]
  look_at_mm: [0, 0, 0]
  exposure_us: 500
  full_well_e: 500000
  events: {on_threshold: 0.15, off_threshold: 0.2, dark_e_per_s: 1e5}
)";

/// A ball of 2 mm radius that starts in touch; the keys run at 100 frames a second.
inline SceneSpec moving_scene(const std::string& keys) {
  SceneSpec scene;
  scene.device = parse_yaml<DeviceSpec>(kMovingDevice, "device.yaml");
  scene.object = parse_yaml<ObjectSpec>(
      "name: ball\nshape: {type: sphere, radius_mm: 2}\nalbedo: [0.6, 0.6, 0.6]\nfriction: 0\n", "object.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 2]\nframe_rate_Hz: 100\nkeys:\n" + keys, "motion.yaml");
  scene.light.min_samples = 16;
  scene.light.max_samples = 16;
  scene.effects.interreflection = Switch::off;
  scene.seed = 5;
  return scene;
}

/// The gel of kMovingDevice, made once a program.
inline std::shared_ptr<const fem::Compliance> moving_gel() {
  static const test::TemporaryFolder cache;
  static const auto gel = set_up_gel(parse_yaml<DeviceSpec>(kMovingDevice, "device.yaml"), cache.path());
  return gel;
}

}  // namespace touchstone::sim
