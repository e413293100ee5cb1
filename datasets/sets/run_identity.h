#pragma once

#include <string>
#include <vector>

#include "datasets/jobs/prepared_job.h"

namespace touchstone::datasets {

/// All that a data set's bytes depend on. A run goes on where another one stopped only if all of it is equal.
struct RunIdentity {
  std::string job_sha256;
  std::string inputs_sha256;   ///< over names and checksums of all input files
  std::string version;         ///< of the program
  std::string program_sha256;  ///< of the executable, or Python's module: versions don't change while one is developing
  std::string processor;       ///< its kind (processor.h)
};

/// This program's version, as in CMakeLists.txt.
std::string program_version();
/// "touchstone 0.1.0": what files and the command call it.
std::string program_name();

/// Of a job file's text and all files that it names.
RunIdentity identity_of(const std::string& job_text, const std::vector<InputFile>& inputs);
RunIdentity identity_of(const PreparedJob& job);

/// What differs between two identities ("the job file", "the program's version (0.1.0 before, 0.2.0 now)"), or the
/// empty string. `what` the run is of.
std::string difference(const RunIdentity& before, const RunIdentity& now, const std::string& what = "job");

/// As run_identity_from_json reads it back.
std::string to_json(const RunIdentity& identity);
/// @throws Error naming `name` if the text isn't what to_json wrote
RunIdentity run_identity_from_json(const std::string& text, const std::string& name);

}  // namespace touchstone::datasets
