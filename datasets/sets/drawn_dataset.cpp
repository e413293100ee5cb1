#include "datasets/sets/drawn_dataset.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "core/seconds_since.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/sets/block_file.h"
#include "datasets/sets/data_card.h"
#include "datasets/sets/drawn_manifest.h"
#include "datasets/sets/run_folder.h"
#include "datasets/sets/run_identity.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kFormatVersion = 1;
constexpr int kMostAttempts = 20;  // draws of one sample

/// A data set's folder, and whose it is.
struct Folder {
  fs::path out;
  RunIdentity identity;
  std::string checksum;  // of the identity: what blocks carry

  fs::path record() const { return out / kUnfinished / "run.json"; }
  fs::path manifest() const { return out / "dataset.json"; }
};

std::string content_checksum(ordered_json manifest) {
  manifest.erase("content_sha256");
  return sha256_of(manifest.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

/// The manifest of a finished set, whole and of this job; nothing if there is none.
std::optional<ordered_json> finished_manifest(const Folder& folder) {
  std::error_code error;
  if (!fs::exists(folder.manifest(), error)) return std::nullopt;
  try {
    ordered_json json = ordered_json::parse(read_whole_file(folder.manifest()));
    if (json.at("format") != kDrawnSetFormat) {
      fail("{}: holds a data set of another kind; give another folder", folder.out.string());
    }
    if (json.at("content_sha256") != content_checksum(json)) {
      fail("{}: was changed; its content doesn't meet its content_sha256", folder.manifest().string());
    }
    const RunIdentity before = run_identity_from_json(json.at("run").dump(), folder.manifest().string());
    const std::string differs = difference(before, folder.identity);
    if (!differs.empty()) {
      fail("{}: holds a finished data set, and since it was made {} has changed; give another folder",
           folder.out.string(), differs);
    }
    return json;
  } catch (const nlohmann::json::exception& error_of) {
    fail("{}: isn't a whole manifest ({})", folder.manifest().string(), error_of.what());
  }
}

/// Is there anything of this job's run? @throws Error if there is something else
bool is_begun(const Folder& folder) {
  std::error_code error;
  if (!fs::exists(folder.out, error)) return false;
  if (!fs::is_directory(folder.out)) fail("{}: isn't a folder", folder.out.string());
  if (fs::exists(folder.record(), error)) {
    const RunIdentity before = run_identity_from_json(read_whole_file(folder.record()), folder.record().string());
    const std::string differs = difference(before, folder.identity);
    if (!differs.empty()) {
      fail(
          "{}: holds an unfinished data set, and since it was begun {} has changed; finish it as it was begun, or "
          "give another folder",
          folder.out.string(), differs);
    }
    return true;
  }
  for (const auto& entry : fs::directory_iterator(folder.out)) {
    if (entry.path().filename() == kUnfinished && entry.is_directory()) continue;  // killed before its first record
    fail("{}: isn't empty ('{}' is in it) and isn't a data set of this job; give another folder", folder.out.string(),
         entry.path().filename().string());
  }
  return false;
}

void begin(const Folder& folder) {
  const auto make = [](const fs::path& path) {
    std::error_code error;
    fs::create_directories(path, error);
    if (error) fail("{}: can't be made ({})", path.string(), error.message());
  };
  make(folder.out / kUnfinished);
  write_whole_file(folder.record(), to_json(folder.identity));  // before all else: it says whose the folder is
  make(folder.out / "blocks");
  is_begun(folder);  // another job's run may have begun here at the same time: the last record counts
}

Folder folder_of(const PreparedDraw& prepared, const fs::path& out) {
  Folder folder;
  folder.out = out;
  folder.identity = identity_of(prepared.text, prepared.inputs);
  folder.checksum = sha256_of(to_json(folder.identity));
  return folder;
}

void refuse_foreign(const Folder& folder, const DrawnBlock& block) {
  fail("{}: is of another job or another run; remove it, or give another folder",
       (folder.out / block_name(block)).string());
}

struct BlockFile {
  std::string name, sha256;
  std::int64_t bytes = 0;
};

ordered_json drawn_json(const std::vector<DrawnNumber>& drawn) {
  ordered_json json = ordered_json::object();
  for (const auto& [path, value] : drawn) json[path] = value;
  return json;
}

std::string manifest_text(const PreparedDraw& prepared, const Folder& folder, const DrawnFigures& figures,
                          const std::vector<BlockFile>& files) {
  const DrawJob& job = prepared.job;
  ordered_json manifest = {{"format", kDrawnSetFormat},
                           {"format_version", kFormatVersion},
                           {"content_sha256", ""},
                           {"program", {{"name", "touchstone"}, {"version", folder.identity.version}}},
                           {"run", ordered_json::parse(to_json(folder.identity))},
                           {"name", job.name},
                           {"licence", job.licence},
                           {"samples", job.samples},
                           {"seed", job.seed}};
  manifest["job"] = {{"file", prepared.file.filename().string()}, {"text", prepared.text}};
  for (const InputFile& input : prepared.inputs) {
    manifest["inputs"].push_back({{"file", input.name}, {"sha256", input.sha256}});
  }
  manifest["splits"]["by"] = job.splits.by == SplitBy::unit ? "unit" : "sample";
  for (int k = 0; k < kDrawnSplits; ++k) {
    manifest["splits"][name_of(static_cast<DrawnSplit>(k))] = figures.splits[static_cast<std::size_t>(k)];
  }
  for (int number = 0; number < job.draw.units.count; ++number) {
    const DrawnUnit unit = drawn_unit(prepared, number);
    ordered_json json = {{"unit", number}, {"seed", unit.seed}, {"drawn", drawn_json(unit.drawn)}};
    if (job.splits.by == SplitBy::unit) json["split"] = name_of(prepared.unit_splits[static_cast<std::size_t>(number)]);
    manifest["units"].push_back(std::move(json));
  }
  for (std::size_t k = 0; k < job.draw.objects.size(); ++k) {
    manifest["objects"].push_back(
        {{"object", k}, {"name", job.draw.objects[k].file.stem().string()}, {"samples", figures.objects[k]}});
  }
  for (const Histogram& one : figures.histograms) {
    manifest["figures"].push_back({{"name", one.name},
                                   {"unit", one.unit},
                                   {"least", one.least},
                                   {"mean", one.mean()},
                                   {"most", one.most},
                                   {"histogram", {{"low", one.low}, {"high", one.high}, {"count", one.count}}}});
  }
  for (std::size_t k = 0; k < files.size(); ++k) {
    ordered_json file = {{"file", files[k].name}, {"bytes", files[k].bytes}, {"sha256", files[k].sha256}};
    if (k < prepared.blocks.size()) {
      const DrawnBlock& block = prepared.blocks[k];
      file["unit"] = block.unit;
      file["first_sample"] = block.first_sample;
      file["samples"] = block.samples;
    }
    manifest["files"].push_back(std::move(file));
  }
  manifest["content_sha256"] = content_checksum(manifest);
  return manifest.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

void verify(const Folder& folder, const ordered_json& manifest) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const ordered_json& file : manifest.at("files")) files.emplace_back(file.at("file"), file.at("sha256"));
  std::vector<char> bad(files.size(), 0);
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t k) {
    const fs::path path = folder.out / files[k].first;
    bad[k] = !fs::is_regular_file(path) || sha256_of_file(path) != files[k].second;
  });
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (bad[k] != 0) {
      fail("{}: is missing or was changed; remove dataset.json and generate again to make it anew",
           (folder.out / files[k].first).string());
    }
  }
}

/// Removes what killed runs left in the finished folder.
void clear_up(const Folder& folder) {
  std::error_code ignored;
  for (const fs::path& place : {folder.out, folder.out / "blocks"}) {
    std::vector<fs::path> left;
    for (const auto& entry : fs::directory_iterator(place, ignored)) {
      if (is_temporary_file(entry.path())) left.push_back(entry.path());
    }
    for (const fs::path& file : left) fs::remove(file, ignored);
  }
  fs::remove_all(folder.out / kUnfinished, ignored);
}

/// Card and manifest of a folder whose blocks are all there.
void merge(const PreparedDraw& prepared, const Folder& folder, const Progress& progress) {
  const auto count = static_cast<std::int64_t>(prepared.blocks.size());
  std::vector<BlockState> states(prepared.blocks.size());
  std::vector<BlockFile> files(prepared.blocks.size());
  std::atomic<std::int64_t> done{0};
  tbb::parallel_for(std::size_t{0}, prepared.blocks.size(), [&](std::size_t k) {
    const std::string name = block_name(prepared.blocks[k]);
    states[k] = state_of_block(folder.out, folder.checksum, prepared.blocks[k]);
    if (states[k] == BlockState::whole) {
      files[k] = {name, sha256_of_file(folder.out / name), static_cast<std::int64_t>(fs::file_size(folder.out / name))};
    }
    if (progress) progress("checking", ++done, count);
  });
  std::vector<std::string> named;
  std::int64_t missing = 0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    if (states[k] == BlockState::foreign) refuse_foreign(folder, prepared.blocks[k]);
    if (states[k] == BlockState::whole) continue;
    constexpr std::size_t kNamed = 3;
    ++missing;
    if (named.size() < kNamed) {
      named.push_back(files[k].name.empty() ? block_name(prepared.blocks[k]) : files[k].name);
      if (states[k] == BlockState::damaged) named.back() += " (damaged)";
    }
  }
  if (missing > 0) {
    fail("{}: {} of {} files are missing ({}{}); `touchstone generate` makes them", folder.out.string(), missing, count,
         fmt::join(named, ", "), missing > static_cast<std::int64_t>(named.size()) ? " ..." : "");
  }
  DrawnFigures figures(prepared);
  for (std::size_t k = 0; k < prepared.blocks.size(); ++k) {
    figures.add(read_block_columns(folder.out, prepared.blocks[k]));
    if (progress) progress("figures", static_cast<std::int64_t>(k) + 1, count);
  }
  const std::string card = data_card(prepared, figures);
  write_whole_file(folder.out / "README.md", card);
  files.push_back({"README.md", sha256_of(card), static_cast<std::int64_t>(card.size())});
  write_whole_file(folder.manifest(), manifest_text(prepared, folder, figures, files));
  clear_up(folder);
}

/// Sample by sample: a touch that can't be pressed is drawn again.
BlockRecord make_record(const PreparedDraw& prepared, const UnitSensor& sensor, std::int64_t sample) {
  for (int attempt = 0;; ++attempt) {
    const DrawnTouch touch = drawn_touch(prepared, sample, attempt);
    const sim::ObjectSpec object = drawn_object(prepared, touch.object, touch.piece);
    try {
      return sensor.press(touch, object);
    } catch (const Unpressable& error) {
      if (attempt + 1 < kMostAttempts) continue;
      fail("sample {}: {} draws in a row couldn't be pressed; the last one: {} of place ({:.3g}, {:.3g}) mm: {}",
           sample, kMostAttempts, object.name, touch.place_mm.x(), touch.place_mm.y(), error.what());
    }
  }
}

/// The first of a shard's blocks, and the one after its last.
std::pair<std::size_t, std::size_t> blocks_of(const Shard& shard, std::size_t all) {
  const auto count = static_cast<std::size_t>(shard.count);
  const auto number = static_cast<std::size_t>(shard.number);
  return {all * (number - 1) / count, all * number / count};
}

}  // namespace

Shard shard_of(const std::string& text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  const auto read = [&](std::size_t from, std::size_t to, int& value) {
    const auto result = std::from_chars(text.data() + from, text.data() + to, value);
    return from < to && result.ec == std::errc() && result.ptr == text.data() + to;
  };
  if (slash == std::string::npos || !read(0, slash, shard.number) || !read(slash + 1, text.size(), shard.count) ||
      shard.count < 1 || shard.number < 1 || shard.number > shard.count) {
    fail("--shard: '{}' isn't a shard; allowed is I/N, the I-th of N parts, I from 1 to N", text);
  }
  return shard;
}

DrawnReport generate_drawn(const fs::path& job_file, const fs::path& out, const DrawnOptions& options,
                           const Progress& progress) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  }
  const PreparedDraw prepared = prepare_draw(job_file);
  const Folder folder = folder_of(prepared, out);
  const Shard& shard = options.shard;
  const auto [first, end] = blocks_of(shard, prepared.blocks.size());
  DrawnReport report;
  for (std::size_t k = first; k < end; ++k) report.samples += prepared.blocks[k].samples;
  if (const auto manifest = finished_manifest(folder)) {
    verify(folder, *manifest);
    clear_up(folder);
    report.was_finished = true;
    return report;
  }
  is_begun(folder);
  begin(folder);
  std::unique_ptr<UnitSensor> sensor;
  std::optional<DrawnUnit> unit;
  std::atomic<std::int64_t> done{0};
  for (std::size_t k = first; k < end; ++k) {
    const DrawnBlock& block = prepared.blocks[k];
    const BlockState state = state_of_block(out, folder.checksum, block);
    if (state == BlockState::foreign) refuse_foreign(folder, block);
    if (state == BlockState::damaged) ++report.damaged_blocks;
    if (state == BlockState::whole) {
      report.kept += block.samples;
      done += block.samples;
      continue;
    }
    auto clock = std::chrono::steady_clock::now();
    if (!unit || unit->number != block.unit) {
      sensor.reset();
      unit = drawn_unit(prepared, block.unit);
      if (progress) progress(fmt::format("unit {}", block.unit), block.unit, prepared.job.draw.units.count);
      sensor = std::make_unique<UnitSensor>(options.source(prepared, *unit));
      report.set_up_s += seconds_since(clock);
      clock = std::chrono::steady_clock::now();
    }
    std::vector<BlockRecord> records(static_cast<std::size_t>(block.samples));
    tbb::parallel_for(std::size_t{0}, records.size(), [&](std::size_t i) {
      records[i] = make_record(prepared, *sensor, block.first_sample + static_cast<std::int64_t>(i));
      const std::int64_t now = ++done;
      if (progress) progress("samples", now, report.samples);
    });
    for (const BlockRecord& record : records) report.drawn_again += record.touch.attempt;
    report.press_s += seconds_since(clock);
    clock = std::chrono::steady_clock::now();
    write_block(out, folder.checksum, prepared, block, *unit, *sensor, records);
    report.write_s += seconds_since(clock);
    report.made += block.samples;
  }
  if (shard.count == 1) merge(prepared, folder, progress);
  return report;
}

DrawnReport merge_drawn(const fs::path& job_file, const fs::path& out, const Progress& progress) {
  const PreparedDraw prepared = prepare_draw(job_file);
  const Folder folder = folder_of(prepared, out);
  DrawnReport report;
  report.samples = prepared.job.samples;
  if (const auto manifest = finished_manifest(folder)) {
    verify(folder, *manifest);
    clear_up(folder);
    report.was_finished = true;
    return report;
  }
  if (!is_begun(folder)) {
    fail("{}: holds nothing of this job; run `touchstone generate {} -o {} --shard I/N` first", out.string(),
         job_file.string(), out.string());
  }
  merge(prepared, folder, progress);
  return report;
}

std::vector<int> missing_shards(const fs::path& job_file, const fs::path& out, int count) {
  if (count < 1) fail("--missing: {} is not allowed; allowed is at least 1", count);
  const PreparedDraw prepared = prepare_draw(job_file);
  const Folder folder = folder_of(prepared, out);
  std::vector<int> missing;
  if (const auto manifest = finished_manifest(folder)) {
    verify(folder, *manifest);
    return missing;
  }
  is_begun(folder);
  std::vector<BlockState> states(prepared.blocks.size());
  tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t k) {
    states[k] = state_of_block(folder.out, folder.checksum, prepared.blocks[k]);
  });
  for (int number = 1; number <= count; ++number) {
    const auto [first, end] = blocks_of({number, count}, states.size());
    bool whole = true;
    for (std::size_t k = first; k < end; ++k) {
      if (states[k] == BlockState::foreign) refuse_foreign(folder, prepared.blocks[k]);
      whole = whole && states[k] == BlockState::whole;
    }
    if (!whole) missing.push_back(number);
  }
  return missing;
}

}  // namespace touchstone::datasets
