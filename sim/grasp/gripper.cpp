#include "sim/grasp/gripper.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"

namespace touchstone::sim {
namespace {

constexpr double kTonnesPerGram = 1e-6;
constexpr double kLoadTolerance = 1e-3;   // of a load
constexpr double kAllFriction = 0.98;     // of mu N: from there on a contact without a sticking vertex slides
constexpr double kFirstMotion_mm = 2e-3;  // with which the stiffness along the gel is found
constexpr double kSoftening = 0.25;       // least stiffness of a further step, of the last one's
constexpr double kLongestMotion_mm = 0.1;
constexpr int kMostMotions = 60;

void check_body(const GraspedBody& body) {
  if (!(body.friction >= 0.0) || !std::isfinite(body.friction)) {
    fail("the grasped object's friction is {}, it must be at least 0 and finite", body.friction);
  }
  if (!(body.mass_g > 0.0) || !std::isfinite(body.mass_g)) {
    fail("the grasped object's mass is {} g, it must be above 0 and finite", body.mass_g);
  }
  if (!(body.crush_force_N > 0.0)) {
    fail("the grasped object's crush force is {} N, it must be above 0", body.crush_force_N);
  }
}

constexpr const char* kWhose = "the gripper's ";  // begins what a refusal says

bool anything_sticks(const fem::PressState& press) {
  return std::any_of(press.node_state.begin(), press.node_state.end(),
                     [](fem::NodeState state) { return state == fem::NodeState::stick; });
}

}  // namespace

Gripper::Gripper(const fem::Compliance& gel, const GraspedBody& body, const GripperSettings& settings)
    : body_(body), settings_(settings), press_(gel, body.shape, body.friction), mass_(body.mass_g * kTonnesPerGram) {
  check_body(body);
  check_above_zero(kWhose, settings.clearance_mm, "clearance_mm");
  check_above_zero(kWhose, settings.step_s, "step_s");
  check_above_zero(kWhose, settings.slide_step_s, "slide_step_s");
  check_above_zero(kWhose, settings.drop_mm, "drop_mm");
  place_object(gel);
  step_to(0.0);
}

/// Puts the object as near to the gel as the clearance says.
void Gripper::place_object(const fem::Compliance& gel) {
  const RigidTransform object_from_gel = settings_.gel_from_object.inverse();
  const Eigen::Vector3d up = object_from_gel.turn(Eigen::Vector3d::UnitZ());
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& vertex : gel.vertices) {
    if (const auto entry = first_entry(body_.shape, object_from_gel * vertex, up)) least = std::min(least, *entry);
  }
  if (std::isinf(least)) fail("the grasped object isn't over the gel");
  start_ = settings_.gel_from_object.translation;
  start_.z() += settings_.clearance_mm - least;
}

double Gripper::half_load(double arm_acceleration) const {
  return 0.5 * mass_ * std::max(0.0, kGravity_mm_s2 + arm_acceleration);
}

/// Moves the object to where the fingers' travel and `sunk` put it, and looks at the forces.
void Gripper::step_to(double sunk) {
  fem::PressTarget target;
  target.rotation = settings_.gel_from_object.rotation;
  target.axis = {fem::AxisControl::at(start_.x()), fem::AxisControl::at(start_.y() - sunk),
                 fem::AxisControl::at(start_.z() - state_.finger_travel_mm)};
  const fem::PressState& press = press_.step(target);
  const double step = sunk - state_.sunk_mm;
  state_.sunk_mm = sunk;
  state_.normal_force_N = press.wrench[2];
  state_.friction_N = press.wrench[1];
  state_.touched = press.contact_vertices > 0;
  state_.peak_normal_force_N = std::max(state_.peak_normal_force_N, state_.normal_force_N);
  state_.crushed = state_.peak_normal_force_N > body_.crush_force_N;
  state_.slipping = state_.touched && !anything_sticks(press) &&
                    std::abs(state_.friction_N) >= kAllFriction * body_.friction * state_.normal_force_N;
  if (state_.slipping) state_.slid_mm += std::abs(step);
}

/// Sinks or lifts the object until the fingers' friction is `load`. False where it slides before.
bool Gripper::balance(double load) {
  double stiffness = stiffness_;
  for (int motion = 0; motion < kMostMotions; ++motion) {
    const double missing = load - state_.friction_N;
    if (std::abs(missing) <= kLoadTolerance * load) return true;
    if (!state_.touched || (missing > 0.0 && state_.slipping)) return false;
    // What has begun to slip gives way ever more, but comes back as stiff as it was at first.
    const double softness = missing > 0.0 ? stiffness : stiffness_;
    double step = softness > 0.0 ? missing / softness : std::copysign(kFirstMotion_mm, missing);
    step = std::clamp(step, -kLongestMotion_mm, kLongestMotion_mm);
    const double before = state_.friction_N;
    step_to(state_.sunk_mm + step);
    const double found = (state_.friction_N - before) / step;
    if (stiffness_ == 0.0 && found > 0.0) stiffness_ = stiffness = found;
    if (missing > 0.0) stiffness = std::max(found, kSoftening * stiffness);
  }
  return state_.friction_N >= load * (1.0 - kLoadTolerance);
}

void Gripper::stand_on_table(double arm_acceleration) {
  step_to(state_.arm_height_mm);
  state_.sliding_speed_mm_s = state_.slipping ? state_.arm_speed_mm_s : 0.0;
  if (state_.friction_N <= half_load(std::max(0.0, arm_acceleration))) return;
  state_.on_table = false;
  hang(arm_acceleration, 0.0);
}

void Gripper::hang(double arm_acceleration, double seconds) {
  if (sliding_) {
    slide(arm_acceleration, seconds);
    return;
  }
  step_to(state_.sunk_mm);
  state_.sliding_speed_mm_s = 0.0;
  stiffness_ = 0.0;  // it depends on how hard the fingers press
  sliding_ = !balance(half_load(arm_acceleration));
}

void Gripper::slide(double arm_acceleration, double seconds) {
  const double gain = kGravity_mm_s2 + arm_acceleration - 2.0 * state_.friction_N / mass_;
  const double speed = state_.sliding_speed_mm_s;
  const double next = speed + gain * seconds;
  if (next > 0.0) {
    state_.sliding_speed_mm_s = next;
    step_to(state_.sunk_mm + 0.5 * (speed + next) * seconds);
    return;
  }
  state_.sliding_speed_mm_s = 0.0;
  step_to(state_.sunk_mm + (gain < 0.0 ? 0.5 * speed * speed / -gain : 0.0));
  stiffness_ = 0.0;
  sliding_ = !balance(half_load(arm_acceleration));
}

void Gripper::remove_table() {
  table_ = false;
  state_.on_table = false;
}

/// The object is out of the fingers: the gel is bare.
void Gripper::release() {
  state_.dropped = true;
  sliding_ = false;
  start_.z() += state_.finger_travel_mm + 2.0 * bounding_ball(body_.shape).radius;
  step_to(state_.sunk_mm);
  state_.object_height_mm = 0.0;
  state_.sliding_speed_mm_s = 0.0;
}

const GripperState& Gripper::advance(double close_by_mm, double arm_acceleration, double seconds) {
  if (!std::isfinite(close_by_mm) || !std::isfinite(arm_acceleration)) {
    fail("the gripper is commanded to close by {} mm and to accelerate by {} mm/s^2", close_by_mm, arm_acceleration);
  }
  if (!(seconds > 0.0) || !std::isfinite(seconds)) fail("an interval of {} s, it must be above 0 and finite", seconds);
  const double travel_end = state_.finger_travel_mm + close_by_mm;
  const double travel_speed = close_by_mm / seconds;
  double rest = seconds;
  while (rest > 0.0) {
    const double longest = sliding_ ? settings_.slide_step_s : settings_.step_s;
    const double parts = std::ceil(rest / longest * (1.0 - 1e-9));
    const bool last = parts <= 1.0;
    const double dt = last ? rest : rest / parts;
    rest = last ? 0.0 : rest - dt;
    state_.seconds += dt;
    state_.arm_height_mm += (state_.arm_speed_mm_s + 0.5 * arm_acceleration * dt) * dt;
    state_.arm_speed_mm_s += arm_acceleration * dt;
    if (state_.dropped) continue;
    state_.finger_travel_mm = travel_end - travel_speed * rest;
    if (state_.on_table) {
      stand_on_table(arm_acceleration);
    } else {
      hang(arm_acceleration, dt);
      if (table_ && state_.sunk_mm > state_.arm_height_mm) {  // it has come down
        state_.on_table = true;
        sliding_ = false;
        stand_on_table(arm_acceleration);
      }
    }
    state_.table_force_N = state_.on_table ? mass_ * kGravity_mm_s2 - 2.0 * state_.friction_N : 0.0;
    state_.object_height_mm = state_.arm_height_mm - state_.sunk_mm;
    const bool out_of_touch = !state_.touched && (!state_.on_table || state_.slid_mm > 0.0);
    if (out_of_touch || state_.slid_mm > settings_.drop_mm) release();
  }
  return state_;
}

}  // namespace touchstone::sim
