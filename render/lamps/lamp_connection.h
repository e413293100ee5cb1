#pragma once
// The light that one point of a lamp's lens sends to a point of the scene: layers between them, Fresnel, absorption,
// shadow.

#include <Eigen/Core>
#include <cmath>

#include "render/lamps/prepared_scene.h"
#include "render/materials/layer_connection.h"

namespace touchstone::render {

/// A point that light may reach, and the state of the path there.
struct Receiver {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  ///< unit, on the side that is lit; zero for a particle, which is lit from all sides
  int layer = 0;
  int medium = 0;
  bool shadowed = true;  ///< false: as if nothing stood in the way
};

/// Light arriving: the unit direction it comes from (in the receiver's medium) and the irradiance in W/m^2 on an area
/// square to it.
template <int N>
struct Arrival {
  Eigen::Vector3d direction;
  Bands<N> irradiance;
  double angle_per_lamp_area = 0.0;  ///< sr of directions at the receiver a mm^2 of the lamp; 0 if it has no area
  bool bends_at_surface = false;     ///< crosses a Refractive surface, which connections take as flat
};

/// What ThinFilms between two points of one medium let through.
template <int N>
[[gnu::noinline]] Bands<N> passed_by_films(const PreparedScene<N>& scene, const Eigen::Vector3d& from,
                                           const Eigen::Vector3d& to, int medium) {
  Bands<N> passed = Bands<N>::Ones();
  const Eigen::Vector3d offset = to - from;
  const double length = offset.norm();
  if (!(length > 0.0)) return passed;
  const Eigen::Vector3d direction = offset / length;
  double at = 0.0;
  RayHit hit;
  while (scene.rays.intersect_film(from + at * direction, direction, length - at, hit)) {
    const PreparedMaterial<N>& film = scene.materials[hit.object];
    const double cosine = std::abs(direction.dot(hit.normal));
    passed *= film_light<N>(film.colour, film.film_index, film.film_mirrors, scene.media[medium].index, cosine).passed;
    if (!(passed.maxCoeff() > 0.0)) break;
    at += std::max(0.0, hit.distance) + RayScene::leave_distance(hit.position) / std::max(cosine, 1e-3);
  }
  return passed;
}

/// Light from the point `source` of lamp `lamp` (not a guide's) to the receiver. False where none arrives: out of the
/// lamp's lobe, from behind the receiver's surface or the lens, in shadow. `connections` counts shadow tests.
///
/// Layers are those between the two heights. A receiver whose medium isn't that of its layer stands beyond a Refractive
/// surface (an object just off the gel): that surface is taken as flat and horizontal at the height where a vertical
/// from the receiver meets it, which is exact for a flat gel, and biased where the gel slopes.
template <int N>
bool connect_to_lamp(const PreparedScene<N>& scene, const PreparedLamp<N>& lamp, const Eigen::Vector3d& source,
                     const Receiver& receiver, std::uint64_t& connections, Arrival<N>& arrival) {
  const Eigen::Vector3d& p = receiver.position;
  const bool up = source.z() <= p.z();  // light runs up to the receiver
  const bool is_particle = receiver.normal.isZero(0.0);
  Layer layers[kMaxLayers];
  int media[kMaxLayers];
  int count = 0;
  double z = source.z();
  const auto add_layer = [&](double until, int medium) {
    layers[count] = {std::abs(until - z), scene.media[medium].index};
    media[count++] = medium;
    z = until;
  };
  if (up) {
    for (int k = lamp.layer; k < receiver.layer; ++k)
      add_layer(std::max(z, scene.faces[k].z), scene.medium_of_layer(k));
  } else {
    for (int k = lamp.layer; k > receiver.layer; --k) {
      add_layer(std::min(z, scene.faces[k - 1].z), scene.medium_of_layer(k));
    }
  }
  const int usual = scene.medium_of_layer(receiver.layer);
  if (receiver.medium != usual) {
    const double off = scene.rays.refractive_along_z(p, !up, std::abs(p.z() - z));
    arrival.bends_at_surface = off >= 0.0;
    if (off >= 0.0) add_layer(up ? std::max(z, p.z() - off) : std::min(z, p.z() + off), usual);
  }
  add_layer(p.z(), receiver.medium);

  Bands<N> light = lamp.intensity_on_axis;
  Eigen::Vector3d from_lamp;  // unit direction of emission
  double per_area = 0.0;      // solid angle at the lamp per mm^2 at the receiver
  bool bends = false;
  for (int k = 1; k < count; ++k) bends = bends || layers[k].index != layers[0].index;

  if (!bends) {
    const Eigen::Vector3d offset = p - source;
    const double distance2 = offset.squaredNorm();
    if (!(distance2 > 1e-18)) return false;
    const double distance = std::sqrt(distance2);
    from_lamp = offset / distance;
    arrival.direction = -from_lamp;
    if (!is_particle && arrival.direction.dot(receiver.normal) <= 0.0) return false;
    per_area = 1.0 / distance2;
    arrival.angle_per_lamp_area = per_area;
    const double height = std::abs(offset.z());
    for (int k = 0; k < count; ++k) {
      if (!scene.media[media[k]].weakens) continue;
      const double share = height > 0.0 ? layers[k].thickness / height : (k + 1 == count ? 1.0 : 0.0);
      light *= (-scene.media[media[k]].extinction * (distance * share)).exp();
    }
  } else {
    const Eigen::Vector2d flat = (p - source).head<2>();
    const double lateral = flat.norm();
    const Eigen::Vector2d toward = lateral > 0.0 ? Eigen::Vector2d(flat / lateral) : Eigen::Vector2d::UnitX();
    LayerPath path;
    if (!solve_layer_path({layers, static_cast<std::size_t>(count)}, lateral, path)) return false;
    const double sense = up ? 1.0 : -1.0;
    const auto direction_in = [&](int k) {
      const double sine = path.tangent[k] * path.cosine[k];
      return Eigen::Vector3d(sine * toward.x(), sine * toward.y(), sense * path.cosine[k]);
    };
    arrival.direction = -direction_in(count - 1);
    if (!is_particle && arrival.direction.dot(receiver.normal) <= 0.0) return false;
    from_lamp = direction_in(0);
    arrival.angle_per_lamp_area =
        path.jacobian * std::pow(layers[0].index / layers[count - 1].index, 2);  // by reciprocity
    per_area = path.jacobian * path.transmittance;
    for (int k = 0; k < count; ++k) {
      if (!scene.media[media[k]].weakens) continue;
      light *= (-scene.media[media[k]].extinction * (layers[k].thickness / path.cosine[k])).exp();
    }
    if (emission_profile(lamp, from_lamp) <= 0.0) return false;

    // Shadows, leg by leg from the receiver back to the lamp; a leg that no opaque thing's height reaches costs
    // nothing.
    ++connections;
    Eigen::Vector3d end = p + RayScene::leave_distance(p) * receiver.normal;
    Eigen::Vector3d corner = p;
    for (int k = count - 1; k >= 0; --k) {
      Eigen::Vector3d next = source;
      if (k > 0) {
        const double step = layers[k].thickness * path.tangent[k];
        next = {corner.x() - step * toward.x(), corner.y() - step * toward.y(),
                corner.z() - sense * layers[k].thickness};
      }
      if (receiver.shadowed && scene.blocked(end, next)) return false;
      if (scene.has_films) light *= passed_by_films(scene, end, next, media[k]);
      corner = next;
      end = next;
    }
  }

  const double profile = emission_profile(lamp, from_lamp);
  if (profile <= 0.0) return false;
  if (!bends) {
    ++connections;
    const Eigen::Vector3d end = p + RayScene::leave_distance(p) * receiver.normal;
    if (receiver.shadowed && scene.blocked(end, source)) return false;
    if (scene.has_films) light *= passed_by_films(scene, end, source, receiver.medium);
  }
  constexpr double kSquareMillimetresPerSquareMetre = 1e6;
  arrival.angle_per_lamp_area *= from_lamp.dot(lamp.frame.z);
  arrival.irradiance = light * (profile * per_area * kSquareMillimetresPerSquareMetre);
  return true;
}

}  // namespace touchstone::render
