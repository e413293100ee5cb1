// How far the gelsight devices' frames, made by direct light, are off path tracing: what all other rows of the sensor
// stand on.

#include <fmt/format.h>

#include <chrono>
#include <limits>

#include "lab/seconds_since.h"
#include "lab/validation.h"
#include "sim/device.h"
#include "sim/touch_rig.h"

namespace touchstone::lab {
namespace {

constexpr double kAllowed_percent = 5.0;  // as scenes/gelsight ask for

}  // namespace

std::vector<ValidationRow> validate_gelsight_light(const ValidateOptions& options) {
  std::vector<ValidationRow> rows;
  for (const char* name : {"flat", "markers", "dome", "portable"}) {
    const auto begun = std::chrono::steady_clock::now();
    const std::string file = fmt::format("gelsight-{}.yaml", name);
    const sim::TouchRig rig(sim::read_device(options.scenes / "devices" / file), options.cache);
    const sim::LightChoice& light = rig.light();
    ValidationRow row;
    row.id = fmt::format("gelsight.light.{}_error_percent", name);
    row.title = fmt::format("gelsight-{}: {}", name, light.reason);
    row.unit = std::string("%");
    row.reference = kAllowed_percent;
    row.quick = options.quick;
    row.ours = std::numeric_limits<double>::quiet_NaN();  // where paths are traced after all
    if (light.direct && light.error) {
      row.ours = 100.0 * light.error->rms;
      const double half = kNormal95 * 100.0 * light.error->rms_error;
      row.ci95 = {row.ours - half, row.ours + half};
      row.holds = row.ours <= kAllowed_percent;
    }
    row.seconds = seconds_since(begun);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace touchstone::lab
