#pragma once
// Frames of a coated gel, painted by a formula of their own: matt shading by four coloured lamps, with noise.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "sensors/heights/ball_press.h"

namespace touchstone::sensors::fixtures {

/// Height and slope at a place, mm and mm/mm.
struct Relief {
  double height = 0.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};
using Field = std::function<Relief(const Eigen::Vector2d& place_mm)>;

/// A ball's imprint: the ball within the contact, beyond it a slope that fades exponentially from the rim's.
struct Ball {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 2.0;
  double contact_mm = 0.8;

  Relief at(const Eigen::Vector2d& place) const {
    const Eigen::Vector2d offset = place - centre_mm;
    const double r = offset.norm();
    const double rim_slope = contact_mm / std::sqrt(radius_mm * radius_mm - contact_mm * contact_mm);
    const double fade = 0.3 * contact_mm;
    if (r < contact_mm) {
      const double rest = std::sqrt(radius_mm * radius_mm - r * r);
      const double rim = std::sqrt(radius_mm * radius_mm - contact_mm * contact_mm);
      return {rim_slope * fade + rest - rim, -offset / rest};
    }
    const double slope = rim_slope * std::exp(-(r - contact_mm) / fade);
    return {slope * fade, -slope * offset / r};
  }
};

struct Light {
  double elevation_deg = 35.0;
  double fall_off = 0.0;  ///< relative change of a lamp's light from the middle to the side nearest to it
  double bend_deg = 0.0;  ///< change of its elevation over that distance
  double level = 1.0;     ///< of all lamps: above 1.4 pictures saturate
  double noise_DN = 1.0;
};

/// Paints frames. Each frame has noise of its own.
class GelPainter {
 public:
  GelPainter(int width, int height, double mm_per_px, const Light& light)
      : width_(width), height_(height), mm_per_px_(mm_per_px), light_(light) {}

  cv::Mat paint(const Field& field) {
    RandomStream random(11, frames_++, Purpose::kTest);
    // Red, green, blue and white, from the left, the top, the right and the bottom; BGR.
    const Eigen::Vector3d colours[] = {{6, 10, 110}, {10, 100, 12}, {115, 14, 5}, {45, 50, 48}};
    const Eigen::Vector2d sides[] = {{-1, 0}, {0, -1}, {1, 0}, {0, 1}};
    cv::Mat frame(height_, width_, CV_8UC3);
    for (int v = 0; v < height_; ++v) {
      for (int u = 0; u < width_; ++u) {
        const Eigen::Vector2d place = mm_per_px_ * Eigen::Vector2d(u + 0.5, v + 0.5);
        const Eigen::Vector2d slope = field(place).slope;
        const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
        Eigen::Vector3d value = Eigen::Vector3d::Constant(20.0);
        const Eigen::Vector2d middle(u + 0.5 - 0.5 * width_, v + 0.5 - 0.5 * height_);
        for (int lamp = 0; lamp < 4; ++lamp) {
          const double nearness = sides[lamp].dot(middle) / (0.5 * width_);
          const double elevation = kRadiansPerDegree * (light_.elevation_deg + light_.bend_deg * nearness);
          Eigen::Vector3d direction;
          direction << std::cos(elevation) * sides[lamp], std::sin(elevation);
          const double power = light_.level * (1.0 + light_.fall_off * nearness);
          value += power * std::max(0.0, normal.dot(direction)) * colours[lamp];
        }
        for (int c = 0; c < 3; ++c) {
          frame.at<cv::Vec3b>(v, u)[c] = cv::saturate_cast<unsigned char>(value[c] + light_.noise_DN * random.normal());
        }
      }
    }
    return frame;
  }
  cv::Mat rest() {
    return paint([](const Eigen::Vector2d&) { return Relief{}; });
  }
  Background background(int frames = 8) {
    std::vector<cv::Mat> all;
    for (int i = 0; i < frames; ++i) all.push_back(rest());
    return mean_background(all);
  }
  BallPress press(const Ball& ball) {
    BallPress result;
    result.name = "press";
    result.frame = paint([&](const Eigen::Vector2d& place) { return ball.at(place); });
    result.circle = ContactCircle{ball.centre_mm / mm_per_px_, ball.contact_mm / mm_per_px_};
    result.ball_radius_mm = ball.radius_mm;
    return result;
  }
  /// Presses on a grid of places.
  std::vector<BallPress> presses(int columns, int rows, double radius_mm, double contact_mm) {
    std::vector<BallPress> all;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const Eigen::Vector2d centre(mm_per_px_ * width_ * (i + 1) / (columns + 1) + 0.013,
                                     mm_per_px_ * height_ * (j + 1) / (rows + 1) - 0.021);
        all.push_back(press({centre, radius_mm, contact_mm}));
      }
    }
    return all;
  }
  /// True heights of a field at the pixels' centres.
  cv::Mat heights(const Field& field) const {
    cv::Mat result(height_, width_, CV_32FC1);
    for (int v = 0; v < height_; ++v) {
      for (int u = 0; u < width_; ++u) {
        result.at<float>(v, u) = static_cast<float>(field(mm_per_px_ * Eigen::Vector2d(u + 0.5, v + 0.5)).height);
      }
    }
    return result;
  }

 private:
  int width_, height_;
  double mm_per_px_;
  Light light_;
  std::uint64_t frames_ = 0;
};

}  // namespace touchstone::sensors::fixtures
