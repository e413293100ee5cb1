#pragma once
// What is true of each pixel, for other people's networks: layers of one EXR. All come from one ray a pixel, through
// its centre and that of hole or lens (render/cameras/first_hits.h), so an edge is a step and blur by hole or lens
// isn't in them. The gel's outer surface counts as the first hit even where the gel is clear.
//
// | output  | channels                     | meaning                                                               |
// | depth   | depth.Z                      | mm from the centre of hole or lens along the optical axis, true place |
// | normals | normal.X normal.Y normal.Z   | unit, gel frame, outward of the surface (+z on an undeformed gel)     |
// | ids     | id.ID                        | see PixelId                                                           |
// | contact | contact.Y                    | 1 where the gel's outer surface lies on an object, else 0             |
// | flow    | flow.X flow.Y                | px: where the material point was in the picture of the undeformed gel,|
// |         |                              | less where it is; the frame's is 0, an object beside the gel has none |
// | error   | error.irradiance             | W/m^2, standard error over all bands (render::RenderedImage)          |
//
// Where a pixel sees nothing depth, normal and flow are NaN, id and contact 0. Flow is NaN, too, where the material
// point lay so far aside that no image point of the distorted lens looked there.

#include "render/cameras/camera.h"
#include "sim/files/image_file.h"
#include "sim/scene/scene.h"
#include "sim/view/seen_geometry.h"

namespace touchstone::sim {

/// What is seen. The numbers are part of the file format. Where the gel lies on object k its id is kFirstObject + k.
struct PixelId {
  static constexpr int kNothing = 0;
  static constexpr int kGel = 1;
  static constexpr int kFrame = 2;
  static constexpr int kFirstObject = 1'000;
  static constexpr int kFirstScreen = 2'000;
  static constexpr int kFirstBead = 10'000;
  static constexpr int kFirstMarker = 20'000;  ///< of a print, also where the gel lies on an object; pins' tips
};

/// The layers that `outputs` asks for, in the order of the table, but for `error`. Pure.
/// @throws Error as render::make_ready
LinearImage pixel_truth(const SeenGeometry& seen, const render::Camera& camera, const OutputSpec& outputs);

/// Adds a CV_32FC1 picture of the same size as another channel.
void add_channel(LinearImage& image, const cv::Mat& channel, const std::string& name);

}  // namespace touchstone::sim
