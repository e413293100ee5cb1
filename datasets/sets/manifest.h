#pragma once
// dataset.json: what a data set holds and how it came to be. See docs/file-formats.md.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "datasets/jobs/prepared_job.h"
#include "datasets/sets/run_identity.h"
#include "datasets/sets/run_journal.h"
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
  std::vector<std::pair<std::string, double>> stages;  ///< name, seconds; in the order of the work
  int threads = 0;
  std::int64_t samples_rendered = 0;  ///< by the run that finished the set; fewer than all if it went on from another
};

/// One array of the truth file.
struct ArrayShape {
  std::string path;
  std::string unit;
  std::string axes;  ///< "samples x 6"
  std::vector<std::int64_t> shape;
};

/// The manifest's text. `timings` may be null: then nothing in it differs between runs. The member `content_sha256` is
/// the SHA-256 of the manifest, as JSON without white space, without `content_sha256` and `timings`; because the
/// manifest holds the checksum of every file, it stands for the whole data set.
std::string manifest_text(const PreparedJob& job, const RunIdentity& identity, const fem::ComplianceReport& gel,
                          const std::vector<ArrayShape>& arrays, const std::vector<WrittenFile>& files,
                          const CountedWork& work, const RunTimings* timings);

/// A scene as its data set describes it.
struct ManifestScene {
  std::string name;
  Split split = Split::train;
  std::int64_t first_sample = 0;
  std::int64_t samples = 0;
  bool has_frames = false;  ///< pictures lie in frames/NAME/
};

/// What programs read back of a manifest.
struct Manifest {
  std::string job_name;
  std::string job_sha256;
  std::string inputs_sha256;
  std::string version;
  std::string content_sha256;
  std::int64_t samples = 0;
  std::vector<ManifestScene> scenes;
  std::vector<WrittenFile> files;
};

/// @throws Error if the folder has no dataset.json, or one that isn't ours, is broken, or whose content_sha256 doesn't
///   meet its content
Manifest read_manifest(const std::filesystem::path& folder);

/// Compares every file of the manifest with its checksum. @throws Error that names the first that differs
void verify_files(const std::filesystem::path& folder, const Manifest& manifest);

/// frames/SCENE/000012.png and the like: `folder` is "frames", "ideal" or "radiance".
std::string picture_name(const std::string& folder, const std::string& scene, std::int64_t frame,
                         const std::string& ending);

}  // namespace touchstone::datasets
