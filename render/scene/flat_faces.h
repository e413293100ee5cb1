#pragma once
// Layers between a scene's flat faces, and a ray's path through them.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "render/materials/fresnel.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// Throws Error if a face names a medium that the scene doesn't have, or stands below the one before it, or the two
/// don't agree on the medium between them.
void check_faces(const Scene& scene);

/// The number of a height's layer: that of the faces below it.
inline int layer_of_height(const std::vector<FlatFace>& faces, double z) {
  int layer = 0;
  while (layer < static_cast<int>(faces.size()) && faces[layer].z < z) ++layer;
  return layer;
}

/// The medium of a layer where no Refractive surface says otherwise.
inline int medium_of_layer(const std::vector<FlatFace>& faces, int layer) {
  if (faces.empty()) return 0;
  return layer == 0 ? faces.front().medium_below : faces[layer - 1].medium_above;
}

/// The medium itself.
inline const Medium& medium_of_layer(const Scene& scene, int layer) {
  return scene.media[medium_of_layer(scene.faces, layer)];
}

/// A ray in a layer; its direction is a unit vector.
struct RayInLayer {
  Eigen::Vector3d origin, direction;
  int layer = 0;

  bool up() const { return direction.z() > 0.0; }
  /// The number of the face ahead; -1 or the number of faces where there is none.
  int face_ahead() const { return up() ? layer : layer - 1; }
};

/// The distance to the face ahead, mm; infinite where there is none.
inline double distance_to_face(const Scene& scene, const RayInLayer& ray) {
  const int face = ray.face_ahead();
  if (ray.direction.z() == 0.0 || face < 0 || face >= static_cast<int>(scene.faces.size())) {
    return std::numeric_limits<double>::infinity();
  }
  return std::max(0.0, (scene.faces[face].z - ray.origin.z()) / ray.direction.z());
}

/// Takes the ray over `distance`, which distance_to_face gave, and through the face there by Snell's law. Under total
/// reflection
/// (`cos_refracted` 0) it stops before the face. @pre there is a face ahead
inline FresnelFace cross_face(const Scene& scene, double distance, RayInLayer& ray) {
  const bool up = ray.up();
  ray.origin += distance * ray.direction;
  ray.origin.z() = scene.faces[ray.face_ahead()].z;
  const int next = up ? ray.layer + 1 : ray.layer - 1;
  const double n_from = medium_of_layer(scene, ray.layer).index;
  const double n_to = medium_of_layer(scene, next).index;
  const FresnelFace face = fresnel(n_from, n_to, std::abs(ray.direction.z()));
  if (face.cos_refracted <= 0.0) return face;
  const double eta = n_from / n_to;
  ray.direction =
      Eigen::Vector3d(eta * ray.direction.x(), eta * ray.direction.y(), up ? face.cos_refracted : -face.cos_refracted)
          .normalized();
  ray.layer = next;
  return face;
}

}  // namespace touchstone::render
