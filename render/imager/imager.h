#pragma once
// From light on the sensor to digital numbers, after the linear camera model of [EMVA1288] (release 4.0 linear):
//
//   mean photons    mu_p = sum over bands of E_b A t lambda_b / (h c)          irradiance, active area, exposure
//   mean electrons  mu_e = sum over bands of eta_b mu_p,b                      quantum efficiency of the pixel's
//                                                                              channel
//   electrons       n    = min(Poisson(mu_e (1 + PRNU) + dark current t), full well)
//   digital number  y    = clamp(floor(black + K (n + DSNU + read noise) + 1/2), 0, 2^bits - 1)
//
// so that mean and temporal variance of a pixel below saturation lie on the photon transfer line
// var_y = K^2 var_d + 1/12 + K (mu_y - mu_dark).
//
// What a camera makes of these numbers before it delivers them isn't part of that model, which ends at the linear ones.
// The order is that of [Ramanath2005, fig. 1], without what we don't simulate (denoising, colour matrix, sharpening):
//
//   the lens's vignetting (render/cameras/lens_camera.h), the light on the sensor
//   expose():  exposure (maybe automatic), photons, hot pixels' dark current, noise, K, rounding to `bits`
//   develop(): black level off, white balance (maybe automatic), colour filled in, tone curve, rounding to 8 bits, JPEG
//
// A pixel of a binned picture has three such numbers, each with electrons, noise and rounding of its own
// (BayerPattern).

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "render/imager/jpeg.h"
#include "render/imager/tone_curve.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// The colours of the filters on the 2x2 pixels at the image's top left corner, by rows. `none`: a grey sensor.
///
/// `binned`: the mosaic is finer than the picture. Each pixel is the mean of a block of 2x2, 4x4, ... of the mosaic's
/// pixels, a quarter of them red, half green, a quarter blue, so it has all three colours and there is nothing to fill
/// in. Of the block's light, A in all, the red and the blue sample get A / 4 each and the green one A / 2. The imager's
/// electrons (full well, read noise, dark current, DSNU), PRNU and K are those of the red sample and of the blue one.
/// The green sample is two of that size: twice the full well and dark current, sqrt(2) times the read noise and DSNU,
/// 1 / sqrt(2) of the PRNU and half of K, so that light that is grey to the filters gives three equal numbers. For a
/// block of n of each of red and blue, whose pixels have a full well w and a read noise r, they're n w and sqrt(n) r.
enum class BayerPattern : std::uint8_t { none, rggb, bggr, grbg, gbrg, binned };

/// Quantum efficiency, rows = channels (R, G, B of a colour sensor, else one row), columns = bands; 0 to 1.
using QuantumEfficiency = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 16>;

/// Pixels whose dark current is far above the others'. Which they are, and how hot, is the unit's. Their dark currents
/// have a log-normal distribution, one of those that fit what is measured of sensors [Baer2006].
struct HotPixels {
  double share = 0.0;                 ///< of all pixels; of a binned picture of each colour's; 0: there are none
  double dark_current_e_per_s = 0.0;  ///< the median of what they have beside the imager's own
  double spread = 0.0;                ///< standard deviation of its natural logarithm
};

/// A camera that sets its exposure so that the pictures' mean level becomes `mean_level` (a part of full scale, before
/// white balance and tone curve), by a factor of the imager's exposure within limits
/// (render/imager/automatic_control.h).
struct AutoExposure {
  double time_constant_s = 0.5;
  double mean_level = 0.2;
  double lowest = 0.25;  ///< factor
  double highest = 4.0;
};

/// A camera that sets its gains of red and blue so that the pictures' mean becomes grey, by factors of the imager's
/// white balance within limits.
struct AutoWhiteBalance {
  double time_constant_s = 0.5;
  double lowest = 0.25;  ///< factor
  double highest = 4.0;
};

/// A sensor and its read-out.
struct Imager {
  int bits = 8;                          ///< 1 to 8 give CV_8U (6 bits: 0 to 63), 9 to 16 give CV_16U
  double active_area_um2 = 0.0;          ///< light-collecting area of one pixel; binned: of all its colours together
  double exposure_s = 0.0;               ///< 0 is legal: a dark frame
  QuantumEfficiency quantum_efficiency;  ///< channels x bands
  Spectrum wavelengths_nm;               ///< of the bands
  double full_well_e = 0.0;              ///< electrons at which a pixel saturates
  double read_noise_e = 0.0;             ///< standard deviation of the temporal dark noise
  double dark_current_e_per_s = 0.0;     ///< mean thermal electrons, with shot noise of their own
  double prnu = 0.0;                     ///< standard deviation over pixels of the relative sensitivity
  double dsnu_e = 0.0;                   ///< standard deviation over pixels of the dark offset
  BayerPattern bayer = BayerPattern::none;
  double gain_DN_per_e = 1.0;   ///< K
  double black_level_DN = 0.0;  ///< added before quantisation, taken off again by `develop`
  Eigen::Vector3d white_balance{1, 1,
                                1};  ///< gains of R, G, B in `develop`; each at least 0; (1,1,1) for a grey sensor
  HotPixels hot_pixels;
  ToneCurve tone_curve;                       ///< of what `develop` delivers
  std::optional<JpegSettings> jpeg;           ///< `develop` delivers what is left behind it
  std::optional<AutoExposure> auto_exposure;  ///< expose() and develop() take what controlled() has made of the imager
  std::optional<AutoWhiteBalance> auto_white_balance;
  /// An ideal image: no shot noise, read noise, dark current, PRNU, DSNU, hot pixels or JPEG. What stays is the
  /// sensor's colour filters, the clip at full well and at the largest number, rounding to the nearest whole number
  /// (inside the range |y - (black + K mu_e)| <= 1/2), white balance and tone curve.
  bool ideal = false;
};

/// Refuses an imager whose numbers make no sense. @throws Error that names field, value and what is allowed
void check(const Imager& imager);

/// One channel (a row of `quantum_efficiency`: 0 R, 1 G, 2 B) by itself: the grey sensor that its pixels or samples
/// are, with their own area, electrons and K. The photon transfer line holds for it. @pre the imager has that channel
Imager channel_imager(const Imager& imager, int channel);

/// OpenCV's type of a raw picture: CV_8U (up to 8 bits) or CV_16U with one channel, of a binned picture with three.
int raw_type(const Imager& imager);

/// What differs from pixel to pixel of one unit, for good; a channel for each of the raw picture's.
struct FixedPattern {
  cv::Mat gain;      ///< CV_32FC1 or CV_32FC3, 1 + PRNU, not below 0
  cv::Mat offset_e;  ///< CV_32FC1 or CV_32FC3, DSNU
  /// CV_32FC1 or CV_32FC3: hot pixels' dark current, of the others 0; empty without hot pixels.
  cv::Mat hot_e_per_s = {};
};

/// The fixed pattern of the unit `unit_seed`: a pure function of the seed and the pixel's row and column.
FixedPattern fixed_pattern(const Imager& imager, cv::Size size, std::uint64_t unit_seed);

/// Raw digital numbers (CV_8UC1 or CV_16UC1, of a binned picture CV_8UC3 or CV_16UC3 in RGB order) of `irradiance`,
/// W/m^2 on the sensor, CV_32FC(bands). Noise is a pure function of (seed, frame_index, row, column, channel) and of
/// that pixel's light, monotonic in the light: the same seed on two nearly equal pictures gives nearly equal noise, and
/// threads don't matter. @pre frame_index < 2^32
/// @throws Error for a negative or non-finite irradiance (naming the first such pixel) or a wrong type or size
cv::Mat expose(const cv::Mat& irradiance, const Imager& imager, const FixedPattern& pattern, std::uint64_t seed,
               std::uint64_t frame_index);

/// The same with the fixed pattern of the unit `seed`, which it works out anew: for single pictures.
cv::Mat expose(const cv::Mat& irradiance, const Imager& imager, std::uint64_t seed, std::uint64_t frame_index);

/// How colour is filled in between a mosaic's pixels; nothing is to be filled in of a binned picture.
enum class Demosaic : std::uint8_t { bilinear, edge_aware };

/// A picture to look at or to track in: black level off, white balance on, full scale to 255, colour filled in, tone
/// curve and JPEG on; CV_8UC3 in BGR order, or CV_8UC1 of a grey sensor. With 8 bits, no black level, no white balance,
/// a linear tone curve and no JPEG it changes no number.
/// @throws Error for a raw image of a foreign type, or of a mosaic under 2x2 pixels
cv::Mat develop(const cv::Mat& raw, const Imager& imager, Demosaic method = Demosaic::bilinear);

/// What the renderer needs to know of the sensor to sample no finer than it can see. The scalars of a binned sensor are
/// of its green samples, which have the most electrons and the most noise of all; those of another channel are in
/// response_of(channel_imager(imager, channel)).
struct ImagerResponse {
  QuantumEfficiency electrons_per_irradiance;  ///< channels x bands: mean electrons per W/m^2, of each channel's area
  double dark_e = 0.0;                         ///< mean dark electrons of an exposure
  double read_noise_e = 0.0;                   ///< standard deviation
  double quantisation_e = 0.0;                 ///< electrons per digital number, 1/K
  double full_well_e = 0.0;
};
/// Of the sensor with its noise, also where `ideal` leaves it out.
ImagerResponse response_of(const Imager& imager);

/// Temporal noise of a pixel whose light frees `electrons` on average (standard deviation in electrons, referred to the
/// input): sqrt(electrons + dark + read^2 + quantisation^2/12).
double noise_e(const ImagerResponse& response, double electrons);

/// The row of `quantum_efficiency` (0 R, 1 G, 2 B; 0 for a grey sensor) of the pixel in the given column and row.
/// @pre `bayer` isn't `binned`, whose pixels have all three
int channel_of(BayerPattern bayer, int column, int row);

/// White balance that makes light of the spectrum `white` (irradiance per band) grey; the smallest gain is 1, so that
/// what saturates the sensor is white. @throws Error if a channel doesn't see `white`
Eigen::Vector3d grey_gains(const Imager& imager, const Spectrum& white);

/// A colour camera with Sony's IMX273 read out by 2x2 skipping, as in the vhs sensor: 640x480 pixels at a pitch of
/// 6.9 um, each the light of one 3.45 um pixel (area 11.9 um^2). Full well 10.5 ke- and 2.8 e- of dark noise follow
/// from the published SNR (40.2 dB) and dynamic range (71.4 dB). Bands at 450, 540 and 610 nm; their quantum
/// efficiencies are typical of what camera makers' data sheets plot for this generation of colour sensors (peak about
/// 0.6), good to about 0.05. PRNU 0.5 %, DSNU 1 e-, dark current 10 e-/s are typical too. The gain takes the full well
/// to the largest number, the black level is four times the read noise, rounded up. RGGB.
Imager imx273_skipping(int bits, double exposure_s);

}  // namespace touchstone::render
