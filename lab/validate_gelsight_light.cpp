// How far the gelsight devices' frames, made by direct light, are off path tracing: what all other rows of the sensor
// stand on.

#include <fmt/format.h>

#include <chrono>

#include "lab/seconds_since.h"
#include "lab/validation.h"
#include "sim/device.h"
#include "sim/touch_rig.h"

namespace touchstone::lab {
namespace {

constexpr double kAllowed_percent = 5.0;  // as scenes/gelsight ask for
constexpr double kNormal95 = 1.96;

}  // namespace

std::vector<ValidationRow> validate_gelsight_light(const ValidateOptions& options) {
  std::vector<ValidationRow> rows;
  for (const char* name : {"flat", "markers", "dome", "portable"}) {
    const auto begun = std::chrono::steady_clock::now();
    const std::string file = fmt::format("gelsight-{}.yaml", name);
    const sim::TouchRig rig(sim::read_device(options.scenes / "devices" / file), options.cache);
    ValidationRow row;
    row.id = fmt::format("gelsight.light.{}_error_percent", name);
    row.unit = std::string("%");
    row.reference = kAllowed_percent;
    row.quick = options.quick;
    if (const auto& error = rig.light().error; rig.light().direct && error) {
      row.title = fmt::format(
          "gelsight-{}: direct light and carried bounced light against path tracing, a ball of 6 mm pressed in by {} "
          "mm, "
          "root mean square over {} pixels, without the paths' noise",
          name, 0.5 * sim::TouchRigSettings{}.deepest_mm, error->pixels);
      row.ours = 100.0 * error->rms;
      row.ci95 = {row.ours - kNormal95 * 100.0 * error->rms_error, row.ours + kNormal95 * 100.0 * error->rms_error};
      row.holds = row.ours <= kAllowed_percent;
    } else {
      row.title = fmt::format("gelsight-{}: {}", name, rig.light().reason);
    }
    row.seconds = seconds_since(begun);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace touchstone::lab
