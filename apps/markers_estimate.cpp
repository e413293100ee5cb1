#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "lab/gelsight/marker_tracks.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path source;
  std::string split = "all";
  double frame_rate_Hz = 0.0;
  lab::MarkerTrackSettings settings;
  std::filesystem::path out;
};

std::vector<datasets::FrameSequence> chosen_frames(const EstimateOptions& options) {
  if (std::filesystem::exists(options.source / "dataset.json")) {
    std::optional<datasets::Split> split;
    if (options.split != "all") split = datasets::split_named(options.split);
    return datasets::frames_of_data_set(options.source, split);
  }
  // Without a rate frames are in order, and that is all: a microsecond apart, which nobody is shown.
  constexpr double kAny_Hz = 1e6;
  return {datasets::frames_of_folder(options.source, options.frame_rate_Hz > 0.0 ? options.frame_rate_Hz : kAny_Hz)};
}

void estimate(const EstimateOptions& options, const GlobalOptions& global) {
  lab::MarkerTrackSettings settings = options.settings;
  settings.times_known = options.frame_rate_Hz > 0.0 || std::filesystem::exists(options.source / "dataset.json");
  std::vector<lab::MarkerTrack> tracks;
  {
    ProgressBar bar(global.quiet);
    tracks = lab::write_marker_tracks(chosen_frames(options), settings, options.out, bar.listener());
  }
  std::int64_t frames = 0;
  for (const lab::MarkerTrack& track : tracks) {
    warn_of_faults(track.faults);
    if (track.jumped_at >= 0) {
      spdlog::warn(
          "{}: frame {}: markers went farther than can be followed; until the gel is at rest again none is trusted",
          track.sequence, track.jumped_at);
    }
    frames += track.frames;
  }
  fmt::print("{}: markers.csv of {} frames\n", options.out.string(), frames);
  for (const lab::MarkerTrack& track : tracks) {
    if (track.frames == 0) continue;
    fmt::print("  {}: {} {} markers, {:.1f} px wide, {:.1f} px apart; {:.1f} % of their places trusted\n",
               track.sequence, track.markers, sensors::name_of(track.appearance.polarity), track.appearance.diameter_px,
               track.appearance.spacing_px,
               100.0 * static_cast<double>(track.trusted) / static_cast<double>(track.places));
  }
}

}  // namespace

void add_markers_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand(
      "markers", "Displacements of printed markers in any layout, from frames alone: no model is needed");
  auto options = std::make_shared<EstimateOptions>();
  command
      ->add_option(
          "source", options->source,
          "A folder of frames, taken in natural order of their names, or a data set that `touchstone generate` "
          "made of scenes")
      ->required();
  command->add_option("--rest", options->settings.rest,
                      "A picture of the untouched gel; without it the first frame shows it");
  command->add_option("--split", options->split, "Of a data set: train, validate, test or all")->capture_default_str();
  command->add_option("--frame-rate", options->frame_rate_Hz, "Of a folder of frames, in Hz: for the column of times")
      ->check(CLI::Range(1e-3, 1e6));
  command->add_flag("--overlay", options->settings.overlay, "Pictures of the frames with arrows, too");
  command
      ->add_option("--arrow-scale", options->settings.arrow_scale,
                   "Length of these arrows for a displacement of 1 px, px")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The folder of markers.csv and of the folder 'overlay'")->required();
  command->callback([&action, options, &global] { action = [options, &global] { estimate(*options, global); }; });
}

}  // namespace touchstone::apps
