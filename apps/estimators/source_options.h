#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "apps/command.h"
#include "datasets/sources/any_source.h"
#include "datasets/sources/frame_watch.h"

namespace touchstone::apps {

/// The help of a calibration whose table names frames.
inline constexpr const char* kTableFramesHelp =
    "The folder of the pictures; or a video or a data set, whose frames the table names as other tables do: "
    "clip-000012 is frame 12 of clip.mp4";

/// Where a command's frames come from, and when they were taken.
struct SourceOptions {
  datasets::SourceChoice choice;
  std::string split;  ///< of a data set: "all" or a split's name
  std::shared_ptr<datasets::FrameNotes> notes = std::make_shared<datasets::FrameNotes>();  ///< of opened_streams
};

/// What else a command asks of its source.
struct SourceNeeds {
  std::string split = "all";  ///< the default of --split
  bool forces = false;        ///< it may be given --forces CSV
};

/// Adds the source as `name` ("source": without a dash; "--frames") and the options that belong to it: --split,
/// --times,
/// --rate, --count, --seconds, --timeout and, if they are wanted, --forces.
std::shared_ptr<SourceOptions> add_source_options(CLI::App& command, const std::string& name, const SourceNeeds& needs,
                                                  bool required = true);

/// The streams that the options name. Of a live source Ctrl-C then ends the frames, not the program; a second one does.
/// @throws Error as datasets::streams_of
std::vector<datasets::FrameStream> opened_streams(const SourceOptions& options);

/// Of what reads motion: without times it would be of no use. @throws Error if a recording's aren't known
void require_times(const datasets::FrameStream& stream);

/// Warns of frames that were doubled or dropped before they came here; of many it names some.
void warn_of_notes(const SourceOptions& options);

/// The place as it was given, without slashes at its end: for names.
std::string name_of_source(const SourceOptions& options);

}  // namespace touchstone::apps
