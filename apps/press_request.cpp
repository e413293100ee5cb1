#include "apps/press_request.h"

namespace touchstone::apps {

sim::PressSpec press_of(const Requested& requested) {
  allow_only(requested, {"object", "x_mm", "y_mm", "turn_x_deg", "turn_y_deg", "turn_z_deg", "force_N", "depth_mm",
                         "drag_x_mm", "drag_y_mm"});
  sim::PressSpec press;
  press.place_mm = {number_of(requested, "x_mm", 0.0), number_of(requested, "y_mm", 0.0)};
  press.angles_deg = {angle_of(requested, "turn_x_deg"), angle_of(requested, "turn_y_deg"),
                      angle_of(requested, "turn_z_deg")};
  press.drag_mm = {number_of(requested, "drag_x_mm", 0.0), number_of(requested, "drag_y_mm", 0.0)};
  if (requested.count("force_N") > 0) press.force_N = number_of(requested, "force_N");
  if (requested.count("depth_mm") > 0) press.depth_mm = number_of(requested, "depth_mm");
  return press;
}

}  // namespace touchstone::apps
