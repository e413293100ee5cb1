#include "lab/gelsight/gelsight_height_experiment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/units.h"
#include "fem/shapes/relief_map.h"
#include "sim/scene/device_gel.h"

namespace touchstone::lab {

namespace {

constexpr double kEdgeRadius_mm = 0.1;
constexpr double kCylinderHeight_mm = 6.0;

/// One of the presses that the gel gets at each place.
struct BallPressed {
  sim::TouchObject ball;
  double radius_mm = 0.0;
  double depth_mm = 0.0;
};

std::vector<Eigen::Vector2d> places_of(const CalibrationPresses& how) {
  const auto along = [](int k, int count) { return count > 1 ? k / (count - 1.0) - 0.5 : 0.0; };
  std::vector<Eigen::Vector2d> places;
  for (int j = 0; j < how.rows; ++j) {
    for (int i = 0; i < how.columns; ++i) {
      places.emplace_back(how.extent_mm.x() * along(i, how.columns), how.extent_mm.y() * along(j, how.rows));
    }
  }
  return places;
}

}  // namespace

sim::ObjectSpec ball_of(double diameter_mm) {
  sim::ObjectSpec object;
  object.name = fmt::format("ball-{}mm", diameter_mm);
  object.shape.radius_mm = 0.5 * diameter_mm;
  return object;
}

sim::ObjectSpec flat_cylinder_of(double diameter_mm) {
  sim::ObjectSpec object;
  object.name = fmt::format("cylinder-{}mm", diameter_mm);
  object.shape.type = sim::ShapeKind::rounded_cylinder;
  object.shape.radius_mm = 0.5 * diameter_mm;
  object.shape.edge_radius_mm = kEdgeRadius_mm;
  object.shape.height_mm = kCylinderHeight_mm;
  return object;
}

sim::ObjectSpec with_friction(sim::ObjectSpec object, double friction) {
  object.friction = friction;
  return object;
}

std::optional<sensors::ContactCircle> contact_circle(const cv::Mat& contact) {
  const cv::Moments moments = cv::moments(contact, true);
  if (moments.m00 < 1.0) return std::nullopt;
  return sensors::ContactCircle{{moments.m10 / moments.m00 + 0.5, moments.m01 / moments.m00 + 0.5},
                                std::sqrt(moments.m00 / kPi)};
}

HeightCalibrationResult calibrate_heights(const sim::VirtualSensor& sensor, const CalibrationPresses& how,
                                          std::optional<sensors::LightCorrection> correction,
                                          std::uint64_t noise_seed) {
  std::vector<cv::Mat> rest;
  for (int i = 0; i < how.background_frames; ++i) rest.push_back(sensor.background(noise_seed, i));
  const sensors::Background background = sensors::mean_background(rest);
  const double mm_per_px = sensor.mm_per_px();
  std::vector<BallPressed> kinds;
  const auto add_kind = [&](double diameter_mm, double depth_mm) {
    kinds.push_back({sensor.object(ball_of(diameter_mm)), 0.5 * diameter_mm, depth_mm});
  };
  for (const double depth : how.depths_mm) add_kind(how.ball_diameter_mm, depth);
  if (how.wide_ball_depth_mm > 0.0) add_kind(how.wide_ball_diameter_mm, how.wide_ball_depth_mm);
  RandomStream hand(noise_seed, 0, Purpose::kPlacement);
  std::vector<sensors::BallPress> presses;
  HeightCalibrationResult result;
  double squares = 0.0;
  int small_ones = 0;
  for (const Eigen::Vector2d& place : places_of(how)) {
    for (const BallPressed& kind : kinds) {
      const sim::Touch touch = sensor.press(kind.ball, {.place_mm = place, .depth_mm = kind.depth_mm},
                                            {.noise_seed = noise_seed + presses.size() + 1});
      const std::optional<sensors::ContactCircle> seen = contact_circle(touch.contact);
      if (!seen) fail("calibration: the ball at ({}, {}) mm isn't seen", place.x(), place.y());
      sensors::BallPress press;
      press.name = fmt::format("press {}", presses.size() + 1);
      press.frame = touch.frame;
      press.ball_radius_mm = kind.radius_mm;
      press.circle.emplace();
      press.circle->centre = seen->centre + how.annotation_px * normal_pair(hand);
      press.circle->radius = seen->radius + how.annotation_px * hand.normal();
      presses.push_back(press);
      try {
        const sensors::ContactCircle found =
            sensors::find_contact_circle(sensors::difference_to(background, press.frame), background,
                                         press.ball_radius_mm, {.mm_per_px = mm_per_px}, press.name);
        ++result.found_circles;
        if (&kind == &kinds.back() && how.wide_ball_depth_mm > 0.0) continue;
        squares += (found.centre - seen->centre).squaredNorm();
        ++small_ones;
      } catch (const Error&) {
        // Counted as not found.
      }
    }
  }
  result.presses = static_cast<int>(presses.size());
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = mm_per_px;
  settings.correction = correction;
  settings.most_lost = how.most_lost;
  result.calibration = sensors::calibrate_height(presses, background, settings);
  sensors::require_all_used(result.calibration);
  result.circle_error_px = small_ones > 0 ? std::sqrt(squares / small_ones) : 0.0;
  return result;
}

HeightError height_error(const sensors::HeightResult& estimate, const sim::Touch& touch, double mm_per_px) {
  TS_ASSERT(estimate.height_mm.size() == touch.height.size() && touch.height.type() == CV_32FC1);
  HeightError error;
  double sum = 0.0;
  double squares = 0.0;
  int pixels = 0;
  int common = 0;
  int either = 0;
  std::vector<float> slopes;
  for (int v = 0; v < touch.height.rows; ++v) {
    const auto* truth = touch.height.ptr<float>(v);
    const auto* ours = estimate.height_mm.ptr<float>(v);
    for (int u = 0; u < touch.height.cols; ++u) {
      if (!std::isfinite(truth[u])) continue;
      const double off_um = kMicrometresPerMillimetre * (static_cast<double>(ours[u]) - static_cast<double>(truth[u]));
      sum += std::abs(off_um);
      squares += off_um * off_um;
      error.worst_um = std::max(error.worst_um, std::abs(off_um));
      if (static_cast<double>(truth[u]) > error.deepest_mm) {
        error.deepest_mm = static_cast<double>(truth[u]);
        error.depth_error_um = off_um;
      }
      ++pixels;
      const bool here = touch.contact.at<unsigned char>(v, u) != 0;
      const bool found = estimate.contact.at<unsigned char>(v, u) != 0;
      common += here && found ? 1 : 0;
      either += here || found ? 1 : 0;
      if (here && u > 0 && v > 0 && std::isfinite(truth[u - 1]) && std::isfinite(touch.height.at<float>(v - 1, u))) {
        slopes.push_back(std::hypot(truth[u] - truth[u - 1], truth[u] - touch.height.at<float>(v - 1, u)));
      }
    }
  }
  if (pixels > 0) {
    error.mean_um = sum / pixels;
    error.rms_um = std::sqrt(squares / pixels);
  }
  error.contact_overlap = either > 0 ? static_cast<double>(common) / either : 1.0;
  if (!slopes.empty()) {
    const auto at = slopes.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(slopes.size() - 1));
    std::nth_element(slopes.begin(), at, slopes.end());
    error.flank_slope = static_cast<double>(*at) / mm_per_px;
  }
  return error;
}

double wave_amplitude(const cv::Mat& height_mm, const cv::Rect& part, double wavelength_px) {
  TS_ASSERT(height_mm.type() == CV_32FC1 && wavelength_px > 0.0 && part.width > wavelength_px);
  TS_ASSERT((part & cv::Rect(0, 0, height_mm.cols, height_mm.rows)) == part);
  using Row = Eigen::Matrix<double, 8, 1>;
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  Row right = Row::Zero();
  for (int v = part.y; v < part.y + part.height; ++v) {
    for (int u = part.x; u < part.x + part.width; ++u) {
      const auto value = static_cast<double>(height_mm.at<float>(v, u));
      if (!std::isfinite(value)) continue;
      const double phase = 2.0 * kPi * (u - part.x) / wavelength_px;
      const double x = 2.0 * (u - part.x) / part.width - 1.0;
      const double y = 2.0 * (v - part.y) / part.height - 1.0;
      Row row;
      row << std::cos(phase), std::sin(phase), 1.0, x, y, x * x, x * y, y * y;
      normal += row * row.transpose();
      right += value * row;
    }
  }
  const Row solution = normal.ldlt().solve(right);
  return std::hypot(solution[0], solution[1]);
}

}  // namespace touchstone::lab
