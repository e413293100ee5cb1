#include "datasets/sets/frame_sequence.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "core/whole_file.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/truth_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

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
  if (!fs::is_directory(folder)) fail("{}: isn't a folder", folder.string());
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
    const bool picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
    if (picture && entry.is_regular_file()) files.push_back(entry.path());
  }
  if (files.empty()) fail("{}: has no .png, .jpg or .jpeg file", folder.string());
  std::sort(files.begin(), files.end());
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
