#include "sim/press/touch_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/contact/press_fields.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::sim {
namespace {

using Kind = fem::AxisControl::Kind;

/// The farthest that a point within a ball about the object's origin goes between two poses.
double farthest_motion(const RigidTransform& from, const RigidTransform& to, const fem::BoundingBall& ball) {
  const double turn = std::acos(std::clamp(0.5 * ((from.rotation.transpose() * to.rotation).trace() - 1.0), -1.0, 1.0));
  return ((to * ball.centre) - (from * ball.centre)).norm() + 2.0 * std::sin(0.5 * turn) * ball.radius;
}

void check_settings(const TouchSessionSettings& settings) {
  if (!(settings.largest_step_mm > 0.0)) {
    fail("largest_step_mm of a session is {}; allowed is above 0", settings.largest_step_mm);
  }
  if (!(settings.largest_part_mm > 0.0)) {
    fail("largest_part_mm of a session is {}; allowed is above 0", settings.largest_part_mm);
  }
}

/// `weight` of the surface's vertices, mm^2.
TouchReading reading_of(const fem::Compliance& gel, const Eigen::VectorXd& weight, const fem::PressState& state) {
  TouchReading next;
  next.gel_from_object = state.gel_from_object;
  next.wrench = state.wrench;
  next.contact_area_mm2 = state.contact_area;
  next.under_resolved = state.under_resolved;
  if (state.contact_vertices == 0) return next;
  double slipping = 0.0;
  double pressed = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < state.node_state.size(); ++v) {
    if (state.node_state[v] == fem::NodeState::open) continue;
    const auto row = static_cast<Eigen::Index>(v);
    const double load = weight[row] * state.traction.row(row).norm();
    pressed += load;
    moment += load * gel.vertices[v];
    if (state.node_state[v] == fem::NodeState::slip) {
      slipping += weight[row] * (state.bearing_share.size() > 0 ? state.bearing_share[row] : 1.0);
    }
  }
  if (pressed > 0.0) next.centre_mm = moment / pressed;
  next.slipping_share = std::min(1.0, slipping / state.contact_area);
  constexpr double kAll = 1.0 - 1e-12;  // sums of the same weights in another order
  next.contact = slipping == 0.0              ? TouchContact::sticking
                 : next.slipping_share < kAll ? TouchContact::partly_slipping
                                              : TouchContact::sliding;
  next.error = fem::estimate_error(gel, state);
  next.error.displacement = 0.0;
  return next;
}

}  // namespace

const char* name_of(TouchContact contact) {
  switch (contact) {
    case TouchContact::none:
      return "none";
    case TouchContact::sticking:
      return "sticking";
    case TouchContact::partly_slipping:
      return "partly_slipping";
    case TouchContact::sliding:
      return "sliding";
  }
  TS_ASSERT(false);
}

TouchReading reading_of(const fem::Compliance& gel, const fem::PressState& state) {
  return reading_of(gel, gel.mass * Eigen::VectorXd::Ones(static_cast<Eigen::Index>(gel.vertices.size())), state);
}

struct TouchSession::Parts {
  Parts(const fem::Compliance& gel_of, const GelSpec& material, fem::PressBody body_of,
        const TouchSessionSettings& settings_of)
      : gel(gel_of),
        relaxation(prony_series(material)),
        body(std::move(body_of)),
        settings(settings_of),
        ball(fem::bounding_ball(body.shape)),
        weight(gel.mass * Eigen::VectorXd::Ones(static_cast<Eigen::Index>(gel.vertices.size()))) {
    check_settings(settings);
    for (const Eigen::Vector3d& vertex : gel.vertices) highest_mm = std::max(highest_mm, vertex.z());
    // A relaxing gel goes over its whole compliance in each step anyhow, and its state doesn't tell what it remembers.
    if (relaxation.empty()) fields.emplace(gel);
    restart();
  }

  void restart() {
    fem::PressTolerance tolerance;
    tolerance.largest_motion = settings.largest_part_mm;
    press.emplace(gel, std::vector<fem::PressBody>{body}, tolerance, relaxation,
                  fields ? fem::PressOutput::forces : fem::PressOutput::fields);
    reading = {};
  }

  /// Refuses a pose that the last one can hardly have led to. Lifting off may be as fast as it likes.
  void check_path(const fem::PressTarget& target) const {
    if (!(target.seconds > 0.0) || !std::isfinite(target.seconds)) {
      fail("a step of a session takes {} s; allowed is a finite time above 0", target.seconds);
    }
    if (reading.step == 0 || reading.contact == TouchContact::none) return;
    RigidTransform to{target.rotation, reading.gel_from_object.translation};
    for (int a = 0; a < 3; ++a) {
      if (target.axis[a].kind == Kind::position) to.translation[a] = target.axis[a].value;
    }
    if (!to.rotation.allFinite() || !to.translation.allFinite()) return;  // which a press refuses
    const double motion = farthest_motion(reading.gel_from_object, to, ball);
    if (motion <= settings.largest_step_mm || (to * ball.centre).z() - ball.radius > highest_mm) return;
    const Eigen::Vector3d& from = reading.gel_from_object.translation;
    fail(
        "the object in contact goes {:.4g} mm in one step, from ({:.4g}, {:.4g}, {:.4g}) mm to ({:.4g}, {:.4g}, "
        "{:.4g}) "
        "mm; allowed is {} (largest_step_mm). Poses are gel_from_object, in mm",
        motion, from.x(), from.y(), from.z(), to.translation.x(), to.translation.y(), to.translation.z(),
        settings.largest_step_mm);
  }

  TouchReading read(const fem::PressState& state, double seconds) const {
    TouchReading next = reading_of(gel, weight, state);
    next.step = reading.step + 1;
    next.t_s = reading.t_s + seconds;
    return next;
  }

  const TouchReading& step(const fem::PressTarget& target) {
    check_path(target);
    reading = read(press->step(target), target.seconds);
    return reading;
  }

  const fem::Compliance& gel;
  fem::PronySeries relaxation;
  fem::PressBody body;
  TouchSessionSettings settings;
  fem::BoundingBall ball;
  Eigen::VectorXd weight;                                        // of surface vertices, mm^2
  double highest_mm = -std::numeric_limits<double>::infinity();  // of the surface at rest
  std::optional<fem::PressFields> fields;
  std::optional<fem::Press> press;
  TouchReading reading;
};

TouchSession::TouchSession(const fem::Compliance& gel, const GelSpec& material, fem::PressBody body,
                           const TouchSessionSettings& settings)
    : parts_(std::make_unique<Parts>(gel, material, std::move(body), settings)) {}
TouchSession::~TouchSession() = default;
TouchSession::TouchSession(TouchSession&&) noexcept = default;
TouchSession& TouchSession::operator=(TouchSession&&) noexcept = default;

const TouchReading& TouchSession::step(const RigidTransform& gel_from_object, double seconds) {
  fem::PressTarget target;
  target.rotation = gel_from_object.rotation;
  for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(gel_from_object.translation[a]);
  target.seconds = seconds;
  return parts_->step(target);
}

const TouchReading& TouchSession::step(const fem::PressTarget& target) {
  return parts_->step(target);
}

const TouchReading& TouchSession::reading() const {
  return parts_->reading;
}

fem::PressState TouchSession::press() const {
  const fem::PressState& state = parts_->press->state();
  return parts_->fields ? parts_->fields->with_fields(state) : state;
}

fem::PressError TouchSession::error(const fem::PressState& press) const {
  return fem::estimate_error(parts_->gel, press);
}

void TouchSession::restart() {
  parts_->restart();
}

}  // namespace touchstone::sim
