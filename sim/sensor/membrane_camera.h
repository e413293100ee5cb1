#pragma once
// The camera of a device whose membrane is milky and lit by the room: fast pictures of what touches it.

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "fem/fine_relief/layer_response.h"
#include "render/membrane/membrane_light.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// How finely the membrane's light is computed.
struct MembraneCameraSettings {
  double cell_mm = 0.2;  ///< of the face's grid, at most; the membrane's sides are cut in an even number of cells
  int walks = 1 << 20;   ///< render::MembraneWalkSettings::walks
  std::uint64_t seed = 1;
};

/// Set up once a device by random walks (some seconds); then a picture of a state of the outer face takes milliseconds.
/// Immutable; many threads may ask it.
class MembraneCamera {
 public:
  /// @throws Error unless the device has a camera of one channel, one band of light, and as gel a bare slab without
  /// layers, lit by the room alone: no lamps, beads, films or coating; and as render::MembraneLight
  explicit MembraneCamera(const DeviceSpec& device, const MembraneCameraSettings& settings = {});

  const render::FaceGrid& grid() const { return light_->grid(); }
  const render::MembraneOptics& optics() const { return optics_; }
  /// Radiance of the room behind the membrane, in parts of that on the camera's side.
  double behind() const { return behind_; }

  /// W/m^2 on each pixel, CV_32FC1. @throws Error as render::MembraneLight
  cv::Mat irradiance(const render::FaceState& state) const;
  /// Electrons a second that light frees in each pixel: what render::EventPixels take. CV_32FC1
  cv::Mat photocurrent(const render::FaceState& state) const;
  /// A face that nothing touches.
  render::FaceState free_face() const;

 private:
  render::MembraneOptics optics_;
  double behind_ = 1.0;
  double radiance_ = 0.0;                  // of the room
  double electrons_per_irradiance_ = 0.0;  // a second
  std::unique_ptr<const render::MembraneLight> light_;
};

/// The optics of a device's plate and slab, for its one band. @throws Error as MembraneCamera
render::MembraneOptics membrane_optics(const DeviceSpec& device);

/// A colour of something before such a device, in its one band. @throws Error as MembraneCamera and in_bands
double in_one_band(const DeviceSpec& device, const Colour& colour, const char* what);

/// A face state from maps of a contact on another grid: coverage is averaged over cells, gaps are those of the nearest
/// cell; from `no_body_mm` on there is no body. CV_32FC1, `from.ny` x `from.nx`; beyond them nothing stands.
/// @throws Error if maps don't fit their grid
render::FaceState face_state(const render::FaceGrid& grid, const fem::PixelGrid& from, const cv::Mat& coverage,
                             const cv::Mat& gap_mm, double no_body_mm, double albedo, double height_mm);

}  // namespace touchstone::sim
