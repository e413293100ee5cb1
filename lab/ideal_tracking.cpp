#include "lab/ideal_tracking.h"

#include "core/error.h"
#include "core/random.h"
#include "lab/pressed_marker.h"
#include "render/first_hits.h"
#include "sim/device_camera.h"
#include "sim/virtual_sensor.h"

namespace touchstone::lab {

TrackedSequence track_ideally(const std::string& name, const sim::SceneSpec& scene, const fem::Compliance& gel,
                              double noise_px, std::uint64_t seed) {
  const sim::DeviceSpec& device = scene.device;
  if (!device.beads || !device.camera)
    fail("{}: a device without {} has no bead to track", name, device.beads ? "a camera" : "beads");
  const std::vector<Eigen::Vector3d> centres = sim::bead_centres(*device.beads);
  const render::Scene faces = bare_faces(device.gel.thickness_mm, device.gel.refractive_index,
                                         device.plate.thickness_mm, device.plate.refractive_index);
  const render::ReadyCamera camera = render::make_ready(sim::camera_of(*device.camera));
  sim::SceneSpec unseen = scene;
  unseen.outputs = {.frames = false, .ideal = false, .radiance = false};
  TrackedSequence tracked;
  tracked.source.name = name;
  for (const sim::Truth& truth : sim::play_motion(unseen, sim::make_plan(unseen), gel)) {
    RandomStream random(seed, static_cast<std::uint64_t>(truth.frame), Purpose::kCentroidNoise);
    LabelledFrame frame;
    frame.t_us = truth.t_us;
    frame.frame = truth.frame;
    frame.force = truth.press.wrench.head<3>();
    sensors::TrackedBeads beads;
    beads.t_us = truth.t_us;
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Eigen::Vector3d centre =
          centres[i] + truth.press.bead_displacement.row(static_cast<Eigen::Index>(i)).transpose();
      const auto pixel = render::project_through_faces(faces, camera, centre);
      if (!pixel) fail("{}: bead {} can't be seen in frame {}", name, i, truth.frame);
      const double x = random.normal(), y = random.normal();
      beads.positions.push_back(*pixel + noise_px * Eigen::Vector2d(x, y));
    }
    beads.measured = beads.positions;
    beads.area_px.assign(centres.size(), 1.0);
    beads.status.assign(centres.size(), sensors::BeadStatus::kFound);
    tracked.source.frames.push_back(frame);
    tracked.beads.push_back(beads);
  }
  return tracked;
}

}  // namespace touchstone::lab
