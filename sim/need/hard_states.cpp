#include "sim/need/hard_states.h"

#include <algorithm>

#include "sim/press/elastic_object.h"
#include "sim/press/play_motion.h"

namespace touchstone::sim {

double strongest_force(const fem::PressState& state) {
  double most = 0.0;
  for (const fem::BodyState& body : state.bodies) most = std::max(most, body.wrench.head<3>().norm());
  return most;
}

std::vector<int> hard_frames(std::span<const Truth> truths) {
  const auto force = [](const Truth& truth) { return strongest_force(truth.press); };
  const auto shear = [](const Truth& truth) {
    double most = 0.0;
    for (const fem::BodyState& body : truth.press.bodies) most = std::max(most, body.wrench.head<2>().norm());
    return most;
  };
  int strongest = -1;
  int sheared = -1;
  int last = -1;
  double most_force = 0.0;
  double most_shear = 0.0;
  for (int k = 0; k < static_cast<int>(truths.size()); ++k) {
    const Truth& truth = truths[static_cast<std::size_t>(k)];
    if (force(truth) > most_force) {
      most_force = force(truth);
      strongest = k;
    }
    if (shear(truth) > most_shear) {
      most_shear = shear(truth);
      sheared = k;
    }
    if (truth.press.contact_vertices > 0) last = k;
  }
  std::vector<int> frames;
  for (const int k : {strongest, sheared, last}) {
    if (k >= 0) frames.push_back(k);
  }
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

std::vector<Truth> play_for_need(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                                 const std::filesystem::path& cache) {
  return play_motion(scene, plan, gel, {}, nullptr, set_up_elastic_objects(scene, plan, cache));
}

}  // namespace touchstone::sim
