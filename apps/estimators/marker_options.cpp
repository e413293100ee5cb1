#include "apps/estimators/marker_options.h"

#include "sensors/heights/height_model_file.h"

namespace touchstone::apps {

std::shared_ptr<MarkerOptions> add_marker_options(CLI::App& command, const std::string& split) {
  auto options = std::make_shared<MarkerOptions>();
  options->source = add_source_options(command, "source", {.split = split, .forces = true});
  command.add_option("--rest", options->rest,
                     "A picture of the untouched gel; without it the first frame of each sequence shows it, of a drawn "
                     "data set its background");
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

sensors::TouchCalibration gel_parts(const MarkerOptions& options) {
  sensors::TouchCalibration parts;
  parts.mm_per_px = options.mm_per_px;
  if (!options.heights.empty()) parts.height = sensors::load_height_model(options.heights);
  return parts;
}

}  // namespace touchstone::apps
