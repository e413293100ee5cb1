#include "render/imager/imager_presets.h"

#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::render {
namespace {

using Maker = ImagerPreset (*)(double);
constexpr std::array<std::pair<std::string_view, Maker>, 4> kPresets = {{{"imx273", imx273_preset},
                                                                         {"c310", c310_class_preset},
                                                                         {"davis240c", davis240c_frames_preset},
                                                                         {"adns2620", adns2620_preset}}};

/// What all presets share: exposure and bands.
Imager three_bands(int bits, double exposure_s) {
  Imager imager;
  imager.bits = bits;
  imager.exposure_s = exposure_s;
  imager.wavelengths_nm.resize(3);
  imager.wavelengths_nm << 450.0, 540.0, 610.0;
  return imager;
}

/// Black level four times the read noise, rounded up; the full well gives the largest number.
void fill_range(Imager& imager) {
  const double largest = static_cast<double>((1 << imager.bits) - 1);
  imager.black_level_DN = std::ceil(4.0 * imager.read_noise_e * largest / imager.full_well_e);
  imager.gain_DN_per_e = (largest - imager.black_level_DN) / imager.full_well_e;
  check(imager);
}

void grey_efficiency(Imager& imager, double blue, double green, double red) {
  imager.quantum_efficiency.resize(1, 3);
  imager.quantum_efficiency << blue, green, red;
}

}  // namespace

ImagerPreset imx273_preset(double exposure_s) {
  return {.name = "imx273",
          .imager = imx273_skipping(12, exposure_s),
          .width = 640,
          .height = 480,
          .pixel_pitch_um = 6.9,
          .frame_rate_Hz = 601.25,
          .line_time_s = 0.0,
          .source = "full well and dark noise: published SNR 40.2 dB and dynamic range 71.4 dB of the IMX273",
          .uncertainty = "quantum efficiency to 0.05; PRNU, DSNU and dark current typical, to a factor of 2"};
}

ImagerPreset c310_class_preset(double exposure_s) {
  Imager imager = three_bands(8, exposure_s);
  imager.active_area_um2 = 2.8 * 2.8;
  imager.quantum_efficiency.resize(3, 3);
  imager.quantum_efficiency << 0.05, 0.08, 0.40,  // red
      0.10, 0.45, 0.12,                           // green
      0.40, 0.10, 0.03;                           // blue
  imager.full_well_e = 6000.0;
  imager.read_noise_e = 6.0;
  imager.dark_current_e_per_s = 50.0;
  imager.prnu = 0.01;
  imager.dsnu_e = 3.0;
  imager.bayer = BayerPattern::rggb;
  fill_range(imager);
  // 720 rows and some 30 of blanking in a thirtieth of a second.
  constexpr double kLinesPerFrame = 750.0;
  return {.name = "c310",
          .imager = imager,
          .width = 1280,
          .height = 720,
          .pixel_pitch_um = 2.8,
          .frame_rate_Hz = 30.0,
          .line_time_s = 1.0 / (30.0 * kLinesPerFrame),
          .source =
              "sensor of 3.6 x 2.7 mm, measured on an opened C310 "
              "[Pomeroy2014]; "
              "1280 x 720 at 30 Hz: Logitech",
          .uncertainty =
              "pitch to 5 %, line time to 5 %; no EMVA figures are public: full well, read noise and quantum "
              "efficiency are typical of front-lit 2.8 um pixels of that time, to a factor of 1.5; PRNU, "
              "DSNU and dark current to a factor of 3"};
}

ImagerPreset davis240c_frames_preset(double exposure_s) {
  Imager imager = three_bands(10, exposure_s);
  constexpr double kFillFactor = 0.22;
  imager.active_area_um2 = kFillFactor * 18.5 * 18.5;
  grey_efficiency(imager, 0.30, 0.40, 0.40);
  imager.read_noise_e = 55.0;
  constexpr double kDynamicRange_dB = 51.0;
  imager.full_well_e = imager.read_noise_e * std::pow(10.0, kDynamicRange_dB / 20.0);
  imager.dark_current_e_per_s = 18000.0;
  imager.prnu = 0.005;
  imager.dsnu_e = 0.005 * imager.full_well_e;
  fill_range(imager);
  return {.name = "davis240c",
          .imager = imager,
          .width = 240,
          .height = 180,
          .pixel_pitch_um = 18.5,
          .frame_rate_Hz = 35.0,
          .line_time_s = 0.0,
          .source =
              "240 x 180 pixels of 18.5 um, frames of 51 dB dynamic range with 0.5 % fixed pattern noise, global "
              "shutter: [Brandli2014, abstract]",
          .uncertainty =
              "fill factor 22 %, read noise 55 e- and dark signal 18000 e-/s are figures quoted for the "
              "sensor that weren't checked again, to a factor of 1.5; the full well follows from read noise "
              "and dynamic range; the fixed pattern is split evenly in gain and offset; quantum efficiency "
              "to 0.1; 10 bits and 35 Hz are the choice of read-out"};
}

ImagerPreset adns2620_preset(double exposure_s) {
  Imager imager = three_bands(6, exposure_s);
  constexpr double kFillFactor = 0.5;
  imager.active_area_um2 = kFillFactor * 60.0 * 60.0;
  grey_efficiency(imager, 0.35, 0.45, 0.45);
  imager.full_well_e = 100000.0;
  imager.read_noise_e = 100.0;
  imager.dark_current_e_per_s = 10000.0;
  imager.prnu = 0.02;
  imager.dsnu_e = 200.0;
  fill_range(imager);
  return {.name = "adns2620",
          .imager = imager,
          .width = 18,
          .height = 18,
          .pixel_pitch_um = 60.0,
          .frame_rate_Hz = 1500.0,
          .line_time_s = 0.0,
          .source =
              "18 x 18 pixels of 6 bits, up to 3000 frames a second, 400 counts an inch, registers Pixel_Sum, "
              "Maximum_Pixel, Minimum_Pixel, SQUAL and Shutter: [ADNS2620]",
          .uncertainty =
              "the data sheet has no photometric figures: pitch (a count at 400 per inch is 63.5 um) to 20 %; "
              "full well, area and quantum efficiency together, so the sensitivity, to a factor of 3; read "
              "noise is below the step of 6 bits in any case; PRNU and DSNU to a factor of 3"};
}

std::vector<std::string_view> imager_preset_names() {
  std::vector<std::string_view> names;
  for (const auto& [name, maker] : kPresets) names.push_back(name);
  return names;
}

ImagerPreset imager_preset(std::string_view name, double exposure_s) {
  for (const auto& [known, maker] : kPresets) {
    if (name == known) return maker(exposure_s);
  }
  fail("there is no imager preset \"{}\"; allowed are {}", name, fmt::join(imager_preset_names(), ", "));
}

}  // namespace touchstone::render
