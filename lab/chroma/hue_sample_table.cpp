#include "lab/chroma/hue_sample_table.h"

#include <fmt/format.h>

#include <map>

#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kColumns = "file,marker_column,marker_row,x_mm,y_mm,z_mm,series";

int place_in_grid(const std::string& cell, const char* field, int count, const SourceLocation& where) {
  const int value = datasets::whole_number_in<int>(cell, field, where);
  if (value < 0 || value >= count) {
    fail_at(where, "{}: {} isn't in the grid, which has {}: 0 to {}", field, value, count, count - 1);
  }
  return value;
}

}  // namespace

std::vector<AnnotatedMarker> read_hue_sample_table(datasets::TableFrames& frames, const fs::path& csv,
                                                   const Eigen::Vector2i& grid) {
  std::vector<AnnotatedMarker> table;
  datasets::for_each_row(csv, kColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    AnnotatedMarker line;
    line.where = where;
    line.file = frames.named(cells[0], where);
    const int column = place_in_grid(cells[1], "marker_column", grid.x(), where);
    const int row = place_in_grid(cells[2], "marker_row", grid.y(), where);
    line.marker = static_cast<std::size_t>(row * grid.x() + column);
    line.displacement_mm = {datasets::number_in(cells[3], "x_mm", where), datasets::number_in(cells[4], "y_mm", where),
                            datasets::number_in(cells[5], "z_mm", where)};
    line.series = datasets::whole_number_in<int>(cells[6], "series", where);
    table.push_back(std::move(line));
  });
  if (table.empty()) fail("{}: has no marker", csv.string());
  return table;
}

TableSamples read_hue_samples(datasets::TableFrames& frames, const std::vector<AnnotatedMarker>& table,
                              sensors::ColourMarkerFinder& finder) {
  const int columns = finder.rest().grid.x();
  std::map<fs::path, sensors::ColourMarkerReading> readings;
  TableSamples result;
  for (const AnnotatedMarker& line : table) {
    const int marker = static_cast<int>(line.marker);
    const std::string name = fmt::format("marker ({}, {})", marker % columns, marker / columns);
    const sensors::MarkerFlaw at_rest = finder.rest().markers[line.marker].flaw;
    if (at_rest != sensors::MarkerFlaw::kNone) {
      fail_at(line.where, "{} isn't sound in the picture at rest: {}", name, sensors::name_of(at_rest));
    }
    auto known = readings.find(line.file);
    if (known == readings.end()) {
      try {
        datasets::naming(line.file,
                         [&] { known = readings.emplace(line.file, finder.find(frames.read(line.file))).first; });
      } catch (const Error& error) {
        fail_at(line.where, "{}", error.what());
      }
    }
    const sensors::ColourMarker& seen = known->second.markers[line.marker];
    if (seen.flaw != sensors::MarkerFlaw::kNone) {
      result.left_out.push_back(
          fmt::format("{}: {}: {}", line.file.filename().string(), name, sensors::name_of(seen.flaw)));
      continue;
    }
    result.samples.push_back({line.marker, seen, line.displacement_mm, line.series});
  }
  return result;
}

}  // namespace touchstone::lab
