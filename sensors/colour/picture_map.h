#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "sensors/colour/colour_marker.h"

namespace touchstone::sensors {

/// From places in a picture to places in a plane: a homography, which is what a camera without distortion makes of one.
struct PictureMap {
  Eigen::Matrix3d mm_from_px = Eigen::Matrix3d::Identity();

  Eigen::Vector2d operator()(const Eigen::Vector2d& px) const { return (mm_from_px * px.homogeneous()).hnormalized(); }
};

/// The map that takes px to mm, by least squares on the normalised direct linear transform.
/// @throws Error for fewer than 4 pairs, or ones that lie on a line
PictureMap fit_picture_map(const std::vector<Eigen::Vector2d>& px, const std::vector<Eigen::Vector2d>& mm);

/// Where a grid's markers are at rest: the gel frame's x along the rows, y from row to row, its origin at the grid's
/// middle. Seen from within the gel, as the camera does, z points away from the camera: a press comes towards it.
std::vector<Eigen::Vector2d> grid_places(const Eigen::Vector2i& grid, double spacing_mm);

/// The map of a picture at rest, by its sound markers' ink.
/// @throws Error as fit_picture_map, or if the spacing isn't above zero
PictureMap map_of_rest(const ColourMarkerReading& rest, double spacing_mm);

}  // namespace touchstone::sensors
