#pragma once
// Reads a grid of soft magenta markers behind rigid yellow filters from colour pictures [Lin2019, sec. IV.B]: light
// evened out (colour_levelling.h), regions segmented and labelled, of each the centroid and the mean hue.
//
// What the paper leaves open, and what is done here:
// - Ink takes green out of white and hardly blue, the filter takes blue and hardly green. So green shows where ink is
//   and blue where filter is, each against the pixel's own largest channel: a shadow darkens all channels and changes
//   neither. How far a pixel is on the line from white to the full colour, which the picture at rest shows, is how much
//   of it is covered. Patches of ink are connected pixels of more than 0.7, so those with a blurred gap stay apart.
// - Filters are rigid: where they are is known from the picture at rest. A patch of ink belongs to the filter that most
//   of it is under (ink_ownership.h), what is filter without ink to that filter's cell. So regions that touch are
//   separated apart, and ink may reach a little under a neighbour's filter.
// - Centroids and areas weigh a rim pixel by what is covered of it: a marker of 4 x 4 px has them to parts of a pixel.
// - The mean hue is circular, as hue wraps at red, over pixels of more than half saturation, as the paper has it.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/colour/colour_levelling.h"
#include "sensors/colour/colour_marker.h"
#include "sensors/colour/ink_ownership.h"

namespace touchstone::sensors {

/// What to look for.
struct ColourMarkerAppearance {
  Eigen::Vector2i grid = {10, 10};    ///< columns, rows; 2 to 64 each
  double spacing_px = 0.0;            ///< between neighbours, in the picture; 0: found in the picture at rest
  double least_saturation = 0.5;      ///< of a pixel that counts for the mean hue (HSV); 0.2 to 0.8
  double most_under_neighbour = 0.1;  ///< part of a marker's ink that may be under other filters; 0 to 0.2
  double least_white = 24.0;  ///< grey levels of white's brightest channel, below which there's no hue; 4 to 128
};

/// Reads pictures of one sensor and one camera. Pictures with neighbours 96 px and more apart are reduced by a
/// whole factor first, and no more is looked at than the grid and a margin of 1.25 spacings: a large picture costs no
/// more than a small one. After the second picture little is allocated. One object is for one thread.
class ColourMarkerFinder {
 public:
  /// @throws Error naming the setting that is out of its range
  explicit ColourMarkerFinder(const ColourMarkerAppearance& appearance);

  /// Takes a picture of the unloaded sensor as the reference for all that follow. Markers that aren't whole in it are
  /// flawed there and in every later picture. The sensor may be turned by up to about 40 degrees.
  /// @throws Error unless the picture is CV_8UC3 with light and colour, and shows the grid that was asked for (see
  ///   find_colour_lattice); this finder is then as it was
  const ColourMarkerReading& find_rest(const cv::Mat& image);

  /// Valid until the next call.
  /// @throws Error before find_rest; unless the picture is CV_8UC3 of the size of the one at rest
  const ColourMarkerReading& find(const cv::Mat& image);

  /// Of the picture at rest. @pre find_rest was called
  const ColourMarkerReading& rest() const { return rest_; }
  /// Median distance between neighbours at rest, px; 0 before find_rest.
  double spacing_px() const { return spacing_px_ * reduction_; }

 private:
  /// Over one marker's pixels.
  struct Sums {
    double coloured = 0.0, ink = 0.0;  ///< px^2, rims by coverage
    Eigen::Vector2d coloured_moment = Eigen::Vector2d::Zero();
    Eigen::Vector2d ink_moment = Eigen::Vector2d::Zero();
    Eigen::Vector2d hue = Eigen::Vector2d::Zero();  ///< sum of (cos, sin)
    int saturated = 0;                              ///< pixels with a hue
    int clipped = 0;                                ///< coloured pixels with a channel at full scale
    double filter_value = 0.0;                      ///< sum of the largest channel over the filter's place
    int filter_pixels = 0;
    double filter = 0.0;  ///< sum of coverages (of 255) over it
  };
  void take_rest(const cv::Mat& image);
  void take_picture(const cv::Mat& image);
  void learn_colours();
  void place_filters(const std::vector<Eigen::Vector2d>& places);
  void classify();
  void take_filter_from_ink();  ///< what a filter alone takes of green isn't ink
  void find_ink();
  int patch_near(int x, int y) const;
  void add_up();
  void read(const ColourMarkerReading* rest, ColourMarkerReading& reading);
  MarkerFlaw flaw_of(const Sums& sums, std::size_t marker) const;
  FrameLight light_of_picture() const;

  ColourMarkerAppearance appearance_;
  cv::Size size_;    ///< of a whole picture
  cv::Rect region_;  ///< looked at
  int reduction_ = 1;
  double spacing_px_ = 0.0;                 ///< of the reduced picture, as all that follows
  std::vector<ColourLevelling> levelling_;  ///< one, once the spacing is known
  cv::Mat part_, levelled_;
  std::array<std::uint8_t, 256> ink_of_ratio_{}, filter_of_ratio_{};  ///< coverage of 255 by green, blue / largest
  std::vector<std::uint8_t> ink_under_filter_;
  cv::Mat ink_, filter_, core_, labels_, stats_, centroids_;
  cv::Mat cell_, filter_at_;  ///< CV_16S, marker or -1: whose cell a pixel is in, and under whose filter
  std::vector<Eigen::Vector2d> filter_place_;
  std::vector<double> filter_area_;
  std::vector<double> filter_at_rest_;  ///< Sums::filter
  double usual_area_ = 0.0;
  std::vector<std::uint8_t> cut_off_;  ///< filters that the picture's edge cuts
  std::vector<InkPatch> patches_;
  std::vector<int> patch_of_label_;
  InkOwners owners_;
  int stray_at_rest_ = 0;
  std::vector<Sums> sums_;
  ColourMarkerReading rest_, reading_;
};

}  // namespace touchstone::sensors
