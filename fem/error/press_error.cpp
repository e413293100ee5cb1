#include "fem/error/press_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;

/// Pressure at the border over the pressure in the mean, where a body is taken for smooth and where for sharp. Measured
/// on contacts of 2 edges' radius and more: spheres 0.65 to 0.95, punches and boxes 1.0 to 1.6. Smaller ones are all
/// border and pass for sharp.
constexpr double kSmoothBorder = 0.9;
constexpr double kSharpBorder = 1.0;
/// Contacts of a smaller radius, in edges, have one to three vertices; what lies between the vertices may be anything.
/// Their errors grow by this power of the radius on top of the table's.
constexpr double kFewVertices = 1.0;
constexpr double kFewVerticesOrder = 3.0;
/// Of a patch's force, on hats that an outline cuts: from so much on the body is a sharp one.
constexpr double kSharpByOutline = 0.5;
/// Edges: of a smooth contact of this radius nearly all of the error is the gel's, the shape of its mesh, and is a
/// sharp one's as well. Added after bodies on a fingertip had been seen (bench/bodies).
constexpr double kGelsOwn = 3.0;
/// What a contact whose hats aren't cut by outlines (at finite strain) is off by on top, as a share of the force at one
/// edge's radius, and the power of the radius with which it falls. Measured against the same presses with hats cut,
/// root mean square over 24 places and radii: balls 37 % at 0.6 edges, 6.8 % at 0.8, 2.3 % at 1 and 0.8 % at 1.3;
/// punches 13 % at 0.8 edges, 12 % at 1, 6.7 % at 2 and 3.9 % at 4.
constexpr double kWholeHatsSmooth = 0.03;
constexpr double kWholeHatsSmoothOrder = 6.0;
constexpr double kWholeHatsSharp = 0.14;

/// Vertices in contact that are connected by triangles, as lists of vertices.
std::vector<std::vector<int>> patches_of(const Compliance& gel, const PressState& state) {
  std::vector<int> root(gel.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  const auto touches = [&](int v) { return state.node_state[v] != NodeState::open; };
  for (const auto& t : gel.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      if (touches(a) && touches(b)) root[std::max(find(a), find(b))] = std::min(find(a), find(b));
    }
  }
  std::vector<int> place(gel.vertices.size(), -1);
  std::vector<std::vector<int>> patches;
  for (int v = 0; v < static_cast<int>(root.size()); ++v) {
    if (!touches(v)) continue;
    int& patch = place[find(v)];
    if (patch < 0) {
      patch = static_cast<int>(patches.size());
      patches.emplace_back();
    }
    patches[patch].push_back(v);
  }
  return patches;
}

/// What is known of a patch of contact.
struct Patch {
  double area = 0.0;
  double radius_per_edge = 0.0;
  double sharpness = 0.0;              ///< 0 smooth, 1 sharp
  double by_outline = 0.0;             ///< likewise, as far as outlines are seen below the mesh's size
  Vector3d force = Vector3d::Zero();   ///< on the gel
  Vector3d normal = Vector3d::Zero();  ///< unit: the direction of the pressure's force on the object
};

Patch describe(const Compliance& gel, const PressState& state, const Eigen::VectorXd& weight,
               const std::vector<char>& border, const std::vector<Vector3d>& normals,
               const std::vector<int>& vertices) {
  Patch patch;
  Vector3d centre = Vector3d::Zero();
  double border_area = 0.0;
  double border_force = 0.0;
  double all_force = 0.0;
  double cut_force = 0.0;
  double hats = 0.0;
  const auto share_of = [&](int v) { return state.bearing_share.size() > 0 ? state.bearing_share[v] : 1.0; };
  for (const int v : vertices) {
    const Vector3d traction = state.traction.row(v);
    const double pressure = -normals[v].dot(traction) * weight[v];
    const double area = weight[v] * share_of(v);
    hats += weight[v];
    patch.area += area;
    patch.force += weight[v] * traction;
    patch.normal += std::max(0.0, pressure) * normals[v];
    centre += area * gel.vertices[v];
    all_force += pressure;
    if (share_of(v) < 1.0) cut_force += pressure;
    if (border[v]) {
      border_area += weight[v];
      border_force += pressure;
    }
  }
  if (patch.normal.norm() > 0.0) patch.normal.normalize();
  centre /= patch.area;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const int v : vertices) {
    const Vector3d from = gel.vertices[v] - centre;
    spread += weight[v] * share_of(v) / patch.area * from * from.transpose();
  }
  // The largest is along the patch, the next across it, the last through it. A vertex stands for a disc of its area.
  const double mean_area = patch.area / static_cast<double>(vertices.size());
  const double mean_hat = hats / static_cast<double>(vertices.size());
  const double across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues()[1];
  const double by_spread = 2.0 * std::sqrt(std::max(0.0, across) + mean_area / (4.0 * std::numbers::pi));
  const double by_area = std::sqrt(patch.area / std::numbers::pi);
  const double edge = std::sqrt(mean_hat * 2.0 / std::sqrt(3.0));  // of equilateral triangles
  patch.radius_per_edge = std::min(by_spread, by_area) / edge;
  const double ratio = all_force > 0.0 && border_area > 0.0 ? border_force / border_area * patch.area / all_force : 1.0;
  patch.by_outline = all_force > 0.0 ? std::clamp(cut_force / all_force / kSharpByOutline, 0.0, 1.0) : 0.0;
  const double by_pressure = std::clamp((ratio - kSmoothBorder) / (kSharpBorder - kSmoothBorder), 0.0, 1.0);
  patch.sharpness = std::max(by_pressure, patch.by_outline);
  return patch;
}

}  // namespace

PressError estimate_error(const Compliance& gel, const PressState& state) {
  PressError error;
  const std::vector<std::vector<int>> patches = patches_of(gel, state);
  if (patches.empty()) return error;
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  std::vector<char> border(gel.vertices.size(), 0);
  std::vector<Vector3d> normals(gel.vertices.size(), Vector3d::Zero());
  for (const auto& t : gel.triangles) {
    const Vector3d normal = (gel.vertices[t[1]] - gel.vertices[t[0]]).cross(gel.vertices[t[2]] - gel.vertices[t[0]]);
    const bool whole = std::all_of(t.begin(), t.end(), [&](int v) { return state.node_state[v] != NodeState::open; });
    for (const int v : t) {
      normals[v] += normal;
      border[v] = border[v] || !whole;
    }
  }
  for (Vector3d& normal : normals) normal.normalize();

  double displacement = 0.0;
  double beads = 0.0;
  double traction = 0.0;
  double area = 0.0;
  for (const std::vector<int>& vertices : patches) {
    const Patch patch = describe(gel, state, weight, border, normals, vertices);
    const double few =
        std::pow(std::max(1.0, kFewVertices / patch.radius_per_edge), kFewVerticesOrder * (1.0 - patch.by_outline));
    const RelativeErrors smooth = errors_at(gel.mesh_error.smooth, patch.radius_per_edge);
    const RelativeErrors sharp = errors_at(gel.mesh_error.sharp, patch.radius_per_edge);
    const RelativeErrors own = errors_at(gel.mesh_error.smooth, std::max(kGelsOwn, patch.radius_per_edge));
    double whole_hats = 0.0;
    if (state.bearing_share.size() == 0) {
      whole_hats =
          (1.0 - patch.sharpness) * kWholeHatsSmooth * std::pow(patch.radius_per_edge, -kWholeHatsSmoothOrder) +
          patch.sharpness * kWholeHatsSharp / patch.radius_per_edge;
    }
    const auto of = [&](ErrorOf kind) {
      const double cut =
          few * ((1.0 - patch.sharpness) * smooth[kind] + patch.sharpness * std::hypot(sharp[kind], own[kind]));
      return std::min(1.0, std::hypot(cut, whole_hats));
    };
    const double pressed = std::abs(patch.force.dot(patch.normal));
    const Vector3d sheared = patch.force - patch.force.dot(patch.normal) * patch.normal;
    for (int a = 0; a < 3; ++a) {
      const double n = patch.normal[a];
      error.force[a] += std::hypot(of(ErrorOf::normal_force) * pressed * n, of(ErrorOf::shear_force) * sheared[a],
                                   of(ErrorOf::cross_force) * pressed * std::sqrt(std::max(0.0, 1.0 - n * n)));
    }
    displacement = std::max(displacement, of(ErrorOf::displacement));
    beads = std::max(beads, of(ErrorOf::beads));
    traction += std::pow(of(ErrorOf::traction) * patch.force.norm() / patch.area, 2) * patch.area;
    area += patch.area;
  }
  if (state.surface_displacement.rows() > 0) {
    error.displacement = displacement * state.surface_displacement.rowwise().norm().maxCoeff();
  }
  if (state.bead_displacement.rows() > 0) error.beads = beads * state.bead_displacement.rowwise().norm().maxCoeff();
  error.traction = std::sqrt(traction / area);
  return error;
}

}  // namespace touchstone::fem
