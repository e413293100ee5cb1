#include "lab/vhs/bead_view.h"

#include <Eigen/LU>
#include <cmath>

#include "core/error.h"
#include "lab/press/pressed_marker.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"

namespace touchstone::lab {
namespace {

constexpr double kStep_mm = 1e-3;  // of differences of projections, which are smooth over millimetres

}  // namespace

BeadView bead_view(const sim::DeviceSpec& device) {
  if (!device.beads || !device.camera) {
    fail("a device without {} has no bead to track", device.beads ? "a camera" : "beads");
  }
  return {sim::bead_centres(*device.beads),
          bare_faces(device.gel.thickness_mm, device.gel.refractive_index, device.plate.thickness_mm,
                     device.plate.refractive_index),
          render::make_ready(sim::camera_of(*device.camera))};
}

Eigen::MatrixX2d bead_pixels(const BeadView& view, const Eigen::MatrixX3d& displacement_mm) {
  const auto count = static_cast<Eigen::Index>(view.rest_mm.size());
  TS_ASSERT(displacement_mm.rows() == count);
  Eigen::MatrixX2d pixels(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d centre = view.rest_mm[static_cast<std::size_t>(i)] + displacement_mm.row(i).transpose();
    const auto pixel = render::project_through_faces(view.faces, view.camera, centre);
    if (!pixel) fail("bead {} can't be seen", i);
    pixels.row(i) = pixel->transpose();
  }
  return pixels;
}

double px_per_mm(const BeadView& view) {
  const auto count = static_cast<Eigen::Index>(view.rest_mm.size());
  const Eigen::MatrixX3d still = Eigen::MatrixX3d::Zero(count, 3);
  const Eigen::Index middle = count / 2;
  const auto moved = [&](int axis) {
    Eigen::MatrixX3d by = still;
    by(middle, axis) = kStep_mm;
    return Eigen::Vector2d((bead_pixels(view, by) - bead_pixels(view, still)).row(middle).transpose() / kStep_mm);
  };
  Eigen::Matrix2d scale;
  scale << moved(0), moved(1);
  return std::sqrt(std::abs(scale.determinant()));
}

}  // namespace touchstone::lab
