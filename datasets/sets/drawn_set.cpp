#include "datasets/sets/drawn_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>

#include "core/error.h"
#include "core/seconds_since.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/sets/block_file.h"
#include "datasets/sets/data_card.h"
#include "datasets/sets/drawn_needs.h"
#include "datasets/sets/job_cost.h"
#include "datasets/sets/manifest_parts.h"
#include "datasets/sets/planned_draw.h"
#include "datasets/sets/run_folder.h"
#include "datasets/sets/run_identity.h"
#include "sim/plan/size_doubt.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kMostAttempts = 20;  // draws of one sample

/// A data set's folder, and whose it is.
struct Folder {
  fs::path out;
  RunIdentity identity;
  std::string checksum;  // of the identity: what blocks carry
};

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

ordered_json drawn_json(const std::vector<DrawnNumber>& drawn) {
  ordered_json json = ordered_json::object();
  for (const auto& [path, value] : drawn) json[path] = value;
  return json;
}

std::string text_of_manifest(const PreparedDraw& prepared, const Folder& folder, const DrawnFigures& figures,
                             const std::vector<WrittenFile>& files) {
  const DrawJob& job = prepared.job;
  ManifestHead head;
  head.source = SetSource::draw;
  head.name = job.name;
  head.licence = job.licence;
  head.seed = job.seed;
  head.samples = job.samples;
  head.job_file = prepared.file.filename().string();
  head.job_text = prepared.text;
  head.inputs = &prepared.inputs;
  head.splits = figures.splits;
  ordered_json manifest = manifest_json(head, folder.identity);
  manifest["splits"]["by"] = job.splits.by == SplitBy::unit ? "unit" : "sample";
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
    ordered_json file = file_json(files[k]);
    if (k < prepared.blocks.size()) {
      const DrawnBlock& block = prepared.blocks[k];
      file["unit"] = block.unit;
      file["first_sample"] = block.first_sample;
      file["samples"] = block.samples;
    }
    manifest["files"].push_back(std::move(file));
  }
  return manifest_text(std::move(manifest));
}

/// Is the set whole already? Then its checksums are verified.
bool is_finished(const Folder& folder) {
  if (state_of_folder(folder.out, folder.identity) != FolderState::finished) return false;
  verify_files(folder.out, read_manifest(folder.out));
  if (fs::exists(folder.out / kUnfinished)) finish_folder(folder.out);  // killed between its last file and clearing up
  return true;
}

/// Card and manifest of a folder whose blocks are all there.
void merge(const PreparedDraw& prepared, const Folder& folder, const Progress& progress) {
  const auto count = static_cast<std::int64_t>(prepared.blocks.size());
  std::vector<BlockState> states(prepared.blocks.size());
  std::vector<WrittenFile> files(prepared.blocks.size());
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
  write_manifest(folder.out, text_of_manifest(prepared, folder, figures, files), files);
  finish_folder(folder.out);
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

/// Tells what the blocks of the shard that aren't there yet will take.
void predict(const PreparedDraw& prepared, const Folder& folder, const GenerateOptions& options,
             const Progress& progress) {
  const auto [first, end] = blocks_of(options.shard, prepared.blocks.size());
  double missing = 0.0;
  for (std::size_t k = first; k < end; ++k) {
    if (state_of_block(folder.out, folder.checksum, prepared.blocks[k]) != BlockState::whole)
      missing += static_cast<double>(prepared.blocks[k].samples);
  }
  try {
    const sim::MachineRates rates = sim::machine_rates(options.threads, options.cache, progress);
    sim::RunCost cost = draw_cost(prepared, rates, options.cache, progress);
    const double part = missing / static_cast<double>(prepared.job.samples);
    cost.mechanics_s *= part;
    cost.cameras_s *= part;
    cost.frames_s *= part;
    cost.frames = static_cast<int>(missing);
    options.predicted(cost);
  } catch (const Error&) {
    // What is wrong with a unit is said where it is made.
  }
}

}  // namespace

GenerateReport generate_draw(PreparedDraw prepared, const fs::path& out, const GenerateOptions& options,
                             const Progress& progress) {
  const Folder folder = folder_of(prepared, out);
  const Shard& shard = options.shard;
  const auto [first, end] = blocks_of(shard, prepared.blocks.size());
  GenerateReport report;
  for (std::size_t k = first; k < end; ++k) report.samples += prepared.blocks[k].samples;
  if (is_finished(folder)) {
    report.was_finished = true;
    return report;
  }
  for (const PlannedDraw& one : planned_draws(prepared)) {
    report.warn(sim::size_doubt(one.scene.device, one.scene.object));
  }
  begin_shared(out, folder.identity);
  std::error_code error;
  fs::create_directories(out / "blocks", error);
  if (error) fail("{}: can't be made ({})", (out / "blocks").string(), error.message());
  for (const NeededDraw& one : plan_by_need(prepared, options.cache, progress)) {
    for (const std::string& warning : one.plan.warnings) report.warn(warning);
  }
  if (options.predicted) predict(prepared, folder, options, progress);
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
      sensor = std::make_unique<UnitSensor>(options.sensors(prepared, *unit));
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

GenerateReport merge_draw(const PreparedDraw& prepared, const fs::path& out, const Progress& progress) {
  const Folder folder = folder_of(prepared, out);
  GenerateReport report;
  report.samples = prepared.job.samples;
  if (is_finished(folder)) {
    report.was_finished = true;
    return report;
  }
  if (state_of_folder(out, folder.identity) == FolderState::absent) {
    fail("{}: holds nothing of this job; run `touchstone generate {} -o {} --shard I/N` first", out.string(),
         prepared.file.string(), out.string());
  }
  merge(prepared, folder, progress);
  return report;
}

std::vector<int> missing_shards_of_draw(const PreparedDraw& prepared, const fs::path& out, int count) {
  const Folder folder = folder_of(prepared, out);
  std::vector<int> missing;
  if (state_of_folder(out, folder.identity) == FolderState::finished) {
    verify_files(out, read_manifest(out));
    return missing;
  }
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
