#pragma once
// The distortion of a lens by OpenCV's model, and its inverse.
//
// A point seen along (x, y, 1) appears where an ideal lens would show (x', y', 1) (OpenCV 4.6 documentation, module
// calib3d, "Detailed Description"), with r^2 = x^2 + y^2:
//
//   x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
//   y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y

#include <Eigen/Core>
#include <optional>

namespace touchstone::render {

/// Coefficients as OpenCV's calibration gives them; all 0 is no distortion. No units: coordinates are tangents.
struct LensDistortion {
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0, k4 = 0.0, k5 = 0.0, k6 = 0.0;
};

/// Where the point seen along (`undistorted`, 1) appears.
Eigen::Vector2d distort(const LensDistortion& distortion, const Eigen::Vector2d& undistorted);

/// Derivative of `distort`: rows x', y'; columns x, y.
Eigen::Matrix2d distort_derivative(const LensDistortion& distortion, const Eigen::Vector2d& undistorted);

/// How far out the radial part can be inverted.
struct DistortionReach {
  double undistorted = 0.0;  ///< tangent of the view angle at which the picture turns back; infinite if it never does
  double distorted = 0.0;    ///< where that appears; infinite likewise
};

/// The reach of the radial part: up to the first zero of its derivative or of its denominator.
DistortionReach radial_reach(const LensDistortion& distortion);

/// The inverse of `distort` within the reach, by Newton's method from the centre with steps halved until they gain; the
/// answer appears within 1e-13 of `distorted`. nullopt where there is none: the picture is folded or has a gap there.
std::optional<Eigen::Vector2d> undistort(const LensDistortion& distortion, const DistortionReach& reach,
                                         const Eigen::Vector2d& distorted);

}  // namespace touchstone::render
