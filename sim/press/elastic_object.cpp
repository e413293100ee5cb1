#include "sim/press/elastic_object.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/locked_work.h"
#include "core/sha256.h"
#include "core/units.h"
#include "fem/error/compliance_cache.h"
#include "fem/mesh/gel_body.h"

namespace touchstone::sim {
namespace {

constexpr double kSurfacePerFine = 1.5;  // edges of round surfaces: these are cut again where they are touched
constexpr double kCoarsePerFine = 3.0;
constexpr double kFineLayers = 2.0;      // depth of the fine part, in edges
constexpr double kTopPart = 0.01;        // of the height: what is so near to the top is the top
constexpr double kSphereHeldFrom = 0.5;  // of the radius

/// Points of a profile in the (radius, z) half plane, no further apart than `edge`.
class Profile {
 public:
  Profile(Eigen::Vector2d start, double edge) : points_{start}, edge_(edge) {}

  void line_to(const Eigen::Vector2d& end) {
    const Eigen::Vector2d start = points_.back();
    const int parts = parts_of((end - start).norm());
    for (int i = 1; i <= parts; ++i) points_.push_back(i == parts ? end : start + (end - start) * i / parts);
  }
  /// Round `centre`, from the angle `begin` (from straight down, towards the outside) to `end`.
  void arc(const Eigen::Vector2d& centre, double radius, double begin, double end) {
    const int parts = std::max(2, parts_of(radius * (end - begin)));
    for (int i = 1; i <= parts; ++i) {
      const double angle = begin + (end - begin) * i / parts;
      points_.push_back(centre + radius * Eigen::Vector2d(std::sin(angle), -std::cos(angle)));
    }
  }
  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  int parts_of(double length) const { return std::max(1, static_cast<int>(std::ceil(length / edge_ - 1e-9))); }
  std::vector<Eigen::Vector2d> points_;
  double edge_;
};

/// The body that the profile sweeps about z, from its lower pole to its upper one: rings of as many points as their
/// length takes, sewn together by angle.
TriangleMesh turned_evenly(const std::vector<Eigen::Vector2d>& profile, double edge) {
  constexpr int kFewest = 6;
  TriangleMesh mesh;
  std::vector<std::pair<int, int>> rings;  // first vertex, count
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const double radius = profile[i].x();
    const bool pole = i == 0 || i + 1 == profile.size();
    const int count = pole ? 1 : std::max(kFewest, static_cast<int>(std::ceil(2.0 * kPi * radius / edge - 1e-9)));
    rings.emplace_back(static_cast<int>(mesh.vertices.size()), count);
    for (int k = 0; k < count; ++k) {
      const double angle = 2.0 * kPi * k / count;
      const double r = pole ? 0.0 : radius;
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), profile[i].y());
    }
  }
  for (std::size_t i = 0; i + 1 < rings.size(); ++i) {
    const auto [low, n] = rings[i];
    const auto [high, m] = rings[i + 1];
    int a = 0;
    int b = 0;
    const int all_a = n == 1 ? 0 : n;
    const int all_b = m == 1 ? 0 : m;
    while (a < all_a || b < all_b) {
      const bool along_low =
          b == all_b || (a < all_a && (a + 1) * static_cast<long>(m) <= (b + 1) * static_cast<long>(n));
      if (along_low) {
        mesh.triangles.push_back({low + a % n, low + (a + 1) % n, high + b % m});
        ++a;
      } else {
        mesh.triangles.push_back({low + a % n, high + (b + 1) % m, high + b % m});
        ++b;
      }
    }
  }
  return mesh;
}

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices) box.extend(vertex);
  return box;
}

/// From the object's frame to the gel's on its back, and back again but for the height.
const Eigen::Vector3d kHalfTurn(1.0, -1.0, -1.0);

double held_from(const ObjectSpec& object, const Eigen::AlignedBox3d& box) {
  if (object.elastic->held_above_mm) return *object.elastic->held_above_mm;
  if (object.shape.type == ShapeKind::sphere) return kSphereHeldFrom * object.shape.radius_mm;
  return box.max().z() - kTopPart * box.sizes().z();
}

}  // namespace

TriangleMesh even_surface(const ShapeSpec& shape, double edge_mm) {
  const double radius = shape.radius_mm;
  switch (shape.type) {
    case ShapeKind::sphere: {
      Profile profile({0.0, -radius}, edge_mm);
      profile.arc({0.0, 0.0}, radius, 0.0, kPi);
      return turned_evenly(profile.points(), edge_mm);
    }
    case ShapeKind::rounded_cylinder: {
      const double edge = shape.edge_radius_mm;
      Profile profile({0.0, 0.0}, edge_mm);
      if (edge < radius) profile.line_to({radius - edge, 0.0});
      if (edge > 0.0) profile.arc({radius - edge, edge}, edge, 0.0, kPi / 2);
      if (edge < shape.height_mm) profile.line_to({radius, shape.height_mm});
      profile.line_to({0.0, shape.height_mm});
      return turned_evenly(profile.points(), edge_mm);
    }
    case ShapeKind::box:
    case ShapeKind::mesh:
    case ShapeKind::egg:
    case ShapeKind::shell:
    case ShapeKind::hexagon:
    case ShapeKind::cone:
    case ShapeKind::torus:
    case ShapeKind::capsule:
    case ShapeKind::lying_cylinder:
    case ShapeKind::wedge:
      break;
  }
  return visible_mesh(shape);
}

fem::SolidGel solid_of(const ObjectSpec& object) {
  TS_ASSERT(object.elastic);
  const ElasticSpec& elastic = *object.elastic;
  fem::SolidGel solid;
  solid.surface = even_surface(object.shape, kSurfacePerFine * elastic.mesh_mm);
  const Eigen::AlignedBox3d box = box_of(solid.surface);
  const double held = held_from(object, box);
  int bonded = 0;
  for (const auto& t : solid.surface.triangles) {
    const bool is_held = std::all_of(t.begin(), t.end(), [&](int v) { return solid.surface.vertices[v].z() >= held; });
    bonded += is_held;
    solid.faces.push_back(is_held ? fem::FaceKind::bonded : fem::FaceKind::outer);
  }
  if (bonded == 0 || bonded == static_cast<int>(solid.faces.size())) {
    fail_at(elastic.where,
            "elastic: {} of the object's faces, which reach from z = {:.4g} to {:.4g} mm, are wholly above "
            "{:.4g} mm, where it is held; held_above_mm must leave both",
            bonded == 0 ? "none" : "all", box.min().z(), box.max().z(), held);
  }
  for (Eigen::Vector3d& vertex : solid.surface.vertices) {
    vertex = kHalfTurn.cwiseProduct(vertex - Eigen::Vector3d(0.0, 0.0, box.min().z()));
  }
  const double reach = std::max(box.min().head<2>().cwiseAbs().maxCoeff(), box.max().head<2>().cwiseAbs().maxCoeff());
  solid.fine = elastic.mesh_mm;
  solid.coarse = kCoarsePerFine * elastic.mesh_mm;
  solid.fine_half_x = solid.fine_half_y = elastic.fine_radius_mm.value_or(reach);
  solid.fine_depth = kFineLayers * elastic.mesh_mm;
  return solid;
}

fem::Compliance turned_back(fem::Compliance solid, double lowest) {
  for (Eigen::Vector3d& vertex : solid.vertices) {
    vertex = kHalfTurn.cwiseProduct(vertex) + Eigen::Vector3d(0.0, 0.0, lowest);
  }
  solid.surface = solid.surface.mirrored(kHalfTurn);
  return solid;
}

std::shared_ptr<const fem::Compliance> set_up_elastic_object(const ObjectSpec& object,
                                                             const std::filesystem::path& cache_folder) {
  TS_ASSERT(object.elastic);
  const fem::SolidGel solid = solid_of(object);
  const fem::ElasticMaterial material{object.elastic->youngs_modulus_MPa, object.elastic->poisson_ratio};
  const double lowest = box_of(even_surface(object.shape, kSurfacePerFine * solid.fine)).min().z();
  Sha256 sum;
  sum.add("elastic object " + fem::compliance_key(solid, std::span(&material, 1), {}));
  sum.add(&lowest, sizeof(lowest));
  try {
    return std::make_shared<const fem::Compliance>(fem::cached_compliance(sum.digest(), cache_folder, [&] {
      fem::Compliance made = fem::compute_compliance(fem::mesh_gel(solid), material, {}, fem::thickness_of(solid));
      made.report.fine_edge = solid.fine;
      return turned_back(std::move(made), lowest);
    }));
  } catch (const Error& error) {
    fail_at(object.elastic->where, "elastic: the object can't be set up as an elastic body: {}", error.what());
  }
}

std::vector<std::shared_ptr<const fem::Compliance>> set_up_elastic_objects(const SceneSpec& scene, const Plan& plan,
                                                                           const std::filesystem::path& cache_folder) {
  std::vector<std::shared_ptr<const fem::Compliance>> all;
  if (!plan.elastic_object) return all;
  // Scenes of one object ask for it at once: the first makes it, the others read it.
  static std::mutex one_at_a_time;
  locked_work(one_at_a_time, [&] {
    for (const MovedObject& moved : moved_objects(scene)) {
      all.push_back(moved.object.elastic ? set_up_elastic_object(moved.object, cache_folder) : nullptr);
    }
  });
  return all;
}

}  // namespace touchstone::sim
