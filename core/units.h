#pragma once
// Units in code are N, mm, MPa, s, radians, nm (wavelengths) and integer microseconds (times of frames and events).
// A name carries its unit where it's another one.

#include <numbers>

namespace touchstone {

inline constexpr double kPi = std::numbers::pi;              ///< of a circle's length to its diameter
inline constexpr double kRadiansPerDegree = kPi / 180.0;     ///< multiply degrees by it
inline constexpr double kMicrosecondsPerSecond = 1e6;        ///< multiply seconds by it
inline constexpr double kMicrometresPerMillimetre = 1000.0;  ///< multiply mm by it
inline constexpr double kTonnePerMm3 = 1e-12;                ///< 1 kg/m^3 in the units of N, mm and s

}  // namespace touchstone
