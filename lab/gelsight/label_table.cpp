#include "lab/gelsight/label_table.h"

#include "core/error.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {

std::vector<LabelledMap> read_label_table(datasets::TableFrames& frames, const std::filesystem::path& csv) {
  std::vector<LabelledMap> table;
  datasets::for_each_row(csv, "file,material", [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    if (cells[1].empty()) fail_at(where, "material: is empty");
    table.push_back({frames.named(cells[0], where), cells[1]});
  });
  if (table.empty()) fail("{}: has no line with a file", csv.string());
  return table;
}

}  // namespace touchstone::lab
