#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/estimators/source_options.h"
#include "sensors/markers/touch_reader.h"

namespace touchstone::apps {

/// Frames of a gel with markers, and what is known of that gel: common to calibrate and estimate.
struct MarkerOptions {
  std::shared_ptr<SourceOptions> source;
  std::filesystem::path rest;     ///< a picture at rest, or empty
  std::filesystem::path heights;  ///< a height model, or empty
  double mm_per_px = 0.0;         ///< 0: the height model's
};

/// Adds the options; `split` is the default of --split.
std::shared_ptr<MarkerOptions> add_marker_options(CLI::App& command, const std::string& split);

/// What the options say of the gel, without lines of force. @throws Error as load_height_model
sensors::TouchCalibration gel_parts(const MarkerOptions& options);

}  // namespace touchstone::apps
