#pragma once
// A small network from the colours at and round a pixel to the membrane's slope there.
//
// A table knows the colour of a pixel alone. Real light isn't so simple: a dent shades and lights up its surroundings,
// lamps reach places unevenly, a channel is cut off at 255. The mean colours of the surroundings, some of them to one
// side of the pixel, and the place tell much of that.

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "sensors/learning/feed_forward_network.h"

namespace touchstone::sensors {

/// From the colours to the slope. Inputs are differences to the background (BGR, in units of kColourUnit_DN): at the
/// pixel, in the mean over a fine neighbourhood, the place along u and v from -1 to 1, then the means over kContext
/// wider neighbourhoods, of which most lie to one side of the pixel. Outputs are both slopes. kContext's sizes were
/// chosen on the 20 presses of a GelSight Mini that docs/sensors/gelsight.md gives figures of.
struct SlopeNetwork {
  FeedForwardNetwork network;  ///< one hidden layer of tanh

  /// A mean with weights of a Gaussian.
  struct Mean {
    double width_mm;           ///< standard deviation
    double right_mm, down_mm;  ///< of its middle from the pixel
  };
  static constexpr double kFine_mm = 0.15;  ///< standard deviation of the fine neighbourhood
  static constexpr std::array<Mean, 10> kContext = {{{0.5, 0.0, 0.0},
                                                     {1.5, 0.0, 0.0},
                                                     {0.3, 0.6, 0.0},
                                                     {0.3, -0.6, 0.0},
                                                     {0.3, 0.0, 0.6},
                                                     {0.3, 0.0, -0.6},
                                                     {0.7, 1.5, 0.0},
                                                     {0.7, -1.5, 0.0},
                                                     {0.7, 0.0, 1.5},
                                                     {0.7, 0.0, -1.5}}};
  static constexpr int kNear = 8;  ///< inputs of the pixel, its fine neighbourhood and its place
  static constexpr int kInputs = kNear + 3 * static_cast<int>(kContext.size());
  static constexpr double kColourUnit_DN = 64.0;
  /// Where the camera sets its white balance, numbers above this count as this, once the frame's gain is taken out:
  /// those are what 20 % more of a channel cuts off. Of 190 to 255, chosen on the same 20 presses
  /// (docs/sensors/gelsight.md).
  static constexpr double kCeiling_DN = 208.0;
};

/// What is wrong with a network, or the empty string.
std::string fault_of(const SlopeNetwork& network);

/// A network's inputs of one picture. Made once for a size; then a picture allocates nothing. kContext's means are made
/// on a coarse grid, and between its points they are linear: they are smooth.
class Neighbourhoods {
 public:
  /// @pre mm_per_px > 0
  Neighbourhoods(const cv::Size& size, double mm_per_px);

  /// @pre difference is CV_32FC3 of the size
  void take(const cv::Mat& difference);
  /// The first kNear inputs at each pixel of row v: input i of pixel u is inputs[i * width + u].
  void near_inputs_of_row(const cv::Mat& difference, int v, float* inputs) const;
  /// All inputs, likewise.
  void inputs_of_row(const cv::Mat& difference, int v, float* inputs) const;

  /// Where a row or column of the picture lies between two of the grid's.
  struct Between {
    int low = 0;
    int high = 0;
    float share = 0.0F;  ///< of the high one
  };
  const cv::Size& grid() const { return grid_; }
  const std::vector<Between>& columns() const { return columns_; }  ///< one each of the picture's
  const std::vector<Between>& rows() const { return rows_; }
  /// CV_32FC3 of the grid's size, by kContext's index, digital numbers.
  const cv::Mat& context(std::size_t index) const { return context_[index].mean; }

 private:
  struct Context {
    double sigma = 0.0;  ///< px of the grid
    cv::Mat blurred, mean;
  };
  cv::Size size_, fine_size_, grid_;
  double fine_sigma_ = 0.0;  ///< px of the picture that is shrunk for the fine neighbourhood
  double right_px_ = 0.0;    ///< of the grid, a mm
  double down_px_ = 0.0;     ///< likewise
  cv::Mat shrunk_, blurred_, fine_, coarse_;
  std::array<Context, SlopeNetwork::kContext.size()> context_;
  std::vector<Between> columns_, rows_;
};

/// Slopes of whole pictures. Not for two threads at once.
class SlopeReader {
 public:
  /// @throws Error if the network is faulty
  SlopeReader(const SlopeNetwork& network, const cv::Size& size, double mm_per_px);

  /// Writes CV_32FC1. @pre difference is CV_32FC3 of the size, without the frame's gain
  void read(const cv::Mat& difference, cv::Mat& slope_u, cv::Mat& slope_v);

 private:
  void sum_context(int row, float* sums);

  cv::Size size_;
  Neighbourhoods neighbourhoods_;
  int units_ = 0;
  std::vector<float> weights_;          ///< of each hidden unit: of the near inputs, then its weights in both outputs
  std::vector<float> context_weights_;  ///< of each hidden unit: its bias, then of the context
  std::array<float, 2> bias_{};
  std::vector<float> inputs_;
  std::vector<float> at_grid_;                ///< a unit's sum over the context, at a row of the grid
  std::array<std::vector<float>, 2> sums_{};  ///< likewise at each column of the picture, of two rows of the grid
};

}  // namespace touchstone::sensors
