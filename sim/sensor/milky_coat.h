#pragma once
// A milky slab under a dark coat, lit by lamps behind it: its light at rest, traced once, times the share of it that is
// left where the coat is pressed in (render/membrane/coat_light.h).

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/monotone_curve.h"
#include "core/triangle_mesh.h"
#include "render/cameras/camera.h"
#include "render/membrane/coat_light.h"
#include "sim/sensor/traced_slab.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

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

}  // namespace touchstone::sim
