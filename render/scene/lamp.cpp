#include "render/scene/lamp.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"
#include "render/scene/scene.h"
#include "render/scene/scene_limits.h"
#include "render/scene/spot_light.h"

namespace touchstone::render {
namespace {

constexpr double kLeastHalfPower = 1e-3;
constexpr double kMostHalfPower = 1.5;

bool same(const Spectrum& a, const Spectrum& b) {
  return a.size() == b.size() && (a == b).all();
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  return a.empty() || cv::norm(a, b, cv::NORM_INF) == 0.0;
}

bool equal(const SpotLamp& a, const SpotLamp& b) {
  return a.position == b.position && a.direction == b.direction && a.lens_radius == b.lens_radius &&
         a.half_angle == b.half_angle && a.soft_angle == b.soft_angle && same(a.power_W, b.power_W);
}

bool equal(const LedLamp& a, const LedLamp& b) {
  return a.position == b.position && a.direction == b.direction && a.radius == b.radius &&
         a.half_power_angle == b.half_power_angle && same(a.power_W, b.power_W) && a.visible == b.visible;
}

bool equal(const AreaLamp& a, const AreaLamp& b) {
  return a.centre == b.centre && a.direction == b.direction && a.along == b.along && a.width == b.width &&
         a.height == b.height && a.half_power_angle == b.half_power_angle && same(a.power_W, b.power_W) &&
         a.visible == b.visible;
}

bool equal(const ProjectedLamp& a, const ProjectedLamp& b) {
  return a.position == b.position && a.direction == b.direction && a.up == b.up &&
         a.half_width_angle == b.half_width_angle && same(a.pattern, b.pattern) && same(a.power_W, b.power_W);
}

bool equal(const GuideLamp& a, const GuideLamp& b) {
  return a.centre == b.centre && a.direction == b.direction && a.tilt == b.tilt && a.width == b.width &&
         a.half_power_angle == b.half_power_angle && same(a.power_W, b.power_W);
}

double integral(const SpotLamp& lamp) {
  return spot_solid_angle(lamp);
}

double integral(const LedLamp& lamp) {
  return 2.0 * kPi / (lobe_exponent(lamp.half_power_angle) + 1.0);
}

double integral(const AreaLamp& lamp) {
  return 2.0 * kPi / (lobe_exponent(lamp.half_power_angle) + 1.0);
}

/// value / cos^3 over the directions is the value over the plane at distance one.
double integral(const ProjectedLamp& lamp) {
  const double half_width = std::tan(lamp.half_width_angle);
  const double half_height = half_width * lamp.pattern.rows / lamp.pattern.cols;
  return 4.0 * half_width * half_height * cv::mean(lamp.pattern)[0];
}

/// The lobe about an axis that leans by `tilt`, cut off at the plane of the exit face. At the angle theta from the axis
/// all of the circle is before that plane up to theta = pi/2 - tilt, beyond it the share acos(-1/(tan theta tan
/// tilt))/pi.
double integral(const GuideLamp& lamp) {
  const double m = lobe_exponent(lamp.half_power_angle);
  const double tilt = std::abs(lamp.tilt);
  if (tilt == 0.0) return 2.0 * kPi / (m + 1.0);
  const double whole = 2.0 * kPi * (1.0 - std::pow(std::sin(tilt), m + 1.0)) / (m + 1.0);
  // The rest by Simpson's rule in s, theta = pi/2 - tilt (1 - s^2), which takes the share's square root away.
  constexpr int kIntervals = 512;
  double rest = 0.0;
  for (int i = 1; i < kIntervals; ++i) {
    const double s = static_cast<double>(i) / kIntervals;
    const double below = tilt * (1.0 - s * s);  // pi/2 - theta
    const double share = std::acos(-std::min(1.0, std::tan(below) / std::tan(tilt))) / kPi;
    rest += (i % 2 == 1 ? 4.0 : 2.0) * std::pow(std::sin(below), m) * std::cos(below) * share * 2.0 * tilt * s;
  }
  return whole + 2.0 * kPi * rest / (3.0 * kIntervals);
}

void check_point(const Eigen::Vector3d& point, const char* name, const std::string& what) {
  if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kFarthest) {
    fail("{}: its {} is ({}, {}, {}); it must be within 100 m of the origin", what, name, point.x(), point.y(),
         point.z());
  }
}

void check_direction(const Eigen::Vector3d& direction, const std::string& what) {
  if (!direction.allFinite() || !(direction.norm() > 1e-9)) fail("{}: it has no direction", what);
}

/// @pre check_direction holds
void check_across(const Eigen::Vector3d& across, const Eigen::Vector3d& direction, const char* name,
                  const std::string& what) {
  if (!across.allFinite() || !(across.norm() > 1e-9) ||
      !(across.normalized().cross(direction.normalized()).norm() > 1e-6)) {
    fail("{}: {} is ({}, {}, {}); it must not be along the lamp's direction", what, name, across.x(), across.y(),
         across.z());
  }
}

void check_lobe(double half_power_angle, bool visible, const std::string& what) {
  if (!(half_power_angle >= kLeastHalfPower && half_power_angle <= kMostHalfPower)) {
    fail("{}: half_power_angle is {} rad; it must be from {} to {}", what, half_power_angle, kLeastHalfPower,
         kMostHalfPower);
  }
  if (visible && half_power_angle > kLambertianHalfPower * (1.0 + 1e-12)) {
    fail("{}: half_power_angle is {} rad; that of a visible lamp must be at most pi/3", what, half_power_angle);
  }
}

void check_length(double length, const char* name, const std::string& what) {
  if (!(length > 0.0 && length < kFarthest)) fail("{}: {} is {} mm; it must be above 0", what, name, length);
}

void check(const SpotLamp& lamp, const std::vector<FlatFace>&, const std::string& what) {
  check_point(lamp.position, "position", what);
  check_direction(lamp.direction, what);
  if (!(lamp.lens_radius >= 0.0 && lamp.lens_radius < kFarthest)) {
    fail("{}: lens_radius is {} mm; it must be 0 or more", what, lamp.lens_radius);
  }
  if (!(lamp.half_angle >= 0.0 && lamp.soft_angle >= 0.0 && lamp.half_angle + lamp.soft_angle > 1e-4 &&
        lamp.half_angle + lamp.soft_angle <= 0.5 * kPi)) {
    fail("{}: half_angle {} and soft_angle {} rad; each must be 0 or more, together above 0 and at most pi/2", what,
         lamp.half_angle, lamp.soft_angle);
  }
}

/// A flat lamp shines from one layer, or the light from its other part would be that of the wrong medium.
void check_in_one_layer(double z, double reach, const std::vector<FlatFace>& faces, const std::string& what) {
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].medium_below == faces[i].medium_above) continue;
    if (std::abs(faces[i].z - z) < reach * (1.0 - 1e-9)) {
      fail("{}: it reaches from z {} to {}, through face {} at z {}; it must lie in one layer", what, z - reach,
           z + reach, i, faces[i].z);
    }
  }
}

void check(const LedLamp& lamp, const std::vector<FlatFace>& faces, const std::string& what) {
  check_point(lamp.position, "position", what);
  check_direction(lamp.direction, what);
  if (!(lamp.radius >= 0.0 && lamp.radius < kFarthest)) {
    fail("{}: radius is {} mm; it must be 0 or more", what, lamp.radius);
  }
  if (lamp.visible && lamp.radius == 0.0) fail("{}: radius is 0; a visible lamp needs one", what);
  check_lobe(lamp.half_power_angle, lamp.visible, what);
  const double rise = lamp.direction.normalized().head<2>().norm();
  check_in_one_layer(lamp.position.z(), lamp.radius * rise, faces, what);
}

void check(const AreaLamp& lamp, const std::vector<FlatFace>& faces, const std::string& what) {
  check_point(lamp.centre, "centre", what);
  check_direction(lamp.direction, what);
  check_across(lamp.along, lamp.direction, "along", what);
  check_length(lamp.width, "width", what);
  check_length(lamp.height, "height", what);
  check_lobe(lamp.half_power_angle, lamp.visible, what);
  const RectangleSides sides = sides_of(lamp);
  const double rise = 0.5 * (lamp.width * std::abs(sides.across.z()) + lamp.height * std::abs(sides.up.z()));
  check_in_one_layer(lamp.centre.z(), rise, faces, what);
}

void check(const ProjectedLamp& lamp, const std::vector<FlatFace>&, const std::string& what) {
  check_point(lamp.position, "position", what);
  check_direction(lamp.direction, what);
  check_across(lamp.up, lamp.direction, "up", what);
  const cv::Mat& pattern = lamp.pattern;
  if (pattern.empty() || (pattern.type() != CV_8UC1 && pattern.type() != CV_32FC1)) {
    fail("{}: its pattern is {} x {} of OpenCV type {}; it must be of type {} (CV_8UC1) or {} (CV_32FC1)", what,
         pattern.cols, pattern.rows, pattern.type(), CV_8UC1, CV_32FC1);
  }
  double low = 0.0;
  double high = 0.0;
  if (!cv::checkRange(pattern, true, nullptr, 0.0, std::numeric_limits<double>::max())) {
    fail("{}: its pattern has a value that is negative or not finite", what);
  }
  cv::minMaxLoc(pattern, &low, &high);
  if (!(high > 0.0)) fail("{}: its pattern is black all over; a dark lamp is one without power", what);
  if (!(lamp.half_width_angle >= kLeastHalfPower && lamp.half_width_angle <= 1.4) ||
      !(std::tan(lamp.half_width_angle) * pattern.rows / pattern.cols < std::tan(1.4) * (1.0 + 1e-9))) {
    fail("{}: half_width_angle is {} rad for {} x {} pixels; it must be from {} to 1.4, and so must half the height",
         what, lamp.half_width_angle, pattern.cols, pattern.rows, kLeastHalfPower);
  }
}

void check(const GuideLamp& lamp, const std::vector<FlatFace>& faces, const std::string& what) {
  check_point(lamp.centre, "centre", what);
  check_direction(lamp.direction, what);
  if (std::abs(lamp.direction.normalized().z()) > 1e-6) {
    fail("{}: its direction rises by {}; it must be level (its lobe may have a tilt)", what,
         lamp.direction.normalized().z());
  }
  if (!(std::abs(lamp.tilt) <= 1.4)) fail("{}: tilt is {} rad; it must be from -1.4 to 1.4", what, lamp.tilt);
  check_length(lamp.width, "width", what);
  check_lobe(lamp.half_power_angle, false, what);
  if (lobe_exponent(lamp.half_power_angle) < 1.0 - 1e-12) {
    fail("{}: half_power_angle is {} rad; that of a guide must be at most pi/3", what, lamp.half_power_angle);
  }
  std::size_t above = 0;
  while (above < faces.size() && faces[above].z < lamp.centre.z()) ++above;
  if (above == 0 || above == faces.size()) {
    fail("{}: its centre is at z {}, which isn't between two flat faces; it must lie in a plate", what,
         lamp.centre.z());
  }
  if (!(faces[above].z > faces[above - 1].z)) fail("{}: the plate that it lies in has no thickness", what);
}

}  // namespace

Lamp::Lamp() = default;
Lamp::Lamp(const Lamp&) = default;
Lamp::Lamp(Lamp&&) noexcept = default;
Lamp& Lamp::operator=(const Lamp&) = default;
Lamp& Lamp::operator=(Lamp&&) noexcept = default;
Lamp::~Lamp() = default;

double lobe_exponent(double half_power_angle) {
  return std::log(0.5) / std::log(std::cos(half_power_angle));
}

double emission_integral(const Lamp& lamp) {
  return std::visit([](const auto& one) { return integral(one); }, lamp);
}

const Eigen::Vector3d& lamp_direction(const Lamp& lamp) {
  return std::visit([](const auto& one) -> const Eigen::Vector3d& { return one.direction; }, lamp);
}

double disc_radius(const Lamp& lamp) {
  if (const auto* spot = std::get_if<SpotLamp>(&lamp)) return spot->lens_radius;
  if (const auto* led = std::get_if<LedLamp>(&lamp)) return led->radius;
  return 0.0;
}

const Eigen::Vector3d& lamp_position(const Lamp& lamp) {
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) return area->centre;
  if (const auto* guide = std::get_if<GuideLamp>(&lamp)) return guide->centre;
  if (const auto* led = std::get_if<LedLamp>(&lamp)) return led->position;
  if (const auto* projector = std::get_if<ProjectedLamp>(&lamp)) return projector->position;
  return std::get<SpotLamp>(lamp).position;
}

const Spectrum& lamp_power(const Lamp& lamp) {
  return std::visit([](const auto& one) -> const Spectrum& { return one.power_W; }, lamp);
}

RectangleSides sides_of(const AreaLamp& lamp) {
  const Eigen::Vector3d out = lamp.direction.normalized();
  const Eigen::Vector3d across = (lamp.along - lamp.along.dot(out) * out).normalized();
  return {across, out.cross(across)};
}

double lamp_extent(const Lamp& lamp) {
  if (const auto* spot = std::get_if<SpotLamp>(&lamp)) return spot->lens_radius;
  if (const auto* led = std::get_if<LedLamp>(&lamp)) return led->radius;
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) return 0.5 * std::hypot(area->width, area->height);
  return 0.0;
}

bool is_visible(const Lamp& lamp) {
  if (const auto* led = std::get_if<LedLamp>(&lamp)) return led->visible;
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) return area->visible;
  return false;
}

bool same_lamp(const Lamp& a, const Lamp& b) {
  if (a.index() != b.index()) return false;
  return std::visit([&b](const auto& one) { return equal(one, *std::get_if<std::decay_t<decltype(one)>>(&b)); }, a);
}

void check_lamp(const Lamp& lamp, Eigen::Index bands, const std::vector<FlatFace>& faces, const std::string& what) {
  std::visit([&](const auto& one) { check(one, faces, what); }, lamp);
  check_spectrum(lamp_power(lamp), bands, kBrightest, what + ": power_W");
}

}  // namespace touchstone::render
