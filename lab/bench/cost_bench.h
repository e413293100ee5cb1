#pragma once
// Do scenes take the seconds that were predicted? The scenes of need_bench.h, predicted and then simulated.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lab/bench/need_bench.h"
#include "sim/cost/scene_cost.h"

namespace touchstone::lab {

/// Seconds beside each other.
struct CostPair {
  double predicted_s = 0.0;
  double measured_s = 0.0;

  double ratio() const { return predicted_s / measured_s; }
};

/// One scene, on one thread: by the stages of a data set's run.
struct CostOutcome {
  std::string light;       ///< as predicted
  std::string light_then;  ///< as the camera chose it
  CostPair gel;            ///< its set-up, as if no gel were kept
  CostPair mechanics;
  CostPair camera;
  CostPair frames;              ///< pictures, with their files
  double look_s = 0.0;          ///< that predicting took
  double needs_s = 0.0;         ///< that measuring what effects change took, where an accuracy is stated; not predicted
  std::vector<std::string> on;  ///< effects that the plan has on
  std::string failure;          ///< of a scene that can't be simulated

  CostPair in_all() const;  ///< all of these but looks and needs
};

/// Set-up seconds of gels that were set up already, by key.
using GelSeconds = std::map<std::string, CostPair>;

/// Predicts the scene and simulates it. `with_accuracy`: by need, with the default accuracy; else by fixed shares.
/// `cache` is a folder in which this run's gels are kept: each is predicted, and then set up, once.
CostOutcome run_cost_trial(const NeedTrial& trial, bool with_accuracy, const sim::MachineRates& rates,
                           const std::filesystem::path& cache, GelSeconds& gels);

/// How many of some are within a part of what was predicted.
struct CostSummary {
  int scenes = 0;
  int within = 0;
  double least = 0.0, most = 0.0;  ///< of predicted over measured
};
/// Of a stage, or of all: `part` is one of CostOutcome's. `allowed`: 0.3 for 30 % of what is measured. Scenes that
/// failed aren't counted.
template <typename Part>
CostSummary summarise(const std::vector<CostOutcome>& outcomes, double allowed, const Part& part) {
  CostSummary sum;
  for (const CostOutcome& one : outcomes) {
    if (!one.failure.empty()) continue;
    const double ratio = part(one).ratio();
    sum.least = sum.scenes == 0 ? ratio : std::min(sum.least, ratio);
    sum.most = std::max(sum.most, ratio);
    ++sum.scenes;
    sum.within += std::abs(ratio - 1.0) <= allowed;
  }
  return sum;
}

}  // namespace touchstone::lab
