#pragma once
// What the manifests of both sources of samples have in common, for those who write them.

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "datasets/jobs/input_files.h"
#include "datasets/sets/manifest.h"

namespace touchstone::datasets {

/// What every manifest begins with.
struct ManifestHead {
  SetSource source = SetSource::scenes;
  std::string name, licence;
  std::uint64_t seed = 0;
  std::int64_t samples = 0;
  std::string job_file;  ///< its name, without folders
  std::string job_text;
  const std::vector<InputFile>* inputs = nullptr;  ///< not null
  std::array<std::int64_t, kSplits> splits{};      ///< samples of each
};

/// The members of `head` and `identity` in their order; those of the source come behind them.
nlohmann::ordered_json manifest_json(const ManifestHead& head, const RunIdentity& identity);

/// An entry of `files`, which a source may add to.
nlohmann::ordered_json file_json(const WrittenFile& file);

/// SHA-256 of a manifest, as JSON without white space, without `content_sha256`, `run` and `timings`, which don't
/// belong to what the set holds. Because a manifest has the checksum of every file, this one stands for the whole set.
std::string content_checksum(nlohmann::ordered_json manifest);

/// The file's text, `content_sha256` filled in.
std::string manifest_text(nlohmann::ordered_json manifest);

}  // namespace touchstone::datasets
