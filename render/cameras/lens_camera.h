#pragma once
// A thin lens with a round stop in its plane, a sensor behind it, and the distortion of a real lens.

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "core/monotone_curve.h"
#include "core/transform.h"
#include "render/cameras/camera_ray.h"
#include "render/cameras/diffraction_spread.h"
#include "render/cameras/lens_distortion.h"

namespace touchstone::render {

/// OpenCV's camera matrix, in pixels, by OpenCV's convention: pixel (column i, row j) has its centre at (i, j). The
/// pixel coordinates of core/transform.h are larger by 0.5; the conversion is made in lens_camera.cpp and nowhere else.
struct CameraMatrix {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
};

/// The light that a real lens's rims let through at a distance r from the principal point, beside what the thin lens
/// has (cos^4): a factor. r is 1 at half of the picture's diagonal. Either 1 + a1 r^2 + a2 r^4 + ... by its
/// coefficients, as in [Goldman2005], or a curve through measured points (r, factor).
using Vignetting = std::variant<std::vector<double>, MonotoneCurve>;

/// The factor at r; never below 0.
double vignetting_at(const Vignetting& vignetting, double r);

/// The camera frame's origin is the lens's centre, +z looks at the scene, the sensor is the plane z = -v with
/// v = sqrt(fx fy) pitch. The image is turned upright as a pinhole's is. What lies in the plane z = focus_distance_mm
/// (in air; through plate and gel the apparent depth counts) is sharp; everything else is blurred by the stop.
///
/// Irradiance: a point of the sensor sees the stop, of area A, under the solid angle of its parts, so that with the
/// distance d from sensor point to lens point dE = L v^2 / d^4 dA: E = pi/4 L (D/v)^2 cos^4(theta) for a small stop,
/// and pi L times the disc's form factor for any. Distortion moves light about on the sensor and loses none: with it E
/// is divided by the determinant of its derivative, and theta is the angle at which the light arrives from the scene.
struct LensCamera {
  int width = 640;
  int height = 480;
  CameraMatrix matrix;
  LensDistortion distortion;
  double pixel_pitch_um = 3.0;  ///< the root of a pixel's area (fx != fy: pixels of v/fx by v/fy)
  double aperture_mm = 1.0;     ///< D, diameter of the stop: focal length / f-number
  double focus_distance_mm = std::numeric_limits<double>::infinity();  ///< from the lens to what is sharp
  std::optional<Vignetting> vignetting;                                ///< absent: none
  RigidTransform gel_from_camera;
  /// At the stop, beside the geometric blur; null: none. As a pinhole's.
  std::shared_ptr<const DiffractionSpread> diffraction;
};

/// The matrix of a lens of the given focal length focused at the given distance (may be infinite), its axis through the
/// middle of the picture. @throws Error if it can't focus so near
CameraMatrix matrix_of_lens(double focal_length_mm, double focus_distance_mm, double pixel_pitch_um, int width,
                            int height);

/// The distance at which a lens of the given focal length is sharp on a sensor that far behind it.
/// @throws Error if the sensor is nearer than the focal length
double focus_of_sensor(double focal_length_mm, double sensor_distance_mm);

/// v, from the lens to the sensor.
double sensor_distance_mm(const LensCamera& camera);

/// f, by 1/f = 1/v + 1/focus distance.
double focal_length_mm(const LensCamera& camera);

/// The diameter on the sensor of the disc to which a point at depth `z_mm` is blurred, D v |1/z - 1/focus distance|, on
/// an undistorted lens.
double blur_circle_mm(const LensCamera& camera, double z_mm);

/// Throws Error naming the first field that is out of range, or the radius beyond which the distortion can't be
/// inverted, if that lies inside the picture.
void check_camera(const LensCamera& camera);

/// A lens made ready for tracing.
struct PreparedLens : LensCamera {
  double sensor_distance = 0.0;  ///< mm
  DistortionReach reach;
};

/// @throws Error as check_camera
PreparedLens prepare(const LensCamera& camera);

/// The ray from the image point (`x`, `y`) in pixels (core/transform.h) through the place on the lens given by (`u`,
/// `v`) in [0,1)^2, (1/2, 1/2) being its centre. The mean of `weight` over u, v is the irradiance per radiance.
/// @throws Error if the distortion can't be inverted there
CameraRay lens_ray(const PreparedLens& camera, double x, double y, double u, double v);

/// From the principal point to an image point, mm on the sensor, along the picture's axes.
Eigen::Vector2d from_axis_mm(const PreparedLens& camera, double x, double y);
/// The inverse.
Eigen::Vector2d image_point_at(const PreparedLens& camera, const Eigen::Vector2d& from_axis_mm);

/// The unit vector of the camera frame along which an image point looks through the lens's centre; nullopt where the
/// distortion can't be inverted: nowhere in a checked camera's picture, and beside it from some distance on.
std::optional<Eigen::Vector3d> view_direction(const PreparedLens& camera, double x, double y);

/// The image point that looks along a vector of the camera frame; nullopt where none does: it doesn't point forwards,
/// or so far aside that the formula of the distortion has folded the picture back.
std::optional<Eigen::Vector2d> image_point(const PreparedLens& camera, const Eigen::Vector3d& direction);

/// Where a point of the camera frame in front of the lens appears (pixels of core/transform.h), seen through the lens's
/// centre in air: cv::projectPoints plus half a pixel.
Eigen::Vector2d project(const LensCamera& camera, const Eigen::Vector3d& point_in_camera);

}  // namespace touchstone::render
