#pragma once
// What a gel's markers look like, read from one picture of them: how large they are, how far apart, and whether they
// are darker or brighter than the gel. No layout is assumed: rows and columns, rings and no order at all are alike.
//
// Markers are spots of one size: they are searched for over all sizes at once, as the places where the picture's
// Laplacian of Gaussian is largest over place and size [Lindeberg1998, sec. 3]. It is taken of the logarithm of the
// light: a lamp that falls off, or a coloured one from the side, then changes no marker's contrast. Of the sizes and of
// dark and bright, that one is chosen whose spots have the most contrast together, and are what MarkerFinder finds,
// too.

#include <opencv2/core/mat.hpp>

#include "sensors/markers/marker_finder.h"

namespace touchstone::sensors {

/// A picture from which markers are learnt must show so many whole ones.
inline constexpr int kLeastMarkers = 4;

/// What the markers of a picture look like, by which MarkerFinder finds them in it and in later ones. Markers may
/// differ in size by a quarter up or down, and in brightness as far as their contrast with the gel round them is alike.
/// @param rest 8 bit, grey or BGR: the gel untouched
/// @throws Error for a picture of another kind, without light, or in which fewer than kLeastMarkers spots of one size
///   stand out
MarkerAppearance learn_appearance(const cv::Mat& rest);

}  // namespace touchstone::sensors
