#include "datasets/exports/webdataset.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/exports/tar_file.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/run_folder.h"
#include "datasets/sets/run_identity.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kIndex = "index.json";
constexpr const char* kUnits = "units";
constexpr std::int64_t kBatch = 32;  // samples that are in memory at once

/// Pixels of a file (red, green, blue) as pictures are in memory.
cv::Mat picture_of(const std::vector<std::uint8_t>& bytes, std::int64_t rows, std::int64_t columns,
                   std::int64_t channels) {
  cv::Mat picture(static_cast<int>(rows), static_cast<int>(columns), CV_8UC(static_cast<int>(channels)));
  const std::uint8_t* from = bytes.data();
  for (int row = 0; row < picture.rows; ++row) {
    auto* to = picture.ptr<std::uint8_t>(row);
    for (int column = 0; column < picture.cols; ++column, from += channels, to += channels) {
      for (std::int64_t c = 0; c < channels; ++c) to[c] = from[channels - 1 - c];
    }
  }
  return picture;
}

/// The library that writes PNG files writes to places only.
std::string png_of(const cv::Mat& picture, const fs::path& scratch) {
  sim::write_png(scratch, picture);
  std::string bytes = read_whole_file(scratch);
  fs::remove(scratch);
  return bytes;
}

/// A sample's labels, with units in the keys. What wasn't asked for is null.
class Labels {
 public:
  explicit Labels(const Hdf5Reader& file)
      : wrench_(file.read<double>("/wrench").values),
        wrench_error_(file.read<double>("/wrench_error").values),
        pose_(file.read<double>("/pose").values),
        sample_(file.read<std::int64_t>("/sample").values),
        seed_(file.read<std::uint64_t>("/seed").values),
        attempt_(file.read<std::int32_t>("/attempt").values),
        unit_(file.read<std::int32_t>("/unit").values),
        object_(file.read<std::int32_t>("/object").values),
        piece_(file.read<std::int64_t>("/piece").values),
        under_resolved_(file.read<std::uint8_t>("/under_resolved").values),
        object_name_(file.read_texts("/object_name")) {
    for (const char* name : {"deepest_mm", "contact_area_mm2", "largest_strain"}) {
      numbers_.emplace_back(name, file.read<double>(fmt::format("/{}", name)).values);
    }
    for (const char* name : {"place_x_mm", "place_y_mm", "turn_deg", "tilt_deg", "tilt_axis_deg", "force_N", "depth_mm",
                             "drag_mm", "drag_toward_deg"}) {
      drawn_.emplace_back(name, file.read<double>(fmt::format("/drawn/{}", name)).values);
    }
  }

  std::string json(std::size_t i, const std::string& split) const {
    const auto part = [&](const std::vector<double>& of, std::size_t width, std::size_t first, std::size_t count) {
      const auto begin = of.begin() + static_cast<std::ptrdiff_t>(i * width + first);
      return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(count));
    };
    const std::vector<double> pose = part(pose_, 12, 0, 12);
    ordered_json json = {{"sample", sample_[i]},
                         {"split", split},
                         {"force_N", part(wrench_, 6, 0, 3)},
                         {"torque_N_mm", part(wrench_, 6, 3, 3)},
                         {"force_error_N", part(wrench_error_, 3, 0, 3)},
                         {"gel_from_object_rotation",
                          {{pose[0], pose[1], pose[2]}, {pose[4], pose[5], pose[6]}, {pose[8], pose[9], pose[10]}}},
                         {"gel_from_object_position_mm", {pose[3], pose[7], pose[11]}}};
    for (const auto& [name, values] : numbers_) json[name] = values[i];
    json["under_resolved"] = under_resolved_[i] != 0;
    json["unit"] = unit_[i];
    json["object"] = object_[i];
    json["object_name"] = object_name_.at(static_cast<std::size_t>(object_[i]));
    json["piece"] = piece_[i];
    json["seed"] = seed_[i];
    json["attempt"] = attempt_[i];
    for (const auto& [name, values] : drawn_) json["drawn"][name] = values[i];
    return json.dump(1) + "\n";
  }

 private:
  using Column = std::pair<std::string, std::vector<double>>;
  std::vector<double> wrench_, wrench_error_, pose_;
  std::vector<std::int64_t> sample_;
  std::vector<std::uint64_t> seed_;
  std::vector<std::int32_t> attempt_, unit_, object_;
  std::vector<std::int64_t> piece_;
  std::vector<std::uint8_t> under_resolved_;
  std::vector<std::string> object_name_;
  std::vector<Column> numbers_, drawn_;
};

/// A block that samples are taken from. Reading is for one thread, packing for many.
struct OpenBlock {
  explicit OpenBlock(const fs::path& path) : file(path), labels(file) {}

  Hdf5Reader file;
  Labels labels;
};

/// A sample's pictures as they lie in the block, and then the files that they become.
struct Sample {
  std::string key, json;
  std::optional<Hdf5Array<std::uint8_t>> frame, contact;
  std::optional<Hdf5Array<float>> height;
  std::vector<std::pair<std::string, std::string>> files;  // name, content

  void read(const OpenBlock& block, std::int64_t row, std::int64_t number, const std::string& split) {
    key = fmt::format("{:08}", number);
    json = block.labels.json(static_cast<std::size_t>(row), split);
    if (block.file.has("/frame")) frame = block.file.read_rows<std::uint8_t>("/frame", row, 1);
    if (block.file.has("/height")) height = block.file.read_rows<float>("/height", row, 1);
    if (block.file.has("/contact")) contact = block.file.read_rows<std::uint8_t>("/contact", row, 1);
  }

  void pack(const fs::path& scratch) {
    constexpr std::uint8_t kWhite = 255;
    if (frame) {
      const auto& shape = frame->shape;
      files.emplace_back(".frame.png", png_of(picture_of(frame->values, shape[1], shape[2], shape[3]), scratch));
    }
    if (height) files.emplace_back(".height.npy", npy_of({height->shape[1], height->shape[2]}, height->values));
    if (contact) {
      for (std::uint8_t& one : contact->values) one = one != 0 ? kWhite : 0;
      files.emplace_back(".contact.png",
                         png_of(picture_of(contact->values, contact->shape[1], contact->shape[2], 1), scratch));
    }
    files.emplace_back(".json", json);
    frame.reset();
    height.reset();
    contact.reset();
  }
};

/// All that an export asks HDF5 for of a block, in a process of its own; pictures are read sample by sample later.
void try_block(const fs::path& path) {
  try_hdf5(path, [&path] {
    const OpenBlock block(path);
    block.file.read_texts("/device_yaml");
    for (const char* picture : {"/frame", "/height", "/contact", "/background"}) {
      if (block.file.has(picture)) block.file.walk_rows(picture);
    }
  });
}

/// The samples of each split, in order.
std::vector<std::vector<std::int64_t>> samples_by_split(const fs::path& folder, const Manifest& manifest) {
  std::vector<std::vector<std::int64_t>> result(kSplits);
  for (const ManifestBlock& block : manifest.blocks) {
    const fs::path path = folder / block.name;
    try_block(path);
    const auto split = Hdf5Reader(path).read<std::uint8_t>("/split").values;
    if (static_cast<std::int64_t>(split.size()) != block.samples) {
      fail("{}: has {} samples, dataset.json says {}", path.string(), split.size(), block.samples);
    }
    for (std::size_t k = 0; k < split.size(); ++k) {
      if (split[k] >= result.size()) fail("{}: '/split' has a {}; allowed is 0 to 2", path.string(), split[k]);
      result[split[k]].push_back(block.first_sample + static_cast<std::int64_t>(k));
    }
  }
  return result;
}

bool is_ours(const fs::path& file) {
  const std::string name = file.filename().string();
  if (is_temporary_file(file) || name == kUnits) return true;
  return std::ranges::any_of(enum_names(Split{}), [&](const auto& split) {
    return name.starts_with(std::string(split.first) + "-") && name.ends_with(".tar");
  });
}

/// Makes `out`, and removes what a killed export left there.
void begin(const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error) fail("{}: can't be made ({})", out.string(), error.message());
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(out)) {
    if (entry.path().filename() == kIndex) {
      fail("{}: holds a finished export; remove it, or give another folder", out.string());
    }
    if (!is_ours(entry.path())) {
      fail("{}: isn't empty ('{}' is in it); give another folder", out.string(), entry.path().filename().string());
    }
    left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove_all(path);
  fs::create_directories(out / kUnits);
}

/// What is once a sensor.
ordered_json write_units(const fs::path& folder, const fs::path& out, const Manifest& manifest) {
  ordered_json units = ordered_json::array();
  int last = -1;
  for (const ManifestBlock& block : manifest.blocks) {
    if (block.unit == last) continue;
    last = block.unit;
    const Hdf5Reader file(folder / block.name);
    const std::string device = fmt::format("{}/{:06}.device.yaml", kUnits, block.unit);
    write_whole_file(out / device, file.read_texts("/device_yaml").at(0));
    ordered_json unit = {{"unit", block.unit}};
    if (file.has("/background")) {  // else no picture was asked for
      const auto background = file.read<std::uint8_t>("/background");
      const auto& shape = background.shape;
      const std::string picture = fmt::format("{}/{:06}.background.png", kUnits, block.unit);
      sim::write_png(out / picture, picture_of(background.values, shape[0], shape[1], shape[2]));
      unit["background"] = picture;
      unit["background_sha256"] = sha256_of_file(out / picture);
    }
    unit["device"] = device;
    unit["device_sha256"] = sha256_of_file(out / device);
    units.push_back(std::move(unit));
  }
  return units;
}

/// Goes through samples of rising numbers, block by block.
class TarMaker {
 public:
  TarMaker(const fs::path& folder, const fs::path& out, const Manifest& manifest)
      : folder_(folder), out_(out), manifest_(manifest) {}

  void write(const std::string& name, const std::string& split, const std::vector<std::int64_t>& numbers,
             const std::function<void(std::int64_t)>& written) {
    block_ = 0;
    open_.reset();
    write_whole_file(out_ / name, [&](const fs::path& temporary) {
      TarWriter tar(temporary);
      for (std::size_t first = 0; first < numbers.size(); first += kBatch) {
        std::vector<Sample> batch(std::min<std::size_t>(kBatch, numbers.size() - first));
        for (std::size_t k = 0; k < batch.size(); ++k) read(batch[k], numbers[first + k], split);
        tbb::parallel_for(std::size_t{0}, batch.size(), [&](std::size_t k) {
          batch[k].pack(out_ / kUnits / fmt::format("scratch-{}.png", batch[k].key));
        });
        for (const Sample& sample : batch) {
          for (const auto& [ending, content] : sample.files) tar.add(sample.key + ending, content);
        }
        written(static_cast<std::int64_t>(batch.size()));
      }
      tar.close();
    });
  }

 private:
  void read(Sample& sample, std::int64_t number, const std::string& split) {
    const auto& blocks = manifest_.blocks;
    while (number >= blocks[block_].first_sample + blocks[block_].samples) {
      ++block_;
      open_.reset();
    }
    if (!open_) open_ = std::make_unique<OpenBlock>(folder_ / blocks[block_].name);
    sample.read(*open_, number - blocks[block_].first_sample, number, split);
  }

  const fs::path& folder_;
  const fs::path& out_;
  const Manifest& manifest_;
  std::size_t block_ = 0;
  std::unique_ptr<OpenBlock> open_;
};

/// Which splits are wanted: by their numbers. @throws Error
std::vector<std::size_t> wanted_splits(const fs::path& folder, const std::vector<std::string>& names,
                                       const std::vector<std::vector<std::int64_t>>& samples) {
  std::vector<std::size_t> wanted;
  for (const std::string& name : names) {
    const auto number = static_cast<std::size_t>(split_named(name));
    if (samples[number].empty()) fail("--split: '{}' of {} has no samples", name, folder.string());
    if (std::find(wanted.begin(), wanted.end(), number) == wanted.end()) wanted.push_back(number);
  }
  if (names.empty()) {
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (!samples[k].empty()) wanted.push_back(k);
    }
  }
  std::sort(wanted.begin(), wanted.end());
  return wanted;
}

}  // namespace

std::string npy_of(const std::vector<std::int64_t>& shape, const std::vector<float>& values) {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::size_t kAligned = 64;
  std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({},), }}", fmt::join(shape, ", "));
  const std::size_t before = 10;  // magic, version, length
  const std::size_t whole = (before + header.size() + 1 + kAligned - 1) / kAligned * kAligned;
  header.resize(whole - before - 1, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return bytes;
}

WebDatasetReport export_webdataset(const fs::path& folder, const fs::path& out, const WebDatasetOptions& options,
                                   const Progress& progress) {
  if (options.samples_per_tar < 1) {
    fail("--samples-per-tar: {} is not allowed; allowed is at least 1", options.samples_per_tar);
  }
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  }
  const Manifest manifest = read_manifest(folder, SetSource::draw);
  verify_files(folder, manifest);
  const auto by_split = samples_by_split(folder, manifest);
  const std::vector<std::size_t> wanted = wanted_splits(folder, options.splits, by_split);
  std::int64_t all = 0;
  for (const std::size_t split : wanted) all += static_cast<std::int64_t>(by_split[split].size());
  begin(out);
  ordered_json index = {{"format", "touchstone-webdataset"},
                        {"format_version", 1},
                        {"program", program_name()},
                        {"name", manifest.name},
                        {"licence", manifest.licence},
                        {"of_content_sha256", manifest.content_sha256},
                        {"samples", all},
                        {"splits", ordered_json::object()},
                        {"units", write_units(folder, out, manifest)}};
  WebDatasetReport report;
  TarMaker maker(folder, out, manifest);
  for (const std::size_t split : wanted) {
    const std::string split_name = name_of(static_cast<Split>(split));
    const std::vector<std::int64_t>& samples = by_split[split];
    const auto count = static_cast<std::int64_t>(samples.size());
    const std::int64_t tars = (count + options.samples_per_tar - 1) / options.samples_per_tar;
    ordered_json files = ordered_json::array();
    for (std::int64_t tar = 0; tar < tars; ++tar) {
      const std::string name = fmt::format("{}-{:06}.tar", split_name, tar);
      std::vector<std::int64_t> dealt;
      for (std::int64_t k = tar; k < count; k += tars) dealt.push_back(samples[static_cast<std::size_t>(k)]);
      maker.write(name, split_name, dealt, [&](std::int64_t more) {
        report.samples += more;
        if (progress) progress("samples", report.samples, all);
      });
      const auto bytes = static_cast<std::int64_t>(fs::file_size(out / name));
      files.push_back(
          {{"file", name}, {"samples", dealt.size()}, {"bytes", bytes}, {"sha256", sha256_of_file(out / name)}});
      ++report.tars;
      report.bytes += bytes;
    }
    index["splits"][split_name] = {{"samples", count}, {"files", std::move(files)}};
  }
  write_whole_file(out / kIndex, index.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
  return report;
}

}  // namespace touchstone::datasets
