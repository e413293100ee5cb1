#pragma once
// Pictures through a wide hole from few paths: neighbouring pixels see nearly the same places, so they share them.

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "render/cameras/camera_footprint.h"
#include "render/paths/path_tracer.h"

namespace touchstone::render {

/// A pinhole's picture as a picture of paths through the hole's centre, one for each point of a grid, spread by the
/// hole's footprint (camera_footprint.h): a path serves all pixels that see its place through some part of the hole, so
/// a pixel's mean has hundreds of paths for the price of one. Footprints are kept for some heights; each block of
/// pixels takes that in the middle of what lies in it and beside it.
///
/// With diffraction the footprint is what the hole spreads, each band's own; of the camera's object alone, at whatever
/// height. Its stated error then has what is seen within the footprint in it.
///
/// What is biased: what is dz from its block's height is blurred by dz / distance too little or too much, and all of
/// the hole sees it behind what hides it from the hole's centre (parallax of the hole's radius: some micrometres a
/// millimetre). Noise is shared, too: it is alike in neighbouring pixels, and alike from frame to frame where nothing
/// changes.
class SharedPaths {
 public:
  /// @param examples of what the camera sees: footprints are made for the heights of the first hits there
  /// @param settings `max_samples` are in the mean of a pixel at least: the grid is as coarse as they allow, but never
  ///   finer than a point a pixel. Where there's a noise target, points get as many paths (kMostPaths at most) as bring
  ///   the lower quartile of the pixels' errors in the last example to that part of the target that neighbours who
  ///   share it call for (kSharedPart); and kEdgePaths times as many where a preview shows edges
  /// @pre there is an example
  SharedPaths(std::span<const Scene> examples, const PinholeCamera& camera, const RenderSettings& settings);
  static constexpr double kSharedPart = 0.25;
  static constexpr int kMostPaths = 16;
  static constexpr int kEdgePaths = 8;

  /// Paths of each point, but for edges.
  int paths_a_point() const { return paths_; }

  /// The whole picture. Of the settings `seed`, `max_depth` and `noise` count; `samples` is left empty.
  /// `standard_error` is empty unless `with_error`: from the scatter of the paths in a pixel's footprint as if they
  /// were drawn at random, which is too much where an edge is seen, since they are stratified.
  RenderedImage render(const Scene& scene, const Tracer& tracer, const RenderSettings& settings, bool with_error) const;

 private:
  int paths_called_for(const Scene& example, const RenderSettings& settings) const;
  cv::Mat paths_of_points(const Tracer& tracer, const RenderSettings& settings) const;
  std::vector<std::size_t> footprints_of_blocks(const Scene& scene) const;

  PinholeCamera camera_;
  int paths_ = 1;
  std::vector<double> heights_;              // of the footprints, mm, falling; with diffraction one
  std::vector<CameraFootprint> footprints_;  // on one grid; with diffraction by band
  cv::Mat weight_;                           // CV_32FC1, W/m^2 on the sensor per radiance through the hole's centre
};

}  // namespace touchstone::render
