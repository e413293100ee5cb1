#pragma once
// dataset.json: what a data set holds and how it came to be; of both sources of samples. See docs/file-formats.md.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "datasets/jobs/split.h"
#include "datasets/sets/run_identity.h"
#include "datasets/sets/run_journal.h"

namespace touchstone::datasets {

/// Where a set's samples come from: the frames of scenes, or presses that are drawn at random.
enum class SetSource : std::uint8_t { scenes, draw };

/// A scene as its data set describes it.
struct ManifestScene {
  std::string name;
  Split split = Split::train;
  std::int64_t first_sample = 0;
  std::int64_t samples = 0;
  bool has_frames = false;  ///< pictures lie in a folder of its name within frames/
};

/// One of a drawn set's blocks: samples first_sample to first_sample + samples - 1, all of one unit.
struct ManifestBlock {
  std::string name;  ///< blocks/000012.h5
  int unit = 0;
  std::int64_t first_sample = 0, samples = 0;
};

/// What programs read back of a manifest.
struct Manifest {
  SetSource source = SetSource::scenes;
  std::string name;     ///< the job's
  std::string licence;  ///< empty: none stated
  std::string content_sha256;
  RunIdentity run;
  std::int64_t samples = 0;
  std::vector<ManifestScene> scenes;  ///< of a set of scenes
  int units = 0;                      ///< of a drawn set
  std::vector<ManifestBlock> blocks;  ///< likewise: by first_sample, without gaps
  std::vector<WrittenFile> files;     ///< all of the set's files, but dataset.json
};

/// @throws Error if the folder has no dataset.json, or one that isn't ours, is broken, or whose content_sha256 doesn't
///   meet its content
Manifest read_manifest(const std::filesystem::path& folder);
/// Likewise, and if the set is of the other source.
Manifest read_manifest(const std::filesystem::path& folder, SetSource wanted);

/// Compares every file of the manifest with its checksum, by many threads. @throws Error that names the first that
/// differs
void verify_files(const std::filesystem::path& folder, const Manifest& manifest);

/// `frames/SCENE/000012.png` and the like: `folder` is "frames", "ideal" or "radiance".
std::string picture_name(const std::string& folder, const std::string& scene, std::int64_t frame,
                         const std::string& ending);

}  // namespace touchstone::datasets
