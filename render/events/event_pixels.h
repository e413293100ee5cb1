#pragma once
// The pixels of an event camera, from the light on them to events:
//
//   log photocurrent    u = ln(I + dark)
//   photoreceptor       dv/dt = 2 pi f3dB (u - v), f3dB = bandwidth (I + dark) / reference       (lag in the dark)
//   change amplifier    d = v - v(last event) + leak ramp
//   comparators         ON event at d = C_on, OFF event at d = -C_off, thresholds of each pixel's own
//   reset               the pixel is blind for the refractory time; at its end d = 0
//   shot noise          events at random times, at a rate that falls with the light
//
// After [Lichtsteiner2008] (pixel, bandwidth in proportion to light), [Nozaki2017] (leak) and v2e [Hu2021] (emulation
// from frames).

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/frame.h"

namespace touchstone::render {

/// What the pixels of a kind are like. Intensities are in the unit of the images, whatever it is (electrons per second,
/// W/m^2). Thresholds are natural logarithms of ratios: 0.2 is a change by 22 %.
struct EventPixelSettings {
  double on_threshold = 0.2;         ///< mean over the pixels
  double off_threshold = 0.2;        ///< mean over the pixels, counted positive
  double threshold_spread = 0.0;     ///< standard deviation over the pixels, of ON and OFF independently
  double dark_intensity = 0.0;       ///< light that gives the same current as the dark; must be given
  double bandwidth_hz = 0.0;         ///< f3dB at `reference_intensity`; 0: the photoreceptor is infinitely fast
  double reference_intensity = 0.0;  ///< needed where `bandwidth_hz` isn't 0
  std::int64_t refractory_us = 0;    ///< 0: a threshold passed n times gives n events
  double leak_rate_hz = 0.0;         ///< ON events a second of a pixel of mean ON threshold in constant light
  double shot_rate_hz = 0.0;         ///< noise events a second in the dark; half of them ON
  double shot_half_intensity = 0.0;  ///< light at which they are half as many; needed where `shot_rate_hz` isn't 0
};

/// The smallest mean threshold that is taken. The most sensitive pixel known fires at 0.003 [Delbruck2010].
inline constexpr double kLeastEventThreshold = 0.001;
inline constexpr double kLargestEventThreshold = 5.0;  ///< larger mean thresholds are refused
inline constexpr double kLongestRefractory_us = 1e9;   ///< longer refractory times are refused
inline constexpr double kFastestEventRate_hz = 1e6;    ///< one a microsecond, the finest time there is

/// Refuses settings that make no sense. @throws Error that names field, value and what is allowed
void check(const EventPixelSettings& settings);

/// Pixels of the DAVIS 240C.
inline constexpr int kDavis240cWidth = 240;
inline constexpr int kDavis240cHeight = 180;  ///< of its rows

/// The DAVIS 240C [Brandli2014], where `intensity_at_1klux` is the intensity of a white surface under 1 klux.
/// Published: threshold mismatch 3.5 % contrast [Brandli2014]; 0.1 events per pixel and second in steady light at 25
/// degrees and a dynamic range of 120 dB [Gallego2022, table 1], taken as the leak and, up to 100 klux, as a dark
/// current like that of 0.1 lux; bandwidth 3 kHz at 1 klux ([Lichtsteiner2008], the DVS128, whose photoreceptor it
/// has). Set by a camera's biases, so not one number: thresholds of 0.2 (the smallest published is 0.11) and a
/// refractory time of 0.5 ms, which v2e [Hu2021] takes for such cameras, as well as 5 shot events/s where it's dark.
/// That they are half as many at 1 lux is our choice: above some 50 lux the leak is then more than they are.
EventPixelSettings davis240c(double intensity_at_1klux);

/// The natural logarithms of `intensity` + dark, CV_32FC1.
/// @throws Error for a wrong type or size, a negative or non-finite intensity
cv::Mat log_intensity(const cv::Mat& intensity, const EventPixelSettings& settings);

/// How many pictures are wanted between two of which the logarithms (log_intensity) are given, so that from one to the
/// next no pixel changes by as much as `largest_change`, if the change is spread evenly; 0 if they are close enough. At
/// most 2^30. @throws Error for pictures of different size, of another type than CV_32FC1, not finite, or a largest
/// change that isn't positive
int needed_subdivisions(const cv::Mat& log_before, const cv::Mat& log_after, double largest_change);

/// One unit of an event camera, watching a sequence. Thresholds are a pure function of (unit seed, row, column), noise
/// of (noise seed, row, column, number of the noise event); events are the same for any number of threads. Noise comes
/// from waiting times, so how densely frames come doesn't change it.
class EventPixels {
 public:
  /// @throws Error for settings that `check` refuses, or sides outside 1 to 65536
  EventPixels(const EventPixelSettings& settings, cv::Size size, std::uint64_t unit_seed, std::uint64_t noise_seed);

  /// Takes the light at the time t_us and appends the events since the last picture, (t_last, t_us], in order of
  /// (t, y, x, OFF before ON). Between pictures the logarithm changes linearly; an event's time is the first whole
  /// microsecond at which its threshold is reached. The first picture only says where the pixels start: settled, and
  /// with no change since their last event (with leak: at a random point of the leak's ramp, so that pixels don't leak
  /// in step). Frames should come so densely that no pixel passes half a threshold (needed_subdivisions); if they
  /// don't, the events are those of the linear change.
  /// @throws Error, and changes nothing, if the picture isn't CV_32FC1 of the size, if a pixel (which is named) is
  /// negative, not finite or above 2^60 times the dark, or if t_us isn't after the last time
  void advance(const cv::Mat& intensity, std::int64_t t_us, std::vector<Event>& events);

  cv::Size size() const { return size_; }
  /// Of all pixels, ON and OFF.
  double smallest_threshold() const;
  /// Each pixel's own, CV_32FC2: ON, OFF.
  cv::Mat thresholds() const;
  /// What the photoreceptors put out: v of the last picture, CV_64FC1, natural logarithm of intensity + dark.
  /// @throws Error before the first picture
  cv::Mat photoreceptor_output() const;

 private:
  struct Interval;
  struct PixelChange;

  void start(const cv::Mat& intensity);
  template <bool kLagging, bool kNoisy>
  void watch_row(const Interval& interval, const float* light, int row, std::vector<Event>& events);
  void watch_band(const Interval& interval, const cv::Mat& intensity, int band);
  void fire(const Interval& interval, const PixelChange& change, std::vector<Event>& events);
  void fire_with_noise(const Interval& interval, const PixelChange& change, std::vector<Event>& events);

  EventPixelSettings settings_;
  cv::Size size_;
  std::uint64_t noise_seed_ = 0;
  bool started_ = false;
  std::int64_t first_us_ = 0;
  std::int64_t last_us_ = 0;

  // Of each pixel, row by row. Levels as in log_photocurrent.h; those that the settings don't need are empty.
  std::vector<std::int32_t> on_level_, off_level_;  // thresholds
  std::vector<std::int32_t> level_;                 // of the photocurrent
  std::vector<std::int32_t> change_;                // d
  std::vector<double> lag_;                         // photoreceptor's output minus level_, in log2
  std::vector<float> photocurrent_;                 // in units of the dark's
  std::vector<double> blind_us_;                    // time left of the refractory time
  std::vector<double> wait_;                        // until the next noise event, in mean waiting times
  std::vector<std::uint32_t> noise_count_;

  std::vector<std::vector<Event>> band_events_;  // rows are watched in bands, whatever the threads
  std::vector<Event> collected_, spare_;
};

}  // namespace touchstone::render
