#pragma once
// Dots scattered over a gel's surface, as they come off a brush: about evenly, in no order, none touching another.

#include <Eigen/Core>
#include <vector>

#include "render/materials/print.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// No two centres are nearer to each other than this part of the spacing, the root of the surface's area per dot. Discs
/// thrown one after the other where they fit fill a plane to 0.547 [Feder1980]; at this distance the spacing takes
/// 0.442.
inline constexpr double kScatterDistance = 0.75;
/// The disc that dots fill has a radius of no more than so many spacings (30 thousand dots).
inline constexpr double kMostScatterRadii = 100.0;

/// The dots of a print of the pattern `scattered`, in the coordinates of along_surface: as many as its spacing gives,
/// in a disc about the origin. The same print gives the same dots.
std::vector<render::PrintedMark> scattered_marks(const PrintSpec& print);

/// Where a point of the undeformed outer surface (gel frame, mm) lies when that is laid out flat about its middle,
/// areas being kept: of a sphere Lambert's azimuthal projection, of the cylinder below it the same rule. A dot near a
/// fingertip's apex is round on the surface; 45 degrees off it is 0.92 as long as a round one along the meridian and
/// 1.08 times as wide. Of slabs, and of meshes, x and y.
Eigen::Vector2d along_surface(const GelSpec& gel, const Eigen::Vector3d& point);

}  // namespace touchstone::sim
