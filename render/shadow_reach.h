#pragma once
// How far a shadow ray can meet anything at all.

#include <memory>
#include <vector>

#include "render/scene.h"

namespace touchstone::render {

/// A coarse map, seen along z, of how steep a membrane is and what else there is. Where the first surface is a
/// connected sheet whose triangles all face the same way along z (a height field), a ray that leaves it and climbs
/// faster than the sheet does anywhere under its way can't meet it. Other things are cylinders along z over the cells
/// they cover. All answers are safe: a ray that meets something is never cut short of it.
class ShadowReach {
 public:
  /// `connected`: what is_connected says of the first surface, kept by those who draw the same triangles again.
  ShadowReach(const Scene& scene, bool connected);

  /// Rays from here, off object `from` (RayHit's numbers), that rise or fall by this much or more per mm across meet
  /// nothing: |dz| >= value * |(dx, dy)|. Infinite where that can't be said.
  float safe_steepness(float x, float y, int from) const;

  /// The part of a ray's `far` within which it may meet something, 0 where it can't. The ray leaves object
  /// `from`.
  float length(float x, float y, float z, float dx, float dy, float dz, float far, int from) const;

 private:
  bool sheet_ = false;
  float low_ = 0.0f, high_ = 0.0f;  // of everything, padded
  float left_ = 0.0f, bottom_ = 0.0f, cell_ = 1.0f;
  int columns_ = 0, rows_ = 0;
  std::vector<float> slope_;   // of the sheet, rise per mm; endless where something else is
  std::vector<float> around_;  // the most of slope_ that a ray no flatter than kUsual meets before it is clear of all
};

/// Do the triangles hang together by common vertices? True without any.
bool is_connected(const TriangleMesh& mesh);

}  // namespace touchstone::render
