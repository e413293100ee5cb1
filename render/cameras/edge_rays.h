#pragma once
// More rays where a picture that is sampled once a grid point has edges.

#include <span>
#include <vector>

#include "render/cameras/camera_rays.h"

namespace touchstone::render {

/// Grid points, in order, that differ from the next one in a row or a column by more than `contrast` of the root mean
/// square over all. `radiance` is [band][grid point].
std::vector<int> edge_points(std::span<const float> radiance, const ImageGrid& grid, int bands, double contrast);

/// Puts side x side rays through a grid point's square into a packet, from `first_lane` on: what a central ray is in
/// the layer changes so smoothly over the picture that the next grid points' rays show it.
/// @pre rays of one sample
void put_edge_rays(const CameraRays& rays, int point, int side, RayPacket& packet, int first_lane);

}  // namespace touchstone::render
