#include "lab/vhs/vhs_experiment.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "datasets/inspection/on_picture.h"

namespace touchstone::lab {
namespace {

constexpr double kNormalStep_N = 0.5;
constexpr double kShearStep_N = 0.3;
constexpr double kNearLevel_N = 0.05;  // how far from 5 N a frame may be to count as one of 5 N

void add_error(AxisErrors& sum, double error) {
  ++sum.frames;
  sum.mean_absolute += std::abs(error);
  sum.rms += error * error;
  sum.largest = std::max(sum.largest, std::abs(error));
}

void divide(AxisErrors& sum) {
  if (sum.frames == 0) return;
  sum.mean_absolute /= static_cast<double>(sum.frames);
  sum.rms = std::sqrt(sum.rms / static_cast<double>(sum.frames));
}

bool has_shear(const Eigen::Vector3d& force) {
  return force.head<2>().cwiseAbs().maxCoeff() >= kShearStep_N / 2;
}

}  // namespace

std::int64_t TrackedSequence::lost() const {
  std::int64_t count = 0;
  for (const sensors::TrackedBeads& frame : beads) {
    count += static_cast<std::int64_t>(frame.positions.size()) - frame.found();
  }
  return count;
}

void require_first(const TrackedSequence& sequence) {
  if (!sequence.without_first) return;
  fail("{}: its first frame, which must show the beads without load, can't be used: {}", sequence.source.name,
       sequence.faults.front());
}

std::vector<TrackedSequence> track(
    const std::vector<datasets::FrameStream>& streams, const sensors::BeadTrackerSettings& settings,
    const Progress& progress,
    const std::function<void(const datasets::SourceFrame& frame, const sensors::TrackedBeads& beads)>& show) {
  const std::int64_t total = datasets::frames_of(streams);
  std::atomic<std::int64_t> done{0};
  std::vector<TrackedSequence> tracked(streams.size());
  std::mutex showing;
  tbb::parallel_for(std::size_t{0}, streams.size(), [&](std::size_t i) {
    TrackedSequence& to = tracked[i];
    to.source.name = streams[i].name;
    sensors::BeadTracker tracker(settings);
    const std::unique_ptr<datasets::FrameSource> source = streams[i].open();
    std::size_t frames = 0;
    for (datasets::SourceFrame frame; source->next(frame); ++frames) {
      std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
        to.beads.push_back(tracker.track({image, frame.label.t_us}));
      });
      if (fault.empty()) {
        to.source.frames.push_back(frame.label);
        if (show) {
          const std::lock_guard<std::mutex> lock(showing);
          show(frame, to.beads.back());
        }
      } else {
        to.without_first = to.without_first || frames == 0;
        to.faults.push_back(std::move(fault));
      }
      const std::int64_t now = ++done;
      if (progress) progress("tracking", now, total);
    }
    datasets::require_a_frame(to.faults, frames);
    if (frames == 0) fail("{}: has no frame", to.source.name);
  });
  return tracked;
}

sensors::ForceSamples training_samples(const std::vector<TrackedSequence>& sequences, int grid) {
  sensors::ForceSamples samples;
  samples.grid = grid;
  samples.rest.assign(static_cast<std::size_t>(grid * grid), Eigen::Vector2d::Zero());
  for (const TrackedSequence& sequence : sequences) {
    require_first(sequence);
    const sensors::TrackedBeads& first = sequence.beads.front();
    if (first.found() != grid * grid) {
      fail("{}: the tracker finds {} of {} beads in the first frame, which must show all of them without load",
           sequence.source.frames.front().file.string(), first.found(), grid * grid);
    }
    for (std::size_t bead = 0; bead < samples.rest.size(); ++bead) {
      samples.rest[bead] += first.positions[bead] / static_cast<double>(sequences.size());
    }
    for (std::size_t i = 0; i < sequence.beads.size(); ++i) {
      const datasets::LabelledFrame& frame = sequence.source.frames[i];
      if (!frame.force) fail("{}: its force isn't known, and training needs it", frame.file.string());
      if (sequence.beads[i].found() != grid * grid) continue;
      samples.positions.push_back(sequence.beads[i].positions);
      samples.forces.push_back(*frame.force);
    }
  }
  return samples;
}

ForceRelations force_relations(const sensors::ForceSamples& samples) {
  const auto count = static_cast<Eigen::Index>(samples.positions.size());
  const int last = samples.grid - 1;
  Eigen::MatrixX4d summed = Eigen::MatrixX4d::Zero(count, 4);  // U_s, and 1
  Eigen::MatrixX3d forces(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& positions = samples.positions[static_cast<std::size_t>(i)];
    for (int row = 0; row < samples.grid; ++row) {
      for (int column = 0; column < samples.grid; ++column) {
        const int squares = (row == 0 || row == last ? 1 : 2) * (column == 0 || column == last ? 1 : 2);
        summed.row(i).head<3>() += squares * (sensors::bead_coordinates(positions, samples.grid, row, column) -
                                              sensors::bead_coordinates(samples.rest, samples.grid, row, column))
                                                 .transpose();
      }
    }
    summed(i, 3) = 1.0;
    forces.row(i) = samples.forces[static_cast<std::size_t>(i)].transpose();
  }
  ForceRelations relations;
  const auto length = static_cast<std::size_t>(count);
  for (int axis = 0; axis < 3; ++axis) {
    relations.axes[static_cast<std::size_t>(axis)] =
        line_through({summed.col(axis).data(), length}, {forces.col(axis).data(), length});
    for (Eigen::Index i = 0; i < count; ++i) {
      relations.points[static_cast<std::size_t>(axis)].emplace_back(summed(i, axis), forces(i, axis));
    }
  }
  const Eigen::VectorXd z = forces.col(2);
  const Eigen::VectorXd left = z - summed * summed.colPivHouseholderQr().solve(z);
  const double spread = (z.array() - z.mean()).square().sum();
  if (spread > 0.0) relations.z_of_all_r2 = 1.0 - left.squaredNorm() / spread;
  return relations;
}

std::vector<ForceRecord> estimate_forces(const std::vector<TrackedSequence>& sequences,
                                         const sensors::StiffnessForceModel& model, RestChoice rest) {
  std::vector<ForceRecord> records;
  for (const TrackedSequence& sequence : sequences) {
    if (rest == RestChoice::first_frame) require_first(sequence);
    const std::vector<Eigen::Vector2d>& reference =
        rest == RestChoice::model ? model.rest : sequence.beads.front().positions;
    for (std::size_t i = 0; i < sequence.beads.size(); ++i) {
      const datasets::LabelledFrame& frame = sequence.source.frames[i];
      records.push_back(
          {sequence.source.name, frame.frame, sensors::estimate(model, sequence.beads[i], reference), frame.force});
    }
  }
  return records;
}

std::array<AxisErrors, 3> force_errors(const std::vector<ForceRecord>& records) {
  std::array<AxisErrors, 3> errors;
  for (const ForceRecord& record : records) {
    if (!record.truth) continue;
    for (int axis = 0; axis < 3; ++axis) add_error(errors[axis], record.estimate.force[axis] - (*record.truth)[axis]);
  }
  for (AxisErrors& axis : errors) divide(axis);
  return errors;
}

Verification verify_forces(const std::vector<ForceRecord>& records) {
  Verification result;
  std::array<std::map<long, LoadLevel>, 3> levels;
  AxisErrors at_5N;
  for (const ForceRecord& record : records) {
    if (!record.truth) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis == 2 && has_shear(*record.truth)) continue;
      const double step = axis == 2 ? kNormalStep_N : kShearStep_N;
      const double truth = (*record.truth)[axis];
      const double estimated = record.estimate.force[axis];
      const long multiple = std::lround(truth / step);
      if (multiple == 0) continue;
      LoadLevel& level = levels[axis][multiple];
      level.load = static_cast<double>(multiple) * step;
      ++level.frames;
      level.mean_true += truth;
      level.mean_estimated += estimated;
      level.mean_absolute_error += std::abs(estimated - truth);
      add_error(result.errors[axis], estimated - truth);
      if (axis == 2 && std::abs(truth - 5.0) < kNearLevel_N) add_error(at_5N, estimated - truth);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    divide(result.errors[axis]);
    for (auto& [multiple, level] : levels[axis]) {
      const auto frames = static_cast<double>(level.frames);
      level.mean_true /= frames;
      level.mean_estimated /= frames;
      level.mean_absolute_error /= frames;
      result.levels[axis].push_back(level);
    }
  }
  divide(at_5N);
  if (at_5N.frames > 0) result.error_at_5N_percent = 100.0 * at_5N.mean_absolute / 5.0;
  return result;
}

}  // namespace touchstone::lab
