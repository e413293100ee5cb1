#pragma once
// What rows and fits share of statistics.

#include <string>

namespace touchstone::lab {

/// In which direction a figure is better.
enum class Better { lower, higher, near };
/// "lower", "higher" or "near".
std::string name_of(Better better);

/// Half of a 95 % interval, in standard errors of a normal distribution.
inline constexpr double kNormal95 = 1.96;

}  // namespace touchstone::lab
