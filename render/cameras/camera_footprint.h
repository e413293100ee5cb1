#pragma once
// What a pixel sees through the whole hole or lens, written as a weighted sum of rays through its centre.

#include <cstdint>
#include <optional>
#include <vector>

#include "render/cameras/camera_rays.h"

namespace touchstone::render {

/// A ray through another place of the hole meets a surface of known height where a ray through the hole's centre does
/// that belongs to another point of the picture. So a picture of central rays, spread by the footprint, is that of the
/// whole hole, as far as the surface lies at that height: a height that is off by dz moves the outermost rays by dz
/// times the tangent of the cone that they make, some hundredth of the footprint for a gel seen from 20 mm.
///
/// Central rays are cast at the points of `grid`, whose spacing is a whole number of pixels; each stands for the square
/// round it. Weights are those squares' shares of footprint and pixel area, so there are spacing^2 sets of them, one
/// for each place of a pixel in a square. A picture is cut into blocks of `block` pixels in which they stay the same.
/// Mean and variance of what is seen along both axes of the picture are kept.
struct CameraFootprint {
  /// One ray of a kernel, by the pixel whose centre it goes through.
  struct Tap {
    std::int32_t column, row;  ///< of the grid, from the square that the pixel lies in
    float weight;
  };
  /// The weighted rays that stand for all of a pixel.
  struct Kernel {
    std::vector<Tap> taps;  ///< weights sum up to 1
  };

  ImageGrid grid;
  int spacing = 1;         ///< pixels
  double narrowest = 0.0;  ///< the hole's blur where it is least, a disc's diameter in pixels
  int margin = 0;          ///< grid points beside the picture on each side
  int block = 0;           ///< pixels, a multiple of spacing
  int blocks_across = 0;
  std::vector<Kernel> kernels;  ///< [block][phase row][phase column]
  std::vector<float> gain;      ///< [block]: mean irradiance per radiance over the hole, over that at its centre

  /// Spreads a row-major picture of grid.columns x grid.rows: writes pixels [left, left + count) of a row, which must
  /// lie in one block's columns, for one phase: out[k] belongs to pixel left + k * spacing.
  void spread(const float* picture, int row, int left, int count, float* out) const;

  /// Makes the grid wider on each side, to `points` beside the picture. @pre points >= margin
  void widen(int points);

  /// The sum of a pixel's squared weights: what is left of the variance of independent points.
  float sum_of_squares(int row, int column) const;

  /// That of a pixel, by its block and its phase.
  const Kernel& kernel_at(int row, int column) const;
  int block_at(int row, int column) const { return row / block * blocks_across + column / block; }
};

/// The footprint of a camera on `surface_z`, the height of what it looks at, by block of the grid of `block` pixels;
/// with `rays_across` central rays along the narrowest footprint at least, or one a pixel, and `most_spacing` pixels
/// from one to the next at most. Of a camera with diffraction that of one band, or the mean over all.
CameraFootprint make_footprint(const Scene& fixture, const ReadyCamera& camera, int layer,
                               const std::vector<double>& surface_z, int block, double rays_across,
                               int most_spacing = 8, std::optional<int> band = {});

/// The blocks that make_footprint works on, their middles (pixels).
std::vector<Eigen::Vector2d> footprint_blocks(const ReadyCamera& camera, int block);

}  // namespace touchstone::render
