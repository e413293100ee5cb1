#include "render/cameras/still_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "render/scene/flat_faces.h"
#include "render/scene/ray_scene.h"

namespace touchstone::render {
namespace {

constexpr double kPassing = 1e-3;  // of a triangle's sides, beside it: some hundred times what single precision loses

int layer_of_sheet(const Scene& scene) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& vertex : scene.surfaces.at(0).mesh.vertices) highest = std::max(highest, vertex.z());
  return layer_of_height(scene.faces, highest);
}

}  // namespace

StillView::StillView(const Scene& scene, const ReadyCamera& camera) {
  check_scene(scene);
  Scene rest = scene;
  rest.surfaces.at(0).mesh = {};
  rest.surfaces[0].normals.clear();
  const RayScene still(rest);
  const int sheet_layer = layer_of_sheet(scene);
  const Eigen::Vector2i size = size_of(camera);
  const RigidTransform& pose = pose_of(camera);
  const int layer = layer_of_height(scene.faces, pose.translation.z());
  rays_.resize(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()));
  tbb::parallel_for(0, size.y(), [&](int row) {
    Ray* kept = rays_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x());
    for (int column = 0; column < size.x(); ++column, ++kept) {
      const std::optional<Eigen::Vector3d> view = view_direction(camera, column + 0.5, row + 0.5);
      if (!view) continue;
      RayInLayer ray{pose.translation, pose.turn(*view), layer};
      for (;;) {
        const double face = distance_to_face(scene, ray);
        RayHit hit;
        const bool met = still.intersect(ray.origin, ray.direction, face, hit);
        if (ray.layer == sheet_layer) {
          kept->origin = ray.origin;
          kept->direction = ray.direction;
          kept->far = met ? hit.distance : std::min(face, std::numeric_limits<double>::max());
        }
        if (met) {
          kept->still = {hit.object, hit.triangle, hit.weight_1, hit.weight_2, hit.position, hit.shading_normal};
          break;
        }
        if (std::isinf(face) || cross_face(scene, face, ray).cos_refracted <= 0.0) break;
      }
    }
  });
}

/// What rays pass of the sheet's heights.
Eigen::AlignedBox2d StillView::seen_of(const Surface& sheet) const {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Eigen::Vector3d& vertex : sheet.mesh.vertices) {
    low = std::min(low, vertex.z());
    high = std::max(high, vertex.z());
  }
  Eigen::AlignedBox2d seen;
  for (const Ray& ray : rays_) {
    if (ray.far < 0.0 || ray.direction.z() == 0.0) continue;
    for (const double z : {low, high}) {
      const double along = (z - ray.origin.z()) / ray.direction.z();
      seen.extend(Eigen::Vector2d((ray.origin + along * ray.direction).head<2>()));
    }
  }
  return seen;
}

FirstHit StillView::hit_of(const Ray& ray, const SheetHit& hit, const Surface& sheet) {
  return {0,
          hit.triangle,
          hit.u,
          hit.v,
          ray.origin + hit.distance * ray.direction,
          normals_at(sheet, hit).shading.normalized()};
}

std::vector<FirstHit> StillView::first_hits(const Surface& sheet, std::span<const std::int32_t> known) const {
  TS_ASSERT(known.empty() || known.size() == rays_.size());
  std::vector<FirstHit> hits(rays_.size());
  std::vector<std::uint8_t> open(rays_.size(), 0);  // not known
  constexpr std::size_t kRaysATask = 1024;
  const std::size_t tasks = (rays_.size() + kRaysATask - 1) / kRaysATask;
  const auto for_rays = [&](const auto& work) {
    tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
      for (std::size_t k = task * kRaysATask; k < std::min(rays_.size(), (task + 1) * kRaysATask); ++k) work(k);
    });
  };
  for_rays([&](std::size_t k) {
    const Ray& ray = rays_[k];
    hits[k] = ray.still;
    if (ray.far < 0.0) return;
    if (!known.empty() && known[k] >= 0) {
      const auto hit = meet_triangle(sheet.mesh, known[k], ray.origin, ray.direction, kPassing);
      if (hit && hit->distance >= 0.0 && hit->distance <= ray.far) {
        hits[k] = hit_of(ray, *hit, sheet);
        return;
      }
    }
    open[k] = 1;
  });
  if (std::ranges::find(open, std::uint8_t{1}) == open.end()) return hits;
  const SheetIndex index(sheet, seen_of(sheet));
  for_rays([&](std::size_t k) {
    if (open[k] == 0) return;
    if (const auto hit = index.first(rays_[k].origin, rays_[k].direction, rays_[k].far)) {
      hits[k] = hit_of(rays_[k], *hit, sheet);
    }
  });
  return hits;
}

}  // namespace touchstone::render
