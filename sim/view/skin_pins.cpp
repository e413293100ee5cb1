#include "sim/view/skin_pins.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "sim/scene/device_pins.h"

namespace touchstone::sim {
namespace {

/// All vertices, nearest first.
std::vector<int> by_distance(const std::vector<Eigen::Vector3d>& vertices, const Eigen::Vector3d& point) {
  std::vector<int> order(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  const auto nearer = [&](int a, int b) {
    const double to_a = (vertices[static_cast<std::size_t>(a)] - point).squaredNorm();
    const double to_b = (vertices[static_cast<std::size_t>(b)] - point).squaredNorm();
    return to_a != to_b ? to_a < to_b : a < b;
  };
  std::sort(order.begin(), order.end(), nearer);
  return order;
}

}  // namespace

SkinPins::SkinPins(const DeviceSpec& device, const fem::Compliance& gel) {
  if (!device.pins) return;
  const PinSpec& spec = *device.pins;
  tip_mm_ = spec.tip_mm;
  tip_from_skin_mm_ = pin_reach_mm(device) - spec.tip_mm;
  // A regular polygon's area is that of a circle of this much less radius.
  const double corner = 2.0 * kPi / kSides;
  radius_mm_ = 0.5 * spec.diameter_mm * std::sqrt(corner / std::sin(corner));
  if (gel.vertices.size() <= static_cast<std::size_t>(kLeastVertices)) {
    fail("device {}: its outer surface has {} vertices; pins need more than {}: a finer mesh", device.name,
         gel.vertices.size(), kLeastVertices);
  }
  for (const PinPlace& place : pin_places(device)) {
    Pin pin;
    pin.skin = place.skin;
    pin.out = -place.inward;
    pin.along_1 = pin.out.unitOrthogonal();
    pin.along_2 = pin.out.cross(pin.along_1);
    const std::vector<int> near = by_distance(gel.vertices, pin.skin);
    const auto offset = [&](int vertex) -> Eigen::Vector3d {
      return gel.vertices[static_cast<std::size_t>(vertex)] - pin.skin;
    };
    // Weights fade to nothing at the first vertex that is left out, or before.
    const double far =
        std::max(offset(near[kLeastVertices]).norm(), kSmoothing * (pin_reach_mm(device) - spec.height_mm));
    for (const int vertex : near) {
      if (offset(vertex).norm() < far) pin.vertex.push_back(vertex);
    }
    const auto count = static_cast<Eigen::Index>(pin.vertex.size());
    Eigen::MatrixXd terms(count, 6);
    Eigen::VectorXd importance(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector3d to = offset(pin.vertex[static_cast<std::size_t>(i)]);
      const double x = to.dot(pin.along_1);
      const double y = to.dot(pin.along_2);
      const double part = to.norm() / far;
      importance[i] = 1.0 - part * part;
      terms.row(i) << 1.0, x, y, x * x, x * y, y * y;
    }
    const Eigen::MatrixXd inverse =
        (importance.asDiagonal() * terms).completeOrthogonalDecomposition().pseudoInverse() * importance.asDiagonal();
    pin.weights = inverse.topRows<3>();
    pins_.push_back(std::move(pin));
  }
  rest_mm_ = tips_mm({});
}

SkinPins::Pose SkinPins::pose(const Pin& pin, const fem::PressState& press) const {
  if (press.surface_displacement.rows() == 0) return {pin.skin, pin.out};
  Eigen::Matrix3d moved = Eigen::Matrix3d::Zero();  // rows: the displacement, its slopes
  for (Eigen::Index i = 0; i < pin.weights.cols(); ++i) {
    moved += pin.weights.col(i) * press.surface_displacement.row(pin.vertex[static_cast<std::size_t>(i)]);
  }
  const Eigen::Vector3d along_1 = pin.along_1 + moved.row(1).transpose();
  const Eigen::Vector3d along_2 = pin.along_2 + moved.row(2).transpose();
  return {pin.skin + moved.row(0).transpose(), along_1.cross(along_2).normalized()};
}

Eigen::MatrixX3d SkinPins::tips_mm(const fem::PressState& press) const {
  Eigen::MatrixX3d tips(static_cast<Eigen::Index>(pins_.size()), 3);
  for (std::size_t i = 0; i < pins_.size(); ++i) {
    const Pose now = pose(pins_[i], press);
    tips.row(static_cast<Eigen::Index>(i)) = (now.skin - (tip_from_skin_mm_ + 0.5 * tip_mm_) * now.out).transpose();
  }
  return tips;
}

TriangleMesh SkinPins::tips(const fem::PressState& press) const {
  TriangleMesh mesh;
  for (const Pin& pin : pins_) {
    const Pose now = pose(pin, press);
    const Eigen::Vector3d aside = (pin.along_1 - pin.along_1.dot(now.out) * now.out).normalized();
    const Eigen::Vector3d across = now.out.cross(aside);
    const Eigen::Vector3d low = now.skin - tip_from_skin_mm_ * now.out;
    const Eigen::Vector3d end = low - tip_mm_ * now.out;
    const int middle = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(end);
    for (int side = 0; side < kSides; ++side) {
      const double angle = 2.0 * kPi * side / kSides;
      const Eigen::Vector3d to = radius_mm_ * (std::cos(angle) * aside + std::sin(angle) * across);
      mesh.vertices.push_back(end + to);
      mesh.vertices.push_back(low + to);
    }
    for (int side = 0; side < kSides; ++side) {
      const int a = middle + 1 + 2 * side;
      const int b = middle + 1 + 2 * ((side + 1) % kSides);
      mesh.triangles.push_back({middle, b, a});
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

}  // namespace touchstone::sim
