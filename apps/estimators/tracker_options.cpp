#include "apps/estimators/tracker_options.h"

#include <spdlog/spdlog.h>

#include "apps/progress_bar.h"
#include "core/error.h"

namespace touchstone::apps {
namespace {

std::vector<datasets::FrameSequence> chosen_frames(const FrameOptions& options) {
  if (options.data.empty() == options.frames.empty()) fail("give either --data DIR or --frames DIR");
  if (!options.data.empty()) {
    std::optional<datasets::Split> split;
    if (!options.split.empty() && options.split != "all") split = datasets::split_named(options.split);
    return datasets::frames_of_data_set(options.data, split);
  }
  if (!options.forces.empty()) return {datasets::frames_of_force_table(options.frames, options.forces)};
  if (options.frame_rate_Hz <= 0.0) fail("--frames needs --forces CSV or --frame-rate HZ, for the frames' times");
  return {datasets::frames_of_folder(options.frames, options.frame_rate_Hz)};
}

}  // namespace

std::shared_ptr<FrameOptions> add_frame_options(CLI::App& command, const std::string& split) {
  auto options = std::make_shared<FrameOptions>();
  options->split = split;
  command.add_option("--data", options->data, "A data set that `touchstone generate` made");
  command.add_option("--split", options->split, "Its scenes: train, validate, test or all")->capture_default_str();
  command.add_option("--frames", options->frames, "A folder of recorded frames, taken in natural order of their names");
  command.add_option("--forces", options->forces,
                     "Times and forces of recorded frames: CSV with the header "
                     "file,t_us,force_x_N,force_y_N,force_z_N");
  command.add_option("--frame-rate", options->frame_rate_Hz, "Of recorded frames without --forces, in Hz");
  command.add_option("--roi-a", options->tracker.roi_a_px, "Side of the region that holds all beads, px")
      ->capture_default_str();
  command.add_option("--roi-b", options->tracker.roi_b_px, "Side of the window round one bead, px")
      ->capture_default_str();
  command.add_flag("--bright-beads", options->bright_beads, "Beads are brighter than what is behind them");
  command.add_flag("--weighted-centroid", options->weighted_centroid,
                   "Weigh pixels at a bead's rim by their grey value ([VisioHaptic2024]: each counts the same)");
  return options;
}

std::vector<lab::TrackedSequence> tracked_frames(const FrameOptions& options, const GlobalOptions& global) {
  sensors::BeadTrackerSettings settings = options.tracker;
  if (options.bright_beads) settings.appearance.polarity = sensors::BeadPolarity::kBright;
  if (options.weighted_centroid) settings.centroid = sensors::CentroidKind::kWeighted;
  std::vector<lab::TrackedSequence> tracked;
  {
    ProgressBar bar(global.quiet);
    tracked = lab::track(chosen_frames(options), settings, bar.listener());
  }
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
