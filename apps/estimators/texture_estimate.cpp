#include <fmt/format.h>

#include <map>
#include <memory>

#include "apps/command.h"
#include "apps/estimators/surface_options.h"
#include "apps/progress_bar.h"
#include "lab/gelsight/texture_table.h"
#include "sensors/texture/texture_model_file.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, out;
  int square_px = lab::TextureLearning{}.square_px;
};

void estimate(const EstimateOptions& options, const SurfaceOptions& surfaces, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sensors::TextureModel model = sensors::load_texture_model(options.model);
  lab::HeightSource source = height_source(surfaces);
  std::vector<lab::TextureRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = lab::write_materials(model, source, options.square_px, options.out, bar.listener());
  }
  std::vector<std::string> faults;
  std::map<std::string, int> counts;
  for (const lab::TextureRecord& record : records) {
    if (record.fault.empty()) {
      ++counts[record.material];
    } else {
      faults.push_back(record.fault);
    }
  }
  warn_of_faults(faults);
  warn_of_notes(*surfaces.frames);
  fmt::print("{}: materials of {} height maps\n", options.out.string(), records.size() - faults.size());
  for (const auto& [material, count] : counts) fmt::print("  {}: {}\n", material, count);
}

}  // namespace

void add_texture_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("texture", "The material of surfaces from their height maps");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate texture` made")->required();
  const auto surfaces = add_surface_options(*command);
  command->add_option("--square-px", options->square_px, "Side of the squares that each map is cut into, px")
      ->check(CLI::Range(1, 8192))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The materials: a .csv file, one line a map")->required();
  command->callback([&action, &global, options, surfaces] {
    action = [options, surfaces, &global] { estimate(*options, *surfaces, global); };
  });
}

}  // namespace touchstone::apps
