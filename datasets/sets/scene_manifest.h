#pragma once
// The manifest of a job with `scenes`: what is in it beside what all manifests have (manifest_parts.h).

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "datasets/jobs/prepared_job.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/truth_file.h"
#include "fem/elements/compliance.h"

namespace touchstone::datasets {

/// Work that was counted: the same in every run of a job.
struct CountedWork {
  std::int64_t pictures = 0;
  std::int64_t pixels_traced = 0;
  std::int64_t paths_traced = 0;
  /// By scene: how its pictures are lit (sim::Capture::light), and how many so; where the plan has direct light.
  std::vector<std::map<std::string, std::int64_t>> light;
};

/// Wall times and what they are for: different in every run.
struct RunTimings {
  std::vector<std::pair<std::string, double>> stages;     ///< name, seconds; in the order of the work
  std::vector<std::pair<std::string, double>> predicted;  ///< the same as they were predicted; none: nothing was
  int threads = 0;
  std::int64_t samples_made = 0;  ///< by the run that finished the set; fewer than all if it went on from another
};

/// The manifest's text. `timings` may be null: then nothing in it differs between runs.
std::string scene_manifest(const PreparedJob& job, const RunIdentity& identity, const fem::ComplianceReport& gel,
                           const std::vector<ArrayShape>& arrays, const std::vector<WrittenFile>& files,
                           const CountedWork& work, const RunTimings* timings);

}  // namespace touchstone::datasets
