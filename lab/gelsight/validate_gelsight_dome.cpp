// The domed gel against what contact mechanics knows of it, and against flat gels' height estimator.

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/gelsight/gelsight_dome_experiment.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kAllowedRadius_percent = 3.0;  // a pixel and a half in the smallest disc
constexpr double kAllowedCentre_mm = 0.1;
constexpr double kTilt_deg = 6.0;
constexpr double kPublishedResolution_um = 40.0;  // [Li2015, sec. 2.2.2]: 10 to 40 um

ValidationRow row(const char* id, std::string title, const char* unit, double ours, bool holds, bool quick,
                  std::chrono::steady_clock::time_point begun) {
  ValidationRow made;
  made.id = id;
  made.title = std::move(title);
  made.unit = unit;
  made.ours = ours;
  made.better = Better::lower;
  made.holds = holds;
  made.quick = quick;
  made.seconds = seconds_since(begun);
  return made;
}

}  // namespace

std::vector<ValidationRow> validate_gelsight_dome(const ValidateOptions& options) {
  auto begun = std::chrono::steady_clock::now();
  sim::VirtualSensorSettings settings;
  settings.seed = 11;
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / "gelsight-dome.yaml"), options.cache,
                                  settings);
  const sim::GelSpec& gel = sensor.device().gel;
  std::vector<ValidationRow> rows;

  const std::vector<double> depths =
      options.quick ? std::vector<double>{0.05, 0.2} : std::vector<double>{0.03, 0.05, 0.1, 0.15, 0.2, 0.3};
  double worst = 0.0;
  double against_hertz = 0.0;
  ValidationSeries series{"force, N", "radius of the contact disc, mm", {}};
  std::uint64_t noise = 0;
  for (const double depth : depths) {
    const PlateContact contact = press_plate(sensor, depth, 0.0, ++noise);
    const double error = 100.0 * (contact.radius_mm / plate_radius_on_layer(gel, contact.force_N) - 1.0);
    if (std::abs(error) > std::abs(worst)) worst = error;
    if (depth == depths.front()) {
      against_hertz = 100.0 * (contact.radius_mm / plate_radius_by_hertz(gel, contact.force_N) - 1.0);
    }
    series.points.emplace_back(contact.force_N, contact.radius_mm);
  }
  rows.push_back(
      row("gelsight.dome.contact_radius_error_percent",
          fmt::format("a plate on the dome, {} to {} mm deep: radius of the disc that pixels see touched against "
                      "a sphere on a bonded layer under the same force, worst",
                      depths.front(), depths.back()),
          "%", std::abs(worst), std::abs(worst) < kAllowedRadius_percent, options.quick, begun));
  rows.back().reference = 0.0;
  rows.back().series = std::move(series);
  rows.push_back(
      row("gelsight.dome.hertz_radius_error_percent",
          fmt::format("the same {} mm deep against Hertz, who knows no plate behind the gel", depths.front()), "%",
          std::abs(against_hertz), std::abs(against_hertz) < 2.0 * kAllowedRadius_percent, options.quick, begun));
  rows.back().reference = 0.0;

  begun = std::chrono::steady_clock::now();
  const PlateContact tilted = press_plate(sensor, 0.15, kTilt_deg * kRadiansPerDegree, ++noise);
  const double centre_error = (tilted.centre_mm - tilted.expected_mm).norm();
  rows.push_back(
      row("gelsight.dome.tilted_centre_error_mm",
          fmt::format("a plate tilted by {} degrees: middle of the touched pixels against the place where it is "
                      "parallel to the dome, {:.2f} mm aside",
                      kTilt_deg, tilted.expected_mm.norm()),
          "mm", centre_error, centre_error < kAllowedCentre_mm, options.quick, begun));
  rows.back().reference = 0.0;

  begun = std::chrono::steady_clock::now();
  CalibrationPresses presses;
  presses.extent_mm = {9.0, 6.0};
  if (options.quick) {
    presses.columns = 3;
    presses.rows = 2;
  }
  const DomeHeights heights = measure_dome_heights(sensor, presses, sensors::LightCorrection::none, 100);
  double mean_um = 0.0;
  for (const HeightError& error : heights.balls) mean_um += error.mean_um / static_cast<double>(heights.balls.size());
  rows.push_back(row("gelsight.dome.height_error_um",
                     "a ball of 4 mm, 0.4 mm deep at three places of the dome: mean error of the height map over the "
                     "picture, by the flat gels' estimator with the dome's own background",
                     "um", mean_um, mean_um < kPublishedResolution_um, options.quick, begun));
  rows.back().published = kPublishedResolution_um;
  rows.push_back(row("gelsight.dome.plate_height_error_um",
                     "the same for a plate 0.3 mm deep, whose disc is as flat as the dome isn't", "um",
                     heights.plate.mean_um, heights.plate.mean_um < kPublishedResolution_um, options.quick, begun));
  rows.back().published = kPublishedResolution_um;
  return rows;
}

}  // namespace touchstone::lab
