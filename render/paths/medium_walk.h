#pragma once
// A path's walk from particle to particle of a scattering medium (scattering.h, deep_walk.h).

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "render/lamps/prepared_scene.h"
#include "render/materials/deep_walk.h"
#include "render/materials/scattering.h"
#include "render/paths/path_leg.h"
#include "render/sampling/sample_sequence.h"
#include "render/sampling/warps.h"

namespace touchstone::render {

/// Free flights and scatterings in the media of one scene; its functions change the leg that they are given.
template <int N>
class MediumWalk {
 public:
  /// The path's present leg.
  using Leg = PathLeg<N>;

  explicit MediumWalk(const PreparedScene<N>& scene) : scene_(scene) {}

  /// How far the leg flies before it would meet a particle of its medium.
  [[gnu::noinline]] Flight<N> fly(const Leg& leg, SampleSequence& numbers) const {
    const auto [u, v] = numbers.next_pair();
    return sample_flight<N>(scene_.media[leg.medium].extinction, leg.throughput, u, v);
  }

  /// The leg, at the particle that it has met, goes on in a new direction. False where the path ends.
  bool go_on(Leg& leg, SampleSequence& numbers) const {
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
        const double kept = share_of_walks_kept(leg.scatterings);
        if (!(numbers.next() < kept)) return false;
        leg.throughput /= kept;
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

 private:
  /// Sets a leg that has just met a particle far from everything onto a sphere round it (deep_walk.h). False where
  /// there is no free space.
  [[gnu::noinline]] bool jump(Leg& leg, SampleSequence& numbers) const {
    const DeepWalk<N>& walk = scene_.media[leg.medium].deep;
    // Light that isn't even after a scattering stands for a place further on. Bands take their mean one: paths along
    // which walks come are even this deep, so what is left is of second order.
    const Eigen::Vector3d centre =
        leg.origin + (leg.throughput * walk.drift).sum() / leg.throughput.sum() * leg.direction;
    double clearance = 1e6;
    const int face_count = static_cast<int>(scene_.faces.size());
    if (leg.layer < face_count) clearance = std::min(clearance, scene_.faces[leg.layer].z - centre.z());
    if (leg.layer > 0) clearance = std::min(clearance, centre.z() - scene_.faces[leg.layer - 1].z);
    for (const PreparedLamp<N>& lamp : scene_.lamps) {
      const double extent = std::max(lamp.radius, std::hypot(lamp.half_width, lamp.half_height));
      clearance = std::min(clearance, (lamp.position - centre).norm() - extent);
    }
    if (clearance < 2.0 * walk.margin) return false;
    const double radius = scene_.rays.clearance(centre, clearance) - walk.margin;
    if (radius < walk.margin) return false;
    const auto [a, b] = numbers.next_pair();
    leg.origin = centre + radius * square_to_sphere(a, b);
    leg.throughput *= share_left(walk, radius);
    const auto [c, d] = numbers.next_pair();
    leg.direction = square_to_sphere(c, d);
    return true;
  }

  const PreparedScene<N>& scene_;
};

}  // namespace touchstone::render
