#include "apps/estimators/reflex_options.h"

#include "core/error.h"

namespace touchstone::apps {

std::shared_ptr<ReflexOptions> add_reflex_options(CLI::App& command, const SourceNeeds& needs) {
  auto options = std::make_shared<ReflexOptions>();
  command.add_option(
      "--registers", options->registers,
      "Reflex mode: recorded registers, one or more CSV with the header t_us,dx,dy,squal,maximum,minimum,average and, "
      "where the force on the object is known, force_x_N,force_y_N,force_z_N behind it");
  options->frames = add_source_options(command, "--frames", needs, false);
  command.add_option("--rest", options->rest,
                     "Of --frames: pictures of the fingertip untouched, one or more; without them the first picture of "
                     "each sequence shows it");
  command.add_option("--white", options->white, "Of --frames: the largest number of a pixel, 63 as the chip gives it")
      ->check(CLI::Range(1.0, 255.0))
      ->capture_default_str();
  command
      .add_option("--pixel-rate", options->pixel_rate_Hz,
                  "Of --frames: 18 x 18 pixels that came one after the other, so many a second (1500), in the order of "
                  "the ADNS-2620; a picture's time is its first pixel's")
      ->check(CLI::Range(1.0, 1e6));
  return options;
}

bool has_pictures(const ReflexOptions& options) {
  const bool frames = !options.frames->choice.place.empty();
  if (frames != options.registers.empty()) fail("give either --registers CSV or --frames SOURCE");
  if (!frames && (!options.rest.empty() || options.pixel_rate_Hz > 0.0)) {
    fail("--rest and --pixel-rate are for --frames");
  }
  return frames;
}

lab::DotPictureSettings picture_settings(const ReflexOptions& options) {
  lab::DotPictureSettings settings;
  settings.rest = options.rest;
  settings.tracker.white = options.white;
  if (options.pixel_rate_Hz > 0.0) settings.tracker.times = sensors::chip_pixel_times(1.0 / options.pixel_rate_Hz);
  return settings;
}

std::vector<datasets::FrameStream> picture_streams(const ReflexOptions& options) {
  std::vector<datasets::FrameStream> streams = opened_streams(*options.frames);
  if (options.pixel_rate_Hz > 0.0) {
    for (const datasets::FrameStream& stream : streams) require_times(stream);
  }
  return streams;
}

}  // namespace touchstone::apps
