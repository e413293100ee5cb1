#include "datasets/sources/frame_sequence.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <string_view>

#include "core/error.h"
#include "core/natural_order.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/truth_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

/// Endings of what read_image reads, in small letters.
constexpr auto kPictures = std::to_array<std::string_view>(
    {".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".tif", ".tiff", ".webp", ".ppm", ".pgm", ".pnm"});
/// Of pictures that would be missing among the frames. EXR and HDR aren't: height maps lie beside frames.
constexpr auto kOtherPictures = std::to_array<std::string_view>(
    {".gif", ".heic", ".heif", ".avif", ".jp2", ".j2k", ".tga", ".psd", ".dng", ".jxl", ".pcx", ".jfif"});

std::string small_ending(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

}  // namespace

std::vector<FrameSequence> frames_of_data_set(const fs::path& folder, std::optional<Split> split) {
  const Manifest manifest = read_manifest(folder, SetSource::scenes);
  const TruthTable truth = read_truth_table(folder / "truth.h5");
  if (truth.samples() != manifest.samples) {
    fail("{}: truth.h5 has {} samples, dataset.json {}", folder.string(), truth.samples(), manifest.samples);
  }
  std::vector<FrameSequence> sequences;
  for (const ManifestScene& scene : manifest.scenes) {
    if (split && scene.split != *split) continue;
    if (!scene.has_frames) fail("{}: the scene '{}' has no frames", folder.string(), scene.name);
    if (scene.first_sample < 0 || scene.samples < 0 || scene.first_sample + scene.samples > truth.samples()) {
      fail("{}: the scene '{}' has samples that there aren't", folder.string(), scene.name);
    }
    FrameSequence sequence;
    sequence.name = scene.name;
    for (std::int64_t i = scene.first_sample; i < scene.first_sample + scene.samples; ++i) {
      const auto at = static_cast<std::size_t>(i);
      LabelledFrame frame;
      frame.frame = truth.frame[at];
      frame.file = folder / picture_name("frames", scene.name, frame.frame, "png");
      frame.t_us = truth.t_us[at];
      frame.force = truth.wrench[at].head<3>();
      sequence.frames.push_back(std::move(frame));
    }
    sequences.push_back(std::move(sequence));
  }
  if (sequences.empty()) {
    fail("{}: has no scene of the split '{}'", folder.string(), split ? name_of(*split) : "any");
  }
  return sequences;
}

bool is_picture_name(const fs::path& file) {
  return std::ranges::find(kPictures, small_ending(file)) != kPictures.end();
}

std::vector<fs::path> picture_files(const fs::path& folder) {
  std::error_code failed;
  if (!fs::is_directory(folder, failed)) fail("{}: isn't a folder", folder.string());
  std::vector<fs::path> files;
  fs::directory_iterator entries(folder, failed);
  if (failed) fail("{}: can't be read ({})", folder.string(), failed.message());
  for (const auto& entry : entries) {
    const fs::path name = entry.path().filename();
    // Hidden ones aren't pictures: beside each 1.png that a Mac copies lies a ._1.png.
    if (name.native().starts_with('.') || entry.is_directory(failed)) continue;
    const std::string ending = small_ending(name);
    if (std::ranges::find(kOtherPictures, ending) != kOtherPictures.end()) {
      fail("{}: is a picture of a kind that isn't read here; allowed are {}", entry.path().string(),
           fmt::join(kPictures, ", "));
    }
    if (is_picture_name(name)) files.push_back(entry.path());
  }
  if (files.empty()) fail("{}: has no picture; read are {}", folder.string(), fmt::join(kPictures, ", "));
  // By the stem first: "a.png" stands before "a-1.png" though a hyphen comes before a dot.
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    const std::string first = a.stem().string(), second = b.stem().string();
    return first == second ? a < b : natural_less(first, second);
  });
  const auto twice = std::ranges::adjacent_find(files, {}, [](const fs::path& file) { return file.stem(); });
  if (twice != files.end()) {
    fail("{}: {} has the same name; which of them is the frame can't be known", std::next(twice)->string(),
         twice->filename().string());
  }
  return files;
}

FrameSequence frames_of_folder(const fs::path& folder) {
  FrameSequence sequence;
  sequence.name = fs::absolute(folder / "").parent_path().filename().string();
  for (const fs::path& file : picture_files(folder)) {
    LabelledFrame frame;
    frame.file = file;
    frame.frame = static_cast<int>(sequence.frames.size());
    frame.t_us = frame.frame;
    frame.timed = false;
    sequence.frames.push_back(std::move(frame));
  }
  return sequence;
}

}  // namespace touchstone::datasets
