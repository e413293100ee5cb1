#include "apps/estimators/surface_options.h"

#include "core/error.h"
#include "sensors/heights/height_model_file.h"

namespace touchstone::apps {

std::shared_ptr<SurfaceOptions> add_surface_options(CLI::App& command) {
  auto options = std::make_shared<SurfaceOptions>();
  command.add_option("--frames", options->frames,
                     "A folder of frames of a coated gel, taken in natural order of their names");
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
  if (options.frames.empty() == options.maps.empty()) fail("give either --frames DIR or --maps DIR");
  if (!options.frames.empty()) {
    if (options.heights.empty()) fail("--frames needs --heights MODEL");
    if (options.mm_per_px > 0.0) fail("--mm-per-px: it is the height model's");
    return {sensors::load_height_model(options.heights), options.frames};
  }
  if (!options.heights.empty()) fail("--heights is for --frames; --maps are heights already");
  if (options.mm_per_px == 0.0) fail("--maps needs --mm-per-px MM");
  return {options.maps, options.mm_per_px};
}

const std::filesystem::path& folder_of(const SurfaceOptions& options) {
  return options.frames.empty() ? options.maps : options.frames;
}

}  // namespace touchstone::apps
