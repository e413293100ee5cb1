#pragma once
// What pressed in pictures of a fingertip's dots, on disk.

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace touchstone::lab {

/// What pressed in a picture.
struct KnownPress {
  double press_mm = 0.0;  ///< beyond the first touch; 0 or less without contact
  double normal_N = 0.0;
  std::optional<Eigen::Vector2d> lateral_mm = {}, shear_N = {};
  int line = 0;  ///< of the table
};

/// Reads a CSV with the header `file,press_mm,force_x_N,force_y_N,force_z_N,lateral_x_mm,lateral_y_mm`: what pressed
/// in a picture (by its name in tables, datasets::name_in_table), on the object; all but press and force_z may be
/// empty. @throws Error with file, line and field
std::map<std::string, KnownPress> read_press_table(const std::filesystem::path& csv);

}  // namespace touchstone::lab
