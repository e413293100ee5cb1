#include "lab/reflex/press_table.h"

#include "core/error.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

constexpr const char* kPressColumns = "file,press_mm,force_x_N,force_y_N,force_z_N,lateral_x_mm,lateral_y_mm";

}  // namespace

std::map<std::string, KnownPress> read_press_table(const std::filesystem::path& csv) {
  std::map<std::string, KnownPress> table;
  datasets::for_each_row(csv, kPressColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    const auto both = [&](std::size_t at, const char* x, const char* y) -> std::optional<Eigen::Vector2d> {
      if (cells[at].empty() && cells[at + 1].empty()) return std::nullopt;
      return Eigen::Vector2d(datasets::number_in(cells[at], x, where), datasets::number_in(cells[at + 1], y, where));
    };
    KnownPress press;
    press.line = where.line;
    press.press_mm = datasets::number_in(cells[1], "press_mm", where);
    press.shear_N = both(2, "force_x_N", "force_y_N");
    press.normal_N = datasets::number_in(cells[4], "force_z_N", where);
    press.lateral_mm = both(5, "lateral_x_mm", "lateral_y_mm");
    const auto [first, is_new] = table.emplace(cells[0], press);
    if (!is_new) fail_at(where, "file: '{}' stands in line {}, too", cells[0], first->second.line);
  });
  if (table.empty()) fail("{}: has no picture", csv.string());
  return table;
}

}  // namespace touchstone::lab
