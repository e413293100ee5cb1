#include "datasets/sets/frame_sequence.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <string_view>

#include "core/error.h"
#include "core/natural_order.h"
#include "core/units.h"
#include "core/whole_file.h"
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

std::vector<fs::path> picture_files(const fs::path& folder) {
  std::error_code failed;
  if (!fs::is_directory(folder, failed)) fail("{}: isn't a folder", folder.string());
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    // Hidden ones aren't pictures: beside each 1.png that a Mac copies lies a ._1.png.
    if (name.native().starts_with('.') || entry.is_directory(failed)) continue;
    std::string ending = name.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
    if (std::ranges::find(kOtherPictures, ending) != kOtherPictures.end()) {
      fail("{}: is a picture of a kind that isn't read here; allowed are {}", entry.path().string(),
           fmt::join(kPictures, ", "));
    }
    if (std::ranges::find(kPictures, ending) != kPictures.end()) files.push_back(entry.path());
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

FrameSequence frames_of_folder(const fs::path& folder, double frame_rate_Hz) {
  if (!(frame_rate_Hz > 0.0) || !std::isfinite(frame_rate_Hz)) fail("frame rate {}: must be above 0", frame_rate_Hz);
  FrameSequence sequence;
  sequence.name = folder.filename().string();
  for (const fs::path& file : picture_files(folder)) sequence.frames.push_back({file, 0, 0, {}});
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    sequence.frames[i].frame = static_cast<int>(i);
    sequence.frames[i].t_us = std::llround(static_cast<double>(i) * kMicrosecondsPerSecond / frame_rate_Hz);
  }
  return sequence;
}

}  // namespace touchstone::datasets
