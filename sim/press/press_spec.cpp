#include "sim/press/press_spec.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/transform.h"
#include "core/units.h"
#include "sim/press/first_touch.h"

namespace touchstone::sim {
namespace {

constexpr double kClearance_mm = 0.05;  // above the gel at the start
// Steps where friction has a history. A first touch that force leads is taken in parts by fem itself
// (PressTolerance::touch_parts). Finer ones change what lies under a ball sideways by 0.4 % of it, and take 1.5 times
// as long (docs/datasets.md, "Speed").
constexpr int kStepsDown = 3;
constexpr double kDragStep_mm = 0.2;
constexpr int kShearSteps = 5;
constexpr double kMostTurn_deg = 360.0;

bool goes_aside(const PressSpec& press) {
  return press.shear_N.has_value() || !press.drag_mm.isZero(0.0);
}

}  // namespace

void check(const PressSpec& press) {
  const int ends = (press.force_N ? 1 : 0) + (press.depth_mm ? 1 : 0) + (press.height_mm ? 1 : 0);
  if (ends != 1) {
    fail("a press has {} of force_N, depth_mm and height_mm; give exactly one", ends == 0 ? "none" : "several");
  }
  const auto above_zero = [](const std::optional<double>& value, const char* name) {
    if (value && !(*value > 0.0 && std::isfinite(*value))) fail("{} is {}; allowed are numbers above 0", name, *value);
  };
  above_zero(press.force_N, "force_N");
  above_zero(press.depth_mm, "depth_mm");
  above_zero(press.seconds, "seconds");
  if (press.height_mm && !std::isfinite(*press.height_mm)) fail("height_mm is {}; it must be finite", *press.height_mm);
  if (!press.place_mm.allFinite() || !press.angles_deg.allFinite() || !press.drag_mm.allFinite() ||
      (press.shear_N && !press.shear_N->allFinite())) {
    fail("a press's place_mm, angles_deg, drag_mm and shear_N must be finite");
  }
  for (const double angle : press.angles_deg) {
    if (std::abs(angle) > kMostTurn_deg) {
      fail("angles_deg has {:g}; allowed is from {:g} to {:g}", angle, -kMostTurn_deg, kMostTurn_deg);
    }
  }
  if (press.shear_N && !press.drag_mm.isZero(0.0)) fail("a press has both drag_mm and shear_N; give one of them");
}

std::string in_words(const PressSpec& press) {
  std::string words = fmt::format("at ({:g}, {:g}) mm", press.place_mm.x(), press.place_mm.y());
  if (!press.angles_deg.isZero(0.0)) {
    words += fmt::format(" turned by ({:g}, {:g}, {:g}) degrees", press.angles_deg.x(), press.angles_deg.y(),
                         press.angles_deg.z());
  }
  if (press.force_N) words += fmt::format(" with {:g} N", *press.force_N);
  if (press.depth_mm) words += fmt::format(" {:g} mm deep", *press.depth_mm);
  if (press.height_mm) words += fmt::format(" to z = {:g} mm", *press.height_mm);
  if (!press.drag_mm.isZero(0.0)) {
    words += fmt::format(" dragged by ({:g}, {:g}) mm", press.drag_mm.x(), press.drag_mm.y());
  }
  if (press.shear_N) words += fmt::format(" sheared by ({:g}, {:g}) N", press.shear_N->x(), press.shear_N->y());
  return words;
}

double first_touch(const PressSpec& press, const ObjectSpec& object, const GelSpec& gel) {
  return first_touch(press, contact_shape(object), gel);
}

double first_touch(const PressSpec& press, const fem::ContactShape& shape, const GelSpec& gel) {
  return first_touch(gel, shape, press.place_mm, rotation_from_xyz(press.angles_deg * kRadiansPerDegree));
}

MotionSpec press_motion(const PressSpec& press, double touch_mm, double friction, double frame_rate_Hz) {
  check(press);
  const bool aside = goes_aside(press);
  const bool tilted = !press.angles_deg.head<2>().isZero(0.0);
  const int steps_down = friction > 0.0 && (aside || tilted) && !press.force_N ? kStepsDown : 1;
  const int steps_aside =
      press.shear_N ? kShearSteps : std::max(1, static_cast<int>(std::ceil(press.drag_mm.norm() / kDragStep_mm)));
  MotionSpec motion;
  motion.frame_rate_Hz = frame_rate_Hz;
  const double end = press.height_mm.value_or(touch_mm);
  motion.start_mm << press.place_mm, std::max(touch_mm, end) + kClearance_mm;
  motion.start_angles_deg = press.angles_deg;
  MotionKey down;
  down.frames = steps_down;
  if (press.force_N) {
    down.z = AxisKey{std::nullopt, *press.force_N};
  } else {
    down.z = AxisKey{press.depth_mm ? touch_mm - *press.depth_mm : *press.height_mm, std::nullopt};
  }
  motion.keys = {down};
  if (aside) {
    MotionKey along;
    along.frames = steps_aside;
    if (press.shear_N) {
      along.x = AxisKey{std::nullopt, press.shear_N->x()};
      along.y = AxisKey{std::nullopt, press.shear_N->y()};
    } else {
      along.x = AxisKey{press.place_mm.x() + press.drag_mm.x(), std::nullopt};
      along.y = AxisKey{press.place_mm.y() + press.drag_mm.y(), std::nullopt};
    }
    motion.keys.push_back(along);
  }
  if (press.seconds) {  // a motion has one frame rate
    if (aside) motion.keys.front().frames = motion.keys.back().frames = std::max(steps_down, steps_aside);
    motion.frame_rate_Hz = motion.keys.front().frames / *press.seconds;
  }
  return motion;
}

}  // namespace touchstone::sim
