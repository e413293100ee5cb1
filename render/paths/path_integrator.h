#pragma once
// One path: from the camera through faces and surfaces to the lamps and the surroundings.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "render/lamps/guide_connection.h"
#include "render/lamps/lamp_sharing.h"
#include "render/lamps/prepared_scene.h"
#include "render/materials/ggx.h"
#include "render/materials/rough_dielectric.h"
#include "render/materials/scattering.h"
#include "render/paths/medium_walk.h"
#include "render/paths/path_leg.h"
#include "render/paths/path_tracer.h"
#include "render/paths/smooth_events.h"
#include "render/sampling/sample_sequence.h"
#include "render/sampling/warps.h"

namespace touchstone::render {

/// Follows paths through a PreparedScene. Radiances here are basic radiances, L / n^2.
template <int N>
class PathIntegrator {
 public:
  /// `lens_scale`: lamps' lenses are taken that many times as wide as they are, for finding the rims of shadows.
  PathIntegrator(const PreparedScene<N>& scene, int max_depth, bool interreflection, double lens_scale = 1.0)
      : scene_(scene),
        lens_scale_(lens_scale),
        max_depth_(max_depth),
        interreflection_(interreflection),
        smooth_(scene),
        walk_(scene),
        lamps_are_seen_(!scene.lamp_bodies.empty()) {}

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
  static constexpr int kMostSmoothEvents = 64;
  static constexpr int kGuidePreview = 6;

  using Leg = PathLeg<N>;
  using Branches = PathBranches<N>;

  /// Which lamp lights a hit, and which point of its lens.
  struct LampNumbers {
    double lamp;
    std::array<double, 2> lens;
  };
  LampNumbers lamp_numbers(SampleSequence& numbers) const {
    const double lamp = numbers.next();
    const auto [u, v] = numbers.next_pair();
    // Numbers beyond [0, 1) lie beside the lamp: point_on_lamp goes on as it is. A guide's are of directions.
    return {lamp, {0.5 + lens_scale_ * (u - 0.5), 0.5 + lens_scale_ * (v - 0.5)}};
  }

  /// One lamp of the scene for a receiver, see LampChooser.
  LampChoice choose_lamp(const Receiver& receiver, bool is_matt, double number) const {
    return scene_.lamp_chooser.choose(receiver.position, is_matt ? &receiver.normal : nullptr,
                                      scene_.media[receiver.medium].index, number);
  }

  /// The probability with which choose_lamp takes a lamp.
  double chance_of_lamp(const Receiver& receiver, bool is_matt, int lamp) const {
    return scene_.lamp_chooser.chance_of(lamp, receiver.position, is_matt ? &receiver.normal : nullptr,
                                         scene_.media[receiver.medium].index);
  }

  void absorb(Leg& leg, double distance) const {
    const auto& medium = scene_.media[leg.medium];
    if (medium.weakens) leg.throughput *= (-medium.absorption * distance).exp();
  }

  /// The path to the leg's end was free.
  void pass(Leg& leg, const Flight<N>* flight, double distance) const {
    if (flight == nullptr) [[likely]] {
      absorb(leg, distance);
    } else {
      leg.throughput *= weight_of_passing(scene_.media[leg.medium].extinction, *flight, distance);
    }
  }

  /// The leg ends on a RoughRefractive surface: lamp light from both sides, then one branch is followed. False where
  /// the path ends.
  [[gnu::noinline]] bool meet_rough_boundary(Leg& leg, const RayHit& hit, const PreparedMaterial<N>& material,
                                             const LampNumbers& at_first_hit, Branches& branches,
                                             SampleSequence& numbers, RayCounts& counts, Bands<N>& sum) const {
    const bool entering = leg.direction.dot(hit.normal) < 0.0;
    const int to = entering ? material.inside : material.outside;
    const double n_out = scene_.media[entering ? material.outside : material.inside].index;
    if (n_out == scene_.media[to].index) {
      smooth_.meet_boundary(leg, hit, material, branches, numbers, sum);
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
        if (!reach_lamp(leg, lamp, chosen.lens, receiver, counts, arrival)) continue;
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

  /// The shading normal on the side that the leg comes from; the triangle's own where a smooth one has turned away.
  static Eigen::Vector3d facing_normal(const Leg& leg, const RayHit& hit) {
    const double side = leg.direction.dot(hit.normal) < 0.0 ? 1.0 : -1.0;
    const bool turned_away = side * leg.direction.dot(hit.shading_normal) >= 0.0;
    return side * (turned_away ? hit.normal : hit.shading_normal);
  }

  /// What the surface's own colour is at a hit.
  Bands<N> colour_at(const PreparedMaterial<N>& material, const RayHit& hit) const {
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
    if (!reach_lamp(leg, lamp, chosen.lens, receiver, counts, arrival)) return;
    if (lamp.visible && interreflection_) {
      share_with_paths(scene_, lamp, choice, receiver,
                       henyey_greenstein(arrival.direction.dot(leg.direction), medium.anisotropy), arrival);
    }
    const double phase = henyey_greenstein(arrival.direction.dot(leg.direction), medium.anisotropy);
    sum += leg.throughput * arrival.irradiance * (phase / (choice.probability * medium.index * medium.index));
  }

  /// Density per sr of the directions that scatter() draws for a leg at its end. `normal` is the surface's, on either
  /// side.
  double scattering_density(const Leg& leg, const Eigen::Vector3d& normal, const PreparedMaterial<N>& material,
                            const Eigen::Vector3d& in) const {
    const double side = leg.direction.dot(normal) < 0.0 ? 1.0 : -1.0;
    const double cosine = side * in.dot(normal);
    if (material.kind == SurfaceKind::kConductor) {
      const NormalFrame frame(side * normal);
      return visible_reflection_density(frame.to_local(-leg.direction), frame.to_local(in), material.roughness);
    }
    if (material.kind == SurfaceKind::kTransmitter) {
      const double back = (leg.throughput * material.colour).sum();
      const double through = (leg.throughput * material.passed).sum();
      if (!(back + through > 0.0)) return 0.0;
      return std::abs(cosine) / kPi * (cosine > 0.0 ? back : through) / (back + through);
    }
    return std::max(0.0, cosine) / kPi;
  }

  /// The leg runs into a lamp.
  [[gnu::noinline]] void add_lamp_seen(const Leg& leg, const LampBodies::Hit& seen, const Departure& departure,
                                       Bands<N>& sum) const {
    const PreparedLamp<N>& lamp = scene_.lamps[seen.lamp];
    if (!(leg.direction.dot(lamp.frame.z) < 0.0)) return;  // its back
    const Eigen::Vector3d point = leg.origin + seen.distance * leg.direction;
    double weight = 1.0;
    if (departure.sharing != Departure::Sharing::kAllToPath) {
      if (departure.sharing == Departure::Sharing::kAllToConnection ||
          bends_at_surface(scene_, lamp, point, departure.from)) {
        return;
      }
      const double of_connection = chance_of_lamp(departure.from, departure.is_matt, seen.lamp) /
                                   (lamp.area * angle_per_lamp_area(scene_, lamp, point, departure.from));
      weight = departure.density / (departure.density + of_connection);
    }
    const double index = scene_.media[leg.medium].index;
    sum += leg.throughput * lamp_radiance(lamp, Eigen::Vector3d(-leg.direction)) * (weight / (index * index));
  }

  /// Light of one lamp at what the leg has met.
  bool reach_lamp(const Leg& leg, const PreparedLamp<N>& lamp, const std::array<double, 2>& place,
                  const Receiver& receiver, RayCounts& counts, Arrival<N>& arrival) const {
    const std::uint64_t before = counts.connections;
    const bool lit = connect(scene_, lamp, place, receiver, counts.connections, arrival);
    if (leg.is_first_sight()) {
      counts.direct += counts.connections - before;
      counts.direct_lit += lit ? 1 : 0;
    }
    return lit;
  }

  /// Lamp light that the surface sends along the leg from `position`, out of its side `normal`: the side that faces the
  /// leg, or the other one of a diffuse transmitter.
  void add_lamp_light(const Leg& leg, const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                      const PreparedMaterial<N>& material, const Bands<N>& surface_colour, const LampNumbers& chosen,
                      bool all_lamps, RayCounts& counts, Bands<N>& sum) const {
    const auto lamp_count = static_cast<int>(scene_.lamps.size());
    if (lamp_count == 0) return;
    const double index = scene_.media[leg.medium].index;
    const bool is_matt = material.kind != SurfaceKind::kConductor;
    const Receiver receiver{position, normal, leg.layer, leg.medium};
    // One lamp a hit. A preview has just one sample and takes them all, guides by several directions.
    const LampChoice choice = all_lamps ? LampChoice{0, 1.0} : choose_lamp(receiver, is_matt, chosen.lamp);
    const int first = choice.lamp;
    const int last = all_lamps ? lamp_count : first + 1;
    const double weight = 1.0 / (choice.probability * index * index);
    for (int i = first; i < last; ++i) {
      const PreparedLamp<N>& lamp = scene_.lamps[i];
      // The middle of a guide's lobe may get nowhere: its preview takes several directions.
      const int parts = all_lamps && lamp.kind == LampKind::kGuide ? kGuidePreview * kGuidePreview : 1;
      const double share = weight / parts;
      for (int part = 0; part < parts; ++part) {
        std::array<double, 2> place = chosen.lens;
        if (parts > 1)
          place = {(part % kGuidePreview + 0.5) / kGuidePreview, (part / kGuidePreview + 0.5) / kGuidePreview};
        Arrival<N> arrival;
        if (!reach_lamp(leg, lamp, place, receiver, counts, arrival)) continue;
        if (lamp.visible && interreflection_ && leg.depth < max_depth_) {
          share_with_paths(scene_, lamp, choice, receiver, scattering_density(leg, normal, material, arrival.direction),
                           arrival);
        }
        const double cosine = arrival.direction.dot(normal);
        if (is_matt) {
          sum += leg.throughput * surface_colour * arrival.irradiance * (share * cosine / kPi);
        } else {
          const NormalFrame frame(normal);
          const Eigen::Vector3d out = frame.to_local(-leg.direction);
          const Eigen::Vector3d in = frame.to_local(arrival.direction);
          const double schlick = schlick_weight((out + in).normalized().dot(out));
          const Bands<N> colour = (surface_colour + (1.0 - surface_colour) * schlick) *
                                  (1.0 + surface_colour * material.single_albedo.missing_ratio(out.z()));
          sum += leg.throughput * colour * arrival.irradiance *
                 (share * cosine * ggx_reflection(out, in, material.roughness));
        }
      }
    }
  }

  /// Turns the leg into the next one after a diffuse or metallic reflection or a diffuse transmission. False where the
  /// path ends.
  bool scatter(Leg& leg, const RayHit& hit, const Eigen::Vector3d& facing, const PreparedMaterial<N>& material,
               const Bands<N>& surface_colour, SampleSequence& numbers) const {
    if (!interreflection_ || leg.depth >= max_depth_) return false;
    Eigen::Vector3d normal = facing;
    Eigen::Vector3d place = hit.position + hit.lift;
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
        place = hit.position;
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
    leg.origin = place + RayScene::leave_distance(hit.position) * normal;
    leg.s_share = 0.5;
    return leg.throughput.maxCoeff() > 0.0;
  }

  /// The leg ends at a particle of its medium, at its origin. Goes on in a new direction; false where the path ends.
  [[gnu::noinline]] bool scatter_in_medium(Leg& leg, const LampNumbers& chosen, SampleSequence& numbers,
                                           RayCounts& counts, Bands<N>& sum) const {
    if (!(leg.throughput.maxCoeff() > 0.0)) return false;
    add_lamp_light_of_particle(leg, chosen, counts, sum);
    if (!interreflection_) return false;
    return walk_.go_on(leg, numbers);
  }

  void follow(Leg& leg, Branches& branches, const LampNumbers& at_first_hit, SampleSequence& numbers, RayCounts& counts,
              Bands<N>& sum) const {
    const int face_count = static_cast<int>(scene_.faces.size());
    Departure departure;  // this and the next are kept up only where a lamp is visible
    Leg before = leg;
    for (;;) {
      if (lamps_are_seen_) [[unlikely]]
        before = leg;
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
        if (!(leg.throughput.maxCoeff() > 0.0)) return;  // an absorber took all: no share of it can be chosen
        drawn = walk_.fly(leg, numbers);
        flight = &drawn;
        most = std::min(most, drawn.distance);
      }
      RayHit hit;
      const bool meets = scene_.rays.intersect(leg.origin, leg.direction, most, hit);
      if (lamps_are_seen_) [[unlikely]] {
        const LampBodies::Hit seen = scene_.lamp_bodies.nearest(leg.origin, leg.direction, meets ? hit.distance : most);
        if (seen.lamp >= 0) {
          pass(leg, flight, seen.distance);
          add_lamp_seen(leg, seen, departure, sum);
          return;
        }
      }
      if (meets) {
        pass(leg, flight, hit.distance);
        const PreparedMaterial<N>& material = scene_.materials[hit.object];
        if (material.kind == SurfaceKind::kBlack) return;
        if (material.kind == SurfaceKind::kEmitter) {
          sum += leg.throughput * material.colour;
          return;
        }
        if (material.kind == SurfaceKind::kRefractive) {
          smooth_.meet_boundary(leg, hit, material, branches, numbers, sum);
          if (lamps_are_seen_) note_smooth_event(departure, before.direction, leg.direction, hit.normal, true);
        } else if (material.kind == SurfaceKind::kRoughRefractive) {
          if (!meet_rough_boundary(leg, hit, material, at_first_hit, branches, numbers, counts, sum)) return;
          // Where nothing was scattered the surface still was in the way of connections.
          departure.sharing = leg.depth == before.depth || !lamps_are_seen_ ? Departure::Sharing::kAllToPath
                                                                            : Departure::Sharing::kAllToConnection;
        } else if (material.kind == SurfaceKind::kFilm) {
          smooth_.meet_film(leg, hit, material, branches, numbers);
          if (!(leg.throughput.maxCoeff() > 0.0)) return;
          if (lamps_are_seen_) note_smooth_event(departure, before.direction, leg.direction, hit.normal, false);
        } else {
          const Eigen::Vector3d normal = facing_normal(leg, hit);
          const Eigen::Vector3d lifted = hit.position + hit.lift;
          const Bands<N> colour = colour_at(material, hit);
          const LampNumbers chosen = leg.is_first_sight() ? at_first_hit : lamp_numbers(numbers);
          const int sides = material.kind == SurfaceKind::kTransmitter ? 2 : 1;
          for (int side = 0; side < sides; ++side) {  // one call, so that the compiler inlines it
            add_lamp_light(leg, side == 0 ? lifted : hit.position, side == 0 ? normal : Eigen::Vector3d(-normal),
                           material, side == 0 ? colour : material.passed, chosen, numbers.is_centre(), counts, sum);
          }
          if (lamps_are_seen_) before = leg;  // with what it carries here
          if (!scatter(leg, hit, normal, material, colour, numbers)) return;
          if (lamps_are_seen_) [[unlikely]] {
            const bool went_back = leg.direction.dot(normal) > 0.0;
            const Eigen::Vector3d lit = went_back ? normal : Eigen::Vector3d(-normal);
            departure = {Departure::Sharing::kShared,
                         {went_back ? lifted : hit.position, lit, before.layer, before.medium},
                         material.kind != SurfaceKind::kConductor,
                         scattering_density(before, normal, material, leg.direction)};
          }
        }
      } else if (most < to_face) {
        const PreparedMedium<N>& medium = scene_.media[leg.medium];
        leg.origin += most * leg.direction;
        leg.throughput *= weight_of_scattering<N>(medium.extinction, medium.scattering, *flight);
        const LampNumbers chosen = leg.is_first_sight() ? at_first_hit : lamp_numbers(numbers);
        if (!scatter_in_medium(leg, chosen, numbers, counts, sum)) return;
        if (lamps_are_seen_) [[unlikely]] {
          departure = {Departure::Sharing::kShared,
                       {leg.origin, Eigen::Vector3d::Zero(), leg.layer, leg.medium},
                       false,
                       henyey_greenstein(leg.direction.dot(before.direction), medium.anisotropy)};
        }
      } else if (std::isfinite(to_face)) {
        pass(leg, flight, to_face);
        leg.origin += to_face * leg.direction;
        smooth_.meet_face(leg, up, branches, numbers, sum);
        if (lamps_are_seen_) {
          note_smooth_event(departure, before.direction, leg.direction, Eigen::Vector3d::UnitZ(), false);
        }
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
  SmoothEvents<N> smooth_;
  MediumWalk<N> walk_;
  bool lamps_are_seen_;  // some lamp is visible
};

}  // namespace touchstone::render
