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
  bool saturated = false;  ///< one of its channels is cut off at 255: of no use for shading, which is linear
};

/// Which differences between places are taken out of the colours before they are looked up.
enum class LightCorrection {
  none,        ///< one table for all places, as in [Li2015]
  background,  ///< each channel is scaled by its mean background / its background there: brightness that falls off
  fitted       ///< so scaled, colours are led back to the middle's by the lamps' vectors there, fitted to the presses
};
/// "none", "background" or "fitted".
const char* name_of(LightCorrection correction);

/// Matt shading by far lamps: colour(n) - colour(rest) = A (n - n_rest), A a 3 x 3 matrix (channels by normal) that
/// differs from place to place. Shadows, gloss and light from the membrane's other parts aren't in it.
struct LampModel {
  int width = 0;                       ///< px, of the picture
  int height = 0;                      ///< px
  int columns = 0;                     ///< of nodes: in the middles of so many equal parts of the picture's width
  int rows = 0;                        ///< likewise of its height
  std::vector<Eigen::Matrix3d> nodes;  ///< A at each, row by row

  /// A at a place, px: bilinear between nodes, beyond the outermost that of the nearest.
  Eigen::Matrix3d at(const Eigen::Vector2d& place) const;
};

/// How fit_lamps does it.
struct LampFit {
  int columns = 8;
  int rows = 6;
  /// How far around a node presses determine its lamps: standard deviation of their weight's fall-off, as a share of
  /// the picture's width. The presses of the default calibration are 0.22 of it apart.
  double reach = 0.25;
  double prior = 0.01;    ///< as which share of all samples, all over the picture, the mean lamps count at a node
  double steepest = 0.6;  ///< slopes up to which every lamp is taken to stand above the membrane's horizon
};
/// The same lamps everywhere: a single node, for which all samples count alike.
inline constexpr LampFit kEvenLamps{1, 1};

/// Least squares fit at each node to the samples with slopes up to `how.steepest` that aren't saturated: lamps that
/// change linearly over the samples near the node. The weight of a sample falls off with its distance, less that of the
/// nearest sample, so that no node is without samples; nodes outside of the rectangle that holds all samples take the
/// lamps of its nearest point, so that nothing is extrapolated.
/// @throws Error if there are too few samples, their slopes all have one direction, or `how` has a figure not above 0
LampModel fit_lamps(std::span<const ColourSample> samples, const cv::Size& size, const LampFit& how);

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

  /// Bounded: where a channel would be made more than kLargestGain times stronger (the absolute values of its row add
  /// up to more) it is made just so much stronger, and slopes come out too flat.
  Eigen::Matrix3d at(const Eigen::Vector2d& place) const;

  /// How many times a channel is made stronger at most: beyond, it would be noise.
  static constexpr double kLargestGain = 6.0;

  /// Share of the picture's pixels at which that bound was needed.
  double bounded_share() const;

 private:
  Eigen::Matrix3d unbounded_at(int u, int v) const;

  cv::Mat gains_;  ///< CV_32FC3, or empty
  LampModel lamps_;
  Eigen::Matrix3d middle_ = Eigen::Matrix3d::Identity();
};

}  // namespace touchstone::sensors
