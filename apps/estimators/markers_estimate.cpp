#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/estimators/marker_options.h"
#include "apps/estimators/overlay_sink.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/gelsight/marker_tracks.h"
#include "sensors/markers/gel_force_model.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  lab::MarkerTrackSettings settings;
  bool touch = false;
  bool overlay = false;
  std::filesystem::path force;
  std::string indenter;
  std::filesystem::path out;
};

/// What is read besides displacements; none unless it's asked for.
std::optional<sensors::TouchCalibration> wanted_touches(const EstimateOptions& options, const MarkerOptions& frames) {
  if (options.force.empty() && !options.indenter.empty()) {
    fail("--indenter: it chooses a line of --force FILE, which isn't given");
  }
  if (!options.touch && options.force.empty() && frames.heights.empty()) return std::nullopt;
  sensors::TouchCalibration parts = gel_parts(frames);
  if (options.force.empty()) return parts;
  const sensors::GelForceModel model = sensors::load_gel_force_model(options.force);
  sensors::use_forces(parts, model, options.indenter);
  return parts;
}

void print_errors(const std::vector<lab::MarkerTrack>& tracks) {
  constexpr const char* kAxes = "xyz";
  bool head = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lab::TouchCount::Errors all;
    for (const lab::MarkerTrack& track : tracks) {
      const lab::TouchCount::Errors& one = track.touches.errors[axis];
      all.frames += one.frames;
      all.squares_N2 += one.squares_N2;
      all.largest_N = std::max(all.largest_N, one.largest_N);
      all.within_two += one.within_two;
    }
    if (all.frames == 0) continue;
    if (!head) fmt::print("\n  axis  frames    RMS N    max N  within two standard errors\n");
    head = true;
    const auto count = static_cast<double>(all.frames);
    fmt::print("  {:<4}  {:>6} {:>8.4f} {:>8.4f}  {:.1f} %\n", kAxes[axis], all.frames,
               std::sqrt(all.squares_N2 / count), all.largest_N, 100.0 * static_cast<double>(all.within_two) / count);
  }
}

void warn_of_rest(const lab::MarkerTrack& track) {
  if (track.rest_frame >= 0) {
    spdlog::warn(
        "{}: the first frame is touched: frame {}, whose rows are straightest, is taken for the gel at rest; "
        "--rest FILE names another",
        track.sequence, track.rest_frame);
  } else if (track.touched_at_rest_seen >= 0) {
    spdlog::warn(
        "{}: frame {} shows that the gel was touched in the frame at rest: displacements are from there; "
        "--rest FILE names another",
        track.sequence, track.touched_at_rest_seen);
  }
}

void estimate(const EstimateOptions& options, const MarkerOptions& chosen, const PictureOptions& pictures,
              const GlobalOptions& global) {
  lab::MarkerTrackSettings settings = options.settings;
  settings.rest = chosen.rest;
  settings.touch = wanted_touches(options, chosen);
  if (settings.touch && settings.touch->normal) {
    const sensors::LinearForce& line = *settings.touch->normal;
    settings.full_force_N = std::max(0.1, line.force_N(line.highest_seen));
  }
  OverlaySink sink(pictures, options.overlay ? options.out / "overlay" : "",
                   "markers of " + chosen.source->choice.place);
  if (sink.wanted()) {
    settings.show = [&sink](const datasets::SourceFrame& frame, const cv::Mat& picture) { sink.take(frame, picture); };
    settings.begin_again = [&sink] { sink.begin_again(); };
  }
  std::vector<lab::MarkerTrack> tracks;
  {
    ProgressBar bar(global.quiet);
    tracks = lab::write_marker_tracks(opened_streams(*chosen.source), settings, options.out, bar.listener());
  }
  sink.finish();
  warn_of_notes(*chosen.source);
  std::int64_t frames = 0;
  for (const lab::MarkerTrack& track : tracks) {
    warn_of_faults(track.faults);
    warn_of_rest(track);
    if (track.jumped_at >= 0) {
      spdlog::warn(
          "{}: frame {}: markers went farther than can be followed; until the gel is at rest again none is trusted",
          track.sequence, track.jumped_at);
    }
    frames += track.frames;
  }
  fmt::print("{}: markers.csv{} of {} frames\n", options.out.string(), settings.touch ? " and touch.csv" : "", frames);
  for (const lab::MarkerTrack& track : tracks) {
    if (track.frames == 0) continue;
    fmt::print("  {}: {} {} markers, {:.1f} px wide, {:.1f} px apart; {:.1f} % of their places trusted\n",
               track.sequence, track.markers, sensors::name_of(track.appearance.polarity), track.appearance.diameter_px,
               track.appearance.spacing_px,
               100.0 * static_cast<double>(track.trusted) / static_cast<double>(track.places));
    if (!settings.touch) continue;
    fmt::print("    touched in {} frames, slip in {}{}\n", track.touches.touched, track.touches.slips,
               track.touches.beyond > 0
                   ? fmt::format("; in {} the force is beyond what the model was fitted to", track.touches.beyond)
                   : "");
  }
  print_errors(tracks);
}

}  // namespace

void add_markers_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand(
      "markers",
      "Displacements of printed markers in any layout, contact and slip from frames alone; forces by a model");
  auto options = std::make_shared<EstimateOptions>();
  const auto frames = add_marker_options(*command, "all");
  command->add_flag("--touch", options->touch, "Contact, its motion and turn, and slip of each frame, too");
  command->add_option("--force", options->force,
                      "The force model that `touchstone calibrate markers` made: forces with their errors, too");
  command->add_option("--indenter", options->indenter, "Whose line of normal force; needed if the model has several");
  command->add_flag("--overlay", options->overlay,
                    "Pictures of the frames with arrows, and with what else is read: contact, slip, force");
  command
      ->add_option("--arrow-scale", options->settings.arrow_scale,
                   "Length of these arrows for a displacement of 1 px, px")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  const auto pictures = add_picture_options(*command);
  command->add_option("-o,--out", options->out, "The folder of markers.csv, touch.csv and of the folder 'overlay'")
      ->required();
  command->callback([&action, options, frames, pictures, &global] {
    action = [options, frames, pictures, &global] { estimate(*options, *frames, *pictures, global); };
  });
}

}  // namespace touchstone::apps
