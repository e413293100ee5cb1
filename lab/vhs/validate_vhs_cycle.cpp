// The vhs sensor trained as its paper did, on some 10,000 samples [VisioHaptic2024, sec. 4.3]: what so many frames
// cost, and what they are good for. In full only: it takes three quarters of a core's hour.

#include <chrono>
#include <ctime>

#include "core/seconds_since.h"
#include "datasets/sets/generate.h"
#include "datasets/sets/sample_source.h"
#include "lab/validation/row_list.h"
#include "lab/vhs/vhs_experiment.h"

namespace touchstone::lab {
namespace {

constexpr double kAllowedMinutes = 30.0;  // issue 9 of this project, on four cores
constexpr double kCores = 4.0;

}  // namespace

std::vector<ValidationRow> validate_vhs_cycle(const ValidateOptions& options) {
  if (options.quick) return {};
  RowList rows("vhs.cycle.", options, RowList::Since::begin);
  const std::filesystem::path data = options.scratch / "vhs-load-cycle";
  datasets::GenerateOptions how = datasets::simulated(options.cache);
  const auto begun = std::chrono::steady_clock::now();
  const std::clock_t processor_begun = std::clock();
  const datasets::GenerateReport report =
      datasets::generate(options.scenes / "jobs" / "vhs-load-cycle.yaml", data, how, options.progress);
  const double minutes = seconds_since(begun) / 60.0;
  const double processor_s = static_cast<double>(std::clock() - processor_begun) / CLOCKS_PER_SEC;
  if (report.made == report.samples) {  // not the rest of a run that was broken off
    rows.add_bounded(
        "processor_s_a_frame",
        fmt::format("processor time of each of {} frames with their mechanics, in all {:.0f} minutes here; "
                    "bound: {:.0f} minutes on {:.0f} cores",
                    report.samples, minutes, kAllowedMinutes, kCores),
        "s", Better::lower, 60.0 * kAllowedMinutes * kCores / static_cast<double>(report.samples), false,
        processor_s / static_cast<double>(report.samples));
  }
  const sensors::BeadTrackerSettings tracker;
  double lost = 0.0;
  const auto tracked = [&](datasets::Split split) {
    std::vector<TrackedSequence> sequences =
        track(datasets::picture_streams(datasets::frames_of_data_set(data, split)), tracker, options.progress);
    for (const TrackedSequence& sequence : sequences) lost += static_cast<double>(sequence.lost());
    return sequences;
  };
  const sensors::ForceSamples samples = training_samples(tracked(datasets::Split::train), tracker.grid);
  const std::vector<TrackedSequence> verification = tracked(datasets::Split::validate),
                                     elsewhere = tracked(datasets::Split::test);
  const std::string axes = "xyz";
  const auto add = [&](const std::string& name, const std::string& how_trained,
                       const sensors::TrainingSettings& settings) {
    const sensors::TrainedModel trained = sensors::train(samples, settings);
    const auto add_errors = [&](const std::string& id, const std::vector<TrackedSequence>& of, const char* what) {
      const Verification found = verify_forces(estimate_forces(of, trained.model, RestChoice::model));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        rows.add_bounded(fmt::format("{}{}_{}_N", name, id, axes[axis]),
                         fmt::format("mean error of the {} force {}, trained on {} samples {}", axes[axis], what,
                                     samples.forces.size(), how_trained),
                         "N", Better::lower, kPublishedForceError_N, true, found.errors[axis].mean_absolute);
      }
    };
    add_errors("error", verification, "in the verification of sec. 4.4");
    add_errors("held_out", elsewhere, "in a load cycle at a place where none was trained");
  };
  add("", "by the paper's rule", sensors::TrainingSettings::as_published());
  add("converged.", "to convergence", sensors::TrainingSettings::to_convergence());
  rows.add_bounded("lost_beads", "beads not found, summed over all frames", "1", Better::lower, 0.0, false, lost);
  return rows.rows();
}

}  // namespace touchstone::lab
