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
#include "render/rough_dielectric.h"
#include "render/sample_sequence.h"
#include "render/scattering.h"
#include "render/thin_film.h"
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
  /// `lens_scale`: lamps' lenses are taken that many times as wide as they are, for finding the rims of shadows.
  PathIntegrator(const PreparedScene<N>& scene, int max_depth, bool interreflection, double lens_scale = 1.0)
      : scene_(scene),
        lens_scale_(lens_scale),
        max_depth_(max_depth),
        interreflection_(interreflection),
        dark_((scene.environment == 0.0).all()) {}

  /// Basic radiance that arrives at `origin` against `direction` (unit).
  Bands<N> trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SampleSequence& numbers,
                 RayCounts& counts) const {
    Bands<N> sum = Bands<N>::Zero();
    Branches branches;
    const int layer = scene_.layer_at(origin.z());
    branches.legs[branches.count++] = {
        origin, direction, Bands<N>::Ones(), 0.5, layer, scene_.medium_of_layer(layer), 0, 0, 0};
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
    int smooth;  // mirror reflections and crossings of faces, Refractive surfaces and films since the last scattering
    std::int64_t scatterings;  // in media so far

    bool is_first_sight() const { return depth == 0 && scatterings == 0; }
  };

  /// Which lamp lights a hit, and which point of its lens.
  struct LampNumbers {
    double lamp;
    std::array<double, 2> lens;
  };
  LampNumbers lamp_numbers(SampleSequence& numbers) const {
    const double lamp = numbers.next();
    const auto [u, v] = numbers.next_pair();
    // Numbers beyond [0, 1) lie beside the lens: square_to_disc goes on as it is.
    return {lamp, {0.5 + lens_scale_ * (u - 0.5), 0.5 + lens_scale_ * (v - 0.5)}};
  }

  struct LampChoice {
    int lamp;
    double probability;
  };

  /// A lamp with a probability in proportion to what it would send without shadow, Fresnel's loss or lobe: by its
  /// power, distance and, for a matt surface, the cosine after refraction as if all of the way were in the lamp's
  /// medium. No lamp that shines is left without a chance.
  LampChoice choose_lamp(const Receiver& receiver, bool is_matt, double number) const {
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
      if (is_matt) {
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
    if (medium.weakens) leg.throughput *= (-medium.absorption * distance).exp();
  }

  /// The way to the leg's end was free.
  void pass(Leg& leg, const Flight<N>* flight, double distance) const {
    if (flight == nullptr) [[likely]] {
      absorb(leg, distance);
    } else {
      leg.throughput *= weight_of_passing(scene_.media[leg.medium].extinction, *flight, distance);
    }
  }

  /// Has the leg nothing before it but the surroundings?
  bool leaves(const Leg& leg) const {
    const bool up = leg.direction.z() > 0.0;
    if (up ? leg.layer < static_cast<int>(scene_.faces.size()) : leg.layer > 0) return false;
    if (scene_.media[leg.medium].scatters) return false;
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
    if (!leg.is_first_sight() || branches.count == kMostBranches || reflectance >= 1.0) {
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

  /// The leg ends on a film: it goes on straight, and where the film mirrors one of two ways as in part().
  [[gnu::noinline]] void meet_film(Leg& leg, const RayHit& hit, const PreparedMaterial<N>& material, Branches& branches,
                                   SampleSequence& numbers) const {
    ++leg.smooth;
    const double along = leg.direction.dot(hit.normal);
    const Eigen::Vector3d facing = along < 0.0 ? hit.normal : Eigen::Vector3d(-hit.normal);
    const FilmLight<N> light = film_light<N>(material.colour, material.film_index, material.film_mirrors,
                                             scene_.media[leg.medium].index, std::abs(along));
    const double leave = RayScene::leave_distance(hit.position);
    Leg mirrored = leg;
    leg.origin = hit.position - leave * facing;
    leg.throughput *= light.passed;
    if (!material.film_mirrors) return;

    leg.s_share = mirrored.s_share = 0.5;
    mirrored.origin = hit.position + leave * facing;
    mirrored.direction = (leg.direction + 2.0 * std::abs(along) * facing).normalized();
    mirrored.throughput *= light.reflected;
    const double on = leg.throughput.sum();
    const double back = mirrored.throughput.sum();
    if (!(on + back > 0.0)) return;
    if (!leg.is_first_sight() || branches.count == kMostBranches) {
      const double chance = back / (on + back);
      const bool turns = numbers.next() < chance;
      if (turns) leg = mirrored;
      leg.throughput /= turns ? chance : 1.0 - chance;
      return;
    }
    Leg weaker = on < back ? leg : mirrored;
    if (on < back) leg = mirrored;
    const double chance = std::min(1.0, weaker.throughput.maxCoeff() / kFaintest);
    if (!(numbers.next() < chance)) return;
    weaker.throughput /= chance;
    branches.legs[branches.count++] = weaker;
  }

  /// The leg ends on a RoughRefractive surface: lamp light from both sides, then one way on. False where the path ends.
  [[gnu::noinline]] bool meet_rough_boundary(Leg& leg, const RayHit& hit, const PreparedMaterial<N>& material,
                                             const LampNumbers& at_first_hit, Branches& branches,
                                             SampleSequence& numbers, RayCounts& counts, Bands<N>& sum) const {
    const bool entering = leg.direction.dot(hit.normal) < 0.0;
    const int to = entering ? material.inside : material.outside;
    const double n_out = scene_.media[entering ? material.outside : material.inside].index;
    if (n_out == scene_.media[to].index) {
      meet_boundary(leg, hit, material, branches, numbers, sum);
      return true;
    }
    const Eigen::Vector3d normal = entering ? hit.normal : Eigen::Vector3d(-hit.normal);
    const NormalFrame frame(normal);
    const Eigen::Vector3d out = frame.to_local(-leg.direction);
    const RoughBoundary& boundary = scene_.boundaries[material.boundary];
    const LampNumbers chosen = leg.is_first_sight() ? at_first_hit : lamp_numbers(numbers);
    for (int side = 0; side < 2 && !scene_.lamps.empty(); ++side) {
      const Receiver receiver{hit.position, side == 0 ? normal : Eigen::Vector3d(-normal), leg.layer,
                              side == 0 ? leg.medium : to};
      // A preview has one sample and takes all lamps.
      const int lamp_count = static_cast<int>(scene_.lamps.size());
      const LampChoice choice = numbers.is_centre() ? LampChoice{0, 1.0} : choose_lamp(receiver, false, chosen.lamp);
      const int last = numbers.is_centre() ? lamp_count : choice.lamp + 1;
      for (int i = choice.lamp; i < last; ++i) {
        const PreparedLamp<N>& lamp = scene_.lamps[i];
        Arrival<N> arrival;
        if (!reach_lamp(leg, lamp, chosen, receiver, counts, arrival)) continue;
        const Eigen::Vector3d in = frame.to_local(arrival.direction);
        sum += leg.throughput * arrival.irradiance *
               (boundary(out, in, !entering) * std::abs(in.z()) / (choice.probability * n_out * n_out));
      }
    }

    if (!interreflection_ || leg.depth >= max_depth_) return false;
    const auto in = boundary.sample(out, !entering, numbers);
    if (!in || std::abs(in->z()) <= 1e-9 || !survives(leg, numbers)) return false;
    const bool passes = in->z() < 0.0;
    leg.direction = frame.to_world(*in).normalized();
    const double leave = RayScene::leave_distance(hit.position);
    leg.origin = hit.position + (passes ? -leave : leave) * normal;
    if (passes) leg.medium = to;
    leg.s_share = 0.5;
    return leg.throughput.maxCoeff() > 0.0;
  }

  /// Counts a reflection and lets chance end paths that carry little (Russian roulette).
  bool survives(Leg& leg, SampleSequence& numbers) const {
    ++leg.depth;
    if (leg.depth >= kRouletteFrom) {
      const double survival = std::min(1.0, leg.throughput.maxCoeff());
      if (!(numbers.next() < survival)) return false;
      leg.throughput /= survival;
    }
    return true;
  }

  /// What the surface's own colour is at a hit.
  const Bands<N>& colour_at(const PreparedMaterial<N>& material, const RayHit& hit) const {
    return material.print < 0 ? material.colour : scene_.prints[material.print].colour(hit, material.colour);
  }

  /// Lamp light that a particle of the medium at the leg's origin sends against the leg's direction.
  void add_lamp_light_of_particle(const Leg& leg, const LampNumbers& chosen, RayCounts& counts, Bands<N>& sum) const {
    if (scene_.lamps.empty()) return;
    const PreparedMedium<N>& medium = scene_.media[leg.medium];
    const Receiver receiver{leg.origin, Eigen::Vector3d::Zero(), leg.layer, leg.medium};
    const LampChoice choice = choose_lamp(receiver, false, chosen.lamp);
    const PreparedLamp<N>& lamp = scene_.lamps[choice.lamp];
    Arrival<N> arrival;
    if (!reach_lamp(leg, lamp, chosen, receiver, counts, arrival)) return;
    const double phase = henyey_greenstein(arrival.direction.dot(leg.direction), medium.anisotropy);
    sum += leg.throughput * arrival.irradiance * (phase / (choice.probability * medium.index * medium.index));
  }

  static Eigen::Vector3d point_of_lens(const PreparedLamp<N>& lamp, const LampNumbers& chosen) {
    Eigen::Vector3d source = lamp.lamp.position;
    if (lamp.lamp.lens_radius > 0.0) {
      const auto [u, v] = chosen.lens;
      const Eigen::Vector2d disc = lamp.lamp.lens_radius * square_to_disc(u, v);
      source += disc.x() * lamp.frame.x + disc.y() * lamp.frame.y;
    }
    return source;
  }

  /// Light of one lamp at what the leg has met.
  bool reach_lamp(const Leg& leg, const PreparedLamp<N>& lamp, const LampNumbers& chosen, const Receiver& receiver,
                  RayCounts& counts, Arrival<N>& arrival) const {
    const std::uint64_t before = counts.connections;
    const bool lit = connect_to_lamp(scene_, lamp, point_of_lens(lamp, chosen), receiver, counts.connections, arrival);
    if (leg.is_first_sight()) {
      counts.direct += counts.connections - before;
      counts.direct_lit += lit ? 1 : 0;
    }
    return lit;
  }

  /// Lamp light that the surface sends along the leg, out of its side `normal`: the side that faces the leg, or the
  /// other one of a diffuse transmitter.
  void add_lamp_light(const Leg& leg, const RayHit& hit, const Eigen::Vector3d& normal,
                      const PreparedMaterial<N>& material, const Bands<N>& surface_colour, const LampNumbers& chosen,
                      bool all_lamps, RayCounts& counts, Bands<N>& sum) const {
    const auto lamp_count = static_cast<int>(scene_.lamps.size());
    if (lamp_count == 0) return;
    const double index = scene_.media[leg.medium].index;
    const bool is_matt = material.kind != SurfaceKind::kConductor;
    const Receiver receiver{hit.position, normal, leg.layer, leg.medium};
    // One lamp a hit. A preview has just one sample and takes them all.
    const LampChoice choice = all_lamps ? LampChoice{0, 1.0} : choose_lamp(receiver, is_matt, chosen.lamp);
    const int first = choice.lamp;
    const int last = all_lamps ? lamp_count : first + 1;
    const double weight = 1.0 / (choice.probability * index * index);
    for (int i = first; i < last; ++i) {
      const PreparedLamp<N>& lamp = scene_.lamps[i];
      Arrival<N> arrival;
      if (!reach_lamp(leg, lamp, chosen, receiver, counts, arrival)) continue;
      const double cosine = arrival.direction.dot(normal);
      if (is_matt) {
        sum += leg.throughput * surface_colour * arrival.irradiance * (weight * cosine / kPi);
      } else {
        const NormalFrame frame(normal);
        const Eigen::Vector3d out = frame.to_local(-leg.direction);
        const Eigen::Vector3d in = frame.to_local(arrival.direction);
        const double schlick = schlick_weight((out + in).normalized().dot(out));
        const Bands<N> colour = (surface_colour + (1.0 - surface_colour) * schlick) *
                                (1.0 + surface_colour * material.single_albedo.missing_ratio(out.z()));
        sum += leg.throughput * colour * arrival.irradiance *
               (weight * cosine * ggx_reflection(out, in, material.roughness));
      }
    }
  }

  /// Turns the leg into the next one after a diffuse or metallic reflection or a diffuse transmission. False where the
  /// path ends.
  bool scatter(Leg& leg, const RayHit& hit, const Eigen::Vector3d& facing, const PreparedMaterial<N>& material,
               const Bands<N>& surface_colour, SampleSequence& numbers) const {
    if (!interreflection_ || leg.depth >= max_depth_) return false;
    Eigen::Vector3d normal = facing;
    Bands<N> colour = surface_colour;
    if (material.kind == SurfaceKind::kTransmitter) {
      const double back = (leg.throughput * surface_colour).sum();
      const double through = (leg.throughput * material.passed).sum();
      if (!(back + through > 0.0)) return false;
      const double chance = back / (back + through);
      if (numbers.next() < chance) {
        colour /= chance;
      } else {
        colour = material.passed / (1.0 - chance);
        normal = -facing;
      }
    }
    const NormalFrame frame(normal);
    const auto [u, v] = numbers.next_pair();
    Eigen::Vector3d in;
    if (material.kind != SurfaceKind::kConductor) {
      in = square_to_cosine_hemisphere(u, v);
      leg.throughput *= colour;
    } else {
      const Eigen::Vector3d out = frame.to_local(-leg.direction);
      if (out.z() <= 0.0) return false;
      const Eigen::Vector3d facet = sample_visible_normal(out, material.roughness, u, v);
      in = 2.0 * out.dot(facet) * facet - out;
      if (in.z() <= 0.0) return false;
      const double kept =
          ggx_masking_shadowing(in.z(), out.z(), material.roughness) / ggx_masking(out.z(), material.roughness);
      leg.throughput *= (colour + (1.0 - colour) * schlick_weight(out.dot(facet))) *
                        (kept * (1.0 + colour * material.single_albedo.missing_ratio(out.z())));
    }
    if (in.z() <= 1e-9 || !survives(leg, numbers)) return false;
    leg.direction = frame.to_world(in).normalized();
    leg.origin = hit.position + RayScene::leave_distance(hit.position) * normal;
    leg.s_share = 0.5;
    return leg.throughput.maxCoeff() > 0.0;
  }

  [[gnu::noinline]] Flight<N> fly(const Leg& leg, SampleSequence& numbers) const {
    const auto [u, v] = numbers.next_pair();
    return sample_flight<N>(scene_.media[leg.medium].extinction, leg.throughput, u, v);
  }

  /// The leg ends at a particle of its medium, at its origin. Goes on in a new direction; false where the path ends.
  [[gnu::noinline]] bool scatter_in_medium(Leg& leg, const LampNumbers& chosen, SampleSequence& numbers,
                                           RayCounts& counts, Bands<N>& sum) const {
    if (!(leg.throughput.maxCoeff() > 0.0)) return false;
    add_lamp_light_of_particle(leg, chosen, counts, sum);
    if (!interreflection_) return false;
    ++leg.scatterings;
    leg.smooth = 0;
    leg.s_share = 0.5;
    if (leg.scatterings >= kRouletteFrom) {
      const double survival = std::min(1.0, leg.throughput.maxCoeff());
      if (survival < 1.0) {
        if (!(numbers.next() < survival)) return false;
        leg.throughput /= survival;
      }
      if (roulette_is_due(leg.scatterings)) {
        if (numbers.next() < 0.5) return false;
        leg.throughput *= 2.0;
      }
    }
    if (leg.scatterings % kJumpEvery == 0 && std::isfinite(scene_.media[leg.medium].deep.margin) &&
        jump(leg, numbers)) {
      return leg.throughput.maxCoeff() > 0.0;
    }
    const auto [u, v] = numbers.next_pair();
    const double cosine = sample_henyey_greenstein(scene_.media[leg.medium].anisotropy, u);
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const double angle = 2.0 * kPi * v;
    const NormalFrame frame(leg.direction);
    leg.direction =
        frame.to_world(Eigen::Vector3d(sine * std::cos(angle), sine * std::sin(angle), cosine)).normalized();
    return true;
  }

  /// Sets a leg that has just met a particle far from everything onto a sphere round it (deep_walk.h). False where
  /// there is no room.
  [[gnu::noinline]] bool jump(Leg& leg, SampleSequence& numbers) const {
    const DeepWalk<N>& walk = scene_.media[leg.medium].deep;
    // Light that isn't even after a scattering stands for a place further on. Bands take their mean one: ways along
    // which walks come are even this deep, so what is left is of second order.
    const Eigen::Vector3d centre =
        leg.origin + (leg.throughput * walk.drift).sum() / leg.throughput.sum() * leg.direction;
    double room = 1e6;
    const int face_count = static_cast<int>(scene_.faces.size());
    if (leg.layer < face_count) room = std::min(room, scene_.faces[leg.layer].z - centre.z());
    if (leg.layer > 0) room = std::min(room, centre.z() - scene_.faces[leg.layer - 1].z);
    for (const PreparedLamp<N>& lamp : scene_.lamps) {
      room = std::min(room, (lamp.lamp.position - centre).norm() - lamp.lamp.lens_radius);
    }
    if (room < 2.0 * walk.margin) return false;
    const double radius = scene_.rays.clearance(centre, room) - walk.margin;
    if (radius < walk.margin) return false;
    const auto [a, b] = numbers.next_pair();
    leg.origin = centre + radius * square_to_sphere(a, b);
    leg.throughput *= share_left(walk, radius);
    const auto [c, d] = numbers.next_pair();
    leg.direction = square_to_sphere(c, d);
    return true;
  }

  void follow(Leg& leg, Branches& branches, const LampNumbers& at_first_hit, SampleSequence& numbers, RayCounts& counts,
              Bands<N>& sum) const {
    const int face_count = static_cast<int>(scene_.faces.size());
    for (;;) {
      ++(leg.is_first_sight() ? counts.primary : counts.bounces);
      const bool up = leg.direction.z() > 0.0;
      double to_face = std::numeric_limits<double>::infinity();
      if (leg.direction.z() != 0.0 && (up ? leg.layer < face_count : leg.layer > 0)) {
        const double face_z = scene_.faces[up ? leg.layer : leg.layer - 1].z;
        to_face = std::max(0.0, (face_z - leg.origin.z()) / leg.direction.z());
      }
      Flight<N> drawn;  // uninitialised unless the medium scatters
      const Flight<N>* flight = nullptr;
      double most = to_face;
      if (scene_.media[leg.medium].scatters && !numbers.is_centre()) [[unlikely]] {
        drawn = fly(leg, numbers);
        flight = &drawn;
        most = std::min(most, drawn.distance);
      }
      RayHit hit;
      if (scene_.rays.intersect(leg.origin, leg.direction, most, hit)) {
        pass(leg, flight, hit.distance);
        const PreparedMaterial<N>& material = scene_.materials[hit.object];
        if (material.kind == SurfaceKind::kBlack) return;
        if (material.kind == SurfaceKind::kEmitter) {
          sum += leg.throughput * material.colour;
          return;
        }
        if (material.kind == SurfaceKind::kRefractive) {
          meet_boundary(leg, hit, material, branches, numbers, sum);
        } else if (material.kind == SurfaceKind::kRoughRefractive) {
          if (!meet_rough_boundary(leg, hit, material, at_first_hit, branches, numbers, counts, sum)) return;
        } else if (material.kind == SurfaceKind::kFilm) {
          meet_film(leg, hit, material, branches, numbers);
          if (!(leg.throughput.maxCoeff() > 0.0)) return;
        } else {
          const Eigen::Vector3d normal =
              leg.direction.dot(hit.normal) < 0.0 ? hit.normal : Eigen::Vector3d(-hit.normal);
          const Bands<N>& colour = colour_at(material, hit);
          const LampNumbers chosen = leg.is_first_sight() ? at_first_hit : lamp_numbers(numbers);
          const int sides = material.kind == SurfaceKind::kTransmitter ? 2 : 1;
          for (int side = 0; side < sides; ++side) {  // one call, so that the compiler inlines it
            add_lamp_light(leg, hit, side == 0 ? normal : Eigen::Vector3d(-normal), material,
                           side == 0 ? colour : material.passed, chosen, numbers.is_centre(), counts, sum);
          }
          if (!scatter(leg, hit, normal, material, colour, numbers)) return;
        }
      } else if (most < to_face) {
        const PreparedMedium<N>& medium = scene_.media[leg.medium];
        leg.origin += most * leg.direction;
        leg.throughput *= weight_of_scattering<N>(medium.extinction, medium.scattering, *flight);
        const LampNumbers chosen = leg.is_first_sight() ? at_first_hit : lamp_numbers(numbers);
        if (!scatter_in_medium(leg, chosen, numbers, counts, sum)) return;
      } else if (std::isfinite(to_face)) {
        pass(leg, flight, to_face);
        leg.origin += to_face * leg.direction;
        meet_face(leg, up, branches, numbers, sum);
      } else {
        if (flight != nullptr) [[unlikely]]
          pass(leg, flight, to_face);
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
  double lens_scale_;
  int max_depth_;
  bool interreflection_;
  bool dark_;  // no light from the surroundings
};

}  // namespace touchstone::render
