#include "render/cameras/lens_camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "render/cameras/camera_pose.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

constexpr double kOpenCvHalfPixel = 0.5;  // OpenCV's pixel centres are whole numbers, ours lie half a pixel on

/// The distorted tangents of an image point (pixels of core/transform.h).
Eigen::Vector2d tangents_of(const CameraMatrix& matrix, double x, double y) {
  return {(x - kOpenCvHalfPixel - matrix.cx) / matrix.fx, (y - kOpenCvHalfPixel - matrix.cy) / matrix.fy};
}

Eigen::Vector2d pixel_of(const CameraMatrix& matrix, const Eigen::Vector2d& tangents) {
  return {matrix.fx * tangents.x() + matrix.cx + kOpenCvHalfPixel,
          matrix.fy * tangents.y() + matrix.cy + kOpenCvHalfPixel};
}

/// Below 0, too, where the numbers say so.
double raw_factor(const Vignetting& vignetting, double r) {
  if (const auto* curve = std::get_if<MonotoneCurve>(&vignetting)) return curve->at(r);
  const auto& coefficients = std::get<std::vector<double>>(vignetting);
  double sum = 0.0;
  for (auto a = coefficients.rbegin(); a != coefficients.rend(); ++a) sum = (sum + *a) * r * r;
  return 1.0 + sum;
}

double mean_focal_px(const CameraMatrix& matrix) {
  return std::sqrt(matrix.fx * matrix.fy);
}

/// The largest distance of the picture's corners from the principal point, as a tangent.
double furthest_corner(const LensCamera& camera) {
  double furthest = 0.0;
  for (double x : {0.0, static_cast<double>(camera.width)}) {
    for (double y : {0.0, static_cast<double>(camera.height)}) {
      furthest = std::max(furthest, tangents_of(camera.matrix, x, y).norm());
    }
  }
  return furthest;
}

/// The distance from the principal point by half of the picture's diagonal.
double vignetting_radius(const LensCamera& camera, double x, double y) {
  const double away = std::hypot(x - kOpenCvHalfPixel - camera.matrix.cx, y - kOpenCvHalfPixel - camera.matrix.cy);
  return 2.0 * away / std::hypot(camera.width, camera.height);
}

void check_vignetting(const LensCamera& camera) {
  if (!camera.vignetting) return;
  double corner = 0.0;
  for (double x : {0.0, static_cast<double>(camera.width)}) {
    for (double y : {0.0, static_cast<double>(camera.height)}) {
      corner = std::max(corner, vignetting_radius(camera, x, y));
    }
  }
  if (const auto* curve = std::get_if<MonotoneCurve>(&*camera.vignetting)) {
    const double first = curve->points().front().x();
    const double last = curve->points().back().x();
    constexpr double kSame = 1e-9;
    if (first != 0.0 || last < corner - kSame) {
      fail(
          "camera: vignetting's points go from r = {} to {}; they must go from 0 to the picture's farthest corner, "
          "{:.4f}",
          first, last, corner);
    }
  }
  constexpr int kSteps = 256;
  constexpr double kMost = 10.0;
  for (int k = 0; k <= kSteps; ++k) {
    const double r = corner * k / kSteps;
    const double factor = raw_factor(*camera.vignetting, r);
    if (!(factor >= 0.0 && factor <= kMost)) {
      fail("camera: vignetting's factor is {:.4g} at r = {:.4f}; allowed is from 0 to {} in all of the picture", factor,
           r, kMost);
    }
  }
}

void check_invertible(const LensCamera& camera, const DistortionReach& reach) {
  const double pixels = mean_focal_px(camera.matrix);
  const double corner = furthest_corner(camera);
  if (reach.distorted <= corner) {
    fail(
        "camera: the distortion can't be inverted beyond {:.1f} pixels from the principal point (a tangent of {:.4f}), "
        "where the picture turns back; the picture's corner lies at {:.1f}",
        reach.distorted * pixels, reach.undistorted, corner * pixels);
  }
  // The tangential part may fold the picture, too. A map with a positive derivative that has an inverse all along a
  // border has one inside it; the points inside are there for gaps that a pole of the fraction makes.
  const auto require = [&](double x, double y) {
    const Eigen::Vector2d distorted = tangents_of(camera.matrix, x, y);
    if (undistort(camera.distortion, reach, distorted)) return;
    fail("camera: the distortion can't be inverted at pixel ({:.1f}, {:.1f}), {:.1f} pixels from the principal point",
         x, y, distorted.norm() * pixels);
  };
  constexpr int kSteps = 64;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = static_cast<double>(camera.width) * i / kSteps;
    for (int j = 0; j <= kSteps; ++j) {
      require(x, static_cast<double>(camera.height) * j / kSteps);
    }
  }
}

DistortionReach checked_reach(const LensCamera& camera) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value)) fail("camera: {} is {}; it must be above 0", name, value);
  };
  if (camera.width < 1 || camera.height < 1 || camera.width > 65536 || camera.height > 65536) {
    fail("camera: a size of {} x {} pixels; each side must be 1 to 65536", camera.width, camera.height);
  }
  positive(camera.pixel_pitch_um, "pixel_pitch_um");
  positive(camera.aperture_mm, "aperture_mm");
  positive(camera.matrix.fx, "the camera matrix's fx");
  positive(camera.matrix.fy, "the camera matrix's fy");
  if (!std::isfinite(camera.matrix.cx) || !std::isfinite(camera.matrix.cy)) {
    fail("camera: the principal point is ({}, {}); it must be finite", camera.matrix.cx, camera.matrix.cy);
  }
  if (!(camera.focus_distance_mm > 0.0)) {
    fail("camera: focus_distance_mm is {}; it must be above 0 (infinite is allowed)", camera.focus_distance_mm);
  }
  const LensDistortion& d = camera.distortion;
  for (double value : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6}) {
    if (!std::isfinite(value)) fail("camera: a distortion coefficient is {}; it must be finite", value);
  }
  // Places on the lens are drawn evenly; of a wider one nearly all would see the sensor edge on.
  constexpr double kWidestAperture = 10.0;
  if (!(camera.aperture_mm <= kWidestAperture * sensor_distance_mm(camera))) {
    fail("camera: aperture_mm is {}; it must be at most {} times the distance to the sensor, {} mm", camera.aperture_mm,
         kWidestAperture, sensor_distance_mm(camera));
  }
  check_vignetting(camera);
  check_camera_pose(camera.gel_from_camera);
  const DistortionReach reach = radial_reach(camera.distortion);
  check_invertible(camera, reach);
  return reach;
}

}  // namespace

double vignetting_at(const Vignetting& vignetting, double r) {
  return std::max(0.0, raw_factor(vignetting, r));
}

CameraMatrix matrix_of_lens(double focal_length_mm, double focus_distance_mm, double pixel_pitch_um, int width,
                            int height) {
  if (!(focal_length_mm > 0.0) || !std::isfinite(focal_length_mm)) {
    fail("camera: focal_length_mm is {}; it must be above 0", focal_length_mm);
  }
  if (!(pixel_pitch_um > 0.0)) fail("camera: pixel_pitch_um is {}; it must be above 0", pixel_pitch_um);
  if (!(focus_distance_mm > focal_length_mm)) {
    fail("camera: focus_distance_mm is {}; a lens of focal length {} mm is sharp beyond that only", focus_distance_mm,
         focal_length_mm);
  }
  const double sensor_distance = 1.0 / (1.0 / focal_length_mm - 1.0 / focus_distance_mm);
  const double focal_px = sensor_distance / (pixel_pitch_um * 1e-3);
  return {focal_px, focal_px, 0.5 * width - kOpenCvHalfPixel, 0.5 * height - kOpenCvHalfPixel};
}

double focus_of_sensor(double focal_length_mm, double sensor_distance_mm) {
  if (!(focal_length_mm > 0.0) || !(sensor_distance_mm >= focal_length_mm)) {
    fail("camera: sensor_distance_mm is {}; it must be at least the focal length, {} mm", sensor_distance_mm,
         focal_length_mm);
  }
  return 1.0 / (1.0 / focal_length_mm - 1.0 / sensor_distance_mm);
}

double sensor_distance_mm(const LensCamera& camera) {
  return mean_focal_px(camera.matrix) * camera.pixel_pitch_um * 1e-3;
}

double focal_length_mm(const LensCamera& camera) {
  return 1.0 / (1.0 / sensor_distance_mm(camera) + 1.0 / camera.focus_distance_mm);
}

double blur_circle_mm(const LensCamera& camera, double z_mm) {
  return camera.aperture_mm * sensor_distance_mm(camera) * std::abs(1.0 / z_mm - 1.0 / camera.focus_distance_mm);
}

void check_camera(const LensCamera& camera) {
  checked_reach(camera);
}

PreparedLens prepare(const LensCamera& camera) {
  const DistortionReach reach = checked_reach(camera);
  return {camera, sensor_distance_mm(camera), reach};
}

CameraRay lens_ray(const PreparedLens& camera, double x, double y, double u, double v) {
  const Eigen::Vector2d distorted = tangents_of(camera.matrix, x, y);
  const std::optional<Eigen::Vector2d> seen = undistort(camera.distortion, camera.reach, distorted);
  if (!seen) fail("camera: the distortion can't be inverted at pixel ({}, {})", x, y);
  const Eigen::Vector3d chief(seen->x(), seen->y(), 1.0);
  const Eigen::Vector2d on_lens = 0.5 * camera.aperture_mm * square_to_disc(u, v);

  CameraRay ray;
  ray.origin = {on_lens.x(), on_lens.y(), 0.0};
  // All rays of a sensor point meet in the plane of focus.
  const bool far = std::isinf(camera.focus_distance_mm);
  ray.direction = (far ? chief : Eigen::Vector3d(chief - ray.origin / camera.focus_distance_mm)).normalized();
  const double from_sensor = (ray.origin + camera.sensor_distance * chief).squaredNorm();
  const double area = 0.25 * kPi * camera.aperture_mm * camera.aperture_mm;
  const double spread = distort_derivative(camera.distortion, *seen).determinant();
  ray.weight = area * camera.sensor_distance * camera.sensor_distance / (from_sensor * from_sensor * spread);
  if (camera.vignetting) ray.weight *= vignetting_at(*camera.vignetting, vignetting_radius(camera, x, y));
  return ray;
}

Eigen::Vector2d from_axis_mm(const PreparedLens& camera, double x, double y) {
  return camera.sensor_distance * tangents_of(camera.matrix, x, y);
}

Eigen::Vector2d image_point_at(const PreparedLens& camera, const Eigen::Vector2d& from_axis_mm) {
  return pixel_of(camera.matrix, from_axis_mm / camera.sensor_distance);
}

std::optional<Eigen::Vector3d> view_direction(const PreparedLens& camera, double x, double y) {
  const auto seen = undistort(camera.distortion, camera.reach, tangents_of(camera.matrix, x, y));
  if (!seen) return std::nullopt;
  return Eigen::Vector3d(seen->x(), seen->y(), 1.0).normalized();
}

std::optional<Eigen::Vector2d> image_point(const PreparedLens& camera, const Eigen::Vector3d& direction) {
  if (!(direction.z() > 0.0)) return std::nullopt;
  const Eigen::Vector2d tangents = direction.head<2>() / direction.z();
  const Eigen::Vector2d distorted = distort(camera.distortion, tangents);
  // Beyond a fold the formula gives points that look elsewhere; only undistort knows which of them do.
  const auto seen = undistort(camera.distortion, camera.reach, distorted);
  constexpr double kSame = 1e-6;
  if (!seen || !((*seen - tangents).norm() <= kSame * (1.0 + tangents.norm()))) return std::nullopt;
  return pixel_of(camera.matrix, distorted);
}

Eigen::Vector2d project(const LensCamera& camera, const Eigen::Vector3d& point_in_camera) {
  TS_ASSERT(point_in_camera.z() > 0.0);
  return pixel_of(camera.matrix, distort(camera.distortion, point_in_camera.head<2>() / point_in_camera.z()));
}

}  // namespace touchstone::render
