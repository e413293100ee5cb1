#include <fmt/format.h>

#include <memory>
#include <set>

#include "apps/command.h"
#include "apps/estimators/chroma_grid.h"
#include "apps/estimators/source_options.h"
#include "core/error.h"
#include "core/units.h"
#include "lab/chroma/chroma_fields.h"
#include "lab/chroma/hue_sample_table.h"
#include "sensors/colour/hue_model_file.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path frames;
  std::filesystem::path presses;
  std::filesystem::path rest;
  std::filesystem::path out;
  std::string grid = "10x10";
  double spacing_mm = 0.0;
  double viewing_distance_mm = 0.0;
  std::string form = "isotropic";
};

sensors::HueModelForm form_named(const std::string& name) {
  sensors::HueModelForm form;
  if (name == "equation4") form.form = sensors::HueForm::kEquation4;
  if (name == "polynomial") form.form = sensors::HueForm::kPolynomial;
  return form;
}

void print_errors(const char* what, const sensors::HueErrors& errors) {
  fmt::print("  {}: RMS {:.0f} um lateral (an axis), {:.0f} um of press; largest {:.0f} um\n", what,
             kMicrometresPerMillimetre * errors.rms_lateral_mm, kMicrometresPerMillimetre * errors.rms_press_mm,
             kMicrometresPerMillimetre * errors.largest_mm);
  if (errors.declined > 0) {
    fmt::print("    {} more have no estimate: their marker, or a neighbour that the form needs, is flawed\n",
               errors.declined);
  }
}

void calibrate(const CalibrateOptions& options) {
  require_writable_place(options.out);
  const Eigen::Vector2i grid = grid_of(options.grid);
  datasets::TableFrames frames(options.frames);
  const std::vector<lab::AnnotatedMarker> table = lab::read_hue_sample_table(frames, options.presses, grid);
  sensors::ColourMarkerFinder finder({.grid = grid});
  lab::find_rest_of(finder, options.rest);
  const lab::TableSamples read = lab::read_hue_samples(frames, table, finder);
  sensors::HueCalibrationSettings settings;
  settings.spacing_mm = options.spacing_mm;
  settings.parallax.viewing_distance_mm = options.viewing_distance_mm;
  settings.form =
      options.form == "best"
          ? sensors::rank_hue_forms(finder.rest(), read.samples, settings, sensors::usual_hue_forms()).front().form
          : form_named(options.form);
  const sensors::HueModel model = sensors::calibrate_hue(finder.rest(), read.samples, settings);
  sensors::save(model, options.out);

  for (const std::string& line : read.left_out) fmt::print("left out: {}\n", line);
  fmt::print("{}: {}, {} samples\n", options.out.string(), sensors::summary_of(model), read.samples.size());
  print_errors("on these", sensors::hue_errors(model, finder.rest(), read.samples));
  std::set<int> series;
  for (const sensors::HueSample& sample : read.samples) series.insert(sample.series);
  if (series.size() < 2) {
    fmt::print("  all is of one series: nothing shows how it does on another\n");
    return;
  }
  try {
    print_errors("on series left out in turn", sensors::cross_validate_hue(finder.rest(), read.samples, settings));
  } catch (const Error& error) {
    fmt::print("  without one of the series the others don't determine it: {}\n", error.what());
  }
}

}  // namespace

void add_chroma_calibration(CLI::App& calibrations, const GlobalOptions&, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "chroma", "Make its model from hues and places to displacements, of frames simulated or recorded");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--frames", options->frames, kTableFramesHelp)->required();
  command
      ->add_option("--presses", options->presses,
                   "CSV with the header file,marker_column,marker_row,x_mm,y_mm,z_mm,series: how far a marker is "
                   "displaced in a picture (a press is -z); lines of one press or shear have one series")
      ->required();
  command->add_option("--rest", options->rest, "The picture of the unloaded sensor")->required();
  command->add_option("--spacing-mm", options->spacing_mm, "From marker to marker")
      ->required()
      ->check(CLI::Range(0.01, 100.0));
  add_grid_option(*command, options->grid);
  command
      ->add_option("--viewing-distance-mm", options->viewing_distance_mm,
                   "Apparent distance from the camera to the markers, for parallax; 0: far away")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option(
          "--form", options->form,
          "Of the model: that of [Lin2019]; polynomials of one marker; or, of many forms, some of which look at "
          "a marker's neighbours, too, the best on series left out")
      ->check(CLI::IsMember({"equation4", "isotropic", "polynomial", "best"}))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, options] { action = [options] { calibrate(*options); }; });
}

}  // namespace touchstone::apps
