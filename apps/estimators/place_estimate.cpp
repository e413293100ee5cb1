#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/surface_options.h"
#include "apps/progress_bar.h"
#include "core/whole_file.h"
#include "lab/gelsight/place_table.h"
#include "sensors/touch_map/tactile_map_file.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, marks, out;
};

void estimate(const EstimateOptions& options, const SurfaceOptions& surfaces, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sensors::TactileMap map(sensors::load_tactile_map(options.model));
  lab::HeightSource source = height_source(surfaces);
  lab::PlaceReader reader(source, options.marks);
  std::vector<lab::PlaceRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = reader.localise(map, bar.listener());
  }
  write_whole_file(options.out, lab::to_csv(records));
  std::vector<std::string> faults;
  int found = 0;
  for (const lab::PlaceRecord& record : records) {
    if (!record.fault.empty()) faults.push_back(record.fault);
    found += record.fault.empty() && record.found.localised() ? 1 : 0;
  }
  warn_of_faults(faults);
  warn_of_notes(*surfaces.frames);
  fmt::print("{}: the places of {} of {} touches\n", options.out.string(), found, records.size());
}

}  // namespace

void add_place_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("place", "Where touches lie on a map of an object's face");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The map that `touchstone calibrate place` made")->required();
  const auto surfaces = add_surface_options(*command);
  command->add_option("--marks", options->marks, "Where pixels look, as for the map");
  command->add_option("-o,--out", options->out, "The places: a .csv file, one line a touch")->required();
  command->callback([&action, &global, options, surfaces] {
    action = [options, surfaces, &global] { estimate(*options, *surfaces, global); };
  });
}

}  // namespace touchstone::apps
