#pragma once
// Where a picture shows the imprint of a ball of known size.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace touchstone::sensors {

/// A place whose surroundings look like a ball's imprint.
struct BallSighting {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< px, good to some 5 % of the ball's radius
  double contact = 0.0;  ///< the contact's radius by the ball's: the one of a few sizes that explains most
  double energy = 0.0;   ///< what the imprint explains of the colours: their squares, summed over pixels and channels
};

/// Looks for places where matt shading explains the colours best: each channel's difference to the background as a
/// linear function of the tilt of the membrane that a ball there makes (BallImprint). Lamps of any number and place are
/// such functions, so neither they nor the contact's own size need to be known. Made once for a picture's size and a
/// ball; then a picture of 320 x 240 takes some 20 ms.
class BallSearch {
 public:
  /// All px. @pre ball_px > 0, thickness_px > 0
  BallSearch(const cv::Size& size, double ball_px, double thickness_px);

  /// The best place of a picture. @pre difference is CV_32FC3 of the size
  BallSighting find(const cv::Mat& difference) const;
  /// The best contact size at a given place.
  BallSighting look_at(const cv::Mat& difference, const Eigen::Vector2d& centre) const;
  /// The best place at least kApart ball radii from `first`, in what `first` doesn't explain. There is always one; its
  /// energy by the first one's is below 0.2 where there's one ball, and above 0.4 where there are two like each other.
  BallSighting find_second(const cv::Mat& difference, const BallSighting& first) const;

  static constexpr double kApart = 1.7;

 private:
  /// An imprint with one contact size.
  struct Size {
    double contact = 0.0;            ///< by the ball's radius
    std::vector<cv::Mat> tilts;      ///< three kernels, CV_32FC1: the normal's change, within the window
    Eigen::Matrix3d inverse;         ///< of their products' sums
    std::vector<float> tilt_over_r;  ///< tilt along r, at whole quarters of a pixel
    std::vector<float> lift;         ///< change of the normal's third component
  };
  cv::Mat shrunk(const cv::Mat& difference) const;
  std::optional<BallSighting> best_of(const cv::Mat& small, const cv::Mat& allowed) const;

  cv::Size size_;
  double shrink_ = 1.0;  ///< px of the picture by a pixel of the search
  double ball_ = 0.0;    ///< radius in pixels of the search
  std::vector<Size> sizes_;
};

}  // namespace touchstone::sensors
