#include "apps/estimators/tracker_options.h"

#include <spdlog/spdlog.h>

#include "apps/progress_bar.h"

namespace touchstone::apps {

std::shared_ptr<FrameOptions> add_frame_options(CLI::App& command, const std::string& split) {
  auto options = std::make_shared<FrameOptions>();
  options->source = add_source_options(command, "--frames,--data", {.split = split, .forces = true});
  command.add_option("--roi-a", options->tracker.roi_a_px, "Side of the region that holds all beads, px")
      ->capture_default_str();
  command.add_option("--roi-b", options->tracker.roi_b_px, "Side of the window round one bead, px")
      ->capture_default_str();
  command.add_flag("--bright-beads", options->bright_beads, "Beads are brighter than what is behind them");
  command.add_flag("--weighted-centroid", options->weighted_centroid,
                   "Weigh pixels at a bead's rim by their grey value ([VisioHaptic2024]: each counts the same)");
  return options;
}

std::vector<lab::TrackedSequence> tracked_frames(
    const FrameOptions& options, const GlobalOptions& global,
    const std::function<void(const datasets::SourceFrame& frame, const sensors::TrackedBeads& beads)>& show) {
  sensors::BeadTrackerSettings settings = options.tracker;
  if (options.bright_beads) settings.appearance.polarity = sensors::BeadPolarity::kBright;
  if (options.weighted_centroid) settings.centroid = sensors::CentroidKind::kWeighted;
  const std::vector<datasets::FrameStream> streams = opened_streams(*options.source);
  for (const datasets::FrameStream& stream : streams) require_times(stream);
  std::vector<lab::TrackedSequence> tracked;
  {
    ProgressBar bar(global.quiet);
    tracked = lab::track(streams, settings, bar.listener(), show);
  }
  warn_of_notes(*options.source);
  for (const lab::TrackedSequence& sequence : tracked) {
    warn_of_faults(sequence.faults);
    if (sequence.lost() > 0) {
      spdlog::warn("{}: beads weren't found {} times in {} frames", sequence.source.name, sequence.lost(),
                   sequence.beads.size());
    }
  }
  return tracked;
}

}  // namespace touchstone::apps
