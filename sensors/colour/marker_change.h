#pragma once

#include <Eigen/Core>

#include "sensors/colour/colour_marker.h"
#include "sensors/colour/picture_map.h"

namespace touchstone::sensors {

/// How a coloured marker looks different from what it was at rest.
struct MarkerChange {
  static constexpr int kSize = 9;

  double hue = 0.0;                                           ///< radians, along the shorter arc
  Eigen::Vector2d centroid_mm = Eigen::Vector2d::Zero();      ///< of all that is coloured, in the plane at rest
  Eigen::Vector2d ink_centroid_mm = Eigen::Vector2d::Zero();  ///< of its ink
  double log_coloured_area = 0.0;                             ///< logarithm of the ratio to that at rest
  double log_ink_area = 0.0;
  bool surroundings_known = false;  ///< if not, what follows is 0
  double log_cell_area = 0.0;       ///< MarkerSurroundings, of its neighbours
  double log_neighbour_area = 0.0;

  /// The numbers in the order of the fields.
  Eigen::Matrix<double, kSize, 1> vector() const;
  /// For models that are of one marker alone: what its neighbours do is then no sign that it looks strange.
  void forget_surroundings();
};

/// @pre neither is flawed
MarkerChange change_of(const ColourMarker& seen, const ColourMarker& rest, const PictureMap& map);

/// How places off the camera's axis look displaced when they come nearer. A camera at the apparent distance D sees a
/// marker at r from the axis, pressed by w, where one at r D / (D - w) would be in the plane at rest. The paper
/// [Lin2019, sec. IV.E] leaves this out; so does this if the distance is 0.
struct ViewParallax {
  /// mm from the camera to the markers at rest, as it is for small motions of the markers in the gel: with a path in
  /// air, and windows of refractive indices n_i and thicknesses t_i, n_gel (d + sum t_i / n_i). 0: far away.
  double viewing_distance_mm = 0.0;
  Eigen::Vector2d axis_mm = Eigen::Vector2d::Zero();  ///< where the view's axis meets the markers' plane, gel frame

  /// Lateral displacement that is seen (mm), of a marker that is at `rest` (mm, gel frame) when unloaded.
  Eigen::Vector2d seen(const Eigen::Vector3d& displacement, const Eigen::Vector2d& rest) const;
  /// The lateral displacement that is seen as `seen` with a press by `press_mm`: the inverse.
  Eigen::Vector2d true_one(const Eigen::Vector2d& seen, double press_mm, const Eigen::Vector2d& rest) const;
};

}  // namespace touchstone::sensors
