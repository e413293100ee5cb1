#include "lab/reflex/reflex_presses.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_checks.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr double kMostTilt_deg = 30.0;
constexpr double kPublishedScale_N = 1.1293;
constexpr double kPublishedRate_per_mm = 0.4677;
constexpr double kPublishedDeepest_mm = 5.0;
constexpr double kMeshError = 0.01;
constexpr double kLeastMeshError_N = 0.02;

constexpr const char* kWhose = "the reflex press's ";  // begins what a refusal says

double radians(double degrees) {
  return degrees * kRadiansPerDegree;
}

/// Adds points straight on from the last one, none further than `step` from the next.
void go(const Eigen::Vector3d& to, double step, sim::PressPath& path) {
  const sim::PathPoint from = path.points.back();
  const double length = (to - from.shift_mm).norm();
  // A step that fits but for rounding fits.
  const int steps = std::max(1, static_cast<int>(std::ceil(length / step - 1e-9)));
  for (int k = 1; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    path.points.push_back({from.at + share * length, from.shift_mm + share * (to - from.shift_mm)});
  }
}

}  // namespace

const char* name_of(ReflexObject object) {
  switch (object) {
    case ReflexObject::plate:
      return "plate";
    case ReflexObject::ball:
      return "ball";
    case ReflexObject::cylinder:
      return "cylinder";
    case ReflexObject::probe:
      return "probe";
  }
  TS_ASSERT(false);
  return "";
}

sim::PressPath press_down(const ReflexPress& press) {
  check_above_zero(kWhose, press.deepest_mm, "depth");
  check_above_zero(kWhose, press.step_mm, "step");
  if (!(press.tilt_deg >= 0.0 && press.tilt_deg <= kMostTilt_deg) || !std::isfinite(press.tilt_towards_deg)) {
    fail("the reflex press's tilt is {} degrees towards {}; allowed are 0 to {} towards any finite angle",
         press.tilt_deg, press.tilt_towards_deg, kMostTilt_deg);
  }
  sim::PressPath path;
  path.friction = press.friction;
  path.place_mm = press.place_mm;
  const double towards = radians(press.tilt_towards_deg);
  const Eigen::Vector3d axis(-std::sin(towards), std::cos(towards), 0.0);
  path.rotation = Eigen::AngleAxisd(radians(press.tilt_deg), axis).toRotationMatrix();
  switch (press.object) {
    case ReflexObject::plate:
      path.shape = fem::BoxShape{{60.0, 60.0, 30.0}};
      break;
    case ReflexObject::ball:
      path.shape = fem::SphereShape{6.35};
      break;
    case ReflexObject::cylinder:
      path.shape = fem::RoundedCylinder{5.0, 0.0, 40.0};
      // Its own axis is z, from its face on: laid along x, its middle over the place.
      path.rotation *= Eigen::AngleAxisd(radians(90.0), Eigen::Vector3d::UnitY()).toRotationMatrix();
      path.place_mm -= (path.rotation * Eigen::Vector3d(0.0, 0.0, 20.0)).head<2>();
      break;
    case ReflexObject::probe:
      path.shape = fem::RoundedCylinder{3.0, 0.5, 20.0};
      break;
  }
  path.points = {{}};
  go({0.0, 0.0, -press.deepest_mm}, press.step_mm, path);
  return path;
}

sim::PressPath press_and_shear(const ReflexPress& press, const ReflexShear& shear) {
  check_above_zero(kWhose, shear.reach_mm, "shear");
  check_above_zero(kWhose, shear.shear_step_mm, "step of shear");
  if (!std::isfinite(shear.towards_deg)) fail("the reflex press's shear goes towards {} degrees", shear.towards_deg);
  sim::PressPath path = press_down(press);
  const double towards = radians(shear.towards_deg);
  const Eigen::Vector3d aside = shear.reach_mm * Eigen::Vector3d(std::cos(towards), std::sin(towards), 0.0);
  const Eigen::Vector3d middle = path.points.back().shift_mm;
  for (const double share : {1.0, 0.0, -1.0, 0.0}) go(middle + share * aside, shear.shear_step_mm, path);
  return path;
}

double published_reflex_force(double z_mm) {
  return z_mm > 0.0 ? kPublishedScale_N * std::expm1(kPublishedRate_per_mm * z_mm) : 0.0;
}

sim::ForceLaw reflex_law(const ReflexPress& press, const sim::PlayedPath& played) {
  return sim::force_law(press_down(press), played, kMeshError, kLeastMeshError_N);
}

double reflex_law_rms(const std::function<double(double)>& force_N, int count) {
  TS_ASSERT(count >= 2);
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    const double z = kPublishedDeepest_mm * k / (count - 1);
    sum += std::pow(force_N(z) - published_reflex_force(z), 2);
  }
  return std::sqrt(sum / count);
}

double reflex_law_rms(const sim::ForceLaw& law, int count) {
  return reflex_law_rms([&](double z_mm) { return law.force(z_mm); }, count);
}

}  // namespace touchstone::lab
