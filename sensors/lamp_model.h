#pragma once
// How colours change with the membrane's slope, and how that differs from place to place: a linear model of matt
// shading.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

namespace touchstone::sensors {

/// One pixel of a calibration: what was seen where, and the slope that was there.
struct ColourSample {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();   ///< px
  Eigen::Vector3f colour = Eigen::Vector3f::Zero();  ///< BGR, frame - background, digital numbers
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();   ///< see height_map.h
};

/// Which differences between places are taken out of the colours before they are looked up.
enum class LightCorrection {
  none,        ///< one table for all places, as the source text has it
  background,  ///< each channel is scaled by its mean background / its background there: brightness that falls off
  fitted       ///< so scaled, colours are led back to the middle's by the lamps' vectors there, fitted to the presses
};
const char* name_of(LightCorrection correction);

/// Matt shading by far lamps: colour(n) - colour(rest) = A (n - n_rest), A a 3 x 3 matrix (channels by normal) that is
/// a polynomial of the place. Shadows, gloss and light from the membrane's other parts aren't in it.
struct LampModel {
  int width = 0;                       ///< px, of the picture
  int height = 0;                      ///< px
  int order = 0;                       ///< of the polynomial: 0, 1 or 2
  std::vector<Eigen::Matrix3d> terms;  ///< 1; x, y; x^2, xy, y^2 with x = (2u - width)/width, y = (2v - height)/width

  /// A at a place, px.
  Eigen::Matrix3d at(const Eigen::Vector2d& place) const;
};

/// How many terms a polynomial of the place has. @pre 0 <= order <= 2
int term_count(int order);

/// Least squares fit to all samples with slopes up to `steepest` (beyond, lamps may fall below the membrane's horizon).
/// @throws Error if the samples don't determine it: too few, or not in enough places for the order
LampModel fit_lamps(std::span<const ColourSample> samples, const cv::Size& size, int order, double steepest);

/// The slope, at most `limit` long, whose shading comes nearest to `colour` under the lamps `a`: photometric stereo
/// with two unknowns and three channels, by Gauss-Newton steps.
Eigen::Vector2d slope_by_lamps(const Eigen::Matrix3d& a, const Eigen::Vector3d& colour, double limit);

/// A colour difference seen at a place as it would be seen in the middle.
class ColourCorrection {
 public:
  /// No correction.
  ColourCorrection() = default;
  /// By the background's smoothed brightness. @pre `background_mean` is CV_32FC3
  static ColourCorrection by_background(const cv::Mat& background_mean);
  /// By the background and then by the lamps of colours that were scaled by it: the likeliest colour in the middle.
  static ColourCorrection by_lamps(const cv::Mat& background_mean, const LampModel& lamps);

  Eigen::Matrix3d at(const Eigen::Vector2d& place) const;

 private:
  cv::Mat gains_;  ///< CV_32FC3, or empty
  LampModel lamps_;
  Eigen::Matrix3d middle_ = Eigen::Matrix3d::Identity();
};

}  // namespace touchstone::sensors
