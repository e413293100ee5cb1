#include "sim/view/marker_motion.h"

#include <algorithm>
#include <vector>

#include "sim/view/visible_scene.h"

namespace touchstone::sim {

MarkerPlaces marker_places(const DeviceSpec& device, const fem::Compliance& gel) {
  MarkerPlaces places;
  places.rest_mm.resize(0, 3);
  if (device.pins) {
    places.pins = SkinPins(device, gel);
    places.rest_mm = places.pins.rest_mm();
    return places;
  }
  if (!device.coating || !device.coating->print) return places;
  const PrintSpec& print = *device.coating->print;
  const std::vector<Eigen::Vector2d> at = print_coordinates(print, device.gel, gel.vertices);
  std::vector<Eigen::Vector3d> rest;
  constexpr double kOnEdge = 1e-9;  // of a triangle: a middle on an edge belongs to the first that has it
  for (const render::PrintedMark& mark : printed_marks(print)) {
    for (std::size_t t = 0; t < gel.triangles.size(); ++t) {
      const std::array<int, 3>& corners = gel.triangles[t];
      const Eigen::Vector2d a = at[static_cast<std::size_t>(corners[0])];
      const Eigen::Vector2d b = at[static_cast<std::size_t>(corners[1])] - a;
      const Eigen::Vector2d c = at[static_cast<std::size_t>(corners[2])] - a;
      const Eigen::Vector2d p = mark.centre - a;
      const double area = b.x() * c.y() - b.y() * c.x();
      if (area == 0.0) continue;
      const double second = (p.x() * c.y() - p.y() * c.x()) / area;
      const double third = (b.x() * p.y() - b.y() * p.x()) / area;
      if (std::min({second, third, 1.0 - second - third}) < -kOnEdge) continue;
      const Eigen::Vector3d share(1.0 - second - third, second, third);
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) point += share[k] * gel.vertices[static_cast<std::size_t>(corners[k])];
      rest.push_back(point);
      places.triangle.push_back(static_cast<int>(t));
      places.share.push_back(share);
      break;
    }
  }
  places.rest_mm.resize(static_cast<Eigen::Index>(rest.size()), 3);
  for (std::size_t k = 0; k < rest.size(); ++k) places.rest_mm.row(static_cast<Eigen::Index>(k)) = rest[k].transpose();
  return places;
}

Eigen::MatrixX3d marker_displacement(const MarkerPlaces& places, const fem::Compliance& gel,
                                     const fem::PressState& press) {
  if (!places.pins.empty()) return places.pins.tips_mm(press) - places.rest_mm;
  Eigen::MatrixX3d moved = Eigen::MatrixX3d::Zero(places.rest_mm.rows(), 3);
  if (press.surface_displacement.rows() == 0) return moved;
  for (std::size_t k = 0; k < places.triangle.size(); ++k) {
    const std::array<int, 3>& corners = gel.triangles[static_cast<std::size_t>(places.triangle[k])];
    for (int c = 0; c < 3; ++c) {
      moved.row(static_cast<Eigen::Index>(k)) += places.share[k][c] * press.surface_displacement.row(corners[c]);
    }
  }
  return moved;
}

}  // namespace touchstone::sim
