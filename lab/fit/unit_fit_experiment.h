#pragma once
// Does a fit find what it is held against? Units with hidden numbers are simulated and recorded, then fitted.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>

#include "lab/fit/unit_fit.h"

namespace touchstone::lab {

/// What the validation fits: balls of 4 to 8 mm pressed 0.3 to 0.5 mm deep at six places of a gelsight with a flat gel,
/// with forces read to 3 mN. `scenes` is the folder scenes/. @throws Error if files aren't there
UnitFitSpec flat_gelsight_fit(const std::filesystem::path& scenes, int coarse_px);

/// Adds an unknown.
void add_unknown(UnitFitSpec& spec, const std::string& path, UnknownHow how, double low, double high,
                 bool together = false);

/// A unit that was recorded: a fit whose labels are what was read on it, and its pictures.
struct RecordedUnit {
  PreparedFit fit;
  UnitRecording recording;
};

/// Simulates and records the device that `fit` has at `hidden` (an entry an unknown: a logarithm or what is added), in
/// whole pixels, all lamps at once, with the imager's noise and fixed pattern and with other seeds of light than the
/// fit takes. The labels in `fit` are what is true; on the recording's they have errors of their standard deviations,
/// and forces are those of the simulation. Presses without a force get none. `backgrounds`: exposures of the untouched
/// sensor. @throws Error as sim::VirtualSensor
RecordedUnit record_unit(const PreparedFit& fit, const Eigen::VectorXd& hidden, int backgrounds, std::uint64_t seed,
                         const std::filesystem::path& cache_folder);

/// Numbers drawn evenly from the middle part of all unknowns' allowed ranges. `part`: from 0 to 1.
Eigen::VectorXd hidden_unknowns(const PreparedFit& fit, double part, std::uint64_t seed);

/// The value of an unknown's first number.
double hidden_value(const PreparedFit& fit, const Eigen::VectorXd& hidden, std::size_t unknown);

}  // namespace touchstone::lab
