// The published figures of the vhs sensor that this program reaches so far: the load cycle on the four squares trains
// the force model (shared/seeds/000, sec. 4.3), the verification of its sec. 4.4 and a cycle at a place that training
// never saw test it. All of it goes the whole way: scene, gel, light, imager, PNG files, tracker, force model.

#include <chrono>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/whole_file.h"
#include "lab/dataset.h"
#include "lab/sample_source.h"
#include "lab/seconds_since.h"
#include "lab/validation.h"
#include "lab/vhs_experiment.h"

namespace touchstone::lab {
namespace {

constexpr double kPublished5N_percent = 2.0;  // table 1
constexpr int kSeeds = 5;                     // sec. 4.4.1: five sets of experiments
constexpr double kStudent95OfFive = 2.776;    // t of 4 degrees of freedom

/// The job with another seed, its scene files named from the root.
std::filesystem::path job_with_seed(const std::filesystem::path& file, std::uint64_t seed,
                                    const std::filesystem::path& scratch) {
  const Job job = read_job(file);
  std::string text = fmt::format("name: {}\nseed: {}\nscenes:\n", job.name, seed);
  for (const JobScene& scene : job.scenes) {
    text += fmt::format("  - {{name: {}, scene: '{}', split: {}", scene.name,
                        std::filesystem::absolute(file.parent_path() / scene.scene).string(), name_of(scene.split));
    if (scene.start_mm) {
      text += fmt::format(", start_mm: [{}, {}, {}]", scene.start_mm->x(), scene.start_mm->y(), scene.start_mm->z());
    }
    text += "}\n";
  }
  const std::filesystem::path out = scratch / fmt::format("vhs-{}.yaml", seed);
  write_whole_file(out, text);
  return out;
}

/// What one data set gives.
struct Trial {
  std::array<double, 3> verified{}, held_out{};  // mean errors over the loads, N
  double at_5N_percent = 0.0;
  double lost = 0.0;  // beads times frames
};

Trial evaluate(const std::filesystem::path& data, const Progress& progress) {
  const sensors::BeadTrackerSettings tracker;
  Trial trial;
  const auto tracked = [&](Split split) {
    std::vector<TrackedSequence> sequences = track(frames_of_data_set(data, split), tracker, progress);
    for (const TrackedSequence& sequence : sequences) trial.lost += static_cast<double>(sequence.lost());
    return sequences;
  };
  const sensors::TrainedModel trained =
      sensors::train(training_samples(tracked(Split::train), tracker.grid), sensors::TrainingSettings::as_published());
  const auto errors = [&](Split split) {
    return verify_forces(estimate_forces(tracked(split), trained.model, RestChoice::model));
  };
  const Verification verified = errors(Split::verify);
  const Verification held_out = errors(Split::test);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    trial.verified[axis] = verified.errors[axis].mean_absolute;
    trial.held_out[axis] = held_out.errors[axis].mean_absolute;
  }
  trial.at_5N_percent = verified.error_at_5N_percent.value_or(std::numeric_limits<double>::quiet_NaN());
  return trial;
}

}  // namespace

std::vector<ValidationRow> validate_vhs(const ValidateOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  const std::filesystem::path job = options.scenes / "jobs" / "vhs-demo.yaml";
  const std::uint64_t first_seed = read_job(job).seed;
  std::vector<Trial> trials;
  std::filesystem::path data;
  GenerateOptions how;
  how.source = simulator(options.cache);
  for (int i = 0; i < (options.quick ? 1 : kSeeds); ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    data = options.scratch / fmt::format("vhs-{}", seed);
    generate(job_with_seed(job, seed, options.scratch), data, how, options.progress);
    trials.push_back(evaluate(data, options.progress));
  }
  const double seconds = seconds_since(begun);

  std::vector<ValidationRow> rows;
  const auto add = [&](const std::string& id, const std::string& title, const std::string& unit, double bound,
                       bool published, auto figure) {
    ValidationRow row;
    row.id = id;
    row.title = title;
    row.unit = unit;
    row.quick = options.quick;
    (published ? row.published : row.reference) = bound;
    double sum = 0.0;
    for (const Trial& trial : trials) sum += figure(trial);
    row.ours = sum / static_cast<double>(trials.size());
    if (trials.size() == kSeeds) {
      double squares = 0.0;
      for (const Trial& trial : trials) squares += std::pow(figure(trial) - row.ours, 2);
      const double half = kStudent95OfFive * std::sqrt(squares / (kSeeds - 1) / kSeeds);
      row.ci95 = {row.ours - half, row.ours + half};
    }
    row.holds = row.ours <= bound;
    row.seconds = seconds;
    rows.push_back(row);
  };
  const std::string axes = "xyz";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    add(fmt::format("vhs.force.error_{}_N", axes[axis]),
        fmt::format("mean error of the {} force in the verification of sec. 4.4", axes[axis]), "N",
        kPublishedForceError_N, true, [axis](const Trial& trial) { return trial.verified[axis]; });
  }
  add("vhs.force.error_5N_percent", "mean error of 5 N normal force, table 1", "%", kPublished5N_percent, true,
      [](const Trial& trial) { return trial.at_5N_percent; });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    add(fmt::format("vhs.force.held_out_{}_N", axes[axis]),
        fmt::format("mean error of the {} force in a load cycle where none was trained", axes[axis]), "N",
        kPublishedForceError_N, true, [axis](const Trial& trial) { return trial.held_out[axis]; });
  }
  add("vhs.track.lost_beads", "beads not found, summed over all frames of all cycles", "1", 0.0, false,
      [](const Trial& trial) { return trial.lost; });

  return rows;
}

}  // namespace touchstone::lab
