#include "render/cameras/still_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/scene/flat_faces.h"
#include "render/scene/ray_scene.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {
namespace {

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

std::vector<FirstHit> StillView::first_hits(const Surface& sheet) const {
  // What rays pass of the sheet's heights.
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
  std::vector<FirstHit> hits(rays_.size());
  const SheetIndex index(sheet, seen);
  constexpr std::size_t kRaysATask = 1024;
  const std::size_t tasks = (rays_.size() + kRaysATask - 1) / kRaysATask;
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    for (std::size_t k = task * kRaysATask; k < std::min(rays_.size(), (task + 1) * kRaysATask); ++k) {
      const Ray& ray = rays_[k];
      hits[k] = ray.still;
      if (ray.far < 0.0) continue;
      const auto hit = index.first(ray.origin, ray.direction, ray.far);
      if (!hit) continue;
      hits[k] = {0,
                 hit->triangle,
                 hit->u,
                 hit->v,
                 ray.origin + hit->distance * ray.direction,
                 index.normals_at(*hit).shading.normalized()};
    }
  });
  return hits;
}

}  // namespace touchstone::render
