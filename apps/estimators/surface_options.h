#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "apps/estimators/source_options.h"
#include "lab/gelsight/height_source.h"

namespace touchstone::apps {

/// Where height maps come from: common to calibrate and estimate of texture and place.
struct SurfaceOptions {
  std::shared_ptr<SourceOptions> frames;  ///< of a coated gel; without a place: there are none
  std::filesystem::path heights;          ///< the model for them, or empty
  std::filesystem::path maps;             ///< height maps as they are, or empty
  double mm_per_px = 0.0;                 ///< of those
};

/// Adds --frames with --heights, and --maps with --mm-per-px.
std::shared_ptr<SurfaceOptions> add_surface_options(CLI::App& command);

/// The source that the options name. @throws Error if they don't fit together
lab::HeightSource height_source(const SurfaceOptions& options);

/// The folder that the files of a table are relative to.
std::filesystem::path folder_of(const SurfaceOptions& options);

}  // namespace touchstone::apps
