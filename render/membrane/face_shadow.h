#pragma once
// How much of the light from outside a body before a membrane keeps off its face.

#include <array>
#include <opencv2/core/mat.hpp>

#include "render/membrane/face_state.h"
#include "render/membrane/membrane_kernels.h"

namespace touchstone::render {

/// Of even light from outside, what of it enters a place of the face within a sector of cosines (membrane_kernels.h):
/// the share that comes from directions in which the body stands, by azimuth: its mean, and the means of it times the
/// cosine and the sine of the azimuth. CV_32FC1 each; empty for a sector into which nothing enters.
using ShadowMoments = std::array<std::array<cv::Mat, 3>, kFaceSectors>;

/// Under the body, and just beside it.
struct BodyShadow {
  ShadowMoments under, beside;
};

/// The shadow on a grid of cells of `factor` x `factor` of those of `grid`. The body fills what lies between its gap
/// and its top. Horizons are looked for along 12 azimuths, at distances that grow by a third.
/// @pre state.gap_mm isn't empty and fits the grid
BodyShadow shadow_of_body(const FaceGrid& grid, const FaceState& state, double index, int factor);

/// The mean shadow on cells which the body is above in the shares `under`, CV_32FC1.
ShadowMoments mean_shadow(const BodyShadow& shadow, const cv::Mat& under);

}  // namespace touchstone::render
