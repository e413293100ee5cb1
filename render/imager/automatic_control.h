#pragma once
// Auto exposure and auto white balance: a camera that sets itself by the pictures that it takes.
//
//   ControlState state = settled(imager, metering_of(light_before, imager));     // it has watched this for long
//   for (...) {
//     frame = expose(light, controlled(imager, state), ...);
//     state = next_state(imager, state, metering_of(light, imager), seconds_to_the_next_frame);
//   }
//
// Metering reads what the sensor would deliver on average, without noise: the mean of a picture's 10^5 numbers has
// less than 1e-4 of it. So the state depends on the light alone, not on the noise's seed.

#include <array>
#include <opencv2/core/mat.hpp>

#include "render/imager/imager.h"

namespace touchstone::render {

/// What an automatic camera reads from one picture: how many of each channel's pixels have which level. A level is a
/// part of full scale (1 is the largest number, the black level off), before white balance and tone curve, at the
/// imager's own exposure; how it clips at another exposure is worked out from it.
struct Metering {
  static constexpr int kBins = 512;
  /// Pixels whose levels lie close together.
  struct Bin {
    double count = 0.0;
    double level = 0.0;  ///< mean
  };
  std::array<std::array<Bin, kBins>, 3> bins{};  ///< by channel: R, G, B; of a grey sensor the first alone
  int channels = 0;
  double full = 1.0;  ///< the level at which a pixel clips

  /// The mean level of a channel where the exposure is `factor` times the imager's.
  double mean(int channel, double factor) const;
  /// Of a picture: of a colour sensor, which has two green pixels for each red and blue one, (R + 2 G + B) / 4.
  double mean(double factor) const;
};

/// @pre `irradiance` as expose() takes it, checked
Metering metering_of(const cv::Mat& irradiance, const Imager& imager);

/// What the camera has set itself to.
struct ControlState {
  double exposure = 1.0;                            ///< factor of the imager's exposure
  Eigen::Vector3d gains = Eigen::Vector3d::Ones();  ///< factors of the imager's white balance; green's is 1
};

/// Does the imager set anything by itself?
inline bool is_automatic(const Imager& imager) {
  return imager.auto_exposure.has_value() || imager.auto_white_balance.has_value();
}

/// After it has watched the same light for long. What isn't automatic stays 1.
ControlState settled(const Imager& imager, const Metering& metering);

/// `seconds` later, having taken pictures of this light. Of a picture that doesn't clip, the logarithms of the exposure
/// and of each gain come nearer to those of settled() by exp(-seconds / time constant). @pre seconds >= 0
ControlState next_state(const Imager& imager, const ControlState& state, const Metering& metering, double seconds);

/// The imager with exposure and white balance as the state has them.
Imager controlled(const Imager& imager, const ControlState& state);

}  // namespace touchstone::render
