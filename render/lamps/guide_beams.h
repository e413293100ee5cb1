#pragma once
// A light guide's light, cut into beams that a light field can hold: by direction, each smooth in space.

#include <Eigen/Core>
#include <vector>

#include "render/lamps/prepared_scene.h"
#include "render/lamps/upright_walls.h"

namespace touchstone::render {

/// How a guide's light is cut. A receiver sees the exit face as an endless upright strip of mirror images
/// (guide_connection.h). Its azimuths are cut into `sectors` that carry about the same light. Each has the exit face
/// itself in slices by height, then the first mirror image, then all further ones together. So a facet whose horizon
/// cuts the guide sees some beams and not others, and shadows get soft rims.
struct GuideCut {
  int sectors = 5;
  int slices = 2;

  int beams_a_sector() const { return slices + 2; }
  int beams() const { return sectors * beams_a_sector(); }
};

/// The vector irradiance (W/m^2, along the light) of each beam of guide `lamp` at a place of `layer`, beyond its plate,
/// without shadows but those of `walls` that stand on the layer's face towards the plate: by Gauss and Legendre's rule
/// with `points` azimuths a sector and `points` elevations of what of a slice isn't hidden. The beams of a sector stand
/// together, from flat to steep.
/// @pre `layer` isn't the plate's; `out` has space for cut.beams()
void guide_beam_flows(const PreparedScene<1>& scene, const PreparedLamp<1>& lamp, const GuideCut& cut, int layer,
                      const Eigen::Vector3d& place, int points, const UprightWalls& walls, Eigen::Vector3d* out);

}  // namespace touchstone::render
