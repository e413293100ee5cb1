#pragma once
// Reflex mode learned from records of a chip whose forces are known [Knoop2013, sec. III.D].

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sensors/reflex/reflex_model.h"

namespace touchstone::sensors {

/// A frame's statistics at a known force.
struct ReflexSample {
  ChipStatistics statistics;
  bool contact = false;
  double normal_N = 0.0;
  std::optional<Eigen::Vector2d> shear_N = {};  ///< where it's known
};

/// Frames of a chip, each one after the other: its motion adds up.
using ReflexRecording = std::vector<ReflexSample>;

/// How it is learned.
struct ReflexTraining {
  int degree = 1;  ///< of the normal force
  ContactTreeSettings tree;
  int shear_every = 10;  ///< of a recording's frames one in so many is taken for shear: neighbours say the same
};

/// A model, and what it was learned from.
struct TrainedReflex {
  ReflexModel model;
  int samples = 0;       ///< frames without fault (reflex_loop.h)
  int contacts = 0;      ///< of them, in contact
  std::string no_shear;  ///< why there is no law for shear; empty if there is one
};

/// Frames with a fault are passed over. There is a law for shear if all frames say theirs and they determine it.
/// @throws Error as train_contact_tree and fit_statistics_force
TrainedReflex train_reflex(std::span<const ReflexRecording> recordings, const ReflexTraining& training = {});

/// What a shear law is fitted to: the sums of a recording's counts in frames where the model says that there is a
/// force, each `every`-th frame. Frames without a known shear count as motion alone.
std::vector<ShearSample> shear_samples(const ReflexModel& model, std::span<const ReflexSample> recording, int every);

/// What a model errs by.
struct ReflexErrors {
  int samples = 0;                         ///< frames without fault
  int missed = 0;                          ///< in contact, and the model says that there is no force
  int alarms = 0;                          ///< the other way round
  double rms_N = 0.0;                      ///< of the normal force, over all of them
  std::optional<double> shear_rms_N = {};  ///< sqrt(mean of the error's square length); none without law or truth

  double wrong_percent() const { return samples > 0 ? 100.0 * (missed + alarms) / samples : 0.0; }
};
/// Shows each recording to a loop of its own.
ReflexErrors test_reflex(const ReflexModel& model, std::span<const ReflexRecording> recordings);

/// The same of each recording by a model of the others. Nothing for fewer than two recordings, or where the others of
/// one don't determine a model.
std::optional<ReflexErrors> cross_validate_reflex(std::span<const ReflexRecording> recordings,
                                                  const ReflexTraining& training = {});

}  // namespace touchstone::sensors
