#pragma once
// A height map in squares, each of which says what it is made of; what most of them say is the map's material.

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "sensors/texture/texture_model.h"

namespace touchstone::sensors {

/// As many whole squares of `side_px` as fit, by rows, about the map's middle; parts of the map itself, not copies.
/// @throws Error for a map that none fits in, or a side below 1
std::vector<cv::Mat> squares_of(const cv::Mat& heights_mm, int side_px);

/// What the squares of one map say together.
struct TextureVote {
  int label = 0;          ///< index in TextureModel::classes: most squares', of several the one with the nearest square
  int squares = 0;        ///< that have voted
  int agreeing = 0;       ///< of them, for this label
  double distance = 0.0;  ///< mean of TextureMatch::distance over these: a large one means an unknown material
};

/// @throws Error without a match
TextureVote vote(std::span<const TextureMatch> matches);

}  // namespace touchstone::sensors
