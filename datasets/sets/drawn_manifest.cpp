#include "datasets/sets/drawn_manifest.h"

#include <tbb/parallel_for.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::datasets {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

DrawnManifest read_drawn_manifest(const fs::path& folder) {
  const fs::path file = folder / "dataset.json";
  if (std::error_code error; !fs::exists(file, error)) {
    fail("{}: isn't there; a data set has this file once it is finished (touchstone generate, merge)", file.string());
  }
  DrawnManifest manifest;
  try {
    ordered_json json = ordered_json::parse(read_whole_file(file));
    if (json.at("format") != kDrawnSetFormat) {
      fail("{}: format: '{}' isn't a set of a job that draws; allowed is '{}'", file.string(),
           json.at("format").get<std::string>(), kDrawnSetFormat);
    }
    manifest.content_sha256 = json.at("content_sha256");
    manifest.name = json.at("name");
    manifest.licence = json.at("licence");
    manifest.samples = json.at("samples");
    manifest.units = static_cast<int>(json.at("units").size());
    std::int64_t next = 0;
    for (const ordered_json& one : json.at("files")) {
      if (!one.contains("first_sample")) continue;  // the card
      ManifestBlock block{one.at("file"), one.at("sha256"), one.at("unit"), one.at("first_sample"), one.at("samples")};
      if (block.first_sample != next) fail("{}: sample {} is in no file", file.string(), next);
      next += block.samples;
      manifest.blocks.push_back(std::move(block));
    }
    if (next != manifest.samples) fail("{}: its files hold {} of {} samples", file.string(), next, manifest.samples);
    json.erase("content_sha256");
    if (sha256_of(json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)) != manifest.content_sha256) {
      fail("{}: was changed; its content doesn't meet its content_sha256", file.string());
    }
  } catch (const nlohmann::json::exception& error) {
    fail("{}: isn't the manifest of a data set ({})", file.string(), error.what());
  }
  return manifest;
}

void check_blocks(const fs::path& folder, const DrawnManifest& manifest) {
  std::vector<char> bad(manifest.blocks.size(), 0);
  tbb::parallel_for(std::size_t{0}, bad.size(), [&](std::size_t k) {
    const fs::path path = folder / manifest.blocks[k].name;
    bad[k] = !fs::is_regular_file(path) || sha256_of_file(path) != manifest.blocks[k].sha256;
  });
  for (std::size_t k = 0; k < bad.size(); ++k) {
    if (bad[k] != 0) fail("{}: is missing or was changed", (folder / manifest.blocks[k].name).string());
  }
}

}  // namespace touchstone::datasets
