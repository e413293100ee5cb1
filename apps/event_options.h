#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

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

}  // namespace touchstone::apps
