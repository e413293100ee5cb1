#pragma once
// Steps iii to vii of the tracker for one window: from grey values to a bead's centroid.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "sensors/bead_tracker.h"
#include "sensors/bit_window.h"

namespace touchstone::sensors {

/// Step ii: grey values times a factor, rounded and cut to 0..255. Colour becomes grey by OpenCV's weights for BGR.
class BrightnessScale {
 public:
  /// `factor` takes the frame's own digital numbers to 0..255 levels. @pre finite and above 0
  void set(double factor);
  /// Reads a pixel row of `count` pixels, each `stride`-th one, from column x on, in row y.
  void read(const cv::Mat& image, int x, int y, int stride, int count, std::uint8_t* out) const;

 private:
  double factor_ = 1.0;
  std::array<std::uint8_t, 256> table_{};  ///< for 8-bit images
};

/// The mean grey value of a part of an image, in its own digital numbers. @pre the part isn't empty
double mean_grey(const cv::Mat& image, const cv::Rect& part);

/// The scaled grey values of a rectangle of the image, each `stride`-th pixel of each `stride`-th row.
struct GreyWindow {
  int x = 0;  ///< image column of the first pixel
  int y = 0;
  int width = 0;  ///< number of pixels taken, at most BitWindow::kMaxSide
  int height = 0;
  int stride = 1;
  std::array<std::uint8_t, BitWindow::kMaxSide * BitWindow::kMaxSide> grey;  ///< row after row
};

/// Reads the window of `side` px a side (in the image; every `stride`-th pixel is taken) whose centre is nearest to
/// `centre`, cut at the image's border. Returns false if nothing of it is in the image.
bool read_window(const cv::Mat& image, const BrightnessScale& scale, const Eigen::Vector2d& centre, int side,
                 int stride, GreyWindow& window);

struct BeadMeasurement {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();  ///< px of the image
  double area_px = 0.0;
  double difference = 0.0;  ///< between the mean grey values of background and bead class
  bool cut = false;         ///< the region touches the window's border
  bool is_core = false;     ///< only the middle of the bead, see BeadLook::core_shift_px
  double elongation = 1.0;  ///< ratio of its principal second moments
};

/// What measure_bead looks for.
struct BeadSearch {
  const BeadTrackerSettings& settings;
  Eigen::Vector2d near = Eigen::Vector2d::Zero();  ///< where the bead is expected
  double expected_area_px = 0.0;                   ///< 0 = not known
  bool take_largest = false;  ///< of the regions that look like a bead, the largest instead of the nearest
};

/// Steps iv to vii: contrast, Otsu's threshold, opening and closing, centroid of the region that looks like the bead
/// (BeadLook). Nothing if no region does.
std::optional<BeadMeasurement> measure_bead(const GreyWindow& window, const BeadSearch& search);

/// Otsu's threshold of a histogram of the values first..255: the value v for which the classes <= v and > v have the
/// largest variance between them; nothing if all counts are at one value or there are none.
std::optional<int> otsu_threshold(const std::array<int, 256>& histogram, int first = 0);

}  // namespace touchstone::sensors
