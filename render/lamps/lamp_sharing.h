#pragma once
// What connections to a visible lamp and paths that run into it need to know of each other (lamp_bodies.h).

#include <Eigen/Core>
#include <cmath>

#include "render/lamps/lamp_choice.h"
#include "render/lamps/lamp_connection.h"
#include "render/lamps/prepared_scene.h"
#include "render/materials/layer_connection.h"

namespace touchstone::render {

/// The directions at the receiver (sr) that a mm^2 of the lamp at `point` fills, seen through the flat faces between
/// them: Arrival::angle_per_lamp_area of a connection that bends at no Refractive surface. 0 where the faces let none
/// through.
template <int N>
double angle_per_lamp_area(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const Eigen::Vector3d& point,
                           const Receiver& receiver) {
  Layer layers[kMaxLayers];
  int count = 0;
  bool bends = false;
  double z = point.z();
  const bool up = z <= receiver.position.z();
  const auto add_layer = [&](double until, int medium) {
    const double index = scene.media[medium].index;
    bends = bends || (count > 0 && index != layers[0].index);
    layers[count++] = {std::abs(until - z), index};
    z = until;
  };
  for (int k = lamp.layer; k != receiver.layer; k += up ? 1 : -1) {
    if (up != (k < receiver.layer)) break;  // rounding, at a face
    const double face = scene.faces[up ? k : k - 1].z;
    add_layer(up ? std::max(z, face) : std::min(z, face), scene.medium_of_layer(k));
  }
  add_layer(receiver.position.z(), receiver.medium);

  const Eigen::Vector3d offset = receiver.position - point;
  if (!bends) {
    const double distance2 = offset.squaredNorm();
    return distance2 > 0.0 ? std::abs(offset.dot(lamp.frame.z)) / (distance2 * std::sqrt(distance2)) : 0.0;
  }
  const double lateral = offset.head<2>().norm();
  const auto path = solve_layer_path({layers, static_cast<std::size_t>(count)}, lateral);
  if (!path) return 0.0;
  Eigen::Vector3d from_lamp(0.0, 0.0, std::copysign(path->cosine[0], offset.z()));
  if (lateral > 0.0) from_lamp.head<2>() = offset.head<2>() * (path->tangent[0] * path->cosine[0] / lateral);
  const double ratio = layers[0].index / layers[count - 1].index;
  return path->jacobian * ratio * ratio * std::abs(from_lamp.dot(lamp.frame.z));
}

/// Would a connection from this point of the lamp to the receiver take a Refractive surface over or under the receiver
/// as flat?
template <int N>
bool bends_at_surface(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const Eigen::Vector3d& point,
                      const Receiver& receiver) {
  if (receiver.medium == scene.medium_of_layer(receiver.layer)) return false;
  const double z = receiver.position.z();
  const bool lamp_is_below = point.z() <= z;
  double edge = point.z();
  if (lamp.layer < receiver.layer) edge = std::max(edge, scene.faces[receiver.layer - 1].z);
  if (lamp.layer > receiver.layer) edge = std::min(edge, scene.faces[receiver.layer].z);
  return scene.rays.refractive_along_z(receiver.position, !lamp_is_below, std::abs(z - edge)) >= 0.0;
}

/// Does a Refractive surface cross the path from the receiver along `direction` through the flat faces to the lamp?
template <int N>
bool passes_refractive(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const Receiver& receiver,
                       Eigen::Vector3d direction) {
  if (!scene.rays.has_refractive()) return false;
  Eigen::Vector3d at = receiver.position + RayScene::leave_distance(receiver.position) * receiver.normal;
  const bool up = lamp.layer > receiver.layer;
  double index = scene.media[receiver.medium].index;
  for (int layer = receiver.layer; layer != lamp.layer; layer += up ? 1 : -1) {
    const double z = scene.faces[up ? layer : layer - 1].z;
    if (direction.z() == 0.0) return false;
    const Eigen::Vector3d corner = at + (z - at.z()) / direction.z() * direction;
    if (scene.rays.meets_refractive(at, corner)) return true;
    const double next = scene.media[scene.medium_of_layer(up ? layer + 1 : layer - 1)].index;
    const Eigen::Vector2d flat = direction.head<2>() * (index / next);
    const double rise2 = 1.0 - flat.squaredNorm();
    if (!(rise2 > 0.0)) return false;
    direction = {flat.x(), flat.y(), std::copysign(std::sqrt(rise2), direction.z())};
    at = corner;
    index = next;
  }
  const double left = (lamp.position - at).dot(lamp.frame.z) / direction.dot(lamp.frame.z);
  return left > 0.0 && std::isfinite(left) && scene.rays.meets_refractive(at, at + left * direction);
}

/// Leaves to paths that run into the lamp their share of what a connection has found; `density` is that of such a
/// path's direction.
template <int N>
inline void share_with_paths(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const LampChoice& choice,
                             const Receiver& receiver, double density, Arrival<N>& arrival) {
  if (!(arrival.angle_per_lamp_area > 0.0)) return;
  if (arrival.bends_at_surface || passes_refractive(scene, lamp, receiver, arrival.direction)) return;
  const double of_connection = choice.probability / (lamp.area * arrival.angle_per_lamp_area);
  arrival.irradiance *= of_connection / (of_connection + density);
}

/// How the light of a lamp that the path runs into is shared with the connections of where the path last scattered.
struct Departure {
  /// Who counts the light: the path that runs into the lamp, the connection, or both by their weights.
  enum class Sharing { kAllToPath, kShared, kAllToConnection } sharing = Sharing::kAllToPath;
  Receiver from;
  bool is_matt = false;
  double density = 0.0;
};

/// After a smooth event at a face or surface of this normal: mirrored light is found by paths only.
inline void note_smooth_event(Departure& departure, const Eigen::Vector3d& before, const Eigen::Vector3d& after,
                              const Eigen::Vector3d& normal, bool is_refractive_surface) {
  if ((before.dot(normal) > 0.0) != (after.dot(normal) > 0.0)) {
    departure.sharing = Departure::Sharing::kAllToPath;
  } else if (is_refractive_surface && departure.sharing == Departure::Sharing::kShared) {
    departure.sharing = Departure::Sharing::kAllToConnection;
  }
}

}  // namespace touchstone::render
