#include "apps/estimators/marker_options.h"

#include <optional>

#include "core/error.h"
#include "sensors/heights/height_model_file.h"

namespace touchstone::apps {
namespace {

bool is_data_set(const MarkerOptions& options) {
  return std::filesystem::exists(options.source / "dataset.json");
}

}  // namespace

std::shared_ptr<MarkerOptions> add_marker_options(CLI::App& command, const std::string& split) {
  auto options = std::make_shared<MarkerOptions>();
  options->split = split;
  command
      .add_option("source", options->source,
                  "A folder of frames, taken in natural order of their names, or a data set that `touchstone generate` "
                  "made of scenes")
      ->required();
  command.add_option("--split", options->split, "Of a data set: train, validate, test or all")->capture_default_str();
  command.add_option("--rest", options->rest,
                     "A picture of the untouched gel; without it the first frame of each sequence shows it");
  command.add_option("--forces", options->forces,
                     "Times and forces of a folder's frames: CSV with the header "
                     "file,t_us,force_x_N,force_y_N,force_z_N; on the object, x to the picture's right, y down");
  command.add_option("--frame-rate", options->frame_rate_Hz, "Of a folder of frames without --forces, in Hz")
      ->check(CLI::Range(1e-3, 1e6));
  command.add_option(
      "--heights", options->heights,
      "The height model that `touchstone calibrate gelsight` made of this gel, or of one like it without "
      "markers: normal force is read from heights");
  command
      .add_option("--mm-per-px", options->mm_per_px,
                  "Size of a pixel on the gel, mm, where it isn't the height model's")
      ->check(CLI::Range(1e-4, 10.0));
  return options;
}

bool times_known(const MarkerOptions& options) {
  return options.frame_rate_Hz > 0.0 || !options.forces.empty() || is_data_set(options);
}

std::vector<datasets::FrameSequence> marker_frames(const MarkerOptions& options) {
  if (is_data_set(options)) {
    if (!options.forces.empty()) fail("--forces: the data set {} has its own", options.source.string());
    std::optional<datasets::Split> split;
    if (options.split != "all") split = datasets::split_named(options.split);
    return datasets::frames_of_data_set(options.source, split);
  }
  if (!options.forces.empty()) {
    if (options.frame_rate_Hz > 0.0) fail("--frame-rate: the times are those of {}", options.forces.string());
    return {datasets::frames_of_force_table(options.source, options.forces)};
  }
  // Without a rate frames are in order, and that is all: a microsecond apart, which nobody is shown.
  constexpr double kAny_Hz = 1e6;
  return {datasets::frames_of_folder(options.source, options.frame_rate_Hz > 0.0 ? options.frame_rate_Hz : kAny_Hz)};
}

sensors::TouchCalibration gel_parts(const MarkerOptions& options) {
  sensors::TouchCalibration parts;
  parts.mm_per_px = options.mm_per_px;
  if (!options.heights.empty()) parts.height = sensors::load_height_model(options.heights);
  return parts;
}

}  // namespace touchstone::apps
