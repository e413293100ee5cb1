#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/surface_options.h"
#include "apps/progress_bar.h"
#include "core/whole_file.h"
#include "lab/gelsight/height_maps.h"
#include "lab/gelsight/place_table.h"
#include "sensors/touch_map/tactile_map_file.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path marks, table, picture, out;
};

void calibrate(const CalibrateOptions& options, const SurfaceOptions& surfaces, const GlobalOptions& global) {
  for (const auto& file : {options.out, options.table, options.picture}) {
    if (!file.empty()) require_writable_place(file);
  }
  lab::HeightSource source = height_source(surfaces);
  lab::PlaceReader reader(source, options.marks);
  std::vector<lab::PlaceRecord> records;
  sensors::TactileMap map;
  {
    ProgressBar bar(global.quiet);
    map = reader.build({}, records, bar.listener());
  }
  sensors::save(map.data(), options.out);
  if (!options.table.empty()) write_whole_file(options.table, lab::to_csv(records));
  if (!options.picture.empty()) lab::write_height_map(map.data().height_mm, options.picture, lab::HeightFormat::exr);
  std::vector<std::string> faults;
  for (const lab::PlaceRecord& record : records) {
    if (!record.fault.empty()) faults.push_back(record.fault);
  }
  warn_of_faults(faults);
  warn_of_notes(*surfaces.frames);
  const sensors::TactileMapData& data = map.data();
  fmt::print("{}: a map of {} of {} touches, {:.1f} x {:.1f} mm\n", options.out.string(), data.touches, records.size(),
             data.height_mm.cols * data.frame.mm_per_px, data.height_mm.rows * data.frame.mm_per_px);
  for (const lab::PlaceRecord& record : records) {
    if (record.fault.empty() && !record.found.localised()) {
      fmt::print("  {} isn't in it: {}\n", record.file, sensors::name_of(record.found.outcome));
    }
  }
}

}  // namespace

void add_place_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      calibrations.add_subcommand("place", "Make a map of an object's face from height maps of touches that overlap");
  auto options = std::make_shared<CalibrateOptions>();
  const auto surfaces = add_surface_options(*command);
  command->add_option(
      "--marks", options->marks,
      "Where pixels look, if not on a straight grid: CSV with the header u_px,v_px,x_mm,y_mm, 20 marks or "
      "more");
  command->add_option("--table", options->table, "Where each touch lies on the map: a .csv file");
  command->add_option("--picture", options->picture, "The map's heights: an .exr file");
  command->add_option("-o,--out", options->out, "The map's file")->required();
  command->callback([&action, &global, options, surfaces] {
    action = [options, surfaces, &global] { calibrate(*options, *surfaces, global); };
  });
}

}  // namespace touchstone::apps
