#pragma once

#include <filesystem>

#include "sensors/touch_map/place_map.h"

namespace touchstone::lab {

/// Where pixels look, from marks on the gel at known places: a CSV with the header `u_px,v_px,x_mm,y_mm` (u right, v
/// down, the first pixel's centre at 0.5; x and y along them).
/// @param size of the pictures @throws Error with file and line; as sensors::fit_place_map, naming the file
sensors::PlaceMap read_place_map(const std::filesystem::path& csv, const cv::Size& size);

}  // namespace touchstone::lab
