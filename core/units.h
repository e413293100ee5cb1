#pragma once
// Units in code are N, mm, MPa, s, radians, nm (wavelengths) and integer microseconds (times of frames and events).
// A name carries its unit where it's another one.

#include <numbers>

namespace touchstone {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadiansPerDegree = kPi / 180.0;
inline constexpr double kMicrosecondsPerSecond = 1e6;
inline constexpr double kMicrometresPerMillimetre = 1000.0;
inline constexpr double kTonnePerMm3 = 1e-12;  // of a density of 1 kg/m^3

}  // namespace touchstone
