#pragma once
// A camera's rays, followed through flat faces to the layer where the membrane is, ahead of time.

#include <cstdint>
#include <vector>

#include "render/packet_scene.h"
#include "render/pinhole_camera.h"

namespace touchstone::render {

/// Packets of 4 x 4 pixels, row by row of such tiles, one set after another for each sample. `far` is the way to the
/// next face or a large number. What a lane's ray brings to its pixel per basic radiance at its end, and what it brings
/// of the surroundings by mirroring, is kept by [packet][lane][band]; `veil` is empty where it would be zero.
struct CameraRays {
  static constexpr int kSide = 4;
  int tiles_across = 0;
  int tiles = 0;
  int bands = 0;
  std::vector<RayPacket> packets;  ///< [sample][tile]
  std::vector<float> through;      ///< W/m^2 on the sensor per basic radiance L / n^2
  std::vector<float> veil;         ///< W/m^2 on the sensor
};

/// `samples` 1 is the middle of each pixel and of the hole; more are SampleSequence's. Of the light that runs to and
/// fro between the faces all that gets through is counted, as if it hit the same place.
/// @pre check_scene(fixture), check_camera(camera)
CameraRays trace_to_layer(const Scene& fixture, const PinholeCamera& camera, int layer, int samples,
                          std::uint64_t seed);

}  // namespace touchstone::render
