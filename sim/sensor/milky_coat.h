#pragma once
// A milky slab under a dark coat, lit by lamps behind it: its light at rest, traced once, times the share of it that is
// left where the coat is pressed in (render/membrane/coat_light.h).

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/monotone_curve.h"
#include "core/triangle_mesh.h"
#include "render/cameras/camera.h"
#include "render/direct/direct_error.h"
#include "render/membrane/coat_light.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

/// What path tracing says once of a unit.
struct TracedSlab {
  cv::Mat rest;                             ///< CV_32FC(bands), W/m^2 on the sensor
  std::vector<std::vector<double>> shares;  ///< by band, of flat coats at kFlatStates: in parts of the light at rest
  render::DirectError error;                ///< of pictures made with it; of none: 0 pixels
};

/// Thicknesses of the flat coats that are traced, in parts of the slab's; between the last two lies the slab at rest.
inline constexpr double kFlatStates[] = {0.06, 0.15, 0.3, 0.5, 0.75, 1.15};

/// Why a device isn't one of them; empty if it is.
std::string unfit_for_milky_coat(const DeviceSpec& device, const render::Scene& at_rest);

/// Pictures of one unit. Made once; `irradiance` is pure and may be called from many threads.
class MilkyCoat {
 public:
  /// Traces the slab at rest and with flat coats. @pre unfit_for_milky_coat says nothing
  MilkyCoat(const SceneView& view, const render::Camera& camera, const fem::PressState& rest, std::uint64_t seed);
  /// With what was traced before, of the same view, camera and seed.
  MilkyCoat(const SceneView& view, const render::Camera& camera, const fem::PressState& rest, std::uint64_t seed,
            TracedSlab traced);

  const TracedSlab& traced() const { return traced_; }
  /// Compares with path tracing of this state, and keeps the error with what was traced.
  void measure(const SceneView& view, const fem::PressState& press, const SeenGeometry& seen,
               const render::Camera& camera, std::uint64_t seed);

  /// `sheet`: the coat.
  cv::Mat irradiance(const TriangleMesh& sheet) const;

 private:
  void set_up(const SceneView& view, const render::Camera& camera, const fem::PressState& rest, std::uint64_t seed);
  /// The flat states by walks beside the traced ones: what walks leave out, such as light that the coat sends back, is
  /// then right in the mean.
  void learn();
  cv::Mat thickness(const TriangleMesh& sheet) const;

  double thickness_mm_ = 0.0;
  std::unique_ptr<const render::CoatLight> light_;
  TracedSlab traced_;
  std::vector<MonotoneCurve> share_of_walks_;  // by band: the walks' share to the traced one
};

/// Keeps what was traced under a key, as light_file does; and reads it: nothing where there is none that's whole.
void write_traced(const std::filesystem::path& folder, const std::string& key, const TracedSlab& traced);
std::optional<TracedSlab> read_traced(const std::filesystem::path& folder, const std::string& key);  ///< see above

}  // namespace touchstone::sim
