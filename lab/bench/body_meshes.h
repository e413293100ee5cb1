#pragma once
// Closed triangle meshes of bodies that are pressed on gels to try the contact: made by code, with edges as sharp as
// can be. Object frame, mm: the face that touches looks along -z, its lowest point lies in the plane z = 0, the body
// above.

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "core/triangle_mesh.h"

namespace touchstone::lab {

/// Raised cells on the lower side of a plate. The plate spans the grid of lines; raised cells reach down to z = 0, the
/// rest of its lower side lies at `height`, its back at `height + plate`. Cells that are raised must not meet in a
/// corner alone: that isn't a solid.
/// @param x, y  rising, at least two lines each
/// @param raised  per cell, x fastest
TriangleMesh pattern_on_plate(const std::vector<double>& x, const std::vector<double>& y,
                              const std::vector<bool>& raised, double height, double plate);

/// One of the letters of letters_known() as a pattern of 5 x 7 cells of `stroke`, centred, with a margin of one stroke
/// around it.
TriangleMesh letter_on_plate(char letter, double stroke, double height, double plate);
/// "EFHILOPTU"
const std::string& letters_known();

/// A square field of `count` x `count` square studs, `width` wide and `pitch` apart, centred on a plate that goes on
/// for half a gap around them.
TriangleMesh studs_on_plate(int count, double width, double pitch, double height, double plate);

/// Ridges along y, `count` of them, on a plate that is `length` long.
TriangleMesh ridges_on_plate(int count, double width, double pitch, double length, double height, double plate);

/// A profile of (radius, z) turned about the z axis in `sides` steps; the first plane of corners lies at the angle
/// pi / sides, so that a side looks along +x. The solid lies to the left of the profile's way when it's drawn with the
/// radius to the right and z up. A profile that begins and ends on the axis (radius 0) is open; another one is closed
/// by a last piece and leaves a hole. `stretch`, if given, multiplies radii by a number above zero that depends on the
/// profile's point and the step.
TriangleMesh turned_profile(const std::vector<Eigen::Vector2d>& profile, int sides,
                            const std::function<double(int point, int step)>& stretch = {});

/// A threaded rod that lies along x: crest at z = 0, axis at z = `radius`. The thread has flanks of 60 degrees to each
/// other, and crests and roots that are an eighth and a quarter of the pitch wide, as ISO metric threads.
TriangleMesh threaded_rod(double radius, double pitch, int turns);

}  // namespace touchstone::lab
