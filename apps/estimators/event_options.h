#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/command.h"
#include "lab/dvs/grasp_files.h"
#include "sensors/events/event_source.h"

namespace touchstone::apps {

/// What event files don't say of their camera: common to calibrate and estimate.
struct EventOptions {
  std::string size;  ///< "240x180", or empty
  int stream = -1;   ///< of an AEDAT 4.0 file with several; -1: not given
};

/// Adds --size and --stream.
std::shared_ptr<EventOptions> add_event_options(CLI::App& command);

/// @throws Error for a size that isn't WIDTHxHEIGHT
sensors::EventReadOptions read_options(const EventOptions& options);

/// The grasps of a table that have what is needed, under a progress bar; warns of those that can't be read.
/// @throws Error as lab::read_grasp_table and lab::read_grasps
lab::SeenGrasps seen_grasps(const std::filesystem::path& table, lab::GraspNeeds needs, const EventOptions& options,
                            const GlobalOptions& global);

}  // namespace touchstone::apps
