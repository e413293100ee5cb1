#pragma once
// What a finished drawn data set's dataset.json says, for those who read the set (docs/datasets.md).

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::datasets {

/// What dataset.json's `format` is.
inline constexpr const char* kDrawnSetFormat = "touchstone-drawn-dataset";

/// One of a set's blocks: samples first_sample to first_sample + samples - 1, all of one unit.
struct ManifestBlock {
  std::string name;  ///< blocks/000012.h5
  std::string sha256;
  int unit = 0;
  std::int64_t first_sample = 0, samples = 0;
};

/// Of a finished set: what it is called, and which file holds which sample.
struct DrawnManifest {
  std::string name, licence, content_sha256;
  std::int64_t samples = 0;
  int units = 0;
  std::vector<ManifestBlock> blocks;  ///< by first_sample, without gaps
};

/// @throws Error that names the file if the folder holds no finished drawn set, or its manifest was changed
DrawnManifest read_drawn_manifest(const std::filesystem::path& folder);

/// Compares blocks with their checksums, by many threads. @throws Error that names the first that differs
void check_blocks(const std::filesystem::path& folder, const DrawnManifest& manifest);

}  // namespace touchstone::datasets
