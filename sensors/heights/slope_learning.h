#pragma once
// A slope network from frames of pressed balls.

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/heights/ball_press.h"
#include "sensors/heights/slope_network.h"

namespace touchstone::sensors {

/// A picture whose slopes are known everywhere: of a pressed ball, by its imprint in an elastic layer (BallImprint), or
/// of the untouched gel.
struct LabelledPicture {
  cv::Mat difference;           ///< CV_32FC3, without the frame's gain
  cv::Mat frame;                ///< CV_8UC3, or empty: where two channels are at 255, nothing is learnt
  ContactCircle circle;         ///< of no meaning if there's no ball
  double ball_radius_mm = 0.0;  ///< 0: untouched
};

/// How a slope network is learnt. Units, samples, epochs, rate and decay were chosen on the 20 presses of a GelSight
/// Mini that docs/sensors/gelsight.md gives figures of, by presses that were left out.
struct SlopeLearning {
  int units = 20;            ///< hidden
  int samples = 40'000;      ///< pixels, of all pictures together
  int epochs = 60;           ///< how often each is learnt from
  double rate = 0.03;        ///< of the first steps; it falls to zero along half a cosine
  double decay = 1e-5;       ///< weight of the parameters' squares beside the mean squared error
  double rest_share = 0.15;  ///< of the samples: from untouched pictures, if there are any
  double gel_thickness_mm = 4.0;
  std::uint64_t seed = 1;
};

/// Learns by Adam's steps [Kingma2015, alg. 1] of 256 pixels, drawn at random: a quarter of a press's round the rim of
/// its contact, a quarter within 1.3 contact radii, half anywhere. The same bits for the same pictures and seed. (With
/// Levenberg and Marquardt's steps, which lower the error on the same pixels faster, presses that were left out came
/// out twice as bad; scaled conjugate gradients took eight times as long for the same.)
/// @pre at least one picture with a ball
SlopeNetwork learn_slopes(std::span<const LabelledPicture> pictures, double mm_per_px, const SlopeLearning& how);

}  // namespace touchstone::sensors
