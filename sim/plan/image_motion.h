#pragma once
// How fast things move in a camera's picture: what calls for motion blur and rolling shutter.

#include "fem/contact/press.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Pixels by which a motion shows, from above: the camera is taken to look at points as near as the outer surface
/// appears, a motion across its axis counts whole, one along it as it shows in the picture's corner.
class ImageScale {
 public:
  /// @pre the device has a camera
  explicit ImageScale(const DeviceSpec& device);
  /// Of a motion in the gel frame.
  double pixels(const Eigen::Vector3d& motion_mm) const;
  /// Of a motion across the view.
  double pixels_across(double mm) const { return pixels_per_mm_ * mm; }
  /// How many times as wide as a pixel the image of a point of the outer surface is (standard deviations along a line):
  /// 1 where all is sharp. What moves within an exposure shows against that width.
  double point_width() const { return point_width_; }

 private:
  Eigen::Vector3d axis_;        // along the view, gel frame
  double pixels_per_mm_ = 0.0;  // across it
  double pixels_per_mm_along_ = 0.0;
  double point_width_ = 1.0;
};

/// How far at most something of an object (within `object_radius_mm` of its origin) or of the gel's surface moves in
/// the picture from one state to the other, pixels.
double image_motion(const ImageScale& scale, const fem::PressState& from, const fem::PressState& to,
                    double object_radius_mm);

/// The farthest point of the scene's objects from their own origins, mm.
double largest_object_radius(const SceneSpec& scene);

/// What a scene's motion files say of its speed, before anything is pressed.
struct MotionSpeed {
  double pixels_per_s = 0.0;  ///< the largest image_motion; 0 without a camera
  double mm_per_s = 0.0;      ///< the largest of an object's points
  bool led_by_force = false;  ///< in part: then an estimate
};

/// Of all objects and keys. Where a force leads, the speed is that of a rigid flat punch of half the object's radius on
/// a half space; where a torque does, of one of a quarter of it, since a narrow contact turns more easily.
MotionSpeed motion_speed(const SceneSpec& scene);

}  // namespace touchstone::sim
