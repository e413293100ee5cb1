#include "datasets/sets/manifest.h"

#include <tbb/parallel_for.h>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/sets/manifest_parts.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kFormat = "touchstone-dataset";
constexpr int kFormatVersion = 2;  // 1: before sets of scenes and drawn sets had one form

const char* name_of(SetSource source) {
  return source == SetSource::scenes ? "scenes" : "draw";
}

void read_blocks(const fs::path& file, const ordered_json& json, Manifest& manifest) {
  std::int64_t next = 0;
  for (const ordered_json& one : json.at("files")) {
    if (!one.contains("first_sample")) continue;  // the card
    ManifestBlock block{one.at("file"), one.at("unit"), one.at("first_sample"), one.at("samples")};
    if (block.first_sample != next) fail("{}: sample {} is in no file", file.string(), next);
    next += block.samples;
    manifest.blocks.push_back(std::move(block));
  }
  if (next != manifest.samples) fail("{}: its files hold {} of {} samples", file.string(), next, manifest.samples);
}

}  // namespace

ordered_json manifest_json(const ManifestHead& head, const RunIdentity& identity) {
  ordered_json manifest = {{"format", kFormat},
                           {"format_version", kFormatVersion},
                           {"content_sha256", ""},
                           {"source", name_of(head.source)},
                           {"program", {{"name", "touchstone"}, {"version", identity.version}}},
                           {"run", ordered_json::parse(to_json(identity))},
                           {"name", head.name},
                           {"licence", head.licence},
                           {"samples", head.samples},
                           {"seed", head.seed}};
  manifest["job"] = {{"file", head.job_file}, {"text", head.job_text}};
  for (const InputFile& input : *head.inputs) {
    manifest["inputs"].push_back({{"file", input.name}, {"sha256", input.sha256}});
  }
  for (int k = 0; k < kSplits; ++k) {
    manifest["splits"][name_of(static_cast<Split>(k))] = head.splits[static_cast<std::size_t>(k)];
  }
  return manifest;
}

ordered_json file_json(const WrittenFile& file) {
  return {{"file", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}};
}

std::string content_checksum(ordered_json manifest) {
  for (const char* beside : {"content_sha256", "run", "timings"}) manifest.erase(beside);
  return sha256_of(manifest.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

std::string manifest_text(ordered_json manifest) {
  manifest["content_sha256"] = content_checksum(manifest);
  return manifest.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string picture_name(const std::string& folder, const std::string& scene, std::int64_t frame,
                         const std::string& ending) {
  return fmt::format("{}/{}/{:06}.{}", folder, scene, frame, ending);
}

Manifest read_manifest(const fs::path& folder) {
  const fs::path file = folder / "dataset.json";
  if (!fs::is_regular_file(file)) {
    fail("{}: isn't a data set; it has no dataset.json, which is written last (touchstone generate, merge)",
         folder.string());
  }
  try {
    const ordered_json json = ordered_json::parse(read_whole_file(file));
    const std::string format = json.at("format");
    if (format != kFormat) {
      fail("{}: format: '{}' isn't a data set's; allowed is '{}'", file.string(), format, kFormat);
    }
    if (json.at("format_version") != kFormatVersion) {
      fail("{}: has format version {}; this program reads {}", file.string(), json.at("format_version").dump(),
           kFormatVersion);
    }
    Manifest manifest;
    manifest.content_sha256 = json.at("content_sha256");
    if (manifest.content_sha256 != content_checksum(json)) {
      fail("{}: was changed; its content doesn't meet its content_sha256", file.string());
    }
    const std::string source = json.at("source");
    if (source != "scenes" && source != "draw") {
      fail("{}: source: '{}' is not known; allowed are scenes and draw", file.string(), source);
    }
    manifest.source = source == "scenes" ? SetSource::scenes : SetSource::draw;
    manifest.name = json.at("name");
    manifest.licence = json.at("licence");
    manifest.run = run_identity_from_json(json.at("run").dump(), file.string());
    manifest.samples = json.at("samples");
    if (manifest.source == SetSource::scenes) {
      for (const ordered_json& scene : json.at("scenes")) {
        manifest.scenes.push_back({scene.at("name"), split_named(scene.at("split")), scene.at("first_sample"),
                                   scene.at("samples"), scene.at("outputs").at("frames")});
      }
    } else {
      manifest.units = static_cast<int>(json.at("units").size());
      read_blocks(file, json, manifest);
    }
    for (const ordered_json& entry : json.at("files")) {
      manifest.files.push_back({entry.at("file"), entry.at("sha256"), entry.at("bytes")});
    }
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    fail("{}: isn't a whole manifest ({})", file.string(), error.what());
  }
}

Manifest read_manifest(const fs::path& folder, SetSource wanted) {
  Manifest manifest = read_manifest(folder);
  if (manifest.source != wanted) {
    fail("{}: source: is '{}'; allowed is '{}': {}", (folder / "dataset.json").string(), name_of(manifest.source),
         name_of(wanted),
         wanted == SetSource::scenes ? "frames in the order of time are needed" : "presses that were drawn are needed");
  }
  return manifest;
}

void verify_files(const fs::path& folder, const Manifest& manifest) {
  std::vector<char> bad(manifest.files.size(), 0);
  tbb::parallel_for(std::size_t{0}, manifest.files.size(), [&](std::size_t i) {
    const fs::path file = folder / manifest.files[i].name;
    bad[i] = !fs::is_regular_file(file) || sha256_of_file(file) != manifest.files[i].sha256;
  });
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (bad[i] == 0) continue;
    const fs::path file = folder / manifest.files[i].name;
    if (!fs::exists(file)) fail("{}: is missing; dataset.json lists it", file.string());
    fail(
        "{}: was changed; it doesn't meet its checksum in dataset.json; remove dataset.json and generate again to "
        "make it anew",
        file.string());
  }
}

}  // namespace touchstone::datasets
