#pragma once
// What is traced once of a milky slab under a dark coat (sim/sensor/milky_coat.h), and the file that keeps it.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/direct/direct_error.h"

namespace touchstone::sim {

/// What path tracing says once of a unit.
struct TracedSlab {
  cv::Mat rest;                             ///< CV_32FC(bands), W/m^2 on the sensor
  std::vector<std::vector<double>> shares;  ///< by band, of flat coats at kFlatStates: in parts of the light at rest
  render::DirectError error;                ///< of pictures made with it; of none: 0 pixels
};

/// Thicknesses of the flat coats that are traced, in parts of the slab's; between the last two lies the slab at rest.
inline constexpr double kFlatStates[] = {0.06, 0.15, 0.3, 0.5, 0.75, 1.15};

/// Keeps what was traced under a key, as light_file does; and reads it: nothing where there is none that's whole.
void write_traced(const std::filesystem::path& folder, const std::string& key, const TracedSlab& traced);
std::optional<TracedSlab> read_traced(const std::filesystem::path& folder, const std::string& key);  ///< see above

}  // namespace touchstone::sim
