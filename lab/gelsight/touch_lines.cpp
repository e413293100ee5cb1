#include "lab/gelsight/touch_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

constexpr int kCells = 26;  ///< between touch_line's start and the status

std::string known(const std::optional<double>& value) {
  return value ? fmt::format("{:.6g}", *value) : std::string();
}

double degrees(double radians) {
  return radians * 180.0 / std::numbers::pi;
}

}  // namespace

std::string touch_header() {
  return "sequence,frame,file,t_us,touched,contact_px,u_px,v_px,markers,moved_u_px,moved_v_px,turn_deg,sigma_turn_deg,"
         "highest_mm,force_x_N,force_y_N,force_z_N,sigma_force_x_N,sigma_force_y_N,sigma_force_z_N,true_x_N,true_y_N,"
         "true_z_N,"
         "extrapolated,motion_ratio,force_ratio,ratios_slip,lag,sigma_lag,slip,trusted,status\n";
}

std::string touch_line(const std::string& start, const sensors::TouchReading& touch,
                       const std::optional<Eigen::Vector3d>& true_force_N) {
  std::string line = start;
  const auto add = [&](const std::string& cell) { line += cell + ","; };
  const auto add_if = [&](bool there, double value) { add(there ? fmt::format("{:.6g}", value) : std::string()); };
  const bool touched = touch.patch.has_value();
  const bool moved = touched && touch.moved.markers > 0;
  add(touched ? "1" : "0");
  add_if(touched, touched ? touch.patch->area_px : 0.0);
  add_if(touched, touched ? touch.patch->centre.x() : 0.0);
  add_if(touched, touched ? touch.patch->centre.y() : 0.0);
  add(touched ? fmt::format("{}", touch.moved.markers) : "");
  add_if(moved, touch.moved.px.x());
  add_if(moved, touch.moved.px.y());
  add_if(touch.moved.turn.has_value(), degrees(touch.moved.turn.value_or(0.0)));
  add_if(touch.moved.turn.has_value(), degrees(touch.moved.turn_error));
  add_if(!touch.height_mm.empty(), touch.height_max_mm);
  const bool shear = touch.shear_N.has_value(), normal = touch.normal_N.has_value();
  add_if(shear, shear ? 0.0 - touch.shear_N->x() : 0.0);  // on the object; no -0
  add_if(shear, shear ? 0.0 - touch.shear_N->y() : 0.0);
  add(known(touch.normal_N));
  add_if(shear, touch.shear_error_N);
  add_if(shear, touch.shear_error_N);
  add_if(normal, touch.normal_error_N);
  for (int axis = 0; axis < 3; ++axis) add_if(true_force_N.has_value(), true_force_N ? (*true_force_N)[axis] : 0.0);
  add(shear || normal ? fmt::format("{}", touch.beyond_calibration ? 1 : 0) : "");
  add(known(touch.motion_ratio));
  add(known(touch.force_ratio));
  add(touch.force_ratio && touch.motion_ratio ? fmt::format("{}", touch.rule_slip ? 1 : 0) : "");
  add(known(touch.rim.lag));
  add_if(touch.rim.lag.has_value(), touch.rim.lag_error);
  add(sensors::name_of(touch.rim.state));
  line += fmt::format("{},{}\n", touch.trusted ? 1 : 0, sensors::name_of(touch.light));
  return line;
}

std::string touch_fault_line(const std::string& start, const std::string& fault) {
  return start + std::string(kCells, ',') + "0," + datasets::csv_cell(fault) + "\n";
}

void TouchCount::add(const sensors::TouchReading& touch, const std::optional<Eigen::Vector3d>& true_force_N) {
  touched += touch.patch ? 1 : 0;
  slips += touch.rule_slip || touch.rim.slips() ? 1 : 0;
  beyond += touch.beyond_calibration ? 1 : 0;
  if (!true_force_N || !touch.trusted) return;
  const auto note = [&](int axis, double estimate_N, double sigma_N) {
    Errors& one = errors[static_cast<std::size_t>(axis)];
    const double off = std::abs(estimate_N - (*true_force_N)[axis]);
    ++one.frames;
    one.squares_N2 += off * off;
    one.largest_N = std::max(one.largest_N, off);
    one.within_two += off <= 2.0 * sigma_N ? 1 : 0;
  };
  if (touch.shear_N) {
    note(0, -touch.shear_N->x(), touch.shear_error_N);
    note(1, -touch.shear_N->y(), touch.shear_error_N);
  }
  if (touch.normal_N) note(2, *touch.normal_N, touch.normal_error_N);
}

}  // namespace touchstone::lab
