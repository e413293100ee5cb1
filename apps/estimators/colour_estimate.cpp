#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/vhs/colour_table.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, regions, mask, out;
};

void estimate(const EstimateOptions& options, const SourceOptions& source, const GlobalOptions& global) {
  require_writable_place(options.out);
  if (options.regions.empty() == options.mask.empty()) fail("give either --regions CSV or --mask PICTURE");
  const sensors::ColourModel model = sensors::load_colour_model(options.model);
  const cv::Size size = model.field.white.size();
  const std::vector<lab::NamedRegion> regions =
      options.mask.empty() ? lab::read_region_table(options.regions, size) : lab::read_region_mask(options.mask, size);
  lab::ColourSummary summary;
  {
    ProgressBar bar(global.quiet);
    summary = lab::write_colours(model, regions, opened_streams(source), options.out, bar.listener());
  }
  warn_of_faults(summary.faults);
  warn_of_notes(source);
  fmt::print("{}: {} colours in {} pictures\n", options.out.string(), summary.colours, summary.pictures);
}

}  // namespace

void add_colour_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("colour", "CIE L*a*b* of regions of what a clear gel touches");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate colour` made")->required();
  const auto source = add_source_options(*command, "--frames", {});
  command->add_option("--regions", options->regions,
                      "CSV with the header region,left_px,top_px,width_px,height_px: rectangles, each with a name");
  command->add_option("--mask", options->mask,
                      "In place of them a grey picture: each number in it but 0 is a region of that name");
  command->add_option("-o,--out", options->out, "The colours: a .csv file, one line a region of a frame")->required();
  command->callback([&action, options, source, &global] {
    action = [options, source, &global] { estimate(*options, *source, global); };
  });
}

}  // namespace touchstone::apps
