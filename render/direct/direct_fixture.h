#pragma once

#include <array>
#include <vector>

#include "render/direct/light_field.h"
#include "render/direct/shadow_reach.h"
#include "render/sampling/warps.h"
#include "render/scene/film_screen.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// What stays the same from frame to frame, besides the camera's rays. Lamps are taken in groups of four, the last one
/// filled up with dark ones.
struct DirectFixture {
  LightField field;
  LampBearings bearings;
  int groups;
  std::vector<float> flow;       ///< [node][group][axis][4]: F of LightField
  std::vector<float> intensity;  ///< [band][group][4]
  std::vector<float> pass;       ///< [node][band][group][4], empty where nothing absorbs
  std::vector<NormalFrame> lens_frames;
  std::vector<double> lens_radii;  // 0 of lamps that are not round
  std::vector<double> lamp_index;  ///< refractive index of the medium that a lamp stands in
  std::vector<bool> lamp_in_layer;
  std::vector<int> flattest;  ///< of each beam: the flattest one of its sector, whose azimuths are its own
  double low, high;           ///< of the field's layer
  std::array<float, kMaxBands> absorption{};
  bool absorbs = false;
  FilmScreen films;              ///< empty where there are none
  std::vector<int> colour_of;    ///< of each lamp: lamps of one colour have equal intensities
  std::vector<int> colour_lamp;  ///< a lamp of each colour

  /// `soft`: see LampBearings.
  DirectFixture(const LightField& of, bool soft);
};

}  // namespace touchstone::render
