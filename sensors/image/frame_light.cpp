#include "sensors/image/frame_light.h"

namespace touchstone::sensors {

namespace {

constexpr double kDarkFraction = 1.0 / 128.0;
constexpr double kSaturatedFraction = 0.98;

}  // namespace

FrameLight light_of_mean(double mean) {
  if (mean < kDarkFraction) return FrameLight::kDark;
  return mean > kSaturatedFraction ? FrameLight::kSaturated : FrameLight::kNormal;
}

const char* name_of(FrameLight light) {
  switch (light) {
    case FrameLight::kNormal:
      return "normal";
    case FrameLight::kDark:
      return "dark";
    case FrameLight::kSaturated:
      return "saturated";
    case FrameLight::kFlat:
      return "flat";
  }
  return "?";
}

}  // namespace touchstone::sensors
