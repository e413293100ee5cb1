#include "lab/vhs/ideal_tracking.h"

#include "core/error.h"
#include "core/random.h"
#include "lab/vhs/bead_view.h"
#include "sim/plan/plan.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

TrackedSequence track_ideally(const std::string& name, const sim::SceneSpec& scene, const fem::Compliance& gel,
                              double noise_px, std::uint64_t seed) {
  BeadView view;
  try {
    view = bead_view(scene.device);
  } catch (const Error& error) {
    fail("{}: {}", name, error.what());
  }
  sim::SceneSpec unseen = scene;
  unseen.outputs = {.frames = false, .ideal = false, .radiance = false};
  TrackedSequence tracked;
  tracked.source.name = name;
  for (const sim::Truth& truth : sim::play_motion(unseen, sim::make_plan(unseen), gel)) {
    RandomStream random(seed, static_cast<std::uint64_t>(truth.frame), Purpose::kCentroidNoise);
    datasets::LabelledFrame frame;
    frame.t_us = truth.t_us;
    frame.frame = truth.frame;
    frame.force = truth.press.wrench.head<3>();
    sensors::TrackedBeads beads;
    beads.t_us = truth.t_us;
    Eigen::MatrixX2d pixels;
    try {
      pixels = bead_pixels(view, truth.press.bead_displacement);
    } catch (const Error& error) {
      fail("{}: {} in frame {}", name, error.what(), truth.frame);
    }
    for (Eigen::Index i = 0; i < pixels.rows(); ++i) {
      const double x = random.normal(), y = random.normal();
      beads.positions.push_back(pixels.row(i).transpose() + noise_px * Eigen::Vector2d(x, y));
    }
    beads.measured = beads.positions;
    beads.area_px.assign(view.rest_mm.size(), 1.0);
    beads.status.assign(view.rest_mm.size(), sensors::BeadStatus::kFound);
    tracked.source.frames.push_back(frame);
    tracked.beads.push_back(beads);
  }
  return tracked;
}

}  // namespace touchstone::lab
