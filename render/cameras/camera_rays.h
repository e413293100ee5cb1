#pragma once
// A camera's rays, followed through flat faces to the layer where the membrane is, ahead of time.

#include <cstdint>
#include <vector>

#include "render/cameras/camera.h"
#include "render/scene/packet_scene.h"

namespace touchstone::render {

/// The middles of a camera's pixels.
ImageGrid pixel_grid(const ReadyCamera& camera);

/// Packets of 4 x 4 grid points, row by row of such tiles, one set after another for each sample. `far` is the distance
/// to the next face or a large number. What a lane's ray brings to the sensor per basic radiance at its end, and what
/// it brings of the surroundings by mirroring, is kept by [packet][lane][band]; `veil` is empty where it would be zero.
struct CameraRays {
  static constexpr int kSide = 4;
  ImageGrid grid;
  int tiles_across = 0;
  int tiles = 0;
  int bands = 0;
  std::vector<RayPacket> packets;  ///< [sample][tile]
  std::vector<float> through;      ///< W/m^2 on the sensor per basic radiance L / n^2
  std::vector<float> veil;         ///< W/m^2 on the sensor
};

/// `samples` 1 is each grid point itself and the middle of hole or lens; more are SampleSequence's over the pixel whose
/// middle the grid point is, and through and veil are then parts of the mean. Of the light that runs to and fro between
/// the faces all that gets through is counted, as if it hit the same place. Grid points beside the picture from which
/// no light comes take the nearest ray of the picture's edge.
/// @pre check_scene(fixture)
CameraRays trace_to_layer(const Scene& fixture, const ReadyCamera& camera, const ImageGrid& grid, int layer,
                          int samples, std::uint64_t seed);

/// Where a camera ray is in the layer: nullopt where it doesn't get there.
struct LayerRay {
  Eigen::Vector3d origin, direction;  ///< gel frame
  double far = 0.0;                   ///< to the next face, mm, or a large number
  double weight = 0.0;                ///< irradiance on the sensor per basic radiance, mean over the bands
};
/// For the place (x, y) of the picture in pixels, and (u, v) in the hole or lens, each from 0 to 1. What bends or
/// weakens before `layer` counts; surfaces don't.
std::optional<LayerRay> ray_in_layer(const Scene& fixture, const ReadyCamera& camera, int layer, double x, double y,
                                     double u, double v);

}  // namespace touchstone::render
