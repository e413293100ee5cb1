#pragma once
// Finds a gel's markers in one picture: threshold, blobs, centroids [Li2015, sec. 4.3]. The thesis has black dots on a
// bright membrane; bright tips on a black skin are found by the same steps.
//
// What the thesis leaves open, and what is done here:
// - "Threshold the image": dark markers against the gel's own brightness beside them (gel_brightness.h), bright ones
//   against the mean of a window as wide as 1.5 spacings, which says how bright markers are there. So a marker in a
//   lamp's shadow and one in full light are found alike. A pixel's brightness is its largest channel: a dark marker is
//   dark in all of them, a slope that one lamp doesn't reach is lit by the others.
// - Centroids weigh each pixel by how much it differs from a plane through the background round the blob: the rim's
//   pixels count by what the marker covers of them. Under dark markers the difference is divided by that plane, so a
//   gradient of light doesn't pull; beside bright ones there may be no light to divide by.
// - What markers look like is read from a picture of them (marker_learning.h), unless it is given.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/image/frame_light.h"
#include "sensors/markers/gel_brightness.h"

namespace touchstone::sensors {

/// Whether markers are darker or brighter than the gel between them.
enum class MarkerPolarity : std::uint8_t { kDark, kBright };
/// "dark", "bright"
const char* name_of(MarkerPolarity polarity);

/// What markers look like, in px of the picture. The defaults are the thesis's, 0.4 mm every 1.2 mm, in 320 px over 17
/// mm.
struct MarkerAppearance {
  double diameter_px = 7.5;  ///< 2 to 256
  double spacing_px = 22.6;  ///< between neighbours' centres; larger than the diameter, at most 1024
  /// A marker's pixels are darker than this part of the gel's brightness; of bright markers the window's mean is darker
  /// than this part of a pixel. 0.1 to 0.99
  double darkness = 0.65;
  double least_difference = 10;  ///< and they differ from that by at least so many grey levels (of 255)
  double least_area = 0.25;      ///< smaller blobs are noise; a part of a disc of the diameter
  MarkerPolarity polarity = MarkerPolarity::kDark;
};

/// The largest channel of each pixel (CV_8UC1), and whether there is light in it.
/// @throws Error unless the picture is 8 bit, grey or BGR, and not empty
FrameLight marker_brightness(const cv::Mat& image, cv::Mat& brightness);

/// One region that is dark (or bright, as markers are), of 8-connected pixels. Coordinates in px, pixel centres at +
/// 0.5 (core/transform.h).
struct MarkerBlob {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  int area_px = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< outermost pixels
  bool at_border = false;                        ///< cut by the picture's edge: the centroid isn't the marker's
};

/// Whether its picture may be that of a disc or a square, seen aslant: no scratch and no edge.
bool is_compact(const MarkerBlob& blob);

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
  void make_room(const cv::Mat& image);
  void mark_dark_pixels();
  void mark_bright_pixels();
  void take_blob(int x, int y);
  Eigen::Vector2d weighted_centroid(const MarkerBlob& blob, std::int32_t label) const;

  MarkerAppearance appearance_;
  FrameLight light_ = FrameLight::kNormal;
  int width_ = 0, height_ = 0;
  cv::Mat brightness_;
  GelBrightness gel_;                ///< of dark markers
  std::vector<std::int32_t> label_;  ///< 0 background, -1 a marker's and not yet taken, else the number of its blob
  std::vector<std::int32_t> column_sum_;
  std::vector<std::uint8_t> limit_;  ///< of a row's pixels: dark ones are below it
  std::vector<std::int32_t> stack_;
  std::int32_t last_label_ = 0;
  std::vector<MarkerBlob> blobs_;
};

}  // namespace touchstone::sensors
