#pragma once
// Ready-made imagers, each with where its figures come from and how far they may be off.

#include <string>
#include <string_view>
#include <vector>

#include "render/imager/imager.h"

namespace touchstone::render {

/// An imager with what a camera needs to know beside it. Bands at 450, 540 and 610 nm.
struct ImagerPreset {
  std::string name;
  Imager imager;
  int width = 0;   ///< pixels as read out
  int height = 0;  ///< likewise
  double pixel_pitch_um = 0.0;
  double frame_rate_Hz = 0.0;
  double line_time_s = 0.0;  ///< from row to row of a rolling shutter (rolling_shutter.h); 0: all rows at once
  std::string source;        ///< which figures are public, and where
  std::string uncertainty;   ///< which are estimates, and how good
};

/// Sony IMX273 with 2x2 skipping, 12 bits (see imx273_skipping).
ImagerPreset imx273_preset(double exposure_s);

/// A webcam of the class of Logitech's C310: 1280x720, 2.8 um, 8 bits, RGGB, rolling shutter. Raw and linear: the
/// webcam's own gamma, sharpening and JPEG compression aren't part of it.
ImagerPreset c310_class_preset(double exposure_s);

/// The frames (not the events) of a DAVIS 240C: 240x180 grey pixels of 18.5 um, 10 bits, global shutter.
ImagerPreset davis240c_frames_preset(double exposure_s);

/// Avago's optical mouse sensor ADNS-2620: 18x18 grey pixels, 6 bits. Its statistics: mouse_statistics.h.
ImagerPreset adns2620_preset(double exposure_s);

/// The names that `imager_preset` knows: imx273, c310, davis240c, adns2620.
std::vector<std::string_view> imager_preset_names();

/// @throws Error for an unknown name or an exposure that is negative or not finite
ImagerPreset imager_preset(std::string_view name, double exposure_s);

}  // namespace touchstone::render
