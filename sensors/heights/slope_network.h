#pragma once
// A small network from the colours at and round a pixel to the membrane's slope there.
//
// A table knows the colour of a pixel alone. Real light isn't so simple: a dent shades and lights up its surroundings,
// lamps reach places unevenly, a channel is cut off at 255. The mean colours of three neighbourhoods and the place tell
// much of that.

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "sensors/learning/feed_forward_network.h"

namespace touchstone::sensors {

/// From the colours to the slope: inputs are the differences to the background (BGR, in units of kColourUnit_DN) at the
/// pixel and in the mean over each neighbourhood, then the place along u and v from -1 to 1; outputs are both slopes.
struct SlopeNetwork {
  FeedForwardNetwork network;                                  ///< one hidden layer of tanh
  std::array<double, 3> neighbourhoods_mm = {0.15, 0.5, 1.5};  ///< standard deviations of their weights

  static constexpr int kInputs = 14;
  static constexpr double kColourUnit_DN = 64.0;
};

/// What is wrong with a network, or the empty string.
std::string fault_of(const SlopeNetwork& network);

/// The neighbourhoods' means of one picture. Made once for a size; then a picture allocates nothing.
class Neighbourhoods {
 public:
  /// @pre mm_per_px > 0
  Neighbourhoods(const cv::Size& size, double mm_per_px, const std::array<double, 3>& neighbourhoods_mm);

  /// @pre difference is CV_32FC3 of the size
  void take(const cv::Mat& difference);
  /// The network's inputs at each pixel of row v: input i of pixel u is inputs[i * width + u].
  void inputs_of_row(const cv::Mat& difference, int v, float* inputs) const;

 private:
  struct Scale {
    cv::Size small;  ///< that the picture is shrunk to before it is blurred
    double sigma = 0.0;
    cv::Mat shrunk, blurred, mean;
  };
  cv::Size size_;
  std::array<Scale, 3> scales_;
};

/// Slopes of whole pictures. Not for two threads at once.
class SlopeReader {
 public:
  /// @throws Error if the network is faulty
  SlopeReader(const SlopeNetwork& network, const cv::Size& size, double mm_per_px);

  /// Writes CV_32FC1. @pre difference is CV_32FC3 of the size, without the frame's gain
  void read(const cv::Mat& difference, cv::Mat& slope_u, cv::Mat& slope_v);

 private:
  cv::Size size_;
  Neighbourhoods neighbourhoods_;
  int units_ = 0;
  std::vector<float> weights_;  ///< of each hidden unit: kInputs and its bias; then its weights in both outputs
  std::array<float, 2> bias_{};
  std::vector<float> inputs_;
};

}  // namespace touchstone::sensors
