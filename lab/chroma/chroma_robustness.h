#pragma once
// Fig. 6 of [Lin2019, sec. III.D]: how well a marker's hue, and a black marker's size, measure a displacement when the
// marker is only a few pixels wide, and when the light isn't even.
//
// What the paper leaves open, and what is done here:
// - A marker's apparent size is the side of its filter in px. "4 x 4 pixels" is taken for a filter of 4 px; if the
//   paper means the whole picture, which is twice as wide in the drawing here, its row is that of 2 px.
// - Pictures are made smaller by the Gaussian pyramid and then blurred by a Gaussian whose standard deviation is an
//   eighth of the picture's size, as the paper has it; then rounded to 8 bit, as a camera gives them.
// - Fits are of the displacement by a polynomial of second order of the measurement: that is how it would be used.
// - The size is the count of pixels in a picture of 1 bit (sensors/colour/marker_size.h). Fig. 6c names the
//   "luminosity" for the black-and-white method, so the gradient is tried on both, the count and the darkness.
// - The gradient is laid over pictures as they are, before any levelling: that hue needs none is the claim.

#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::lab {

/// R2 of the size of a black marker of 4 x 4 px (fig. 6b: "as low as").
inline constexpr double kPublishedSizeR2 = 0.5;

/// One displacement, as seen in colour and with a black marker on white in place of the coloured one.
struct RobustnessRung {
  double displacement = 0.0;  ///< in any unit, or the marker's size
  cv::Mat colour;             ///< BGR, CV_8UC3 or CV_32FC3 with white at about 1
  cv::Mat black_white;        ///< CV_8UC1 or CV_32FC1
};

/// Which gradient is laid over a picture, from its left edge to its right one.
enum class LightGradient {
  light,    ///< light falls off: pixels are multiplied by 1 - opacity .. 1, as by a gradient from black to nothing
  overlay,  ///< one from black to white: it adds grey too, as a haze would, so saturations change
};

/// How pictures are made smaller, read, and lit unevenly.
struct RobustnessSettings {
  double smallest_px = 4.0;       ///< apparent size down to which pictures are reduced; at least 2
  double filter_px = 256.0;       ///< side of the filter in the rungs' pictures
  double least_saturation = 0.5;  ///< of a pixel that counts for the hue (HSV)
  double size_threshold = 0.5;    ///< of the full scale
  double blur = 0.125;            ///< standard deviation as a part of the picture's size
  double gradient = 0.25;         ///< its opacity
  LightGradient kind = LightGradient::light;
};

/// How well displacements are estimated at one size.
struct PixelRobustness {
  double marker_px = 0.0;
  double hue_r2 = 0.0;       ///< of the fit of second order; 0 where there's no fit
  double size_r2 = 0.0;      ///< by the count of pixels
  double darkness_r2 = 0.0;  ///< by the darkness
};

/// One row for each size: the rungs' own brought to the next lower power of two times the smallest, halved down to
/// that.
/// @throws Error for fewer than 4 rungs, pictures of differing sizes or of another kind, a filter below the smallest
///   size, or a displacement whose coloured picture has no saturated pixel
std::vector<PixelRobustness> pixel_robustness(const std::vector<RobustnessRung>& rungs,
                                              const RobustnessSettings& settings);

/// Whether so few pixels cost the count of a black marker's pixels at least half of what they cost it in the paper,
/// where R2 falls from 1 to kPublishedSizeR2 ("dramatic effects").
bool size_is_lost(const PixelRobustness& few);

/// What a gradient does at one displacement: differences between with and without it, in percent of the measurement's
/// range over all displacements.
struct GradientShift {
  double displacement = 0.0;
  double hue_percent = 0.0;
  double size_percent = 0.0;
  double darkness_percent = 0.0;
};

/// What a gradient does to hue and size: each displacement, their mean and the worst.
struct GradientRobustness {
  std::vector<GradientShift> shifts;
  GradientShift mean;  ///< over displacements
  GradientShift worst;
};

/// @param marker_px the size at which it is tried: the nearest that pixel_robustness has
/// @throws Error as pixel_robustness, and if hue or darkness don't change over the rungs
GradientRobustness gradient_robustness(const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings,
                                       double marker_px);

/// The paper's drawing: 512 x 512 px, an opaque magenta square under a yellow one of 256 px with 50 % opacity, on
/// white; the displacement is the magenta's side as a part of the yellow's.
std::vector<RobustnessRung> drawn_robustness_rungs(double smallest = 0.7, double largest = 1.3, int count = 31);

/// For the drawing: yellow of 50 % opacity on white has a saturation of 0.5 itself, so half of that parts it from
/// white.
RobustnessSettings drawn_robustness_settings();

}  // namespace touchstone::lab
