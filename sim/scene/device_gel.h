#pragma once
// A device file's gel as fem asks for it.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// The shape and its edge lengths, of any kind of gel.
fem::GelBody gel_body(const DeviceSpec& device);

/// The body's, then the layers' from the outer surface inwards.
std::vector<fem::ElasticMaterial> gel_materials(const GelSpec& gel);

/// The device's beads, centres in the gel frame, mm; none where it has none.
std::vector<fem::Bead> gel_beads(const DeviceSpec& device);

/// The outer surface of a dome or a fingertip: the radius of its sphere, and of the circle that it fills, seen along z.
struct RoundFace {
  double sphere_radius_mm = 0.0;
  double radius_mm = 0.0;
};

/// Nothing for a slab or a mesh.
std::optional<RoundFace> round_face(const GelSpec& gel);

/// Height (gel frame's z, mm) of the undeformed outer surface over a place; of a dome or fingertip beyond its rim that
/// of the rim. @pre the gel isn't a mesh
double rest_height(const GelSpec& gel, const Eigen::Vector2d& place);

/// Is the outer surface flat, or a dome that fine relief (fem/fine_relief/fine_relief.h) can have: no steeper at its
/// rim than fem::kSteepestDome?
bool takes_fine_relief(const GelSpec& gel);

/// Is the outer surface flat, or a dome so gentle that what has moved on it may be followed over x and y alone: no
/// steeper than 0.5 rad?
bool is_gentle(const GelSpec& gel);

/// Is the gel a dome whose rim lies on the plate: a cap without a cylinder?
bool ends_on_plate(const GelSpec& gel);

}  // namespace touchstone::sim
