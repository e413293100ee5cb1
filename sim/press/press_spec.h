#pragma once
// A press as people ask for it: this object here, so hard or so deep, then dragged. The one way to ask for a press in
// this program: data sets, Python, tests, servers, fits and experiments all go through press_motion.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "fem/shapes/contact_shape.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

/// Exactly one of `force_N`, `depth_mm` and `height_mm` is given.
struct PressSpec {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();    ///< of the object's origin, gel frame
  Eigen::Vector3d angles_deg = Eigen::Vector3d::Zero();  ///< the object is turned about x, then y, then z
  std::optional<double> force_N = {};                    ///< along z on the object; above 0
  std::optional<double> depth_mm = {};                   ///< how far it is lowered beyond its first touch; above 0
  std::optional<double> height_mm = {};                  ///< of the object's origin at the end: gel frame's z
  Eigen::Vector2d drag_mm = Eigen::Vector2d::Zero();     ///< then moved along the gel, its force or height being held
  std::optional<Eigen::Vector2d> shear_N = {};           ///< or led aside until this force is on it; not beside drag_mm
  /// Time of the press and of the drag, each; for gels that relax. Without it a step is a frame of the camera.
  std::optional<double> seconds = {};
};

/// @throws Error for a press with none or several of force, depth and height, with drag and shear, angles beyond 360
/// degrees, or numbers that aren't finite or not above 0
void check(const PressSpec& press);

/// "at (0, 0) mm with 2 N dragged by (0.1, 0) mm", for messages.
std::string in_words(const PressSpec& press);

/// Where the object just touches the undeformed gel on the press's path down: first_touch() of the object with all its
/// relief. @throws Error as first_touch
double first_touch(const PressSpec& press, const ObjectSpec& object, const GelSpec& gel);
/// The same of contact_shape(object).
double first_touch(const PressSpec& press, const fem::ContactShape& shape, const GelSpec& gel);

/// The motion of a press: from just above the gel down, then along it. Where friction has a history (the object is
/// tilted or goes aside) both are cut into steps. `touch_mm` is what first_touch gave. @throws Error as check
MotionSpec press_motion(const PressSpec& press, double touch_mm, double friction, double frame_rate_Hz);

}  // namespace touchstone::sim
