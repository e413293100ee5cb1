#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "datasets/sets/frame_sequence.h"
#include "sensors/markers/touch_reader.h"

namespace touchstone::apps {

/// Frames of a gel with markers, and what is known of that gel: common to calibrate and estimate.
struct MarkerOptions {
  std::filesystem::path source;   ///< a folder of frames or a data set
  std::string split;              ///< of the data set
  std::filesystem::path rest;     ///< a picture at rest, or empty
  std::filesystem::path forces;   ///< a table of recorded frames' times and forces, or empty
  double frame_rate_Hz = 0.0;     ///< of recorded frames; 0: not known
  std::filesystem::path heights;  ///< a height model, or empty
  double mm_per_px = 0.0;         ///< 0: the height model's
};

/// Adds the options; `split` is the default of --split.
std::shared_ptr<MarkerOptions> add_marker_options(CLI::App& command, const std::string& split);

/// Are the frames' times known, or only their order?
bool times_known(const MarkerOptions& options);

/// The sequences that the options name. @throws Error if they don't fit together
std::vector<datasets::FrameSequence> marker_frames(const MarkerOptions& options);

/// What the options say of the gel, without lines of force. @throws Error as load_height_model
sensors::TouchCalibration gel_parts(const MarkerOptions& options);

}  // namespace touchstone::apps
