#pragma once
// How soft pressed pieces are, from tables of forces over time on disk.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "sensors/skin/softness_model.h"

namespace touchstone::lab {

/// Forces of presses, evenly in time.
struct KnownSoftnessFiles {
  std::vector<sensors::KnownSoftness> presses;
  double rate_Hz = 0.0;             ///< of all of them
  std::vector<std::string> faults;  ///< of presses that are left out, naming their file
};

/// Reads a CSV with the header `forces,softness`: files of forces (datasets::read_force_readings) relative to its
/// folder, and the level of what was pressed. Their rate is the first one's; slower ones are left out, others are
/// brought to it. @param rate_Hz in place of that; 0: not given
/// @throws Error with file and line, or if no press can be used
KnownSoftnessFiles read_softness_table(const std::filesystem::path& csv, double rate_Hz);

/// What came of one table of forces.
struct SoftnessRecord {
  std::filesystem::path file;
  std::string softness;
  double probability = 0.0;
  std::string fault = {};
};
/// Writes `csv`: `file,softness,probability,fault`, a line for each file. @throws Error if no file can be used
std::vector<SoftnessRecord> write_softness(const sensors::SoftnessModel& model,
                                           const std::vector<std::filesystem::path>& files,
                                           const std::filesystem::path& csv, const Progress& progress = {});

}  // namespace touchstone::lab
