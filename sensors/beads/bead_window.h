#pragma once
// Steps iii to vii of the tracker for one window: from grey values to a bead's centroid.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/bit_window.h"

namespace touchstone::sensors {

/// The level (0..255) of each grey value that a pixel may have. It never falls.
using LevelTable = std::array<std::uint8_t, 256>;

/// Step ii: grey values times a factor, rounded and cut to 0..255. Colour becomes grey by OpenCV's weights for BGR.
class BrightnessScale {
 public:
  /// `factor` takes the frame's own digital numbers to 0..255 levels. @pre finite and above 0
  void set(double factor);
  /// Reads a pixel row of `count` pixels, each `stride`-th one, from column x on, in row y. Of 8-bit images these are
  /// the image's own grey values, which levels_of takes to levels (of fewer values than a window has pixels, so later);
  /// of 16-bit images they are levels.
  void read(const cv::Mat& image, int x, int y, int stride, int count, std::uint8_t* out) const;
  /// What the values that are read mean. Valid as long as this is, until the next `set`.
  const LevelTable& levels_of(const cv::Mat& image) const;

 private:
  double factor_ = 1.0;
  LevelTable table_{};  ///< for 8-bit images
};

/// The grey values of a rectangle of the image, each `stride`-th pixel of each `stride`-th row.
struct GreyWindow {
  int x = 0;  ///< image column of the first pixel
  int y = 0;
  int width = 0;  ///< number of pixels taken, at most BitWindow::kMaxSide
  int height = 0;
  int stride = 1;
  std::array<std::uint8_t, BitWindow::kMaxSide * BitWindow::kMaxSide> grey;  ///< row after row
  const LevelTable* levels = nullptr;                                        ///< of each value of `grey`
};

/// Reads the window of `side` px a side (in the image; every `stride`-th pixel is taken) whose centre is nearest to
/// `centre`, cut at the image's border. Returns false if nothing of it is in the image. The window's levels are the
/// scale's.
bool read_window(const cv::Mat& image, const BrightnessScale& scale, const Eigen::Vector2d& centre, int side,
                 int stride, GreyWindow& window);

/// The region in a window that was taken for the bead.
struct BeadMeasurement {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();  ///< px of the image
  double area_px = 0.0;
  double difference = 0.0;  ///< between the mean grey values of background and bead class
  bool cut = false;         ///< the region touches the window's border
  bool is_core = false;     ///< only the middle of the bead, see BeadAppearance::core_shift_px
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
/// (BeadAppearance). Nothing if no region does.
std::optional<BeadMeasurement> measure_bead(const GreyWindow& window, const BeadSearch& search);

/// How many pixels have one value.
struct ValueCount {
  int value;
  int count;
};

/// Otsu's threshold: the index of the last entry of the lower class, where both classes have the largest variance
/// between them. Nothing if there are fewer than two entries. @pre at most 256 entries; values rise, from 0 to 255;
/// counts are above 0, together at most those of a GreyWindow
std::optional<std::size_t> otsu_threshold(std::span<const ValueCount> histogram);

}  // namespace touchstone::sensors
