#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
#include "lab/dtact/dark_presses.h"
#include "sensors/heights/darkness_calibration.h"
#include "sensors/heights/darkness_model_file.h"

namespace touchstone::apps {
namespace {

namespace fs = std::filesystem;

struct CalibrateOptions {
  fs::path frames;
  fs::path annotations;
  std::vector<fs::path> rest;
  double mm_per_px = 0.0;
  std::optional<double> camera_distance_mm;
  double smoothing_px = sensors::DarkeningSettings{}.smoothing_px;
  bool locked_exposure = false;
  fs::path out;
};

void print_error(const char* of, const sensors::ProfileError& error) {
  fmt::print(
      "  {}: heights over rings are off by {:.4f} mm in the mean, {:.4f} RMS, {:.4f} at most; single pixels by "
      "{:.4f} (RMS)\n",
      of, error.mean_mm, error.rms_mm, error.largest_mm, error.pixel_rms_mm);
}

void calibrate(const CalibrateOptions& options) {
  require_writable_place(options.out);
  sensors::DarknessCalibrationSettings settings;
  settings.scale.mm_per_px = options.mm_per_px;
  if (options.camera_distance_mm) settings.scale.camera_distance_mm = *options.camera_distance_mm;
  settings.darkening.smoothing_px = options.smoothing_px;
  settings.darkening.follow_exposure = !options.locked_exposure;
  settings.cross_validate = true;
  datasets::TableFrames frames(options.frames);
  const std::vector<lab::AnnotatedPress> table = lab::read_ball_press_table(frames, options.annotations);
  const sensors::RestPicture rest = lab::read_rest_picture(frames, lab::rest_files(frames, options.rest));
  const std::vector<sensors::BallPress> presses =
      lab::read_dark_presses(frames, table, rest, settings.darkening, settings.scale);
  const sensors::DarknessCalibration result = sensors::calibrate_darkness(presses, rest, settings);
  sensors::save(result.model, options.out);

  for (std::size_t i = 0; i < presses.size(); ++i) {
    const sensors::ContactCircle& circle = presses[i].circle.value();
    fmt::print("{}: contact {} ({:.2f}, {:.2f}), radius {:.2f} px; the ball is {:.3f} mm deep\n", presses[i].name,
               table[i].circle ? "at" : "found at", circle.centre.x(), circle.centre.y(), circle.radius,
               result.depths_mm[i]);
  }
  const sensors::DarknessCurve& curve = result.model.curve;
  fmt::print("{}: {} presses, {} pixels; calibrated to {:.3f} mm, where it is darker by {:.0f} %\n",
             options.out.string(), presses.size(), result.pixels, curve.deepest_mm(), 100.0 * curve.darkest());
  if (result.nearest_to_rest > 0.0) {
    fmt::print(
        "  no contact reaches the height of rest: below a darkening of {:.1f} % the curve goes on straight; "
        "shallower presses would measure it\n",
        100.0 * result.nearest_to_rest);
  }
  print_error("on what was learnt from", result.fitted);
  print_error("on halves of contacts that were held out", *result.held_out);
}

}  // namespace

void add_9dtact_calibration(CLI::App& calibrations, const GlobalOptions&, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "9dtact", "Make the curve from darkness to height of frames of a pressed ball: a milky gel under a black skin");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--frames", options->frames, kTableFramesHelp)->required();
  command
      ->add_option("--annotations", options->annotations,
                   "CSV with the header file,u_px,v_px,radius_px,ball_diameter_mm: the outline of the touched part of "
                   "the ball in each picture, or three empty cells where it is to be found")
      ->required();
  command
      ->add_option("--rest", options->rest,
                   "Pictures of the untouched gel, one or more: of these frames, or files elsewhere")
      ->required();
  command->add_option("--mm-per-px", options->mm_per_px, "Size of a pixel on the gel, mm")
      ->required()
      ->check(CLI::Range(1e-4, 10.0));
  command
      ->add_option(
          "--camera-distance-mm", options->camera_distance_mm,
          "How far before the gel the camera seems to stand (focal length in pixels times --mm-per-px): what is "
          "pressed in looks larger. Without it that is left out")
      ->check(CLI::Range(1.0, 1e6));
  command
      ->add_option("--smoothing-px", options->smoothing_px,
                   "Standard deviation of the Gaussian that pictures are smoothed by, px; 0 is none")
      ->check(CLI::Range(0.0, sensors::kMostSmoothing_px))
      ->capture_default_str();
  command->add_flag("--locked-exposure", options->locked_exposure,
                    "The camera's exposure never changes: don't read it from the picture's border");
  command->add_option("-o,--out", options->out, "The model's file")->required();
  command->callback([&action, options] { action = [options] { calibrate(*options); }; });
}

}  // namespace touchstone::apps
