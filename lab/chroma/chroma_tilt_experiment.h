#pragma once
// The tilt error of coloured markers, and spherical markers as its remedy [Lin2019, sec. V], on the setup of
// chroma_tilt_setup.h: each kind of marker is calibrated by moving it level, then tilted about its own centre, and what
// its picture seems to say of a displacement is the systematic error, since the centre hasn't moved.

#include <cstdint>
#include <span>
#include <vector>

#include "core/progress.h"
#include "lab/chroma/chroma_tilt_setup.h"

namespace touchstone::lab {

/// What a picture of one marker gives, by plain code on ideal pictures: no mosaic, no noise, no segmentation.
struct TiltReading {
  double hue = 0.0;  ///< radians, -pi to pi, 0 is red: circular mean over pixels of more than half saturation
  Eigen::Vector2d ink_px = Eigen::Vector2d::Zero();  ///< centroid of the ink
  double ink_area_px = 0.0;                          ///< pixels counted by what ink covers of them
  double ink_width_px = 0.0;      ///< the ink's larger width: of a square its side, root of 12 times the variance
  double coloured_area_px = 0.0;  ///< number of pixels of more than half saturation
};
/// `picture` as tilt_picture gives it. Ink is looked for in saturated pixels only, as the paper does, since a ball
/// throws a pink shade of saturation 0.3 on the sheet beside it. Their red and green are split into bare sheet and ink,
/// under the film or beside it as their blue shows. @throws Error if nothing in it is coloured, or has ink
TiltReading read_tilt_picture(const cv::Mat& picture, const TiltColours& colours);

/// How a level marker's reading goes with its displacement.
struct TiltCalibration {
  double hue_slope = 0.0;      ///< radians a mm towards the film: of the straight line over 0 to 1 mm
  double hue_fit_r2 = 0.0;     ///< of that line
  double centroid_gain = 0.0;  ///< px a mm along x, level and not pressed
  double area_slope = 0.0;     ///< relative change of the ink's area a mm towards the film
  double width_slope = 0.0;    ///< likewise of its width
};

/// What a tilt seems to be.
struct TiltError {
  double tilt = 0.0;        ///< radians
  double hue_change = 0.0;  ///< radians, from level
  double normal_um = 0.0;   ///< by the hue: towards the film
  double size_um = 0.0;     ///< by the ink's area: towards the film
  double width_um = 0.0;    ///< by the ink's larger width, which a tilt leaves as it is: towards the film
  double lateral_um = 0.0;  ///< by the ink's centroid: along x, to the side that is tilted towards the film
  double across_um = 0.0;   ///< likewise along y
};

/// One kind of marker, calibrated and then tilted.
struct TiltTable {
  TiltMarker marker = TiltMarker::flat;
  TiltCalibration calibration;
  std::vector<TiltError> errors;  ///< one a tilt
  double noise_normal_um = 0.0;   ///< what the paths' noise makes of one reading: difference of two seeds / sqrt 2
  double noise_lateral_um = 0.0;  ///< likewise
};

/// Calibrates and tilts one kind of marker. Each reading is the mean over four pictures that lie half a pixel apart on
/// the pixels, so that what is left isn't the grid's luck. @throws Error as tilt_scene and read_tilt_picture
TiltTable measure_tilt(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker,
                       std::span<const double> tilts, std::uint64_t seed, const Progress& progress = {});

}  // namespace touchstone::lab
