#include "datasets/sources/force_readings_table.h"

#include "core/error.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::datasets {

sensors::ForceReadings read_force_readings(const std::filesystem::path& csv) {
  sensors::ForceReadings readings;
  for_each_row(csv, "t_us,force_N", [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    const auto t_us = whole_number_in<std::int64_t>(cells[0], "t_us", where);
    if (!readings.t_us.empty() && t_us <= readings.t_us.back()) {
      fail_at(where, "t_us: {} isn't after the line before's, {}", t_us, readings.t_us.back());
    }
    readings.t_us.push_back(t_us);
    readings.force_N.push_back(number_in(cells[1], "force_N", where));
  });
  if (const std::string fault = fault_of(readings); !fault.empty()) fail("{}: {}", csv.string(), fault);
  return readings;
}

}  // namespace touchstone::datasets
