#include "render/cameras/pinhole_camera.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "render/cameras/camera_pose.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

/// The part of one disc that another covers, as slices across the line of centres. The first disc's centre is the
/// origin, the second's lies at distance `shift` along +e.
struct DiscOverlap {
  double radius_a, radius_b, shift;
  double half_height;  // of the overlap, along v

  DiscOverlap(double a, double b, double d) : radius_a(a), radius_b(b), shift(d), half_height(0.0) {
    if (d >= a + b) return;
    if (d <= std::abs(a - b)) {
      half_height = std::min(a, b);
      return;
    }
    const double chord = (d * d + a * a - b * b) / (2.0 * d);  // of the two circles' crossings, along e
    if (chord < 0.0) {
      half_height = a;
    } else if (chord > d) {
      half_height = b;
    } else {
      half_height = std::sqrt(std::max(0.0, a * a - chord * chord));
    }
  }

  void slice(double v, double& low, double& high) const {
    const double half_a = std::sqrt(std::max(0.0, radius_a * radius_a - v * v));
    const double half_b = std::sqrt(std::max(0.0, radius_b * radius_b - v * v));
    low = std::max(-half_a, shift - half_b);
    high = std::min(half_a, shift + half_b);
  }
};

/// The height of one slice of an overlap, and its probability density (per mm).
struct SliceHeight {
  double v, density;
};

/// Takes u in [0,1) to slices so that points drawn uniformly along them cover the overlap of two discs of about the
/// same radius uniformly but for a weight near one; what the radii's difference does to the width is left to the weight
/// too. In units of the smaller radius and for discs whose centres lie q apart, the slice at height v is
/// 2 sqrt(1 - v^2) - q wide, up to v_most = sqrt(1 - q^2 / 4).
///
/// The inverse of the area below a height has no closed form. A table holds, for some q, the derivative of v / v_most
/// by y = sqrt(1 - x), x the share of the half overlap's area below v: smooth up to the tip, where v by x is not.
/// Between its nodes the derivative is linear and v its integral, between rows both are linear in q: a map in its own
/// right, whose density is known exactly, so the approximation biases nothing. Weights spread by less than a part in a
/// thousand.
class SliceHeights {
 public:
  SliceHeights() {
    for (int row = 0; row <= kRows; ++row) fill(row);
  }

  SliceHeight at(const DiscOverlap& overlap, double q, double u) const {
    const double place = kRows * std::sqrt(0.5 * std::clamp(q, 0.0, 2.0));
    const int row = std::min(static_cast<int>(place), kRows - 1);
    const double part = place - row;
    const double x = 2.0 * u - 1.0;
    const double y = std::sqrt(std::sqrt(1.0 - std::abs(x)));
    const int cell = std::min(static_cast<int>(y * kCells), kCells - 1);
    const double along = y * kCells - cell;
    double height = 0.0;
    double slope = 0.0;
    for (int k = 0; k < 2; ++k) {
      const Node& a = nodes_[row + k][cell];
      const double rise = nodes_[row + k][cell + 1].slope - a.slope;
      const double share = k == 0 ? 1.0 - part : part;
      height += share * (a.height - along / kCells * (a.slope + 0.5 * along * rise));
      slope += share * (a.slope + along * rise);
    }
    return {std::copysign(height * overlap.half_height, x), 2.0 * y * y * y / (slope * overlap.half_height)};
  }

 private:
  static constexpr int kRows = 16;  // at q = 2 (row / kRows)^2
  static constexpr int kCells = 32;
  struct Node {
    double height, slope;  // v / v_most, and the rate at which it falls with y
  };

  void fill(int row) {
    const double root = static_cast<double>(row) / kRows;
    const double q = std::min(1.999, 2.0 * root * root);
    const double most = std::acos(0.5 * q);
    const auto area_below = [q](double angle) { return angle + std::sin(angle) * (std::cos(angle) - q); };
    const double area = area_below(most);
    Node* nodes = nodes_[row].data();
    double low = 0.0;  // the height is sin(angle); the area rises with it
    for (int i = kCells; i >= 0; --i) {
      const double y = static_cast<double>(i) / kCells;
      double high = most;
      for (int halving = 0; halving < 60; ++halving) {
        const double middle = 0.5 * (low + high);
        (area_below(middle) < (1.0 - y * y * y * y) * area ? low : high) = middle;
      }
      const double width = 2.0 * std::cos(low) - q;
      nodes[i].slope = i > 0 ? 4.0 * y * y * y * area / (width * std::sin(most)) : 0.0;
    }
    nodes[0].height = 0.0;
    for (int i = 0; i < kCells; ++i) {
      nodes[i + 1].height = nodes[i].height - 0.5 * (nodes[i].slope + nodes[i + 1].slope) / kCells;
    }
    const double whole = -nodes[kCells].height;
    for (int i = 0; i <= kCells; ++i) {
      nodes[i].slope /= whole;
      nodes[i].height = 1.0 + nodes[i].height / whole;
    }
  }

  std::array<std::array<Node, kCells + 1>, kRows + 1> nodes_;
};

}  // namespace

void check_camera(const PinholeCamera& camera) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value)) fail("camera: {} is {}; it must be above 0", name, value);
  };
  if (camera.width < 1 || camera.height < 1 || camera.width > 65536 || camera.height > 65536) {
    fail("camera: a size of {} x {} pixels; each side must be 1 to 65536", camera.width, camera.height);
  }
  positive(camera.pixel_pitch_um, "pixel_pitch_um");
  positive(camera.hole_diameter_um, "hole_diameter_um");
  positive(camera.distance_mm, "distance_mm");
  if (!(camera.foil_thickness_um >= 0.0) || !(camera.foil_thickness_um * 1e-3 < camera.distance_mm)) {
    fail("camera: foil_thickness_um is {}; it must be 0 or more and less than the distance to the sensor, {} mm",
         camera.foil_thickness_um, camera.distance_mm);
  }
  // Places in the hole are drawn evenly; of a wider one nearly all would see the sensor edge on.
  constexpr double kWidestHole = 10.0;
  if (!(1e-3 * camera.hole_diameter_um <= kWidestHole * camera.distance_mm)) {
    fail("camera: hole_diameter_um is {}; it must be at most {} times the distance to the sensor, {} mm",
         camera.hole_diameter_um, kWidestHole, camera.distance_mm);
  }
  check_camera_pose(camera.gel_from_camera);
}

std::optional<CameraRay> pinhole_ray(const PinholeCamera& camera, double x, double y, double u, double v) {
  const double pitch = camera.pixel_pitch_um * 1e-3;
  const double radius = 0.5e-3 * camera.hole_diameter_um;
  const double half_foil = 0.5e-3 * camera.foil_thickness_um;
  const double distance = camera.distance_mm;
  // Light crosses over in the hole, read-out turns the picture upright again.
  const Eigen::Vector3d sensor(-(x - 0.5 * camera.width) * pitch, -(y - 0.5 * camera.height) * pitch, -distance);

  // Both rims as the sensor point sees them in the hole's middle plane: discs scaled about the sensor point.
  const double scale_near = distance / (distance - half_foil);  // the rim on the sensor's side
  const double scale_far = distance / (distance + half_foil);
  const Eigen::Vector2d centre_near = (1.0 - scale_near) * sensor.head<2>();
  const Eigen::Vector2d centre_far = (1.0 - scale_far) * sensor.head<2>();
  const Eigen::Vector2d between = centre_far - centre_near;
  const double shift = between.norm();
  const DiscOverlap overlap(radius * scale_near, radius * scale_far, shift);
  if (overlap.half_height <= 0.0) return std::nullopt;
  const Eigen::Vector2d e = shift > 0.0 ? Eigen::Vector2d(between / shift) : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d across(-e.y(), e.x());

  static const SliceHeights heights;
  double low = 0.0;
  double high = 0.0;
  overlap.slice(0.0, low, high);
  const double q = 2.0 - (high - low) / std::min(overlap.radius_a, overlap.radius_b);
  const SliceHeight height = heights.at(overlap, q, u);
  overlap.slice(height.v, low, high);
  if (!(high > low && height.density > 0.0)) return std::nullopt;
  const double along = low + v * (high - low);
  const double area = (high - low) / height.density;

  const Eigen::Vector2d hole = centre_near + along * e + height.v * across;
  CameraRay ray;
  ray.origin = {hole.x(), hole.y(), 0.0};
  const Eigen::Vector3d through = ray.origin - sensor;
  const double length2 = through.squaredNorm();
  ray.direction = through / std::sqrt(length2);
  const double cosine = ray.direction.z();
  ray.weight = area * cosine * cosine / length2;
  return ray;
}

Eigen::Vector3d view_direction(const PinholeCamera& camera, double x, double y) {
  const double pitch = camera.pixel_pitch_um * 1e-3;
  return Eigen::Vector3d((x - 0.5 * camera.width) * pitch, (y - 0.5 * camera.height) * pitch, camera.distance_mm)
      .normalized();
}

std::optional<Eigen::Vector2d> image_point(const PinholeCamera& camera, const Eigen::Vector3d& direction) {
  if (!(direction.z() > 0.0)) return std::nullopt;
  return project(camera, direction);
}

Eigen::Vector2d project(const PinholeCamera& camera, const Eigen::Vector3d& point_in_camera) {
  TS_ASSERT(point_in_camera.z() > 0.0);
  const double scale = camera.distance_mm / (point_in_camera.z() * camera.pixel_pitch_um * 1e-3);
  return {0.5 * camera.width + scale * point_in_camera.x(), 0.5 * camera.height + scale * point_in_camera.y()};
}

}  // namespace touchstone::render
