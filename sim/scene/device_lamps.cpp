#include "sim/scene/device_lamps.h"

#include <cmath>
#include <opencv2/core.hpp>

#include "core/units.h"
#include "render/scene/lamp_arrays.h"
#include "sim/files/image_file.h"

namespace touchstone::sim {
namespace {

bool is_array(LampType type) {
  return type == LampType::led_strip || type == LampType::led_ring || type == LampType::led_array;
}

bool is_led(LampType type) {
  return type == LampType::led || is_array(type);
}

/// Where the LEDs of a row or field are in the middle: what their common direction starts from.
Eigen::Vector3d middle_of(const LampSpec& lamp) {
  if (lamp.type == LampType::led_strip) return 0.5 * (lamp.position_mm + lamp.to_mm);
  if (lamp.type == LampType::led_array) return lamp.position_mm + 0.5 * (lamp.side_a_mm + lamp.side_b_mm);
  return lamp.position_mm;
}

Eigen::Vector3d direction_of(const LampSpec& lamp) {
  return lamp.target_mm ? Eigen::Vector3d(*lamp.target_mm - middle_of(lamp)).normalized() : lamp.direction.normalized();
}

/// A lamp's spectrum, if it has one.
void read_emission(YamlReader& in, LampSpec& lamp) {
  in.required("power_W", lamp.power_W, Allowed::at_least(0.0));
  if (!in.has("spectrum")) return;
  std::string file;
  in.required("spectrum", file);
  if (in.describing()) return;
  try {
    lamp.spectrum = render::read_spectral_curve(in.folder() / file, render::CurveKind::relative);
  } catch (const Error& error) {
    fail_at(in.where("spectrum"), "spectrum: {}", error.what());
  }
  if (lamp.power_W.numbers.size() != 1) {
    fail_at(in.where("power_W"), "power_W: beside a spectrum it must be one number, all that the lamp radiates");
  }
}

void read_pattern(YamlReader& in, LampSpec& lamp) {
  std::string file;
  in.required("pattern", file);
  if (in.describing()) return;
  try {
    lamp.pattern = read_image(in.folder() / file);
  } catch (const Error& error) {
    fail_at(in.where("pattern"), "pattern: {}", error.what());
  }
  if (lamp.pattern.channels() != 1) fail_at(in.where("pattern"), "pattern: {} isn't grey", file);
  if (lamp.pattern.depth() != CV_8U) {
    constexpr double kWhite16 = 65535.0;
    lamp.pattern.convertTo(lamp.pattern, CV_32F, 1.0 / kWhite16);
  }
}

void read_place(YamlReader& in, LampSpec& lamp) {
  switch (lamp.type) {
    case LampType::led_strip:
      in.required("from_mm", lamp.position_mm);
      in.required("to_mm", lamp.to_mm);
      in.required("count", lamp.count, Allowed::within(1, 1000));
      break;
    case LampType::led_ring:
      in.required("centre_mm", lamp.position_mm);
      in.required("ring_radius_mm", lamp.ring_radius_mm, Allowed::above(0.0));
      in.required("count", lamp.count, Allowed::within(1, 1000));
      break;
    case LampType::led_array:
      in.required("corner_mm", lamp.position_mm);
      in.required("side_a_mm", lamp.side_a_mm);
      in.required("side_b_mm", lamp.side_b_mm);
      in.required("grid", lamp.grid, Allowed::within(1, 100));
      break;
    default:
      in.required("position_mm", lamp.position_mm);
  }
  if (lamp.type == LampType::guide) {
    in.required("direction", lamp.direction);
    return;
  }
  in.required("target_mm", lamp.target_mm);
  if ((*lamp.target_mm - middle_of(lamp)).norm() < 1e-9) {
    fail_at(in.where("target_mm"), "target_mm: is the lamp's own position; the lamp has no direction");
  }
}

render::LedLamp led_of(const LampSpec& lamp, const render::Spectrum& power) {
  return {middle_of(lamp), direction_of(lamp), lamp.chip_radius_mm, 0.5 * lamp.viewing_angle_deg * kRadiansPerDegree,
          power,           lamp.visible};
}

}  // namespace

EnumNames<LampType> enum_names(LampType) {
  return {{"spot", LampType::spot},           {"led", LampType::led},
          {"led_strip", LampType::led_strip}, {"led_ring", LampType::led_ring},
          {"led_array", LampType::led_array}, {"area", LampType::area},
          {"projector", LampType::projector}, {"guide", LampType::guide}};
}

void fields(YamlReader& in, LampSpec& lamp) {
  lamp.where = in.where();
  in.optional("type", lamp.type);
  read_place(in, lamp);
  const Allowed angle = Allowed::within(0.1, 175.0);
  if (is_led(lamp.type)) {
    in.optional("chip_radius_mm", lamp.chip_radius_mm, Allowed::at_least(0.0));
    in.optional("viewing_angle_deg", lamp.viewing_angle_deg, angle);
    in.optional("visible", lamp.visible);
  }
  if (is_array(lamp.type)) {
    in.optional("power_spread", lamp.power_spread, Allowed::within(0.0, 1.0));
    in.optional("tilt_spread_deg", lamp.tilt_spread_deg, Allowed::within(0.0, 28.0));
    in.optional("seed", lamp.seed);
  }
  switch (lamp.type) {
    case LampType::spot:
      in.required("lens_radius_mm", lamp.lens_radius_mm, Allowed::above(0.0));
      in.required("half_angle_deg", lamp.half_angle_deg, Allowed::above_up_to(0.0, 80.0));
      in.optional("soft_angle_deg", lamp.soft_angle_deg, Allowed::within(0.0, 80.0 - lamp.half_angle_deg));
      break;
    case LampType::area:
      in.required("size_mm", lamp.size_mm, Allowed::above(0.0));
      in.optional("along", lamp.along);
      in.optional("viewing_angle_deg", lamp.viewing_angle_deg, angle);
      in.optional("visible", lamp.visible);
      break;
    case LampType::projector:
      in.required("half_angle_deg", lamp.half_angle_deg, Allowed::above_up_to(0.0, 80.0));
      in.optional("up", lamp.up);
      read_pattern(in, lamp);
      break;
    case LampType::guide:
      in.required("width_mm", lamp.width_mm, Allowed::above(0.0));
      in.optional("tilt_deg", lamp.tilt_deg, Allowed::within(-85.0, 85.0));
      in.required("viewing_angle_deg", lamp.viewing_angle_deg, angle);
      break;
    default:
      break;
  }
  read_emission(in, lamp);
}

render::Spectrum lamp_power(const LampSpec& lamp, const SceneBands& bands) {
  if (!lamp.spectrum) return in_bands(lamp.power_W, bands, "lamps.power_W");
  if (!bands.ranges) {
    fail_at(lamp.power_W.where, "lamps.spectrum: the device doesn't say its `bands`, which it could be shared out to");
  }
  try {
    return render::band_powers(*lamp.spectrum, lamp.power_W.numbers[0], *bands.ranges);
  } catch (const Error& error) {
    fail_at(lamp.power_W.where, "lamps.spectrum: {}", error.what());
  }
}

std::vector<render::Lamp> lamps_of(const LampSpec& lamp, const SceneBands& bands, double level) {
  const render::Spectrum power = level * lamp_power(lamp, bands);
  const Eigen::Vector3d direction = direction_of(lamp);
  const double half_power = 0.5 * lamp.viewing_angle_deg * kRadiansPerDegree;
  const render::LedSpread spread{lamp.seed, lamp.power_spread, lamp.tilt_spread_deg * kRadiansPerDegree};
  const auto all = [](const std::vector<render::LedLamp>& leds) {
    return std::vector<render::Lamp>(leds.begin(), leds.end());
  };
  try {
    switch (lamp.type) {
      case LampType::spot:
        return {render::SpotLamp{lamp.position_mm, direction, lamp.lens_radius_mm,
                                 lamp.half_angle_deg * kRadiansPerDegree, lamp.soft_angle_deg * kRadiansPerDegree,
                                 power}};
      case LampType::led:
        return {led_of(lamp, power)};
      case LampType::led_strip:
        return all(render::led_strip(led_of(lamp, power), lamp.position_mm, lamp.to_mm, lamp.count, spread));
      case LampType::led_ring:
        return all(render::led_ring(led_of(lamp, power), lamp.position_mm, lamp.ring_radius_mm, *lamp.target_mm,
                                    lamp.count, spread));
      case LampType::led_array:
        return all(render::led_array(led_of(lamp, power), lamp.position_mm, lamp.side_a_mm, lamp.side_b_mm,
                                     lamp.grid.x(), lamp.grid.y(), spread));
      case LampType::area:
        return {render::AreaLamp{lamp.position_mm, direction, lamp.along, lamp.size_mm.x(), lamp.size_mm.y(),
                                 half_power, power, lamp.visible}};
      case LampType::projector:
        return {render::ProjectedLamp{lamp.position_mm, direction, lamp.up, lamp.half_angle_deg * kRadiansPerDegree,
                                      lamp.pattern, power}};
      case LampType::guide:
        return {render::GuideLamp{lamp.position_mm, direction, lamp.tilt_deg * kRadiansPerDegree, lamp.width_mm,
                                  half_power, power}};
    }
  } catch (const Error& error) {
    fail_at(lamp.where, "lamps: {}", error.what());
  }
  TS_ASSERT(false);
  return {};
}

}  // namespace touchstone::sim
