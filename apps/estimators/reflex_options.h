#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <vector>

#include "apps/estimators/source_options.h"
#include "lab/reflex/dot_pictures.h"

namespace touchstone::apps {

/// What a fingertip's chip has given: registers of each frame, or pictures of its dots. Common to calibrate and
/// estimate.
struct ReflexOptions {
  std::vector<std::filesystem::path> registers;  ///< tables; empty: there are pictures
  std::shared_ptr<SourceOptions> frames;
  std::vector<std::filesystem::path> rest;
  double white = sensors::ExploreSettings{}.white;
  double pixel_rate_Hz = 0.0;  ///< 0: all pixels at once
};

/// Adds --registers, and --frames with --rest, --white and --pixel-rate.
std::shared_ptr<ReflexOptions> add_reflex_options(CLI::App& command, const SourceNeeds& needs);

/// Is it of pictures? @throws Error unless one of registers and frames is given
bool has_pictures(const ReflexOptions& options);

/// How their dots are followed.
lab::DotPictureSettings picture_settings(const ReflexOptions& options);

/// The streams of pictures. @throws Error as opened_streams, or if the pixels' rate is given and times aren't known
std::vector<datasets::FrameStream> picture_streams(const ReflexOptions& options);

}  // namespace touchstone::apps
