#pragma once
// Frame in, height map out [Li2015, sec. 2.2.2, steps 1 to 3].

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "sensors/heights/frame_gain.h"
#include "sensors/heights/height_map.h"
#include "sensors/heights/height_model.h"
#include "sensors/heights/rest_follower.h"
#include "sensors/heights/slope_network.h"
#include "sensors/numerics/poisson_solver.h"

namespace touchstone::sensors {

/// How heights end at the picture's border, what is contact, and which frames are flagged.
struct HeightSettings {
  HeightBorder border = HeightBorder::zero;
  ContactRule contact{};
  double most_lost = 0.02;   ///< share of pixels with two channels at 255 from which a frame is flagged
  double most_dark = 0.5;    ///< share of black pixels, likewise
  double least_rest = 0.05;  ///< share of the picture that shows the gel at rest, below which a frame is flagged
  FollowSettings follow{};   ///< how the background is followed as it drifts: not, unless `frames` says so
};

/// Why a pixel's slope is to be doubted: bits of HeightEstimator::doubts.
enum SlopeDoubt : std::uint8_t {
  kSlopeOfTwo = 1,   ///< one channel is at 255: the slope is from two
  kSlopeLost = 2,    ///< two or three are, or all are 0
  kSlopeUnseen = 4,  ///< calibration has seen no colour like this
  kSlopeSteep = 8    ///< steeper than 99 % of the calibration's pixels
};

/// What one frame gives. The images stay valid until the estimator's next frame.
struct HeightResult {
  cv::Mat height_mm;         ///< CV_32FC1, see height_map.h
  cv::Mat slope_u, slope_v;  ///< CV_32FC1, as looked up
  cv::Mat contact;           ///< CV_8UC1: 255 where ContactRule says contact
  int contact_pixels = 0;
  cv::Vec3d gain{1.0, 1.0, 1.0};  ///< of the frame's channels, BGR, which was taken out; 1 without white balance
  double saturated_share = 0.0;   ///< of the pixels: a channel is at 255
  double lost_share = 0.0;        ///< of the pixels: two or three channels are
  double dark_share = 0.0;        ///< all channels are 0
  double rest_share = 0.0;        ///< of the picture: as the gel at rest (FollowSettings::still_DN)
  bool overexposed = false;       ///< more lost pixels than the settings allow: heights there are too flat
  bool dark = false;              ///< more black pixels than the settings allow: no light, or a covered camera
  bool flat = false;              ///< all pixels are alike: no camera that sees a gel delivers that
  /// Less of the picture is at rest than the settings ask for, where its border is to be: the light has changed, it's
  /// another unit's background, or the contact is all over. Never with HeightBorder::free, which is for such contacts.
  bool unlike = false;
  bool contact_at_border = false;  ///< the contact runs out of the picture: use HeightBorder::free, and mind the level

  bool trusted() const { return !overexposed && !dark && !flat && !unlike; }
};

/// How well the calibration's colours cover those of a frame.
struct FrameCoverage {
  double measured_share = 0.0;  ///< of the pixels: calibration has hit the cell of their colour or one beside it
  double contact_measured_share = 0.0;  ///< of those that differ clearly from the background (1 if there are none)
  double steep_share = 0.0;             ///< of the pixels: steeper than 99 % of the calibration's, so extrapolated
};

/// Made once for a model; then every frame costs the same and, read by the table, allocates nothing. Where the
/// background is followed, a frame's heights depend on the frames before it; else on itself alone. Not for two threads
/// at once. Colours and slopes are looked up at places that are corrected in bands of four rows.
class HeightEstimator {
 public:
  /// @throws Error if the model is faulty
  explicit HeightEstimator(const HeightModel& model, const HeightSettings& settings = {});

  /// @throws Error if the frame isn't a colour picture of the model's size
  const HeightResult& estimate(const cv::Mat& frame);

  /// Takes frames of the gel at rest for its background from now on, as after a scratch, or a night.
  /// @throws Error as mean_background, or if they aren't of the model's size
  void set_rest(std::span<const cv::Mat> frames);

  /// @throws Error as estimate
  FrameCoverage coverage(const cv::Mat& frame);

  /// SlopeDoubt bits of each pixel, CV_8UC1. @throws Error as estimate
  cv::Mat doubts(const cv::Mat& frame);

 private:
  void find_slopes(const cv::Mat& frame);  ///< fills the result's slopes, gain and shares
  void take_background();                  ///< the model's, to look up from
  void look_up_slopes(const cv::Mat& frame);
  void count_shares(const cv::Mat& frame);

  HeightModel model_;
  HeightSettings settings_;
  PoissonSolver poisson_;
  std::optional<GainFinder> gains_;  ///< with white balance
  std::optional<SlopeReader> reader_;
  RestFollower follower_;
  HeightResult result_;
  cv::Mat planes_[3];
  std::vector<std::int16_t> rest_;    ///< 3 planes: the background in 128ths
  std::vector<std::int16_t> matrix_;  ///< a band of four rows after the other: 9 rows of coefficients
  std::int16_t offset_[3] = {};       ///< of the table, in 16ths of a cell
  std::vector<std::int32_t> cell_;    ///< of one row
};

}  // namespace touchstone::sensors
