#pragma once
// A motion-sensing chip frame by frame: what Avago's ADNS-2620 makes of the light on its 18x18 pixels.
//
//   MotionChip chip(settings, unit_seed, noise_seed);
//   for (...) {
//     ChipFrame frame = chip.expose(light_at(chip.next_middle_s()));
//     frame.statistics;                                                  // the registers after each frame
//     if (auto image = grabber.add(frame)) ...                           // one every 324 frames
//   }

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/motion_chip.h"
#include "core/pixel_grab.h"
#include "render/imager/imager.h"
#include "render/imager/motion_match.h"

namespace touchstone::render {

/// The chip's own control of its exposure. The data sheet [ADNS2620] says that it keeps the average and the maximum of
/// the pixels within normal operating ranges, and that each change is by 1/16 of the value; the ranges aren't public:
/// those of the maximum here are ours, that of the average is left out. No register holds the exposure fixed. A picture
/// that is too dark for the range at the longest exposure is therefore exposed evenly for as long as it is.
struct ChipShutter {
  bool automatic = true;       ///< false: always the longest
  int darkest_maximum = 45;    ///< below it the exposure grows by 1/16, up to the longest
  int brightest_maximum = 62;  ///< above it the exposure falls by 1/16
};

/// A chip's picture, clock and shutter.
struct MotionChipSettings {
  Imager imager;                  ///< grey, 6 bits; its exposure is the longest there is
  double frame_rate_Hz = 1500.0;  ///< the chip's default; exact, without the oscillator's tolerance
  ChipShutter shutter;
};

/// Refuses settings that make no sense. @throws Error that names field, value and what is allowed
void check(const MotionChipSettings& settings);

/// What the chip makes of one exposure.
struct ChipFrame {
  std::int64_t index = 0;
  cv::Mat raw;                ///< CV_8UC1, 18x18
  ChipStatistics statistics;  ///< as mouse_statistics.h and motion_match.h have them; counts are pixels, positive to
                              ///< the right and down
  int shutter = 0;            ///< ticks of the 24 MHz clock
};

/// Exposes frame after frame; the same bytes for the same light and seeds.
class MotionChip {
 public:
  /// `unit_seed` is the unit's: its fixed pattern. `noise_seed` is that of the noise in time.
  /// @throws Error as check
  MotionChip(const MotionChipSettings& settings, std::uint64_t unit_seed, std::uint64_t noise_seed);

  /// Seconds from the first frame's begin to the middle of the next exposure: the light of that moment stands for all
  /// of it, so motion within an exposure isn't blurred.
  double next_middle_s() const;

  /// The next frame. `irradiance` is CV_32FC(bands), 18x18, W/m^2. @throws Error as render::expose, for another size
  ChipFrame expose(const cv::Mat& irradiance);

 private:
  MotionChipSettings settings_;
  FixedPattern pattern_;
  std::uint64_t noise_seed_;
  std::int64_t next_ = 0;
  int longest_;
  int shutter_;
  MotionCounter motion_;
};

/// Puts pictures together from one pixel a frame.
class PixelGrabber {
 public:
  /// The picture that this frame's pixel completes.
  std::optional<GrabbedImage> add(const ChipFrame& frame);

 private:
  int next_ = 0;
  GrabbedImage growing_;
};

}  // namespace touchstone::render
