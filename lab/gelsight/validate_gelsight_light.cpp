// How far the gelsight devices' frames, made by direct light, are off path tracing: what all other rows of the sensor
// stand on.

#include <fmt/format.h>

#include "lab/validation/direct_light_row.h"

namespace touchstone::lab {

std::vector<ValidationRow> validate_gelsight_light(const ValidateOptions& options) {
  std::vector<ValidationRow> rows;
  for (const char* name : {"flat", "markers", "dome", "portable"}) {
    rows.push_back(direct_light_row(fmt::format("gelsight.light.{}_error_percent", name),
                                    fmt::format("gelsight-{}", name), {}, options));
  }
  return rows;
}

}  // namespace touchstone::lab
