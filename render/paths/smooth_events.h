#pragma once
// What happens to a path at smooth boundaries: flat faces, Refractive surfaces, thin films.
//
// Before the first diffuse or metallic hit a ray that meets a smooth boundary follows both branches, weighted by
// Fresnel's reflectance, so that mirror images in the glass add no noise; a branch weaker than kFaintest is followed
// now and then with that weight (Russian roulette). After that hit a random number chooses one branch.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "render/lamps/prepared_scene.h"
#include "render/materials/fresnel.h"
#include "render/materials/thin_film.h"
#include "render/paths/path_leg.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {

/// What flat faces, Refractive surfaces and films of one scene make of a leg.
template <int N>
class SmoothEvents {
 public:
  /// The path's present leg.
  using Leg = PathLeg<N>;
  /// The legs that are followed later.
  using Branches = PathBranches<N>;

  explicit SmoothEvents(const PreparedScene<N>& scene) : scene_(scene), dark_((scene.environment == 0.0).all()) {}

  /// The leg, at the flat face above (`up`) or below its layer, goes on. A branch that the surroundings end at once
  /// adds to `sum`, others to `branches`; so for the functions below.
  void meet_face(Leg& leg, bool up, Branches& branches, SampleSequence& numbers, Bands<N>& sum) const {
    const int index = up ? leg.layer : leg.layer - 1;
    const FlatFace& face = scene_.faces[index];
    leg.origin.z() = face.z;
    const int to = up ? face.medium_above : face.medium_below;
    const double n_from = scene_.media[leg.medium].index;
    const double n_to = scene_.media[to].index;
    if (n_from == n_to) {
      leg.medium = to;
      leg.layer += up ? 1 : -1;
      return;
    }
    ++leg.smooth;
    const FresnelFace light = fresnel(n_from, n_to, std::abs(leg.direction.z()));
    const auto mirror = [](Leg& turned) { turned.direction.z() = -turned.direction.z(); };
    const auto refract = [&](Leg& passed) {
      const double eta = n_from / n_to;  // keeps the direction's length at one, as Snell's law gives the cosine
      passed.direction = {eta * passed.direction.x(), eta * passed.direction.y(),
                          up ? light.cos_refracted : -light.cos_refracted};
      passed.medium = to;
      passed.layer += up ? 1 : -1;
    };
    part(leg, light.reflectance_s, light.reflectance_p, mirror, refract, branches, numbers, sum);
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
    if (n_from == n_to) {
      leg.origin = hit.position - leave * facing;
      leg.medium = to;
      return;
    }
    Eigen::Vector3d normal = entering ? hit.shading_normal : Eigen::Vector3d(-hit.shading_normal);
    if (-leg.direction.dot(normal) <= 1e-6) normal = facing;
    double cosine = -leg.direction.dot(normal);
    Eigen::Vector3d reflected = leg.direction + 2.0 * cosine * normal;
    if (reflected.dot(facing) <= 0.0) {  // the interpolated normal would mirror light through the surface
      normal = facing;
      cosine = -leg.direction.dot(normal);
      reflected = leg.direction + 2.0 * cosine * normal;
    }
    const FresnelFace light = fresnel(n_from, n_to, cosine);
    // A curved surface has another plane of incidence than the flat faces: unpolarised from here.
    leg.s_share = 0.5;
    const double mean = light.mean_reflectance();
    const auto mirror = [&](Leg& turned) {
      turned.origin = hit.position + leave * facing;
      turned.direction = reflected.normalized();
    };
    const auto refract = [&](Leg& passed) {
      const double eta = n_from / n_to;
      Eigen::Vector3d bent = eta * passed.direction + (eta * cosine - light.cos_refracted) * normal;
      if (bent.dot(facing) >= 0.0) bent -= (bent.dot(facing) + 1e-6) * facing;
      passed.origin = hit.position - leave * facing;
      passed.direction = bent.normalized();
      passed.medium = to;
    };
    part(leg, mean, mean, mirror, refract, branches, numbers, sum);
  }

  /// The leg ends on a film: it goes on straight, and where the film mirrors follows one of two branches or both.
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
    if (!(back > 0.0)) return;  // a film of the medium's own index draws no number
    if (!leg.is_first_sight() || branches.is_full()) {
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
    branches.next_free() = weaker;
    ++branches.count;
  }

  /// Is the surroundings all that lies before the leg?
  bool leaves(const Leg& leg) const {
    const bool up = leg.direction.z() > 0.0;
    if (up ? leg.layer < static_cast<int>(scene_.faces.size()) : leg.layer > 0) return false;
    if (scene_.media[leg.medium].scatters || !scene_.lamp_bodies.empty()) return false;
    return scene_.rays.nothing_beyond(leg.origin.z(), up);
  }

 private:
  static constexpr double kFaintest = 0.01;

  /// Goes on at a smooth boundary with one of two branches, and before the first diffuse hit with the other one as
  /// well. `mirror` and `refract` turn the leg into either.
  template <typename Mirror, typename Refract>
  void part(Leg& leg, double reflectance_s, double reflectance_p, const Mirror& mirror, const Refract& refract,
            Branches& branches, SampleSequence& numbers, Bands<N>& sum) const {
    const double s = leg.s_share;
    const double reflectance = s * reflectance_s + (1.0 - s) * reflectance_p;
    const double transmittance = 1.0 - reflectance;
    const auto take = [&](Leg& branch, bool mirrored) {
      const double whole = mirrored ? reflectance : transmittance;
      const double of_s = s * (mirrored ? reflectance_s : 1.0 - reflectance_s);
      branch.s_share = whole > 0.0 ? of_s / whole : 0.5;
      if (mirrored) {
        mirror(branch);
      } else {
        refract(branch);
      }
    };
    if (reflectance >= 1.0) return take(leg, true);
    if (!leg.is_first_sight() || branches.is_full()) return take(leg, numbers.next() < reflectance);

    const bool mirror_is_weaker = reflectance < 0.5;
    const double weak = std::min(reflectance, transmittance);
    Leg& weaker = branches.next_free();
    weaker = leg;
    take(weaker, mirror_is_weaker);
    take(leg, !mirror_is_weaker);
    const double strength = weak * weaker.throughput.maxCoeff();
    leg.throughput *= 1.0 - weak;
    if (dark_ && leaves(weaker)) return;
    const double chance = std::min(1.0, strength / kFaintest);
    if (chance < 1.0 && !(numbers.next() < chance)) return;
    weaker.throughput *= weak / chance;
    if (leaves(weaker)) {
      sum += weaker.throughput * scene_.environment;
    } else {
      ++branches.count;
    }
  }

  const PreparedScene<N>& scene_;
  bool dark_;  // no light from the surroundings
};

}  // namespace touchstone::render
