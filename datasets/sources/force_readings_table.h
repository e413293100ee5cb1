#pragma once

#include <filesystem>

#include "sensors/events/force_readings.h"

namespace touchstone::datasets {

/// Forces over time: a CSV with the header `t_us,force_N`, in the order of time. @throws Error with file and line
sensors::ForceReadings read_force_readings(const std::filesystem::path& csv);

}  // namespace touchstone::datasets
