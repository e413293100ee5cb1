#pragma once
// Pictures through a wide hole from few paths: neighbouring pixels see nearly the same places, so they share them.

#include "render/camera_footprint.h"
#include "render/path_tracer.h"

namespace touchstone::render {

/// A pinhole's picture as a picture of paths through the hole's centre, one for each point of a grid, spread by the
/// hole's footprint (camera_footprint.h): a path serves all pixels that see its place through some part of the hole, so
/// a pixel's mean has hundreds of paths for the price of one.
///
/// What is biased: only what lies at the height the footprint was made for is blurred just as the hole does; what is
/// dz from it by dz / distance times the hole's share of the blur too much or too little, and is seen by all of the
/// hole from where its centre sees it (parallax of the hole's radius: some micrometres a millimetre). What is noise
/// is shared, too: it is alike in neighbouring pixels, and alike from frame to frame where nothing changes.
class SharedPaths {
 public:
  /// @param rest what the camera sees at first: the footprint is made for the heights of the first hits there
  /// @param least_paths in the mean of a pixel: the grid is as coarse as they allow, but never finer than a path a pixel
  SharedPaths(const Scene& rest, const PinholeCamera& camera, int least_paths);

  /// The whole picture. Of the settings only `seed` and `max_depth` count; `samples` is left empty. `standard_error`
  /// is empty unless `with_error`: from the scatter of the paths in a pixel's footprint as if they were drawn at
  /// random, which is too much where an edge is seen, since they are stratified.
  RenderedImage render(const Tracer& tracer, const RenderSettings& settings, bool with_error) const;

  /// A path for each square of so many pixels a side.
  int spacing_px() const { return footprint_.spacing; }

 private:
  PinholeCamera camera_;
  CameraFootprint footprint_;
  cv::Mat weight_;  // CV_32FC1, W/m^2 on the sensor per radiance through the hole's centre
};

}  // namespace touchstone::render
