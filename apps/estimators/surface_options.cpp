#include "apps/estimators/surface_options.h"

#include "core/error.h"
#include "sensors/heights/height_model_file.h"

namespace touchstone::apps {

std::shared_ptr<SurfaceOptions> add_surface_options(CLI::App& command) {
  auto options = std::make_shared<SurfaceOptions>();
  options->frames = add_source_options(command, "--frames", {}, false);
  command.add_option("--heights", options->heights,
                     "The height model of --frames, that `touchstone calibrate gelsight` made");
  command.add_option(
      "--maps", options->maps,
      "In place of frames: a folder of height maps, EXR with a channel height_mm, as `touchstone estimate "
      "gelsight` and `estimate 9dtact` write them");
  command.add_option("--mm-per-px", options->mm_per_px, "Size of a pixel of --maps, mm")->check(CLI::Range(1e-4, 10.0));
  return options;
}

lab::HeightSource height_source(const SurfaceOptions& options) {
  const bool frames = !options.frames->choice.place.empty();
  if (frames != options.maps.empty()) fail("give either --frames SOURCE or --maps DIR");
  if (frames) {
    if (options.heights.empty()) fail("--frames needs --heights MODEL");
    if (options.mm_per_px > 0.0) fail("--mm-per-px: it is the height model's");
    return {sensors::load_height_model(options.heights), opened_streams(*options.frames)};
  }
  if (!options.heights.empty()) fail("--heights is for --frames; --maps are heights already");
  if (options.mm_per_px == 0.0) fail("--maps needs --mm-per-px MM");
  return {options.maps, options.mm_per_px};
}

std::filesystem::path folder_of(const SurfaceOptions& options) {
  return options.maps.empty() ? std::filesystem::path(options.frames->choice.place) : options.maps;
}

}  // namespace touchstone::apps
