#pragma once
// What a camera sees of a milky membrane whose outer face is touched, at the cost of some Fourier transforms.
//
// The light that a camera's ray brings is followed backwards, as a walk (membrane_kernels.h): it goes to and fro
// between the room on the camera's side and the outer face. At the face, h_j(x) is the light that a walk brings which
// arrives in sector j at the place x, g_i(x) that of one which leaves it evenly in sector i, both in parts of the
// room's radiance:
//   g_i = e_i + sum_j exchange_ij * h_j              (e: out to the camera's side; *: over the face)
//   h_j = (1 - c) [r_j g_j + (1 - r_j) o] + c a g_matt,
// with the contact's coverage c(x) and the body's albedo a, Fresnel's mean reflectance r, g_matt the mean over all
// sectors, and what comes from outside
//   o = (1 - shadow) behind + shadow a (light on the body through the face).
// The state is the sum over ever more crossings, on cells of the membrane's own blur; what the camera sees of h takes
// its own kernel on finer cells, and its straight ray. All is linear in differences from the free face, so a kernel's
// far end may be cut, and white things in an even room give exactly one.
//
// What is left out: walks forget their azimuth at the face, and their place within a sector; the face is flat (a press
// thins the membrane by a few percent); a body beside which light goes up throws its shadow as if all light entered
// evenly. measure_membrane_error (membrane_error.h) tells what that amounts to.

#include <memory>
#include <opencv2/core/mat.hpp>

#include "render/cameras/camera.h"
#include "render/membrane/face_state.h"
#include "render/membrane/membrane_kernels.h"

namespace touchstone::render {

/// Cells, reach and tolerance of the convolutions.
struct MembraneLightSettings {
  double behind = 1.0;            ///< radiance of what is behind the membrane, in parts of the room's
  double view_cell_mm = 0.2;      ///< cells on which the camera's kernel is applied, and
  double exchange_cell_mm = 0.4;  ///< those on which the face lights itself: multiples of the grid's
  double view_reach_mm = 12.0;    ///< the kernels' ends
  double exchange_reach_mm = 20.0;
  double tolerance = 1e-4;  ///< of the exchange's sum, in parts of the room's radiance
};

/// One membrane before one camera, made ready: then a picture takes some transforms. It can be moved, not copied.
class MembraneLight {
 public:
  /// @param grid the outer face's; the membrane ends where it ends, and beside it what is behind is seen
  /// @throws Error if the camera, the grid or the settings can't be used, or the camera sees the face at larger angles
  /// than the kernels were made for
  MembraneLight(const MembraneKernels& kernels, const Camera& camera, const FaceGrid& grid,
                const MembraneLightSettings& settings = {});
  ~MembraneLight();
  MembraneLight(MembraneLight&&) noexcept;
  MembraneLight& operator=(MembraneLight&&) noexcept;

  /// Irradiance on the camera's pixels, W/m^2 for a room of 1 W/m^2/sr: CV_32FC1. A pure function, to be called by any
  /// number of threads. @throws Error if the state doesn't fit the grid or a value is out of range
  cv::Mat irradiance(const FaceState& state) const;

  /// That of the constructor.
  const FaceGrid& grid() const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

/// Where a camera sees the outer face: CV_32FC2, x and y in mm of each pixel's middle; NaN where it doesn't.
cv::Mat seen_places(const MembraneOptics& optics, const Camera& camera);

/// What is seen of a free face without an end, in parts of the room's radiance, without what plate and lens take:
/// in a direction of the squared sine (in the membrane) to its normal, before surroundings behind it of `behind`.
double free_face_radiance(const MembraneKernels& kernels, double behind, double squared_sine);

/// What is seen of a face that is wetted all over by a body of one albedo.
double touched_face_radiance(const MembraneKernels& kernels, double albedo, double squared_sine);

}  // namespace touchstone::render
