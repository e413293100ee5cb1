#pragma once
// Where a camera sees the centres of a device's beads, through plate and gel.

#include <Eigen/Core>
#include <vector>

#include "render/cameras/camera.h"
#include "render/scene/scene.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// A device's beads and its camera, without the rest of its scene.
struct BeadView {
  std::vector<Eigen::Vector3d> rest_mm;  ///< without load, row by row, gel frame
  render::Scene faces;
  render::ReadyCamera camera;
};

/// @throws Error for a device without beads or camera, or whose camera can't be made
BeadView bead_view(const sim::DeviceSpec& device);

/// Pixels of all beads, m x 2, moved by `displacement_mm` (m x 3). @throws Error that names a bead which can't be seen
Eigen::MatrixX2d bead_pixels(const BeadView& view, const Eigen::MatrixX3d& displacement_mm);

/// Pixels per mm along x and y at the middle bead or beads, without load: root of the picture's scale of areas.
double px_per_mm(const BeadView& view);

}  // namespace touchstone::lab
