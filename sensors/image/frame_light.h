#pragma once

#include <cstdint>

namespace touchstone::sensors {

/// Whether a frame, or the part of it that matters, has light that something can be measured in.
enum class FrameLight : std::uint8_t {
  kNormal,
  kDark,       ///< its mean is below 1/128 of the full scale: too few grey levels
  kSaturated,  ///< its mean is above 0.98 of the full scale
  kFlat,       ///< all of it has one value
};

/// Dark, saturated or normal, by a mean grey value as a part of the full scale.
FrameLight light_of_mean(double mean);

/// "normal", "dark", "saturated", "flat"
const char* name_of(FrameLight light);

}  // namespace touchstone::sensors
