#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "lab/vhs/colour_table.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path frames, patches, out;
  std::vector<std::filesystem::path> card;
  double smooth_px = 4.0;
};

void calibrate(const CalibrateOptions& options, const GlobalOptions& global) {
  require_writable_place(options.out);
  datasets::TableFrames frames(options.frames);
  const std::vector<lab::KnownPatch> patches = lab::read_patch_table(frames, options.patches);
  std::vector<std::filesystem::path> card;
  for (const std::filesystem::path& name : options.card) card.push_back(frames.named_or_file(name));
  lab::ColourCalibration made;
  {
    ProgressBar bar(global.quiet);
    made = lab::calibrate_colour(frames, card, options.smooth_px, patches, bar.listener());
  }
  sensors::save(made.model, options.out);
  warn_of_faults(made.faults);
  fmt::print("{}: {} patches; {:.0f} % of the picture is seen in front of a white card\n", options.out.string(),
             made.model.patches, 100.0 * made.trusted_share);
  fmt::print("  colours of these are off by {:.2f} CIEDE2000 in the mean, {:.2f} at most\n",
             made.model.mean_error_de2000, made.model.largest_error_de2000);
  const std::vector<double>& left_out = made.left_out_de2000;
  if (left_out.empty()) return;
  fmt::print("  of patches left out in turn by {:.2f}, {:.2f} at most\n",
             std::accumulate(left_out.begin(), left_out.end(), 0.0) / static_cast<double>(left_out.size()),
             *std::ranges::max_element(left_out));
}

}  // namespace

void add_colour_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "colour", "Make the model of colours seen through a clear gel, of a white card and patches that are known");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--frames", options->frames, kTableFramesHelp)->required();
  command
      ->add_option("--patches", options->patches,
                   "CSV with the header file,left_px,top_px,width_px,height_px,L,a,b (CIE L*a*b*, D65), or "
                   "red,green,blue (sRGB, 0 to 255) in place of these three: rectangles of known colour")
      ->required();
  command
      ->add_option(
          "--card", options->card,
          "Pictures of an even white card through the gel, one or more, of the same exposure: of these frames, or "
          "files elsewhere")
      ->required();
  command->add_option("--smoothing-px", options->smooth_px, "Standard deviation of the card's smoothing, px; 0 is none")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model's file")->required();
  command->callback([&action, options, &global] { action = [options, &global] { calibrate(*options, global); }; });
}

}  // namespace touchstone::apps
