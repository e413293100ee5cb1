// The grasps of [Li2015, sec. 4.5, fig. 4-9]: egg, chip and leaf are lifted with the grasp rule, led by camera frames.
// The thesis shows one grasp of each, and all are held; here each is tried over a range of frictions, weights, places
// and turns, with other noise each time. The rule's steps and the arm's speed were chosen on one grasp of each object
// with a friction of 0.6 in the middle of the gel, none of the full form's trials; how long slip is forgotten after it
// was given (GraspSenseSettings) was chosen on its second one.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/seconds_since.h"
#include "lab/gelsight/gelsight_grasp_experiment.h"
#include "lab/gelsight/gelsight_grasp_senses.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr std::uint64_t kSeed = 4501;
constexpr double kMembrane_um = 80.0;  // a vein of half a millimetre is six of these wide
constexpr int kEdgeSide = 2;
constexpr double kWidest_mm = 0.8;  // what the light has to hold: an egg's weight shears the gel by some 0.4 mm

struct Trials {
  std::vector<GraspTrial> trials;
  std::vector<GraspOutcome> outcomes;

  int held(const std::string& object = "") const {
    int count = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      count += (object.empty() || trials[i].object.name == object) && outcomes[i].held;
    }
    return count;
  }
  int tried(const std::string& object) const {
    return static_cast<int>(
        std::count_if(trials.begin(), trials.end(), [&](const auto& one) { return one.object.name == object; }));
  }
  /// The hardest that one was pressed, N.
  double peak(const std::string& object) const {
    double most = 0.0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      if (trials[i].object.name == object) most = std::max(most, outcomes[i].peak_force_N);
    }
    return most;
  }
  /// "; not held: egg of friction 0.3, 58 g: dropped"
  std::string failures() const {
    std::string text;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      if (outcomes[i].held) continue;
      const sim::ObjectSpec& object = trials[i].object;
      text += fmt::format("{} {} of friction {:g}, {:.3g} g, at ({:g}, {:g}) mm, {:g} degrees: {}",
                          text.empty() ? "; not held:" : ",", object.name, object.friction, *object.mass_g,
                          trials[i].place_mm.x(), trials[i].place_mm.y(), trials[i].turn_deg, outcomes[i].failure);
    }
    return text;
  }
};

/// The thesis names no friction; its own force ratios go from 0.04 to 2.21.
std::vector<GraspTrial> trials_of(const std::vector<sim::ObjectSpec>& objects, bool quick) {
  struct Grasp {
    Eigen::Vector2d place_mm;
    double turn_deg;
    double weight;  // of the object's own
  };
  const std::vector<double> frictions = quick ? std::vector<double>{0.6} : std::vector<double>{0.5, 1.0};
  const std::vector<Grasp> grasps = quick ? std::vector<Grasp>{{{0.5, 0.0}, 0.0, 1.0}}
                                          : std::vector<Grasp>{{{0.0, 0.0}, 0.0, 1.0}, {{1.0, -1.5}, 20.0, 1.2}};
  std::vector<GraspTrial> trials;
  for (const sim::ObjectSpec& object : objects) {
    for (const double friction : frictions) {
      for (const Grasp& grasp : grasps) {
        GraspTrial trial;
        trial.object = object;
        trial.object.friction = friction;
        trial.object.mass_g = grasp.weight * *object.mass_g;
        trial.place_mm = grasp.place_mm;
        trial.turn_deg = grasp.turn_deg;
        trial.noise_seed = kSeed + trials.size();
        trials.push_back(std::move(trial));
      }
    }
  }
  return trials;
}

/// Plays the trials. `known`, if given, are outcomes of the same trials with at least as much answered to slip: where
/// nothing was answered then, the same frames lead to the same end, and it isn't played again.
Trials run(const sim::VirtualSensor& sensor, const sensors::TouchCalibration& calibration,
           const std::vector<GraspTrial>& trials, const GraspLoopSettings& loop, const GraspSenseSettings& senses,
           const Trials* known = nullptr) {
  Trials result{trials, known != nullptr ? known->outcomes : std::vector<GraspOutcome>(trials.size())};
  tbb::parallel_for(std::size_t{0}, trials.size(), [&](std::size_t i) {
    if (known != nullptr && known->outcomes[i].slip_reactions == 0) return;
    result.outcomes[i] = run_grasp_trial(sensor, trials[i], loop, grasp_senses(calibration, senses));
  });
  return result;
}

}  // namespace

std::vector<ValidationRow> validate_gelsight_grasp(const ValidateOptions& options) {
  auto begun = std::chrono::steady_clock::now();
  sim::VirtualSensorSettings light;
  light.widest_mm = kWidest_mm;
  light.membrane_um = kMembrane_um;
  light.edge_side = kEdgeSide;
  const auto sensor_of = [&](const char* device) {
    return sim::VirtualSensor(sim::read_device(options.scenes / "devices" / device), options.cache, light);
  };
  const sim::VirtualSensor sensor = sensor_of("gelsight-markers.yaml");
  const sensors::TouchCalibration calibration = calibrate_for_grasps(sensor_of("gelsight-flat.yaml"), sensor, kSeed);
  std::vector<sim::ObjectSpec> objects;
  for (const char* name : {"egg.yaml", "chip.yaml", "leaf.yaml"}) {
    objects.push_back(sim::read_object(options.scenes / "objects" / name));
  }
  const std::vector<GraspTrial> trials = trials_of(objects, options.quick);
  const GraspLoopSettings loop;
  GraspLoopSettings blind = loop;
  blind.rule.react_to_slip = false;

  std::vector<ValidationRow> rows;
  const auto add = [&](const std::string& id, const std::string& title, const std::string& unit) -> ValidationRow& {
    ValidationRow row;
    row.id = id;
    row.title = title;
    row.unit = unit;
    row.quick = options.quick;
    row.seconds = seconds_since(begun);
    rows.push_back(row);
    return rows.back();
  };
  const auto add_count = [&](const std::string& id, const std::string& title, int count, int of, bool published) {
    ValidationRow& row = add(id, title, fmt::format("of {}", of));
    (published ? row.published : row.reference) = of;
    row.ours = count;
    row.better = Better::higher;
    row.holds = count == of;
  };

  const Trials ruled = run(sensor, calibration, trials, loop, {});
  const int all = static_cast<int>(trials.size());
  add_count("gelsight.grasp.held_of_trials",
            "egg, chip and leaf lifted by the rule, held for a second without sliding, not crushed" + ruled.failures(),
            ruled.held(), all, true);
  for (const sim::ObjectSpec& object : objects) {
    add_count(fmt::format("gelsight.grasp.{}_held_of_trials", object.name), fmt::format("of these, {}", object.name),
              ruled.held(object.name), ruled.tried(object.name), true);
    ValidationRow& row =
        add(fmt::format("gelsight.grasp.{}_peak_N", object.name),
            fmt::format("{}: hardest press of a finger, against the force that breaks it", object.name), "N");
    row.reference = *object.crush_force_N;
    row.ours = ruled.peak(object.name);
    row.better = Better::lower;
    row.holds = row.ours < *object.crush_force_N;
  }

  const auto add_control = [&](const std::string& id, const std::string& title, const GraspLoopSettings& how,
                               const GraspSenseSettings& senses) {
    begun = std::chrono::steady_clock::now();
    const Trials control = run(sensor, calibration, trials, how, senses, &ruled);
    ValidationRow& row = add(id, title + control.failures(), fmt::format("of {}", all));
    row.reference = ruled.held();
    row.ours = control.held();
    row.better = Better::lower;
    row.holds = control.held() < ruled.held();
  };
  add_control("gelsight.grasp.blind_held_of_trials",
              "the same trials without the rule's answer to slip: fewer should be held", blind, {});
  if (!options.quick) {
    GraspSenseSettings ratios;
    ratios.rim = false;
    add_control("gelsight.grasp.ratios_held_of_trials",
                "the same trials with slip by the thesis's two ratios alone, above 1 and 0.5", loop, ratios);
  }
  return rows;
}

}  // namespace touchstone::lab
