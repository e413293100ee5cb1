#pragma once
// A coated gel that is painted, and what a touch reader needs of it.

#include <opencv2/core.hpp>
#include <vector>

#include "sensors/heights/height_calibration.h"
#include "sensors/markers/touch_reader.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {

inline constexpr int kGelWidth = 240;  ///< px
inline constexpr int kGelHeight = 180;
inline constexpr double kGelScale_mm = 0.053;  ///< a pixel

/// A model from two presses, with a smaller table than the default's, to be quick.
inline HeightModel small_height_model(fixtures::GelPainter& painter) {
  HeightCalibrationSettings settings;
  settings.mm_per_px = kGelScale_mm;
  settings.table.most_cells = 1U << 15U;
  settings.correction = LightCorrection::none;
  settings.cross_validate = false;
  return calibrate_height(painter.presses(2, 2, 1.0, 0.75), painter.background(), settings).model;
}

/// The gel with markers printed on it.
struct MarkedGel {
  fixtures::GelPainter painter{kGelWidth, kGelHeight, kGelScale_mm, {}};
  std::vector<Eigen::Vector2d> markers = fixtures::marker_grid(22.6, kGelWidth, kGelHeight);
  cv::Mat ink =
      fixtures::paint_markers({.width = kGelWidth, .height = kGelHeight, .brightness = 255, .shading = 0}, markers);

  cv::Mat frame(const fixtures::Field& field) {
    cv::Mat picture = painter.paint(field);
    cv::multiply(picture, ink, picture, 1.0 / 255);
    return picture;
  }
  /// Pressed in the middle by a ball of 6 mm radius, over 2.2 mm round it.
  cv::Mat pressed() {
    const fixtures::Ball ball{kGelScale_mm * Eigen::Vector2d(120, 90), 6.0, 2.2};
    return frame([&](const Eigen::Vector2d& place) { return ball.at(place); });
  }
  TouchCalibration calibration() {
    TouchCalibration made;
    made.height = small_height_model(painter);
    made.normal = LinearForce{.newton_per_unit = 0.1};
    made.shear = LinearForce{.newton_per_unit = 2.0};
    made.background = frame([](const Eigen::Vector2d&) { return fixtures::Relief{}; });
    return made;
  }
};

}  // namespace touchstone::sensors
