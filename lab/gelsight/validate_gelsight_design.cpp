// Which ball to calibrate gelsight with. [Li2015, sec. 2.2.2]: a larger one has more pixels, which fill the table of
// colours better; a small one can be pressed in so far that steep slopes are seen, too; so "around 2 mm". Here each
// size is used by itself, and what it teaches is tried on other balls.

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/gelsight/gelsight_height_experiment.h"
#include "lab/validation/row_list.h"

namespace touchstone::lab {
namespace {

constexpr std::uint64_t kCalibrationSeed = 1000;
constexpr std::uint64_t kTestSeed = 9500;
constexpr double kMembrane_um = 40.0;
constexpr double kDepth_mm = 0.6;
constexpr double kDeepest = 0.3;  // of a ball's diameter
constexpr double kRim = 1.15;     // of the contact's radius: the membrane's own slope around it and the hand's errors

/// Mean absolute error (um) over presses of other balls than any that calibrates.
double error_elsewhere(const sim::VirtualSensor& sensor, sensors::HeightEstimator& estimator) {
  double sum = 0.0;
  int count = 0;
  for (const double diameter : {3.0, 6.0, 16.0}) {
    const sim::TouchObject ball = sensor.object(ball_of(diameter));
    for (const double depth : {0.2, 0.5}) {
      const sim::Touch touch = sensor.press(ball, {.place_mm = {0.7, -0.9}, .depth_mm = depth},
                                            {.noise_seed = kTestSeed + static_cast<unsigned>(count)});
      sum += height_error(estimator.estimate(touch.frame), touch, sensor.mm_per_px()).mean_um;
      ++count;
    }
  }
  return sum / count;
}

}  // namespace

std::vector<ValidationRow> validate_gelsight_design(const ValidateOptions& options) {
  sim::VirtualSensorSettings settings;
  settings.membrane_um = kMembrane_um;
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / "gelsight-flat.yaml"), options.cache,
                                  settings);
  RowList rows("gelsight.design.", options, RowList::Since::last_row);
  std::vector<double> diameters = {2.0, 4.0, 12.7};
  if (!options.quick) diameters = {1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.7, 22.25};
  const cv::Size picture = sensor.background(kCalibrationSeed, 0).size();
  const Eigen::Vector2d seen_mm = sensor.mm_per_px() * Eigen::Vector2d(picture.width, picture.height);
  std::vector<std::pair<double, double>> steepest, error, pixels;
  for (const double diameter : diameters) {
    CalibrationPresses presses;
    presses.ball_diameter_mm = diameter;
    presses.wide_ball_depth_mm = 0.0;  // by itself
    const double depth = std::min(kDepth_mm, kDeepest * diameter);
    presses.depths_mm = {depth};
    // A large ball's contact is as wide as the ball at that depth, and must be seen whole.
    const double reach = kRim * std::sqrt(depth * (diameter - depth));
    presses.extent_mm = presses.extent_mm.cwiseMin((seen_mm.array() - 2.0 * reach).matrix());
    if (options.quick) {
      presses.columns = 3;
      presses.rows = 2;
    }
    const HeightCalibrationResult made = calibrate_heights(sensor, presses, {}, kCalibrationSeed);
    const sensors::TableCoverage& coverage = made.calibration.coverage;
    sensors::HeightEstimator estimator(made.calibration.model);
    // Balls that can't go as deep as the others show slopes of their depth, not of their size.
    if (depth == kDepth_mm) steepest.emplace_back(diameter, coverage.steepest_slope);
    pixels.emplace_back(diameter, static_cast<double>(made.calibration.pixels) / made.presses);
    error.emplace_back(diameter, error_elsewhere(sensor, estimator));
    rows.add(fmt::format("ball_{:g}mm_table_percent", diameter),
             fmt::format(
                 "cells of the colour table that {} presses of a ball of {:g} mm to {:.2g} mm fill: {} of {}, from {} "
                 "pixels; slopes to {:.2f}; on balls of 3, 6 and 16 mm the model errs by {:.1f} um",
                 made.presses, diameter, presses.depths_mm.front(), coverage.cells_hit, coverage.cells,
                 made.calibration.pixels, coverage.steepest_slope, error.back().second),
             "%", 100.0 * static_cast<double>(coverage.cells_hit) / static_cast<double>(coverage.cells), Better::near,
             true);
  }
  const auto rises = [](const std::pair<double, double>& a, const std::pair<double, double>& b) {
    return a.second < b.second;
  };
  ValidationRow& slope = rows.add(
      "slope_of_smallest_over_largest",
      fmt::format("steepest slope that the smallest ball shows over that of the largest, of those pressed {:g} "
                  "mm deep; holds if it falls from each size to the next",
                  kDepth_mm),
      "1", steepest.front().second / steepest.back().second, Better::higher,
      std::is_sorted(steepest.rbegin(), steepest.rend(), rises));
  slope.series = ValidationSeries{"ball's diameter, mm", "steepest slope", steepest};
  ValidationRow& more =
      rows.add("pixels_of_largest_over_smallest",
               "pixels that a press of the largest ball teaches from over those of the smallest; holds if "
               "they rise from each size to the next, as the thesis says",
               "1", pixels.back().second / pixels.front().second, Better::higher,
               std::is_sorted(pixels.begin(), pixels.end(), rises));
  more.series = ValidationSeries{"ball's diameter, mm", "pixels of a press", pixels};
  const auto best = std::min_element(error.begin(), error.end(), rises);
  ValidationRow& chosen = rows.add(
      "best_ball_mm",
      fmt::format("the ball that calibrates best by itself, {:.1f} um off on others; the thesis's of 2 mm is {:.1f} "
                  "um off",
                  best->second,
                  std::find_if(error.begin(), error.end(), [](auto& e) { return e.first == 2.0; })->second),
      "mm", best->first, Better::near, true);
  chosen.series = ValidationSeries{"ball's diameter, mm", "mean error on other balls, um", error};
  return rows.rows();
}

}  // namespace touchstone::lab
