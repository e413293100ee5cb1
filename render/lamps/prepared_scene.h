#pragma once
// A scene with its number of bands known to the compiler and all that can be computed ahead computed.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "render/lamps/lamp_bodies.h"
#include "render/lamps/lamp_choice.h"
#include "render/lamps/prepared_lamp.h"
#include "render/materials/deep_walk.h"
#include "render/materials/ggx.h"
#include "render/scene/ray_scene.h"
#include "render/scene/scene.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A medium with N bands; coefficients are per mm.
template <int N>
struct PreparedMedium {
  double index;
  bool weakens;  ///< does light get less on its path?
  Bands<N> absorption;
  bool scatters;
  Bands<N> scattering;
  Bands<N> extinction;  ///< absorption + scattering
  double anisotropy;
  DeepWalk<N> deep;
};

/// The materials of Material, by number.
enum class SurfaceKind {
  kLambertian,
  kConductor,
  kBlack,
  kEmitter,
  kRefractive,
  kTransmitter,
  kFilm,
  kRoughRefractive
};

/// A material with N bands; which fields count depends on `kind`.
template <int N>
struct PreparedMaterial {
  SurfaceKind kind = SurfaceKind::kBlack;
  Bands<N> colour = Bands<N>::Zero();  ///< albedo, reflectance at normal incidence, radiance, or a film's dye
  Bands<N> passed = Bands<N>::Zero();  ///< transmittance of a diffuse transmitter
  double roughness = 0.0;
  double film_index = 1.0;
  bool film_mirrors = false;
  int print = -1;           ///< index into PreparedScene::prints
  int boundary = -1;        ///< of a RoughRefractive: index into PreparedScene::boundaries
  GgxAlbedo single_albedo;  ///< of a conductor
  int inside = 0, outside = 0;
};

/// A Print with N bands, ready to be looked up.
template <int N>
struct PreparedPrint {
  std::vector<Eigen::Vector2d> points;
  std::vector<std::array<int, 3>> triangles;
  std::vector<Bands<N>> mark_colours;
  PrintIndex index;
  std::shared_ptr<const PrintedPicture> picture;
  std::vector<int> ground;
  std::vector<Bands<N>> inks;  // of the ground
  bool inked;                  // is there anything over the ground?

  /// The ink at a hit, or `own` where there is none.
  Bands<N> colour(const RayHit& hit, const Bands<N>& own) const {
    const int under = ground.empty() ? -1 : ground[hit.triangle];
    const Bands<N>& plain = under < 0 ? own : inks[under];
    if (!inked) return plain;
    const auto& t = triangles[hit.triangle];
    const Eigen::Vector2d at =
        (1.0 - hit.weight_1 - hit.weight_2) * points[t[0]] + hit.weight_1 * points[t[1]] + hit.weight_2 * points[t[2]];
    const int mark = index.mark_at(at);
    if (mark >= 0) return mark_colours[mark];
    const float* pixel = picture ? picture->at(at) : nullptr;
    if (pixel == nullptr) return plain;
    return Eigen::Map<const Eigen::Array<float, N, 1>>(pixel).template cast<typename Bands<N>::Scalar>();
  }
};

/// See Scene. Layer k lies between face k-1 and face k.
template <int N>
struct PreparedScene {
  std::vector<PreparedMedium<N>> media;
  std::vector<FlatFace> faces;
  std::vector<PreparedMaterial<N>> materials;  ///< by RayHit::object
  std::vector<PreparedPrint<N>> prints;
  std::vector<RoughBoundary> boundaries;
  std::vector<PreparedLamp<N>> lamps;
  LampChooser lamp_chooser;
  Bands<N> environment;
  bool interreflection;
  RayScene rays;
  LampBodies lamp_bodies;
  bool has_films;

  /// @pre check_scene(scene) holds, and it has N bands
  explicit PreparedScene(const Scene& scene)
      : faces(scene.faces),
        environment(scene.environment),
        interreflection(scene.interreflection),
        rays(scene),
        has_films(rays.has_films()) {
    for (const Medium& medium : scene.media) {
      Bands<N> absorption = Bands<N>::Zero();
      if (medium.absorption.size() > 0) absorption = medium.absorption;
      Bands<N> scattering = Bands<N>::Zero();
      if (medium.scattering.size() > 0) scattering = medium.scattering;
      const Bands<N> extinction = absorption + scattering;
      media.push_back({medium.index, (extinction > 0.0).any(), absorption, (scattering > 0.0).any(), scattering,
                       extinction, medium.anisotropy, deep_walk<N>(absorption, scattering, medium.anisotropy)});
    }
    for (const Surface& surface : scene.surfaces) {
      materials.push_back(prepare(surface.material));
      if (surface.print) add_print(surface);
    }
    for (const Ball& ball : scene.balls) materials.push_back(prepare(ball.material));
    for (const Lamp& lamp : scene.lamps) {
      lamps.push_back(prepare_lamp<N>(lamp, scene.faces));
      const PreparedLamp<N>& one = lamps.back();
      if (!one.visible) continue;
      lamp_bodies.add(
          {one.frame, one.position, one.radius, one.half_width, one.half_height, static_cast<int>(lamps.size()) - 1});
    }
    for (const auto& lamp : lamps) {
      lamp_chooser.add(lamp.position, lamp.total_power, media[medium_of_layer(lamp.layer)].index);
    }
  }

  /// Does anything opaque, a visible lamp's body included, stand between the two points?
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    return rays.occluded(from, to) || (!lamp_bodies.empty() && lamp_bodies.stand_between(from, to));
  }

  int layer_at(double z) const { return layer_of_height(faces, z); }

  int medium_of_layer(int layer) const { return render::medium_of_layer(faces, layer); }

 private:
  void add_print(const Surface& surface) {
    const Print& print = *surface.print;
    const bool inked = !print.marks.empty() || print.picture;
    PreparedPrint<N> made{print.material_mm, surface.mesh.triangles, {}, PrintIndex(print.marks),
                          print.picture,     print.ground,           {}, inked};
    if (!print.ground.empty()) made.inks.assign(print.inks.begin(), print.inks.end());
    for (const PrintedMark& mark : print.marks) made.mark_colours.push_back(print.inks[mark.ink]);
    materials.back().print = static_cast<int>(prints.size());
    prints.push_back(std::move(made));
  }

  PreparedMaterial<N> prepare(const Material& material) {
    PreparedMaterial<N> made;
    if (const auto* lambertian = std::get_if<Lambertian>(&material)) {
      made.kind = SurfaceKind::kLambertian;
      made.colour = lambertian->albedo;
    } else if (const auto* conductor = std::get_if<RoughConductor>(&material)) {
      made.kind = SurfaceKind::kConductor;
      made.colour = conductor->reflectance;
      made.roughness = conductor->roughness;
      const bool as_before = !materials.empty() && materials.back().kind == SurfaceKind::kConductor &&
                             materials.back().roughness == made.roughness;
      made.single_albedo = as_before ? materials.back().single_albedo : GgxAlbedo(made.roughness);
    } else if (const auto* emitter = std::get_if<Emitter>(&material)) {
      made.kind = SurfaceKind::kEmitter;
      made.colour = emitter->radiance;
    } else if (const auto* refractive = std::get_if<Refractive>(&material)) {
      made.kind = SurfaceKind::kRefractive;
      made.inside = refractive->medium_inside;
      made.outside = refractive->medium_outside;
    } else if (const auto* rough = std::get_if<RoughRefractive>(&material)) {
      made.kind = SurfaceKind::kRoughRefractive;
      made.inside = rough->medium_inside;
      made.outside = rough->medium_outside;
      made.roughness = rough->roughness;
      const bool as_before = !materials.empty() && materials.back().kind == SurfaceKind::kRoughRefractive &&
                             materials.back().roughness == made.roughness && materials.back().inside == made.inside &&
                             materials.back().outside == made.outside;
      if (!as_before) boundaries.emplace_back(made.roughness, media[made.outside].index, media[made.inside].index);
      made.boundary = static_cast<int>(boundaries.size()) - 1;
    } else if (const auto* transmitter = std::get_if<DiffuseTransmitter>(&material)) {
      made.kind = SurfaceKind::kTransmitter;
      made.colour = transmitter->reflectance;
      made.passed = transmitter->transmittance;
    } else if (const auto* film = std::get_if<ThinFilm>(&material)) {
      made.kind = SurfaceKind::kFilm;
      made.colour = film->transmittance;
      made.film_index = film->index;
      made.film_mirrors = film->fresnel;
    }
    return made;
  }
};

}  // namespace touchstone::render
