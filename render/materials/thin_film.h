#pragma once
// A thin clear coloured film, such as the yellow filter foil of a sensor that measures depth by hue.
//
//   scene.surfaces.push_back({sheet, ThinFilm{transmittance}});                    // dye only, both sides wetted
//   scene.surfaces.push_back({sheet, ThinFilm{transmittance, 1.49, true}});        // a foil in air, with its faces
//
// The dye takes light away and doesn't scatter: what passes at an angle has a path longer by 1 / cos(angle inside), so
// its transmittance is t^(1 / cos) of the one t at normal incidence (Beer-Lambert). The film has no thickness in the
// scene: a ray goes on where it met the film, without the sideways shift d sin(a - b) / cos(b) of a real foil (20 um
// for a foil of 0.05 mm at 50 degrees). It stands in one medium, whose index bends the ray to its angle inside.
// With `fresnel` both faces mirror: reflections to and fro inside add up as powers (a foil much thicker than a
// wavelength; no interference colours), light is taken as unpolarised. Lamps shine through films; a lamp's mirror
// image in a film lights nothing.

#include <Eigen/Core>
#include <cmath>

#include "render/materials/fresnel.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A foil without thickness, which bends nothing.
struct ThinFilm {
  Spectrum transmittance;  ///< of the dye at normal incidence without the faces' losses, 0 to 1 in each band
  double index = 1.5;      ///< of the film's substance, 1 to 5
  bool fresnel = false;    ///< do its two faces mirror?
};

/// What a film sends back and lets through, of one.
template <int N>
struct FilmLight {
  Bands<N> reflected;
  Bands<N> passed;
};

/// Light that meets a film of dye transmittance `dye` and index `index`, out of a medium of index `n_medium`, at cosine
/// `cosine` in [0, 1]. With R and t the reflectance of one face and the dye's transmittance of one passage, the
/// geometric series give passed = (1-R)^2 t / (1 - R^2 t^2) and reflected = R (1 + t passed) for each polarisation
/// ([Born1999, sec. 7.6], without the phase); the mean of the two is returned. Beyond the critical angle nothing
/// passes.
template <int N>
FilmLight<N> film_light(const Bands<N>& dye, double index, bool fresnel_faces, double n_medium, double cosine) {
  const FresnelFace face = fresnel(n_medium, index, cosine);
  if (!(face.cos_refracted > 0.0)) return {Bands<N>::Constant(fresnel_faces ? 1.0 : 0.0), Bands<N>::Zero()};
  const Bands<N> inside = dye.pow(1.0 / face.cos_refracted);
  if (!fresnel_faces) return {Bands<N>::Zero(), inside};
  FilmLight<N> light{Bands<N>::Zero(), Bands<N>::Zero()};
  for (const double r : {face.reflectance_s, face.reflectance_p}) {
    if (r >= 1.0) {
      light.reflected += 0.5;
      continue;
    }
    const Bands<N> passed = (1.0 - r) * (1.0 - r) * inside / (1.0 - r * r * inside * inside);
    light.passed += 0.5 * passed;
    light.reflected += 0.5 * r * (1.0 + inside * passed);
  }
  return light;
}

}  // namespace touchstone::render
