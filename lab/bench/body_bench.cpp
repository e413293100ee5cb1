#include "lab/bench/body_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/seconds_since.h"
#include "fem/contact/press.h"
#include "fem/error/press_error.h"
#include "sim/press/first_touch.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"

namespace touchstone::lab {
namespace {

using Eigen::Vector3d;

constexpr double kShearPerDepth = 0.3;  // most of the contact sticks with mu = 0.5, its rim slips
constexpr double kPartOfRoom = 0.8;     // that the gel may come up to, and it can be said that no plate is touched
constexpr double kLess = 0.9;           // of the force, for how the depth goes with it

Eigen::Matrix3d rotation_of(const BodyTrial& trial) {
  return rotation_from_xyz(Vector3d(0.0, trial.tilt_deg, trial.yaw_deg) * std::numbers::pi / 180.0);
}

fem::PressTarget target_of(const BodyTrial& trial, fem::AxisControl z, double drag = 0.0) {
  const double angle = trial.shear_deg * std::numbers::pi / 180.0;
  fem::PressTarget target;
  target.rotation = rotation_of(trial);
  target.axis = {fem::AxisControl::at(trial.place_mm.x() + drag * std::cos(angle)),
                 fem::AxisControl::at(trial.place_mm.y() + drag * std::sin(angle)), z};
  return target;
}

/// What a press said of its forces.
struct Reading {
  double normal = 0.0;
  double normal_bar = 0.0;
  Eigen::Vector2d shear = Eigen::Vector2d::Zero();
  double shear_bar = 0.0;
};

Reading read(const fem::Compliance& gel, const fem::PressState& state) {
  const fem::PressError error = fem::estimate_error(gel, state);
  return {state.wrench[2], error.force.z(), state.wrench.head<2>(), error.force.head<2>().norm()};
}

struct DepthPress {
  Reading pressed;
  std::optional<Reading> dragged;
  fem::PressState state;  ///< pressed
};

/// Down to the depth, then dragged where there is friction. What fails leaves its message.
std::optional<DepthPress> press_to_depth(const BodyTrial& trial, const fem::ContactShape& shape,
                                         const fem::Compliance& gel, double z, std::string& failure) {
  DepthPress result;
  const char* what = "by depth";
  try {
    fem::Press press(gel, shape, trial.friction);
    result.state = press.step(target_of(trial, fem::AxisControl::at(z)));
    result.pressed = read(gel, result.state);
    if (trial.friction > 0.0) {
      what = "dragged";
      result.dragged =
          read(gel, press.step(target_of(trial, fem::AxisControl::at(z), kShearPerDepth * trial.depth_mm)));
    }
  } catch (const Error& error) {
    failure = fmt::format("{}: {}", what, error.what());
    if (result.state.node_state.empty()) return std::nullopt;
  }
  return result;
}

struct ForcePress {
  double depth = 0.0;  ///< beyond the first touch, mm
  double bar = 0.0;    ///< of the force, N
  double soft = 0.0;   ///< depth per force, mm / N: what a bar of the force is worth
};

std::optional<ForcePress> press_by_force(const BodyTrial& trial, const fem::Compliance& gel, double touch, double force,
                                         std::string& failure) {
  try {
    fem::Press press(gel, trial.body.shape, trial.friction);
    fem::Press lighter(gel, trial.body.shape, trial.friction);
    const double less =
        touch -
        lighter.step(target_of(trial, fem::AxisControl::with_force(kLess * force))).gel_from_object.translation.z();
    const fem::PressState& state = press.step(target_of(trial, fem::AxisControl::with_force(force)));
    const double depth = touch - state.gel_from_object.translation.z();
    return ForcePress{depth, fem::estimate_error(gel, state).force.z(), (depth - less) / ((1.0 - kLess) * force)};
  } catch (const Error& error) {
    if (failure.empty()) failure = fmt::format("by force: {}", error.what());
    return std::nullopt;
  }
}

double seconds_of(const std::function<void()>& work) {
  const auto begun = std::chrono::steady_clock::now();
  work();
  return seconds_since(begun);
}

}  // namespace

double TrialError::bars() const {
  return std::abs(off) / std::hypot(bar, reference_bar);
}

std::vector<TrialGel> set_up_trials(bool quick, const std::filesystem::path& cache, const Progress& progress) {
  std::vector<TrialGel> gels = trial_gels(quick);
  for (TrialGel& gel : gels) {
    gel.own = sim::set_up_gel(gel.device, cache, progress);
    sim::DeviceSpec finer = gel.device;
    finer.mesh.fine_mm *= gel.reference_edges;
    finer.mesh.coarse_mm *= gel.reference_edges;
    if (quick) {
      const fem::GelBody body = sim::gel_body(finer);
      auto reference = std::make_shared<fem::Compliance>(fem::compute_compliance(
          fem::mesh_gel(body), sim::gel_materials(finer.gel), {}, fem::thickness_of(body), progress));
      reference->mesh_error = gel.own->mesh_error;
      gel.reference = std::move(reference);
    } else {
      gel.reference = sim::set_up_gel(finer, cache, progress);
    }
  }
  return gels;
}

TrialOutcome run_trial(const BodyTrial& trial, const TrialGel& gel) {
  TrialOutcome outcome;
  const double touch = sim::first_touch(gel.device.gel, trial.body.shape, trial.place_mm, rotation_of(trial));
  const double z = touch - trial.depth_mm;
  std::optional<DepthPress> reference;
  outcome.reference_seconds = seconds_of([&] {
    const double room = trial.body.height_mm - trial.depth_mm;  // from the undeformed gel to the plate
    if (trial.body.lifted && room > 0.0) {
      reference = press_to_depth(trial, *trial.body.lifted, *gel.reference, z, outcome.reference_failure);
      outcome.plate_lifted = reference && reference->state.surface_displacement.col(2).maxCoeff() < kPartOfRoom * room;
      if (outcome.plate_lifted) return;
      outcome.reference_failure.clear();
    }
    reference = press_to_depth(trial, trial.body.shape, *gel.reference, z, outcome.reference_failure);
  });
  std::optional<DepthPress> own;
  outcome.seconds = seconds_of([&] { own = press_to_depth(trial, trial.body.shape, *gel.own, z, outcome.failure); });
  if (own) {
    outcome.contact_vertices = own->state.contact_vertices;
    outcome.contact_area = own->state.contact_area;
    outcome.largest_strain = own->state.largest_strain;
  }
  if (!reference || reference->pressed.normal <= 0.0) return outcome;
  outcome.reference_N = reference->pressed.normal;
  const double reference_bar = reference->pressed.normal_bar / outcome.reference_N;
  if (own) {
    outcome.force = {own->pressed.normal / outcome.reference_N - 1.0, own->pressed.normal_bar / outcome.reference_N,
                     reference_bar};
    if (own->dragged && reference->dragged) {
      const double scale = reference->dragged->shear.norm();
      // Signed by the size of the force, which is mostly along the drag; its false direction counts in full.
      const double size = (own->dragged->shear - reference->dragged->shear).norm();
      const double sign = own->dragged->shear.norm() >= scale ? 1.0 : -1.0;
      outcome.shear = {sign * size / scale, own->dragged->shear_bar / scale, reference->dragged->shear_bar / scale};
    }
  }
  std::optional<ForcePress> by_force;
  outcome.seconds +=
      seconds_of([&] { by_force = press_by_force(trial, *gel.own, touch, outcome.reference_N, outcome.failure); });
  if (by_force) {
    const double part = by_force->soft / trial.depth_mm;
    outcome.depth = {by_force->depth / trial.depth_mm - 1.0, part * by_force->bar,
                     part * reference->pressed.normal_bar};
  }
  return outcome;
}

TrialSummary summarise(const std::vector<TrialOutcome>& outcomes, std::optional<TrialError> TrialOutcome::*figure) {
  std::vector<double> off;
  std::vector<double> size;
  int within = 0;
  int within_own = 0;
  for (const TrialOutcome& outcome : outcomes) {
    const std::optional<TrialError>& error = outcome.*figure;
    if (!error) continue;
    off.push_back(error->off);
    size.push_back(std::abs(error->off));
    within += error->bars() <= 2.0;
    within_own += std::abs(error->off) <= 2.0 * error->bar;
  }
  if (off.empty()) return {};
  std::sort(off.begin(), off.end());
  std::sort(size.begin(), size.end());
  const auto at = [](const std::vector<double>& sorted, double part) {
    return sorted[static_cast<std::size_t>(std::lround(part * static_cast<double>(sorted.size() - 1)))];
  };
  const auto count = static_cast<double>(off.size());
  return {
      static_cast<int>(off.size()), at(size, 0.5), at(size, 0.95), at(off, 0.5), within / count, within_own / count};
}

}  // namespace touchstone::lab
