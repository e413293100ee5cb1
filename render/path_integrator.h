#pragma once
// One path: from the camera through faces and surfaces to the lamps and the surroundings.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "render/fresnel.h"
#include "render/ggx.h"
#include "render/lamp_connection.h"
#include "render/path_tracer.h"
#include "render/prepared_scene.h"
#include "render/sample_sequence.h"
#include "render/warps.h"

namespace touchstone::render {

/// Follows paths through a PreparedScene. Radiances here are basic radiances, L / n^2.
///
/// Before the first diffuse or metallic hit a ray that meets a smooth boundary goes both ways, weighted by Fresnel's
/// reflectance, so that mirror images in the glass add no noise; a branch weaker than kFaintest is followed now and
/// then with that weight (Russian roulette). After that hit a random number chooses one way.
template <int N>
class PathIntegrator {
 public:
  PathIntegrator(const PreparedScene<N>& scene, int max_depth, bool interreflection)
      : scene_(scene),
        max_depth_(max_depth),
        interreflection_(interreflection),
        dark_((scene.environment == 0.0).all()) {}

  /// Basic radiance that arrives at `origin` against `direction` (unit).
  Bands<N> trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SampleSequence& numbers,
                 RayCounts& counts) const {
    Bands<N> sum = Bands<N>::Zero();
    Branches branches;
    const int layer = scene_.layer_at(origin.z());
    branches.legs[branches.count++] = {origin, direction, Bands<N>::Ones(), 0.5, layer, scene_.medium_of_layer(layer),
                                       0,      0};
    // Drawn before the path's smooth events draw theirs, so that a pixel's samples share lamps and lenses evenly.
    const LampNumbers at_first_hit = lamp_numbers(numbers);
    while (branches.count > 0) {
      Leg leg = branches.legs[--branches.count];
      follow(leg, branches, at_first_hit, numbers, counts, sum);
    }
    return sum;
  }

 private:
  static constexpr double kFaintest = 0.01;
  static constexpr int kMostBranches = 12;
  static constexpr int kMostSmoothEvents = 64;
  static constexpr int kRouletteFrom = 3;

  struct Leg {  // without default values: a path makes room for a dozen and mostly uses three
    Eigen::Vector3d origin, direction;
    Bands<N> throughput;
    double s_share;  // of the light, polarised square to the plane of incidence at the flat faces
    int layer, medium;
    int depth;   // diffuse and metallic reflections so far
    int smooth;  // refractions, mirror reflections and crossings of Refractive surfaces so far
  };

  /// Which lamp lights a hit, and which point of its lens.
  struct LampNumbers {
    double lamp;
    std::array<double, 2> lens;
  };
  static LampNumbers lamp_numbers(SampleSequence& numbers) {
    const double lamp = numbers.next();
    return {lamp, numbers.next_pair()};
  }

  struct LampChoice {
    int lamp;
    double probability;
  };

  /// A lamp with a probability in proportion to what it would send without shadow, Fresnel's loss or lobe: by its
  /// power, distance and, for a matt surface, the cosine after refraction as if all of the way were in the lamp's
  /// medium. No lamp that shines is left without a chance.
  LampChoice choose_lamp(const Receiver& receiver, const PreparedMaterial<N>& material, double number) const {
    const auto lamp_count = static_cast<int>(scene_.lamps.size());
    if (lamp_count == 1) return {0, 1.0};
    constexpr double kLeastCosine = 0.05;
    constexpr int kMostWeighed = 32;
    if (lamp_count > kMostWeighed) {
      return {std::min(lamp_count - 1, static_cast<int>(number * lamp_count)), 1.0 / lamp_count};
    }
    std::array<double, kMostWeighed> weights{};
    double total = 0.0;
    for (int i = 0; i < lamp_count; ++i) {
      const PreparedLamp<N>& lamp = scene_.lamps[i];
      const Eigen::Vector3d way = lamp.lamp.position - receiver.position;
      const double distance2 = std::max(1e-12, way.squaredNorm());
      double cosine = 1.0;
      if (material.kind == SurfaceKind::kLambertian) {
        const double bend =
            scene_.media[scene_.medium_of_layer(lamp.layer)].index / scene_.media[receiver.medium].index;
        const double lateral2 = std::min(1.0, bend * bend * way.head<2>().squaredNorm() / distance2);
        const double shrink = bend / std::sqrt(distance2);
        const double height = std::copysign(std::sqrt(1.0 - lateral2), way.z());
        cosine = std::max(kLeastCosine, receiver.normal.x() * way.x() * shrink +
                                            receiver.normal.y() * way.y() * shrink + receiver.normal.z() * height);
      }
      weights[i] = lamp.total_power * cosine / distance2;
      total += weights[i];
    }
    if (!(total > 0.0)) return {0, 1.0};
    double rest = number * total;
    int i = 0;
    while (i + 1 < lamp_count && rest >= weights[i]) rest -= weights[i++];
    while (weights[i] == 0.0) --i;  // rounding may have run past the last lamp that shines
    return {i, weights[i] / total};
  }

  struct Branches {
    std::array<Leg, kMostBranches> legs;  // uninitialised on purpose, see Leg
    int count = 0;
  };

  void absorb(Leg& leg, double distance) const {
    const auto& medium = scene_.media[leg.medium];
    if (medium.absorbs) leg.throughput *= (-medium.absorption * distance).exp();
  }

  /// Has the leg nothing before it but the surroundings?
  bool leaves(const Leg& leg) const {
    const bool up = leg.direction.z() > 0.0;
    if (up ? leg.layer < static_cast<int>(scene_.faces.size()) : leg.layer > 0) return false;
    return scene_.rays.nothing_beyond(leg.origin.z(), up);
  }

  /// Goes on at a smooth boundary with one of two ways, and before the first diffuse hit with the other one as well.
  void part(Leg& leg, Leg& mirrored, Leg& refracted, double reflectance_s, double reflectance_p, Branches& branches,
            SampleSequence& numbers, Bands<N>& sum) const {
    const double s = leg.s_share;
    const double reflectance = s * reflectance_s + (1.0 - s) * reflectance_p;
    const double transmittance = 1.0 - reflectance;
    const auto share = [](double piece, double whole) { return whole > 0.0 ? piece / whole : 0.5; };
    mirrored.s_share = share(s * reflectance_s, reflectance);
    refracted.s_share = share(s * (1.0 - reflectance_s), transmittance);
    if (leg.depth > 0 || branches.count == kMostBranches || reflectance >= 1.0) {
      leg = reflectance >= 1.0 || numbers.next() < reflectance ? mirrored : refracted;
      return;
    }
    const bool mirror_is_weaker = reflectance < 0.5;
    const double weak = std::min(reflectance, transmittance);
    leg = mirror_is_weaker ? refracted : mirrored;
    leg.throughput *= 1.0 - weak;
    Leg& weaker = mirror_is_weaker ? mirrored : refracted;
    if (dark_ && leaves(weaker)) return;
    const double chance = std::min(1.0, weak * weaker.throughput.maxCoeff() / kFaintest);
    if (chance < 1.0 && !(numbers.next() < chance)) return;
    weaker.throughput *= weak / chance;
    if (leaves(weaker)) {
      sum += weaker.throughput * scene_.environment;
    } else {
      branches.legs[branches.count++] = weaker;
    }
  }

  /// The leg ends on the flat face above (`up`) or below its layer.
  void meet_face(Leg& leg, bool up, Branches& branches, SampleSequence& numbers, Bands<N>& sum) const {
    const int index = up ? leg.layer : leg.layer - 1;
    const FlatFace& face = scene_.faces[index];
    leg.origin.z() = face.z;
    const int to = up ? face.medium_above : face.medium_below;
    const double n_from = scene_.media[leg.medium].index;
    const double n_to = scene_.media[to].index;
    if (n_from != n_to) {
      ++leg.smooth;
      const double cosine = std::abs(leg.direction.z());
      const FresnelFace fresnel_face = fresnel(n_from, n_to, cosine);
      Leg mirrored = leg;
      mirrored.direction.z() = -leg.direction.z();
      const double eta = n_from / n_to;
      Leg refracted = leg;
      refracted.direction = {eta * leg.direction.x(), eta * leg.direction.y(),
                             up ? fresnel_face.cos_refracted : -fresnel_face.cos_refracted};
      refracted.direction.normalize();
      refracted.medium = to;
      refracted.layer += up ? 1 : -1;
      part(leg, mirrored, refracted, fresnel_face.reflectance_s, fresnel_face.reflectance_p, branches, numbers, sum);
      return;
    }
    leg.medium = to;
    leg.layer += up ? 1 : -1;
  }

  /// The leg ends on a Refractive surface.
  void meet_boundary(Leg& leg, const RayHit& hit, const PreparedMaterial<N>& material, Branches& branches,
                     SampleSequence& numbers, Bands<N>& sum) const {
    const bool entering = leg.direction.dot(hit.normal) < 0.0;
    const int to = entering ? material.inside : material.outside;
    const double leave = RayScene::leave_distance(hit.position);
    const Eigen::Vector3d facing = entering ? hit.normal : Eigen::Vector3d(-hit.normal);
    const double n_from = scene_.media[leg.medium].index;
    const double n_to = scene_.media[to].index;
    ++leg.smooth;
    if (n_from != n_to) {
      Eigen::Vector3d normal = entering ? hit.shading_normal : Eigen::Vector3d(-hit.shading_normal);
      if (-leg.direction.dot(normal) <= 1e-6) normal = facing;
      double cosine = -leg.direction.dot(normal);
      Eigen::Vector3d reflected = leg.direction + 2.0 * cosine * normal;
      if (reflected.dot(facing) <= 0.0) {  // the interpolated normal would mirror light through the surface
        normal = facing;
        cosine = -leg.direction.dot(normal);
        reflected = leg.direction + 2.0 * cosine * normal;
      }
      const FresnelFace face = fresnel(n_from, n_to, cosine);
      const double eta = n_from / n_to;
      Eigen::Vector3d bent = eta * leg.direction + (eta * cosine - face.cos_refracted) * normal;
      if (bent.dot(facing) >= 0.0) bent -= (bent.dot(facing) + 1e-6) * facing;
      // A curved surface has another plane of incidence than the flat faces: unpolarised from here.
      leg.s_share = 0.5;
      Leg mirrored = leg;
      mirrored.origin = hit.position + leave * facing;
      mirrored.direction = reflected.normalized();
      const double mean = face.mean_reflectance();
      Leg refracted = leg;
      refracted.origin = hit.position - leave * facing;
      refracted.direction = bent.normalized();
      refracted.medium = to;
      part(leg, mirrored, refracted, mean, mean, branches, numbers, sum);
      return;
    }
    leg.origin = hit.position - leave * facing;
    leg.medium = to;
  }

  /// Lamp light that the surface sends back along the leg. `normal` faces the leg.
  void add_lamp_light(const Leg& leg, const RayHit& hit, const Eigen::Vector3d& normal,
                      const PreparedMaterial<N>& material, const LampNumbers& chosen, bool all_lamps, RayCounts& counts,
                      Bands<N>& sum) const {
    const auto lamp_count = static_cast<int>(scene_.lamps.size());
    if (lamp_count == 0) return;
    const double index = scene_.media[leg.medium].index;
    const Receiver receiver{hit.position, normal, leg.layer, leg.medium};
    // One lamp a hit. A preview has just one sample and takes them all.
    const LampChoice choice = all_lamps ? LampChoice{0, 1.0} : choose_lamp(receiver, material, chosen.lamp);
    const int first = choice.lamp;
    const int last = all_lamps ? lamp_count : first + 1;
    const double weight = 1.0 / (choice.probability * index * index);
    for (int i = first; i < last; ++i) {
      const PreparedLamp<N>& lamp = scene_.lamps[i];
      Eigen::Vector3d source = lamp.lamp.position;
      if (lamp.lamp.lens_radius > 0.0) {
        const auto [u, v] = chosen.lens;
        const Eigen::Vector2d disc = lamp.lamp.lens_radius * square_to_disc(u, v);
        source += disc.x() * lamp.frame.x + disc.y() * lamp.frame.y;
      }
      Arrival<N> arrival;
      if (!connect_to_lamp(scene_, lamp, source, receiver, counts.connections, arrival)) continue;
      const double cosine = arrival.direction.dot(normal);
      if (material.kind == SurfaceKind::kLambertian) {
        sum += leg.throughput * material.colour * arrival.irradiance * (weight * cosine / kPi);
      } else {
        const NormalFrame frame(normal);
        const Eigen::Vector3d out = frame.to_local(-leg.direction);
        const Eigen::Vector3d in = frame.to_local(arrival.direction);
        const double schlick = schlick_weight((out + in).normalized().dot(out));
        const Bands<N> colour = (material.colour + (1.0 - material.colour) * schlick) *
                                (1.0 + material.colour * material.single_albedo.missing_ratio(out.z()));
        sum += leg.throughput * colour * arrival.irradiance *
               (weight * cosine * ggx_reflection(out, in, material.roughness));
      }
    }
  }

  /// Turns the leg into the next one after a diffuse or metallic reflection. False where the path ends.
  bool scatter(Leg& leg, const RayHit& hit, const Eigen::Vector3d& normal, const PreparedMaterial<N>& material,
               SampleSequence& numbers) const {
    if (!interreflection_ || leg.depth >= max_depth_) return false;
    const NormalFrame frame(normal);
    const auto [u, v] = numbers.next_pair();
    Eigen::Vector3d in;
    if (material.kind == SurfaceKind::kLambertian) {
      in = square_to_cosine_hemisphere(u, v);
      leg.throughput *= material.colour;
    } else {
      const Eigen::Vector3d out = frame.to_local(-leg.direction);
      if (out.z() <= 0.0) return false;
      const Eigen::Vector3d facet = sample_visible_normal(out, material.roughness, u, v);
      in = 2.0 * out.dot(facet) * facet - out;
      if (in.z() <= 0.0) return false;
      const double kept =
          ggx_masking_shadowing(in.z(), out.z(), material.roughness) / ggx_masking(out.z(), material.roughness);
      leg.throughput *= (material.colour + (1.0 - material.colour) * schlick_weight(out.dot(facet))) *
                        (kept * (1.0 + material.colour * material.single_albedo.missing_ratio(out.z())));
    }
    if (in.z() <= 1e-9) return false;
    ++leg.depth;
    if (leg.depth >= kRouletteFrom) {
      const double survival = std::min(1.0, leg.throughput.maxCoeff());
      if (!(numbers.next() < survival)) return false;
      leg.throughput /= survival;
    }
    leg.direction = frame.to_world(in).normalized();
    leg.origin = hit.position + RayScene::leave_distance(hit.position) * normal;
    leg.s_share = 0.5;
    return leg.throughput.maxCoeff() > 0.0;
  }

  void follow(Leg& leg, Branches& branches, const LampNumbers& at_first_hit, SampleSequence& numbers, RayCounts& counts,
              Bands<N>& sum) const {
    const int face_count = static_cast<int>(scene_.faces.size());
    for (;;) {
      ++(leg.depth == 0 ? counts.primary : counts.bounces);
      const bool up = leg.direction.z() > 0.0;
      double to_face = std::numeric_limits<double>::infinity();
      if (leg.direction.z() != 0.0 && (up ? leg.layer < face_count : leg.layer > 0)) {
        const double face_z = scene_.faces[up ? leg.layer : leg.layer - 1].z;
        to_face = std::max(0.0, (face_z - leg.origin.z()) / leg.direction.z());
      }
      RayHit hit;
      if (scene_.rays.intersect(leg.origin, leg.direction, to_face, hit)) {
        absorb(leg, hit.distance);
        const PreparedMaterial<N>& material = scene_.materials[hit.object];
        if (material.kind == SurfaceKind::kBlack) return;
        if (material.kind == SurfaceKind::kEmitter) {
          sum += leg.throughput * material.colour;
          return;
        }
        if (material.kind == SurfaceKind::kRefractive) {
          meet_boundary(leg, hit, material, branches, numbers, sum);
        } else {
          const Eigen::Vector3d normal =
              leg.direction.dot(hit.normal) < 0.0 ? hit.normal : Eigen::Vector3d(-hit.normal);
          add_lamp_light(leg, hit, normal, material, leg.depth == 0 ? at_first_hit : lamp_numbers(numbers),
                         numbers.is_centre(), counts, sum);
          if (!scatter(leg, hit, normal, material, numbers)) return;
        }
      } else if (std::isfinite(to_face)) {
        absorb(leg, to_face);
        leg.origin += to_face * leg.direction;
        meet_face(leg, up, branches, numbers, sum);
      } else {
        sum += leg.throughput * scene_.environment;
        return;
      }
      if (leg.smooth > kMostSmoothEvents) {
        sum += leg.throughput * scene_.environment;
        return;
      }
    }
  }

  const PreparedScene<N>& scene_;
  int max_depth_;
  bool interreflection_;
  bool dark_;  // no light from the surroundings
};

}  // namespace touchstone::render
