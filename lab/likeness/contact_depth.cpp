#include "lab/likeness/contact_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr int kSteps = 16;
constexpr double kFriction = 0.5;  // of steel on silicone

}  // namespace

std::optional<double> DepthTable::depth_of(double radius) const {
  if (radius > radius_px.back()) return std::nullopt;
  const auto above = std::lower_bound(radius_px.begin(), radius_px.end(), radius) - radius_px.begin();
  if (above == 0) return depth_mm.front();
  const auto k = static_cast<std::size_t>(above);
  const double share = (radius - radius_px[k - 1]) / (radius_px[k] - radius_px[k - 1]);
  return depth_mm[k - 1] + share * (depth_mm[k] - depth_mm[k - 1]);
}

DepthTable measure_depths(const sim::VirtualSensor& sensor, const sim::TouchObject& ball, double deepest_mm,
                          const Progress& progress) {
  DepthTable table{{0.0}, {0.0}};
  for (int step = 1; step <= kSteps; ++step) {
    // A contact's radius goes with the depth's root: finer steps at the start.
    const double depth = deepest_mm * std::pow(static_cast<double>(step) / kSteps, 2);
    sim::PressSpec press;
    press.depth_mm = depth;
    const sim::Touch touch = sensor.press(ball, press);
    const double radius = std::sqrt(cv::countNonZero(touch.contact) / kPi);
    if (radius > table.radius_px.back()) {
      table.depth_mm.push_back(depth);
      table.radius_px.push_back(radius);
    }
    if (progress) progress("depths of contacts", step, kSteps);
  }
  if (table.depth_mm.size() < 2) {
    fail("{}: pressed in by {} mm in the gel's middle, nothing of the contact is seen", sensor.device().name,
         deepest_mm);
  }
  return table;
}

const RecordedBall& recorded_ball(std::map<double, RecordedBall>& balls, const sim::VirtualSensor& sensor,
                                  double radius_mm, double deepest_mm, const Progress& progress) {
  const auto known = balls.find(radius_mm);
  if (known != balls.end()) return known->second;
  sim::ObjectSpec ball;
  ball.name = fmt::format("ball of {} mm", 2 * radius_mm);
  ball.shape.radius_mm = radius_mm;
  ball.friction = kFriction;
  const sim::TouchObject object = sensor.object(ball);
  return balls.emplace(radius_mm, RecordedBall{object, measure_depths(sensor, object, deepest_mm, progress)})
      .first->second;
}

}  // namespace touchstone::lab
