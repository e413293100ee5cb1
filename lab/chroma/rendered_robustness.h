#pragma once
// Fig. 6 of [Lin2019] with pictures that light made, in place of a drawing: markers of several sizes on the white
// sheet, behind the yellow film, traced in bands on the setup of chroma_tilt_setup.h with the colours of
// scenes/devices/chroma.yaml.

#include <cstdint>
#include <vector>

#include "lab/chroma/chroma_robustness.h"
#include "lab/chroma/chroma_tilt_setup.h"

namespace touchstone::lab {

/// Pictures of one marker behind its film, from a small marker to a large one.
struct RenderedRungs {
  double filter_px = 128.0;  ///< side of the film in the picture, which is twice as wide; whole
  double smallest = 0.7;     ///< side of the marker, of the film's
  double largest = 1.3;
  int count = 31;
  int samples = 16;  ///< paths a pixel
};

/// As the paper does it the marker alone changes its size, the sheet stays where it is. The rival is a black marker
/// behind a film that takes nothing. Each set is exposed so that its white is at 0.9; the light's own unevenness stays.
/// @throws Error for fewer than 2 rungs, sizes that aren't above 0, rise and leave white at the picture's rim (1.6 at
///   the most), or a film narrower than 4 px
std::vector<RobustnessRung> rendered_robustness_rungs(const TiltSpectra& spectra, const RenderedRungs& rungs,
                                                      std::uint64_t seed);

}  // namespace touchstone::lab
