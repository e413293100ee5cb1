#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace touchstone::sensors {

/// What a force sensor said beside a recording of events, on the same clock.
struct ForceReadings {
  std::vector<std::int64_t> t_us;  ///< ascending, each later than the one before
  std::vector<double> force_N;     ///< one each
};

/// What is wrong with readings (none, as many times as forces, order, values that aren't finite), or nothing.
std::string fault_of(const ForceReadings& readings);

/// The mean force from one time to another, N: readings' course is straight from one to the next, before the first one
/// as that, after the last one as that. @pre sound readings, from_us < to_us
double mean_force_N(const ForceReadings& readings, std::int64_t from_us, std::int64_t to_us);

}  // namespace touchstone::sensors
