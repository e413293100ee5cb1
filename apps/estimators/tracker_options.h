#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
#include "lab/vhs/vhs_experiment.h"

namespace touchstone::apps {

/// Where frames come from, and how beads are found in them: common to calibrate and estimate.
struct FrameOptions {
  std::shared_ptr<SourceOptions> source;
  sensors::BeadTrackerSettings tracker;
  bool bright_beads = false;
  bool weighted_centroid = false;
};

/// Adds the options; `split` is the default of --split.
std::shared_ptr<FrameOptions> add_frame_options(CLI::App& command, const std::string& split);

/// The sequences that the options name, tracked. Shows progress unless asked to be quiet, and warns of lost beads.
/// @param show as lab::track's @throws Error if they don't fit together
std::vector<lab::TrackedSequence> tracked_frames(
    const FrameOptions& options, const GlobalOptions& global,
    const std::function<void(const datasets::SourceFrame& frame, const sensors::TrackedBeads& beads)>& show = {});

}  // namespace touchstone::apps
