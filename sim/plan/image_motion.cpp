#include "sim/plan/image_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "sim/scene/device_camera.h"

namespace touchstone::sim {
namespace {

/// Sensor distance in pixels: what a slope of 1 measures in the picture.
double focal_pixels(const render::Camera& camera) {
  if (const auto* lens = std::get_if<render::LensCamera>(&camera)) return std::max(lens->matrix.fx, lens->matrix.fy);
  const auto& pinhole = std::get<render::PinholeCamera>(camera);
  return 1e3 * pinhole.distance_mm / pinhole.pixel_pitch_um;
}

/// Of an object, from its origin and from its z axis to the farthest point.
struct Reach {
  double from_origin = 0.0;
  double from_axis = 0.0;

  explicit Reach(const ObjectSpec& object) {
    for (const Eigen::Vector3d& vertex : visible_mesh(object.shape).vertices) {
      from_origin = std::max(from_origin, vertex.norm());
      from_axis = std::max(from_axis, vertex.head<2>().norm());
    }
  }
};

/// What is known of one axis while its keys are gone through.
struct AxisTrack {
  double position_mm = 0.0;  // as last led
  double force_N = 0.0;
  bool by_force = false;

  /// mm that the key leads it.
  double go(const AxisKey& key, double stiffness) {
    if (key.position_mm) {
      const double distance = std::abs(*key.position_mm - position_mm);
      position_mm = *key.position_mm;
      by_force = false;
      force_N = 0.0;
      return distance;
    }
    const double distance = std::abs(*key.force_N - force_N) / stiffness;
    force_N = *key.force_N;
    by_force = true;
    return distance;
  }
};

constexpr double kTurningContact = 0.25;  // contact's radius by the object's, under a torque that turns it
constexpr double kMostTurning_rad = 0.8;  // that a press takes of a torque

/// The torques on an object while its keys are gone through.
struct TurnTrack {
  Eigen::Vector3d torque_Nmm = Eigen::Vector3d::Zero();

  /// Radians that the key's torques turn it, as a rigid round punch of radius a on a half space, which resists tilting
  /// by 8 G a^3 / (3 (1 - nu)) and twisting by 16 G a^3 / 3 [Johnson1985]. `plane_MPa`: E / (1 - nu^2).
  double go(const MotionKey& key, double radius_mm, double plane_MPa, double poisson_ratio) {
    const double cube = std::pow(kTurningContact * radius_mm, 3);
    const double tilting = 4.0 / 3.0 * plane_MPa * cube;
    const double twisting = 8.0 / 3.0 * plane_MPa * (1.0 - poisson_ratio) * cube;
    const std::optional<TurnKey>* const turns[3] = {&key.turn_x, &key.turn_y, &key.turn_z};
    double angle = 0.0;
    for (int a = 0; a < 3; ++a) {
      if (!*turns[a]) continue;
      angle += std::abs((*turns[a])->torque_Nmm - torque_Nmm[a]) / (a == 2 ? twisting : tilting);
      torque_Nmm[a] = (*turns[a])->torque_Nmm;
    }
    return std::min(angle, kMostTurning_rad);
  }
};

}  // namespace

ImageScale::ImageScale(const DeviceSpec& device) {
  TS_ASSERT(device.camera.has_value());
  const CameraSpec& camera = *device.camera;
  const render::Camera eye = camera_of(camera);
  axis_ = pose_of(camera).turn(Eigen::Vector3d::UnitZ());
  // Behind flat faces the surface appears nearer.
  const auto nearer = [](double thickness, double index) { return thickness * (1.0 - 1.0 / index); };
  const double distance = -camera.position_mm.z() - nearer(device.gel.thickness_mm, device.gel.refractive_index) -
                          nearer(device.plate.thickness_mm, device.plate.refractive_index);
  pixels_per_mm_ = focal_pixels(eye) / distance;
  const double half_diagonal = 0.5 * std::hypot(camera.width, camera.height);
  pixels_per_mm_along_ = half_diagonal / distance;
  // A disc of diameter d has the variance d^2 / 16 along a line, a pixel 1 / 12.
  const double disc = blur_disc_px(eye, distance);
  point_width_ = std::sqrt(1.0 + 12.0 / 16.0 * disc * disc);
}

double ImageScale::pixels(const Eigen::Vector3d& motion_mm) const {
  const double along = motion_mm.dot(axis_);
  return pixels_per_mm_ * (motion_mm - along * axis_).norm() + pixels_per_mm_along_ * std::abs(along);
}

double image_motion(const ImageScale& scale, const fem::PressState& from, const fem::PressState& to,
                    double object_radius_mm) {
  double pixels = 0.0;
  for (std::size_t k = 0; k < from.bodies.size(); ++k) {
    const RigidTransform& a = from.bodies[k].gel_from_object;
    const RigidTransform& b = to.bodies[k].gel_from_object;
    const double angle = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
    // Any direction across the view is as bad as another; along it nothing moves farther.
    const double turned = scale.pixels_across(angle * object_radius_mm);
    pixels = std::max(pixels, scale.pixels(b.translation - a.translation) + turned);
  }
  for (Eigen::Index i = 0; i < from.surface_displacement.rows(); ++i) {
    pixels =
        std::max(pixels, scale.pixels((to.surface_displacement.row(i) - from.surface_displacement.row(i)).transpose()));
  }
  return pixels;
}

double largest_object_radius(const SceneSpec& scene) {
  double radius = 0.0;
  for (const MovedObject& moved : moved_objects(scene)) radius = std::max(radius, Reach(moved.object).from_origin);
  return radius;
}

MotionSpeed motion_speed(const SceneSpec& scene) {
  std::optional<ImageScale> scale;
  if (scene.device.camera) scale.emplace(scene.device);
  const GelSpec& gel = scene.device.gel;
  MotionSpeed speed;
  for (const MovedObject& moved : moved_objects(scene)) {
    const Reach reach(moved.object);
    const double stiffness = gel.youngs_modulus_MPa * reach.from_axis / (1.0 - gel.poisson_ratio * gel.poisson_ratio);
    AxisTrack tracks[3];
    for (int a = 0; a < 3; ++a) tracks[a].position_mm = moved.motion.start_mm[a];
    Eigen::Vector3d angles_deg = moved.motion.start_angles_deg;
    TurnTrack turns;
    for (const MotionKey& key : moved.motion.keys) {
      const double seconds = key.frames / moved.motion.frame_rate_Hz;
      Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
      const std::optional<AxisKey>* const axes[3] = {&key.x, &key.y, &key.z};
      for (int a = 0; a < 3; ++a) {
        if (!*axes[a]) continue;
        velocity[a] = tracks[a].go(**axes[a], stiffness) / seconds;
        speed.led_by_force = speed.led_by_force || (tracks[a].by_force && velocity[a] > 0.0);
      }
      if (key.vibration) {
        velocity[static_cast<int>(key.vibration->axis)] +=
            2.0 * kPi * key.vibration->amplitude_mm * key.vibration->frequency_Hz;
      }
      double turning = 0.0;  // mm/s of the farthest point
      if (key.angles_deg) {
        turning = (*key.angles_deg - angles_deg).cwiseAbs().sum() * kRadiansPerDegree / seconds * reach.from_origin;
        angles_deg = *key.angles_deg;
        turns.torque_Nmm.setZero();
      }
      const double turned = turns.go(key, reach.from_axis, stiffness / reach.from_axis, gel.poisson_ratio);
      turning += turned / seconds * reach.from_origin;
      speed.led_by_force = speed.led_by_force || turned > 0.0;
      speed.mm_per_s = std::max(speed.mm_per_s, velocity.norm() + turning);
      if (scale) {
        speed.pixels_per_s = std::max(speed.pixels_per_s, scale->pixels(velocity) + scale->pixels_across(turning));
      }
    }
  }
  return speed;
}

}  // namespace touchstone::sim
