#pragma once
// A device's pins on a pressed gel: where they are, which way they point, and what is seen of them.

#include <Eigen/Core>
#include <vector>

#include "core/triangle_mesh.h"
#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Pins are rigid and stand upright on a skin that doesn't change its thickness: a line through skin and pin goes with
/// the outer surface's point and turns with its normal. So a pin's tip moves aside where the skin tilts, which is what
/// a TacTip is read by. What the gel between pins does to them is left out.
///
/// Inside the skin all is smoother than at its face. So the displacement that mechanics gives at the mesh's vertices is
/// made smooth round each pin: a quadratic in the tangent plane's coordinates, by weighted least squares over the
/// vertices within kSmoothing thicknesses of the skin (at least the 12 nearest). Made once a gel; for many threads.
class SkinPins {
 public:
  SkinPins() = default;                                            ///< none
  SkinPins(const DeviceSpec& device, const fem::Compliance& gel);  ///< those of the device's skin

  bool empty() const { return pins_.empty(); }
  /// Middles of the white tips on the undeformed gel, mm, a row a pin (sim/scene/device_pins.h).
  const Eigen::MatrixX3d& rest_mm() const { return rest_mm_; }
  /// The same on a pressed gel. A state without displacements is one at rest.
  Eigen::MatrixX3d tips_mm(const fem::PressState& press) const;
  /// All white tips as one mesh, open where they stand on the pins: discs of kSides sides and their walls.
  TriangleMesh tips(const fem::PressState& press) const;
  TriangleMesh tips_at_rest() const { return tips({}); }

  static constexpr int kSides = 16;              ///< of a tip's disc, whose area is the circle's
  static constexpr int kTriangles = 3 * kSides;  ///< of a tip

 private:
  static constexpr int kLeastVertices = 12;
  // Found where tips come nearest to those of lines of material inside the tactip's skin (docs/sensors/tactip.md).
  static constexpr double kSmoothing = 2.8;

  struct Pin {
    Eigen::Vector3d skin;                   // on the undeformed outer surface
    Eigen::Vector3d out, along_1, along_2;  // right-handed: along_1 x along_2 = out
    std::vector<int> vertex;
    Eigen::Matrix3Xd weights;  // of displacements, a column a vertex: the value, its slopes along_1 and along_2
  };
  struct Pose {
    Eigen::Vector3d skin, out;
  };

  Pose pose(const Pin& pin, const fem::PressState& press) const;

  std::vector<Pin> pins_;
  Eigen::MatrixX3d rest_mm_;
  double tip_from_skin_mm_ = 0.0;  // from the outer surface to a tip's nearer end
  double tip_mm_ = 0.0;
  double radius_mm_ = 0.0;
};

}  // namespace touchstone::sim
