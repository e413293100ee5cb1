#pragma once
// Frames of a gel that shows depth as darkness, painted by closed forms: no simulation.

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "sensors/heights/ball_press.h"

namespace touchstone::sensors::fixtures {

/// How a membrane lies round a ball.
enum class Layer {
  thick,  ///< a half space [Hertz1882], [Johnson1985, sec. 4.2]: it sinks round the ball, half of the depth at the rim
  thin    ///< bonded: the rim is at rest, and round it the gel bulges
};

/// A ball of radius R, pressed `depth` deep at a place, all mm.
struct DarkBall {
  Eigen::Vector2d centre;
  double radius = 4.0;
  double depth = 1.0;
  Layer layer = Layer::thick;

  double contact_radius() const {
    if (layer == Layer::thick) return std::sqrt(radius * depth);
    return std::sqrt(2.0 * radius * depth - depth * depth);
  }
  double height_at(const Eigen::Vector2d& place) const {
    const double r = (place - centre).norm();
    const double a = contact_radius();
    if (layer == Layer::thin) {
      if (r <= a) return depth - radius + std::sqrt(radius * radius - r * r);
      const double away = (r - a) / (0.2 * a);
      return -0.12 * depth * away * std::exp(1.0 - away);
    }
    // A paraboloid: the closed form's indenter. The calibration takes a sphere; they differ by r^4 / (8 R^3).
    if (r <= a) return depth - r * r / (2.0 * radius);
    return ((2.0 * a * a - r * r) * std::asin(a / r) + a * std::sqrt(r * r - a * a)) / (3.14159265358979 * radius);
  }
};

/// The sensor that is painted.
class DarknessPainter {
 public:
  int width = 320;
  int height = 240;
  double mm_per_px = 0.05;
  double strength = 0.55;     ///< of the light, that a very deep press takes
  double soft_mm = 2.5;       ///< depth at which 63 % of that is taken
  double fall_off = 0.25;     ///< of the lamps, from the middle to the corners
  double brightness = 160.0;  ///< DN, of the middle
  double noise_DN = 1.5;
  int channels = 3;
  double camera_distance_mm = INFINITY;  ///< of a pinhole over the picture's middle: nearer places look larger

  /// The law that calibration should find.
  double darkening_of(double height_mm) const { return strength * (1.0 - std::exp(-height_mm / soft_mm)); }

  using Heights = std::function<double(const Eigen::Vector2d&)>;

  cv::Mat frame(const Heights& height_mm, double exposure = 1.0, int seed = 1) const {
    cv::RNG random(static_cast<std::uint64_t>(seed));
    const double tints[] = {1.0, 0.97, 0.9};
    cv::Mat picture(height, width, CV_8UC(channels));
    const Eigen::Vector2d middle(0.5 * width, 0.5 * height);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const Eigen::Vector2d place(u + 0.5, v + 0.5);
        double height_seen = height_mm(mm_per_px * place);
        for (int pass = 0; pass < 8 && std::isfinite(camera_distance_mm); ++pass) {
          const double nearer = 1.0 - height_seen / camera_distance_mm;
          height_seen = height_mm(mm_per_px * (middle + nearer * (place - middle)));
        }
        const double lamps = brightness * (1.0 - fall_off * (place - middle).squaredNorm() / middle.squaredNorm());
        const double light = exposure * lamps * (1.0 - darkening_of(height_seen));
        for (int c = 0; c < channels; ++c) {
          picture.ptr<unsigned char>(v)[u * channels + c] =
              cv::saturate_cast<unsigned char>(tints[c] * light + random.gaussian(noise_DN));
        }
      }
    }
    return picture;
  }
  cv::Mat rest(int seed = 9) const {
    return frame([](const Eigen::Vector2d&) { return 0.0; }, 1.0, seed);
  }
  BallPress press(const DarkBall& ball, double exposure = 1.0, int seed = 2) const {
    return {"painted", frame([&](const Eigen::Vector2d& place) { return ball.height_at(place); }, exposure, seed),
            ContactCircle{ball.centre / mm_per_px, ball.contact_radius() / mm_per_px}, ball.radius};
  }
};

}  // namespace touchstone::sensors::fixtures
