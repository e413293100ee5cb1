#pragma once
// Distinguishes erythema from purpura as dermatologists do with a glass (diascopy): from a frame before and a frame
// under pressure. What fades is blood in vessels, what stays isn't.
//
// The measure is an erythema index as narrow-band meters use it [Diffey1984]: 100 log10 of red by green, since
// haemoglobin takes green and leaves red. As a ratio it knows nothing of shading, fall-off or whether the gel wets the
// skin, and the colour of the light is a constant, which goes out because a mark's index is taken less that of the skin
// round it in the same frame. A mark blanches if it loses more than half of that under pressure.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// What a mark is, by whether it fades.
enum class SkinMarkKind {
  erythema,  ///< fades
  purpura,   ///< stays
  unknown,   ///< one of the frames doesn't show it (dark, white, behind beads), or it isn't touched in the second
};

/// "erythema", "purpura" or "unknown".
const char* name_of(SkinMarkKind kind);

/// One mark, with the figures that it is judged by.
struct SkinMark {
  SkinMarkKind kind = SkinMarkKind::unknown;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< px in the first frame, pixel centres at + 0.5
  double area_px = 0.0;                              ///< in the first frame
  double index_before = 0.0;                         ///< erythema index less that of the skin round it
  double index_pressed = 0.0;                        ///< the same under pressure
  double blanched = 0.0;                             ///< share of index_before that is gone
  double darkened = 0.0;                             ///< its red light under pressure by that before
};

/// What is taken for a mark, and from when on it has faded.
struct SkinMarkSettings {
  double smooth_px = 4.0;    ///< standard deviation of the smoothing against noise
  double least_index = 3.0;  ///< above the skin's median: what is fainter is no mark
  double least_area_px = 300.0;
  double rim_px = 8.0;          ///< of a mark, left out: it moves by some pixels under pressure, and the hole blurs it
  double ring_px = 16.0;        ///< width of the skin round it that it is compared with
  double bead_px = 44.0;        ///< dark things narrower than this are beads (0.5 mm and the blur): left out
  double blanched_share = 0.5;  ///< from there on it's erythema
  /// Behind gel that wets it a skin is darker than behind air, by about the gel's index squared. A mark that keeps more
  /// than this part of its light isn't touched, and is unknown. 0: no check (for a first frame in which the skin is
  /// wetted already).
  double wetted_part = 0.8;
};

/// The marks in the first frame, by area, largest first. The frames are of one exposure and light.
/// @param before, pressed CV_8UC3, of one size, of a camera that stands still, linear in light
/// @throws Error for other pictures, settings that make no sense, or frames of which less than half is neither dark nor
/// at the largest number
std::vector<SkinMark> skin_marks(const cv::Mat& before, const cv::Mat& pressed, const SkinMarkSettings& settings = {});

}  // namespace touchstone::sensors
