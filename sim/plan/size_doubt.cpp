#include "sim/plan/size_doubt.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <variant>

#include "core/overloaded.h"
#include "sim/files/gltf_mesh.h"

namespace touchstone::sim {
namespace {

constexpr double kMuchLonger = 10.0;

Eigen::Vector3d extent_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices) box.extend(vertex);
  return box.sizes();
}

/// The gel's longest side, mm.
double longest_side(const GelSpec& gel) {
  return std::visit(
      Overloaded{[&](const SlabSpec& slab) {
                   return std::max({slab.size_x_mm, slab.size_y_mm, gel.thickness_mm});
                 },
                 [&](const DomeSpec& dome) { return std::max(2.0 * dome.base_radius_mm, gel.thickness_mm); },
                 [](const FingertipSpec& tip) { return std::max(2.0 * tip.radius_mm, tip.radius_mm + tip.length_mm); },
                 [](const GelMeshSpec& mesh) {
                   if (!mesh.surface) return std::numeric_limits<double>::infinity();  // it wasn't read
                   return extent_of(mesh.surface->mesh).maxCoeff();
                 }},
      gel.shape);
}

std::string in_words(const Eigen::Vector3d& size) {
  return fmt::format("{:.5g} x {:.5g} x {:.5g}", size.x(), size.y(), size.z());
}

}  // namespace

std::string size_doubt(const DeviceSpec& device, const ObjectSpec& object) {
  const Eigen::Vector3d size = extent_of(visible_mesh(object.shape));
  const double longest = size.maxCoeff();
  const double gel = longest_side(device.gel);
  std::string against;
  if (longest > kMuchLonger * gel) {
    against = fmt::format("more than {} times as long as the gel, {:.4g} mm", kMuchLonger, gel);
  } else if (!device.mesh.force_error && longest < device.mesh.fine_mm) {
    against = fmt::format("less than one edge of the gel's mesh, {:.4g} mm", device.mesh.fine_mm);
  } else {
    return {};
  }
  std::string text = fmt::format("object {}: it is {} mm, {}", object.name, in_words(size), against);
  if (object.shape.type == ShapeKind::mesh) {
    const double unit = object.shape.mm_per_unit.value_or(1.0);
    text += fmt::format("; {} is {} of its own units, each of which is taken for {:.5g} mm (shape.mm_per_unit)",
                        object.shape.file.filename().string(), in_words(size / unit), unit);
  } else {
    text += ": are its lengths in mm?";
  }
  return text;
}

}  // namespace touchstone::sim
