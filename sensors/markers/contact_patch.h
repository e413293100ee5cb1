#pragma once
// Where the gel is touched, as an ellipse, and what the markers on it do.

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "sensors/markers/marker_tracker.h"

namespace touchstone::sensors {

/// The ellipse that has the first and second moments of a contact mask. Coordinates in px, pixel centres at + 0.5. A
/// flat end, whose picture differs from the background at its rim only, gets one 1.4 times as large as the rim.
struct ContactPatch {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double area_px = 0.0;                                ///< of the mask
  Eigen::Matrix2d edge = Eigen::Matrix2d::Identity();  ///< (p - centre)^T edge (p - centre) = 1 on the ellipse

  /// The mask's part of the ellipse.
  double cover() const { return area_px * std::sqrt(std::max(edge.determinant(), 0.0)) / std::numbers::pi; }
  /// 0 in the centre, 1 on the edge, growing with the square of the distance.
  double reach_squared(const Eigen::Vector2d& place) const { return (place - centre).dot(edge * (place - centre)); }
};

/// Takes out of a mask what the markers themselves made in it: discs of `radius_px` round where they were at rest and
/// where they are. (A moved marker differs from the background without any contact; a resting one doesn't within the
/// contact.) Out goes also a strip as wide along the picture's edge: markers that it cuts aren't followed.
void erase_markers(cv::Mat& mask, const TrackedMarkers& markers, double radius_px);

/// The patch of a mask (CV_8UC1, not 0 = contact); none with fewer than `least_px` pixels. Left out are pixels with
/// fewer than three set ones about them, and those far out, more than 1.5 times the size of the ellipse of what is left
/// (in three rounds): a few specks of noise don't widen it.
/// @throws Error unless the mask is CV_8UC1 and not empty
std::optional<ContactPatch> contact_patch(const cv::Mat& mask, int least_px);

/// How the markers on the patch have moved since rest.
struct PatchMotion {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< mean displacement [Li2015, sec. 4.3]
  int markers = 0;                               ///< measured ones on the patch, over which the mean goes
  /// How far they have turned about their middle, from u (right) towards v (down), radians: the turn of what sticks to
  /// the gel, less what the patch's rim lags behind. None with fewer than three markers.
  std::optional<double> turn;
  double turn_error = 0.0;  ///< standard error, from what a turn with a swelling leaves over
};

/// The motion since rest of the markers that are measured and lie on the patch now.
PatchMotion patch_motion(const TrackedMarkers& markers, const ContactPatch& patch);

}  // namespace touchstone::sensors
