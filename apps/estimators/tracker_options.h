#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/command.h"
#include "lab/vhs/vhs_experiment.h"

namespace touchstone::apps {

/// Where frames come from, and how beads are found in them: common to calibrate and estimate.
struct FrameOptions {
  std::filesystem::path data;    ///< a data set, or empty
  std::string split;             ///< of the data set; empty: all
  std::filesystem::path frames;  ///< a folder of recorded frames, or empty
  std::filesystem::path forces;  ///< their forces, or empty
  double frame_rate_Hz = 0.0;    ///< of recorded frames without a table
  sensors::BeadTrackerSettings tracker;
  bool bright_beads = false;
  bool weighted_centroid = false;
};

/// Adds the options; `split` is the default of --split.
std::shared_ptr<FrameOptions> add_frame_options(CLI::App& command, const std::string& split);

/// The sequences that the options name, tracked. Shows progress unless asked to be quiet, and warns of lost beads.
/// @throws Error if they don't fit together
std::vector<lab::TrackedSequence> tracked_frames(const FrameOptions& options, const GlobalOptions& global);

}  // namespace touchstone::apps
