#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace touchstone::sensors {

/// Displacements of a regular grid of markers that sit on a gel's outer surface, in the gel frame (core/transform.h):
/// a press is -z. Markers are numbered row by row: y grows from row to row, x along a row.
struct MarkerField {
  Eigen::Vector2i grid = Eigen::Vector2i::Zero();  ///< columns, rows
  std::vector<Eigen::Vector3d> displacement;       ///< mm; undefined where not measured
  std::vector<std::uint8_t> measured;              ///< 0 or 1
};

}  // namespace touchstone::sensors
