#include <cmath>

#include "core/units.h"
#include "datasets/inspection/inspection_page.h"
#include "sim/files/colour.h"
#include "sim/scene/object.h"

namespace touchstone::datasets {
namespace {

constexpr double kLongestArrow_mm_per_N = 10.0;
constexpr double kArrowOfGel = 0.4;      // of the gel's width, at most
constexpr double kBeadRadius_mm = 0.25;  // of a set whose device isn't known
constexpr int kSides = 16;

/// A cone or a cylinder about the line from `from` to `to`, without ends.
void add_cone(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_from, double radius_to,
              TriangleMesh& mesh) {
  const Eigen::Vector3d along = (to - from).normalized();
  const Eigen::Vector3d side = along.unitOrthogonal();
  const Eigen::Vector3d other = along.cross(side);
  const int first = static_cast<int>(mesh.vertices.size());
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * kPi * i / kSides;
    const Eigen::Vector3d out = std::cos(angle) * side + std::sin(angle) * other;
    mesh.vertices.emplace_back(from + radius_from * out);
    mesh.vertices.emplace_back(to + radius_to * out);
    const int next = (i + 1) % kSides;
    mesh.triangles.push_back({first + 2 * i, first + 2 * next, first + 2 * i + 1});
    mesh.triangles.push_back({first + 2 * next, first + 2 * next + 1, first + 2 * i + 1});
  }
}

sim::ShapeSpec sphere(double radius_mm) {
  sim::ShapeSpec ball;
  ball.type = sim::ShapeKind::sphere;
  ball.radius_mm = radius_mm;
  return ball;
}

}  // namespace

std::vector<sim::GltfPart> sample_parts(const InspectedSample& sample, const InspectedGel& gel,
                                        const PreparedScene* scene) {
  const std::vector<Eigen::Vector3d> here = {Eigen::Vector3d::Zero()};
  sim::GltfPart free{"gel surface", {gel.displaced, {}}, {0.75, 0.8, 0.85}, 0.6, false, here};
  sim::GltfPart touched{"gel in contact", {gel.displaced, {}}, {0.9, 0.35, 0.2}, 0.9, false, here};
  double width = 0.0;
  for (const Eigen::Vector3d& vertex : gel.rest) width = std::max(width, 2.0 * vertex.head<2>().cwiseAbs().maxCoeff());
  for (const std::array<int, 3>& corners : gel.triangles) {
    bool all = true;
    for (const int corner : corners) all = all && gel.contact[static_cast<std::size_t>(corner)];
    (all ? touched : free).mesh.triangles.push_back(corners);
  }
  std::vector<sim::GltfPart> parts = {free, touched};
  if (!gel.beads.empty()) {
    const bool known = scene != nullptr && scene->spec.device.beads;
    const double radius = known ? 0.5 * scene->spec.device.beads->diameter_mm : kBeadRadius_mm;
    parts.push_back({"bead", visible_mesh(sphere(radius)), {0.1, 0.1, 0.1}, 1.0, true, gel.beads});
  }
  if (scene != nullptr) {
    const sim::ObjectSpec& object = scene->spec.object;
    TriangleMesh body = visible_mesh(object.shape);
    for (Eigen::Vector3d& vertex : body.vertices) vertex = sample.gel_from_object * vertex;
    const Eigen::Vector3d colour = object.radiance ? Eigen::Vector3d(0.9, 0.9, 0.8) : display_colour(object.albedo);
    parts.push_back({object.name, std::move(body), colour, 0.5, false, here});
  }
  const Eigen::Vector3d force = sample.wrench.head<3>();
  if (force.norm() > 0.0) {
    const double length = std::min(kLongestArrow_mm_per_N * force.norm(), kArrowOfGel * width);
    const Eigen::Vector3d foot = sample.gel_from_object.translation.cwiseProduct(Eigen::Vector3d(1, 1, 0));
    const Eigen::Vector3d tip = foot + length * force.normalized();
    const Eigen::Vector3d neck = foot + 0.75 * length * force.normalized();
    sim::GltfPart arrow{"force on the object", {}, {0.1, 0.3, 0.9}, 1.0, false, here};
    add_cone(foot, neck, 0.02 * length, 0.02 * length, arrow.mesh);
    add_cone(neck, tip, 0.06 * length, 0.0, arrow.mesh);
    parts.push_back(std::move(arrow));
  }
  return parts;
}

}  // namespace touchstone::datasets
