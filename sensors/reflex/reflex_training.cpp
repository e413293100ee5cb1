#include "sensors/reflex/reflex_training.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "sensors/reflex/left_out.h"
#include "sensors/reflex/motion_counts.h"
#include "sensors/reflex/reflex_loop.h"

namespace touchstone::sensors {
namespace {

/// Sums of squares while recordings go by.
struct Sums {
  ReflexErrors errors;
  double squares_N2 = 0.0, shear_N2 = 0.0;
  int shears = 0;

  void add(const ReflexModel& model, const ReflexRecording& recording) {
    ReflexLoop loop(model, {.stop_above_N = std::numeric_limits<double>::max(), .stop_when_blind = false});
    for (const ReflexSample& sample : recording) {
      const ReflexDecision decision = loop.next(sample.statistics);
      if (decision.fault != ChipFault::none) continue;
      ++errors.samples;
      errors.missed += sample.contact && !decision.force_present ? 1 : 0;
      errors.alarms += !sample.contact && decision.force_present ? 1 : 0;
      squares_N2 += std::pow(decision.force_N - sample.normal_N, 2);
      if (!model.shear || !sample.shear_N || !sample.contact) continue;
      shear_N2 += (decision.shear_N - *sample.shear_N).squaredNorm();
      ++shears;
    }
  }
  ReflexErrors result() {
    if (errors.samples > 0) errors.rms_N = std::sqrt(squares_N2 / errors.samples);
    if (shears > 0) errors.shear_rms_N = std::sqrt(shear_N2 / shears);
    return errors;
  }
};

}  // namespace

TrainedReflex train_reflex(std::span<const ReflexRecording> recordings, const ReflexTraining& training) {
  if (training.shear_every < 1) fail("shear_every is {}, it must be at least 1", training.shear_every);
  TrainedReflex made;
  std::vector<ContactSample> contact;
  std::vector<StatisticsForceSample> force;
  bool shear_is_known = !recordings.empty();
  for (const ReflexRecording& recording : recordings) {
    for (const ReflexSample& sample : recording) {
      if (fault_of(sample.statistics) != ChipFault::none) continue;
      contact.push_back({sample.statistics, sample.contact});
      if (sample.contact) force.push_back({sample.statistics, sample.normal_N});
      shear_is_known = shear_is_known && sample.shear_N.has_value();
    }
  }
  made.samples = static_cast<int>(contact.size());
  made.contacts = static_cast<int>(force.size());
  made.model.tree = train_contact_tree(contact, training.tree);
  made.model.force = fit_statistics_force(force, training.degree);
  if (!shear_is_known) {
    made.no_shear = "not every frame's shear is known";
    return made;
  }
  std::vector<ShearSample> shear;
  for (const ReflexRecording& recording : recordings) {
    const std::vector<ShearSample> more = shear_samples(made.model, recording, training.shear_every);
    shear.insert(shear.end(), more.begin(), more.end());
  }
  try {
    made.model.shear = fit_shear_law(shear);
  } catch (const Error& error) {  // as of a plate that only goes up and down
    made.no_shear = error.what();
  }
  return made;
}

std::vector<ShearSample> shear_samples(const ReflexModel& model, std::span<const ReflexSample> recording, int every) {
  TS_ASSERT(every >= 1);
  MotionCounts counts;
  std::vector<ShearSample> samples;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const ReflexSample& sample = recording[i];
    if (fault_of(sample.statistics) != ChipFault::none) continue;
    const bool present = force_present(model.tree, sample.statistics);
    const Eigen::Vector2d sum = counts.next(sample.statistics, present);
    if (!present || !sample.shear_N || (i + 1) % static_cast<std::size_t>(every) != 0) continue;
    samples.push_back({sum, model.force.force_N(sample.statistics), *sample.shear_N});
  }
  return samples;
}

ReflexErrors test_reflex(const ReflexModel& model, std::span<const ReflexRecording> recordings) {
  Sums sums;
  for (const ReflexRecording& recording : recordings) sums.add(model, recording);
  return sums.result();
}

std::optional<ReflexErrors> cross_validate_reflex(std::span<const ReflexRecording> recordings,
                                                  const ReflexTraining& training) {
  Sums sums;
  const bool done = test_left_out(
      recordings, [&](const std::vector<ReflexRecording>& others) { return train_reflex(others, training).model; },
      [&](const ReflexModel& model, const ReflexRecording& recording) { sums.add(model, recording); });
  return done ? std::optional(sums.result()) : std::nullopt;
}

}  // namespace touchstone::sensors
