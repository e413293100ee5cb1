#pragma once
// How much of its light a camera's pixel keeps where the coat of a milky slab is pressed in: the ways of coat_walks.h
// that stay below the coat. A picture takes some ten milliseconds.

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/cameras/camera.h"
#include "render/membrane/coat_walks.h"
#include "render/membrane/face_state.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// One slab before one camera. What is left out: a coat that isn't black lights the slab again, and walls and faces
/// send back what left it; a walk's course after the first scattering doesn't lean with the camera's ray; beside the
/// slab its coat goes on as in a mirror. What that amounts to is for measure_direct_error
/// (render/direct/direct_error.h) to say.
class CoatLight {
 public:
  /// @param faces the scene's flat faces with their media: the slab is the layer whose back is at z = -thickness
  /// @param size_mm of the slab along x and y
  /// @param arrivals what walks were made of: of `columns` x `rows` places, row by row
  /// @throws Error as first_hits
  CoatLight(CoatWalks walks, const Scene& faces, const Camera& camera, const Eigen::Vector2d& size_mm,
            const std::vector<LampArrival>& arrivals, int columns, int rows);

  /// The cells of a map of the coat.
  const FaceGrid& grid() const { return grid_; }

  /// `thickness`: CV_32FC1 of the grid, mm from the back to the coat. The share of the light of a flat coat at the
  /// slab's thickness: CV_32FC1 of the camera's size; above 1 where the coat bulges. Pure, from any number of threads.
  /// @throws Error for a map of another size or kind
  cv::Mat share(const cv::Mat& thickness) const;

 private:
  cv::Mat brought(const cv::Mat& thickness) const;

  CoatWalks walks_;
  FaceGrid grid_;
  cv::Size camera_;
  int stride_ = 1;                                        // pixels of the camera between two that are looked at
  cv::Size looked_;                                       // how many are
  std::vector<cv::Mat> column_, row_;                     // by depth class: where the walks of a looked-at pixel stand
  std::vector<std::array<cv::Mat, kLightSides>> weight_;  // by depth class and side: of one walk
  cv::Mat rest_;
};

}  // namespace touchstone::render
