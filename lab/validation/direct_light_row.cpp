#include "lab/validation/direct_light_row.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>

#include "core/seconds_since.h"
#include "sim/scene/device.h"

namespace touchstone::lab {
namespace {

constexpr double kAllowed_percent = 5.0;

}  // namespace

ValidationRow direct_light_row(const std::string& id, const std::string& name,
                               const sim::VirtualSensorSettings& settings, const ValidateOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / (name + ".yaml")), options.cache,
                                  settings);
  const sim::LightChoice& light = sensor.light();
  ValidationRow row;
  row.id = id;
  row.title = fmt::format("{}: {}", name, light.reason);
  row.unit = std::string("%");
  row.reference = kAllowed_percent;
  row.quick = options.quick;
  row.ours = std::numeric_limits<double>::quiet_NaN();
  if (light.direct && light.error) {
    row.ours = 100.0 * light.error->rms;
    const double half = kNormal95 * 100.0 * light.error->rms_error;
    row.ci95 = {row.ours - half, row.ours + half};
    row.holds = row.ours <= kAllowed_percent;
  }
  row.seconds = seconds_since(begun);
  return row;
}

}  // namespace touchstone::lab
