#pragma once
// Finds a gel's black markers in one picture: threshold, blobs, centroids [Li2015, sec. 4.3].
//
// What the thesis leaves open, and what is done here:
// - "Threshold the image": with the mean of a window as wide as 1.5 spacings, so a marker in a lamp's shadow and one in
//   full light are found alike. A pixel's brightness is its largest channel: a marker is dark in all of them, a slope
//   that one lamp doesn't reach is lit by the others.
// - Centroids weigh each pixel by how much darker it is than a plane through the background round the blob, divided by
//   that plane: the rim's pixels count by what the marker covers of them, and a gradient of light doesn't pull.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/image/frame_light.h"

namespace touchstone::sensors {

/// What markers look like, in px of the picture. The defaults are the thesis's, 0.4 mm every 1.2 mm, in 320 px over 17
/// mm.
struct MarkerAppearance {
  double diameter_px = 7.5;      ///< 2 to 64
  double spacing_px = 22.6;      ///< between neighbours' centres; larger than the diameter, at most 256
  double darkness = 0.65;        ///< a marker's pixels are darker than this part of the window's mean; 0.1 to 0.95
  double least_difference = 10;  ///< and by at least so many grey levels (of 255)
  double least_area = 0.25;      ///< smaller blobs are noise; a part of a disc of the diameter
};

/// One dark region, of 8-connected pixels. Coordinates in px, pixel centres at + 0.5 (core/transform.h).
struct MarkerBlob {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  int area_px = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< outermost pixels
  bool at_border = false;                        ///< cut by the picture's edge: the centroid isn't the marker's
};

/// Finds markers in pictures of one size. After the first picture nothing is allocated. One object is for one thread.
class MarkerFinder {
 public:
  /// The most blobs that are looked at in one picture, the first in row order: noise can't eat time or memory.
  static constexpr std::size_t kMostBlobs = 4096;

  /// @throws Error naming the setting that is out of its range
  explicit MarkerFinder(const MarkerAppearance& appearance);

  /// The blobs in row order of their first pixels, valid until the next call; none if light() isn't normal.
  /// @throws Error unless the picture is 8 bit, grey or BGR, at least a spacing wide and high, and of the first one's
  /// size
  const std::vector<MarkerBlob>& find(const cv::Mat& image);

  /// Of the last picture: dark, saturated, flat (one value everywhere), or normal.
  FrameLight light() const { return light_; }
  const MarkerAppearance& appearance() const { return appearance_; }

 private:
  void read_brightness(const cv::Mat& image);
  void mark_dark_pixels();
  void take_blob(int x, int y);
  Eigen::Vector2d weighted_centroid(const MarkerBlob& blob, std::int32_t label) const;

  MarkerAppearance appearance_;
  FrameLight light_ = FrameLight::kNormal;
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> brightness_;  ///< largest channel
  std::vector<std::int32_t> label_;       ///< 0 background, -1 dark and not yet taken, else the number of its blob
  std::vector<std::int32_t> column_sum_;
  std::vector<std::int32_t> stack_;
  std::int32_t last_label_ = 0;
  std::vector<MarkerBlob> blobs_;
};

}  // namespace touchstone::sensors
