#pragma once
// Evens out the light in a picture of coloured markers on white ([Lin2019, sec. IV.B]: "top-hat", then equalisation).
//
// What the paper leaves open, and what is done here:
// - The markers are darker than the white between them, so the paper's top-hat is the dark one: the picture's closing
//   with an element larger than a marker less the picture itself. The closing is the white that would be seen if there
//   were no markers. Light multiplies, so here the picture is divided by it and not subtracted from it: a subtraction
//   would leave a hue that depends on how bright a place is lit. picture / closing = 1 - top-hat / closing.
// - The closing is made of each channel, so white that isn't neutral is balanced too.
// - Equalisation of each channel's histogram would bend hues. What it is for, the same contrast under any exposure, is
//   had by one gain for all channels: white comes to lie at kWhite.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// Levels pictures. After the first picture of a size little is allocated. One object is for one thread.
class ColourLevelling {
 public:
  /// Where white lies in a levelled picture, of 255: the rest is margin for noise.
  static constexpr int kWhite = 230;

  /// @param spacing_px between neighbouring markers, whose sides are about two thirds of it. White between them must
  ///   stay to be seen within any square of 1.5 spacings
  /// @throws Error unless it is from 4 to 4096
  explicit ColourLevelling(double spacing_px);

  /// The picture with white at kWhite everywhere, CV_8UC3, valid until the next call. What is brighter than 255 /
  /// kWhite of white is cut there.
  /// @param image CV_8UC3, at least a spacing wide and high. Its values are proportional to light
  /// @throws Error for another picture
  const cv::Mat& level(const cv::Mat& image);

  /// The last picture's white at a place (px), in its own grey levels, by channel (B, G, R).
  Eigen::Vector3d white_at(const Eigen::Vector2d& place) const;

  /// The last picture at reduced resolution, CV_32FC3, as white is sought in it.
  const cv::Mat& reduced() const { return small_; }

 private:
  void find_white(const cv::Mat& image);
  void multiply_rows(const cv::Mat& image);

  double spacing_px_;
  cv::Size size_;
  cv::Mat small_bytes_, small_, white_, gain_;
  std::vector<int> left_;             ///< for each column, the reduced one to its left, times 3
  std::vector<float> towards_right_;  ///< and the fraction of the distance to the next
  std::vector<float> row_gain_;
  cv::Mat levelled_;
};

}  // namespace touchstone::sensors
