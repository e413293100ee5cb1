#pragma once
// How far pictures of a membrane (membrane_light.h) are from the random walks that they stand for.

#include <opencv2/core/mat.hpp>

#include "render/cameras/camera.h"
#include "render/membrane/face_state.h"
#include "render/membrane/membrane_kernels.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// The scene of a state for the path tracer, in a room of 1 W/m^2/sr: plate, membrane and air without an end, a matt
/// sheet in the membrane where at least half of a cell is wetted, columns over the cells that have the body above them,
/// and where `behind` isn't 1 a luminous panel far behind. @throws Error if the maps don't fit the grid
Scene membrane_scene(const MembraneOptics& optics, const FaceGrid& grid, const FaceState& state, double behind);

/// How many pixels and paths the measurement takes.
struct MembraneErrorSettings {
  int fields = 12;     ///< along the picture's longer side: what is averaged to find the worst place
  int pixels = 16;     ///< looked at in each field
  int samples = 128;   ///< paths a pixel, twice
  int max_depth = 64;  ///< RenderSettings::max_depth
  std::uint64_t seed = 0;
};

/// In parts of the contrast: the largest change from the free face's picture to that of the state.
struct MembraneError {
  double contrast = 0.0;                ///< in parts of the free face's irradiance
  double rms = 0.0, rms_error = 0.0;    ///< root mean square difference over the pixels, without the paths' noise
  double mean = 0.0, mean_error = 0.0;  ///< picture minus traced
  double worst = 0.0;                   ///< largest mean difference of a field, with its sign
  double worst_error = 0.0;             ///< standard error of a field's mean
  int pixels = 0;
};

/// Compares a picture with path tracing of `scene`, at the pixels that see the grid. `free` is the picture of the free
/// face. @throws Error as Tracer, if the pictures aren't CV_32FC1 of the camera's size or are the same, or settings are
/// out of range
MembraneError measure_membrane_error(const cv::Mat& picture, const cv::Mat& free, const Scene& scene,
                                     const MembraneOptics& optics, const FaceGrid& grid, const Camera& camera,
                                     const MembraneErrorSettings& settings = {});

}  // namespace touchstone::render
