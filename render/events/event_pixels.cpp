#include "render/events/event_pixels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/events/event_order.h"
#include "render/events/log_photocurrent.h"

namespace touchstone::render {

/// The time between two pictures; all that its pixels have in common.
struct EventPixels::Interval {
  std::int64_t begin_us = 0;
  double length_us = 0.0;
  std::int64_t leak = 0;        ///< rise of the leak's ramp, in levels
  std::int32_t small_leak = 0;  ///< the same, or 0 where it's too much for 32 bits
  bool all_fire = false;        ///< no pixel's 32 bits show that it doesn't fire
  float per_dark = 0.0F;        ///< photocurrent of an intensity of 1
  float relaxations = 0.0F;     ///< of the photoreceptor at the dark's current
  float dark_waits = 0.0F;      ///< mean number of noise events in the dark
  float waits_fall = 0.0F;      ///< by how much a photocurrent of 1 thins them out
};

/// One pixel in an interval.
struct EventPixels::PixelChange {
  std::size_t pixel = 0;
  std::uint16_t x = 0, y = 0;
  std::int64_t before = 0;  ///< d at the interval's begin
  std::int64_t rise = 0;    ///< of d in it, if no event comes
  double waits = 0.0;       ///< mean number of noise events in it
};

namespace {

constexpr int kLongestSide = 1 << 16;  // a pixel's row and column share 32 bits of its random stream's index
constexpr int kRowsOfBand = 16;
constexpr int kBlock = 64;  // pixels that are checked for events at once
constexpr std::int64_t kLargestTime_us = std::int64_t{1} << 52;
constexpr std::int64_t kLargestSmallLeak = std::int64_t{1} << 28;
constexpr std::uint32_t kPhaseOfLeak = 0xffffffffu;  // a number that no noise event bears
constexpr double kNever = std::numeric_limits<double>::infinity();

std::uint64_t index_of(std::uint32_t x, std::uint32_t y, std::uint32_t number = 0) {
  return (static_cast<std::uint64_t>(number) << 32) | (y << 16) | x;
}

struct NoiseEvent {
  double wait;  ///< since the last one, in mean waiting times: exponentially distributed
  bool on;
};

NoiseEvent noise_event(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t number) {
  RandomStream stream(seed, index_of(x, y, number), Purpose::kEventNoise);
  const double wait = -std::log1p(-stream.uniform());
  return {wait, stream.uniform() < 0.5};
}

// Of one pixel. The most sensitive tail is cut, or a pixel at zero would fire for ever, and so is what 32 bits of level
// wouldn't hold together with the largest change of light.
std::int32_t threshold_level(double mean, double spread, double normal) {
  constexpr double kMostThreshold = 20.0;
  const double threshold =
      std::clamp(mean + spread * normal, std::max(0.1 * mean, kLeastEventThreshold), kMostThreshold);
  return static_cast<std::int32_t>(std::lround(threshold * kLevelPerLog));
}

void require_picture(const cv::Mat& intensity, cv::Size size, double dark) {
  if (intensity.type() != CV_32FC1 || intensity.size() != size) {
    fail("event pixels: the picture is {} x {} of OpenCV's type {}; allowed is {} x {} of type CV_32FC1",
         intensity.cols, intensity.rows, intensity.type(), size.width, size.height);
  }
  const auto largest =
      static_cast<float>(std::min(dark * kLargestPhotocurrent, 0.5 * std::numeric_limits<float>::max()));
  for (int row = 0; row < size.height; ++row) {
    const float* light = intensity.ptr<float>(row);
    int good = 0;
    for (int x = 0; x < size.width; ++x)
      good += static_cast<int>(light[x] >= 0.0F) & static_cast<int>(light[x] <= largest);
    if (good == size.width) continue;
    for (int x = 0; x < size.width; ++x) {
      if (!(light[x] >= 0.0F && light[x] <= largest)) {
        fail("intensity of pixel (column {}, row {}) is {}; allowed is a number from 0 to {}", x, row, light[x],
             largest);
      }
    }
  }
}

}  // namespace

EventPixels::EventPixels(const EventPixelSettings& settings, cv::Size size, std::uint64_t unit_seed,
                         std::uint64_t noise_seed)
    : settings_(settings), size_(size), noise_seed_(noise_seed) {
  check(settings);
  if (size.width < 1 || size.height < 1 || size.width > kLongestSide || size.height > kLongestSide) {
    fail("event pixels: the size is {} x {}; allowed are sides from 1 to {}", size.width, size.height, kLongestSide);
  }
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  on_level_.resize(pixels);
  off_level_.resize(pixels);
  level_.resize(pixels);
  change_.resize(pixels);
  if (settings.bandwidth_hz > 0.0) lag_.resize(pixels);
  if (settings.bandwidth_hz > 0.0 || settings.shot_rate_hz > 0.0) photocurrent_.resize(pixels);
  if (settings.refractory_us > 0) blind_us_.resize(pixels);
  if (settings.shot_rate_hz > 0.0) {
    wait_.resize(pixels);
    noise_count_.resize(pixels);
  }
  band_events_.resize(static_cast<std::size_t>((size.height + kRowsOfBand - 1) / kRowsOfBand));

  tbb::parallel_for(0, size.height, [&](int y) {
    std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width);
    for (int x = 0; x < size.width; ++x, ++pixel) {
      double on = 0.0;
      double off = 0.0;
      if (settings.threshold_spread > 0.0) {
        RandomStream stream(unit_seed, index_of(x, y), Purpose::kEventThreshold);
        on = stream.normal();
        off = stream.normal();
      }
      on_level_[pixel] = threshold_level(settings.on_threshold, settings.threshold_spread, on);
      off_level_[pixel] = threshold_level(settings.off_threshold, settings.threshold_spread, off);
    }
  });
}

double EventPixels::smallest_threshold() const {
  const std::int32_t smallest = std::min(*std::min_element(on_level_.begin(), on_level_.end()),
                                         *std::min_element(off_level_.begin(), off_level_.end()));
  return smallest / kLevelPerLog;
}

cv::Mat EventPixels::thresholds() const {
  cv::Mat both(size_, CV_32FC2);
  std::size_t pixel = 0;
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x, ++pixel) {
      both.at<cv::Vec2f>(y, x) = {static_cast<float>(on_level_[pixel] / kLevelPerLog),
                                  static_cast<float>(off_level_[pixel] / kLevelPerLog)};
    }
  }
  return both;
}

cv::Mat EventPixels::photoreceptor_output() const {
  if (!started_) fail("event pixels: no picture was seen yet, so the photoreceptors put out nothing");
  cv::Mat output(size_, CV_64FC1);
  const double dark = std::log(settings_.dark_intensity);
  std::size_t pixel = 0;
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x, ++pixel) {
      const double lag = lag_.empty() ? 0.0 : lag_[pixel];
      output.at<double>(y, x) = dark + level_[pixel] / kLevelPerLog + lag * std::numbers::ln2;
    }
  }
  return output;
}

void EventPixels::start(const cv::Mat& intensity) {
  const auto per_dark = static_cast<float>(1.0 / settings_.dark_intensity);
  tbb::parallel_for(0, size_.height, [&](int y) {
    const float* light = intensity.ptr<float>(y);
    std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.width);
    for (int x = 0; x < size_.width; ++x, ++pixel) {
      const float photocurrent = 1.0F + light[x] * per_dark;
      level_[pixel] = level_of(photocurrent);
      if (!photocurrent_.empty()) photocurrent_[pixel] = photocurrent;
      if (!wait_.empty()) wait_[pixel] = noise_event(noise_seed_, x, y, 0).wait;
      if (settings_.leak_rate_hz > 0.0) {
        RandomStream stream(noise_seed_, index_of(x, y, kPhaseOfLeak), Purpose::kEventNoise);
        change_[pixel] = static_cast<std::int32_t>(stream.uniform() * on_level_[pixel]);
      }
    }
  });
}

void EventPixels::advance(const cv::Mat& intensity, std::int64_t t_us, std::vector<Event>& events) {
  require_picture(intensity, size_, settings_.dark_intensity);
  if (t_us < -kLargestTime_us || t_us > kLargestTime_us) {
    fail("event pixels: the time is {} us; allowed is {} to {}", t_us, -kLargestTime_us, kLargestTime_us);
  }
  if (!started_) {
    start(intensity);
    started_ = true;
    first_us_ = last_us_ = t_us;
    return;
  }
  if (t_us <= last_us_) {
    fail("event pixels: the time is {} us; allowed is a time after the last picture's, {} us", t_us, last_us_);
  }
  Interval interval;
  interval.begin_us = last_us_;
  interval.length_us = static_cast<double>(t_us - last_us_);
  const double seconds = interval.length_us / kMicrosecondsPerSecond;
  // The ramp is rounded as a whole, not step by step.
  const double leak_per_us = settings_.leak_rate_hz * settings_.on_threshold * kLevelPerLog / kMicrosecondsPerSecond;
  const auto ramp = [&](std::int64_t t) { return std::llround(leak_per_us * static_cast<double>(t - first_us_)); };
  if (leak_per_us * static_cast<double>(t_us - first_us_) > 0x1.0p62) {
    fail("event pixels: the time is {} us; with this leak allowed is a time sooner after the first picture's, {} us",
         t_us, first_us_);
  }
  interval.leak = ramp(t_us) - ramp(last_us_);
  interval.all_fire = interval.leak > kLargestSmallLeak;
  interval.small_leak = interval.all_fire ? 0 : static_cast<std::int32_t>(interval.leak);
  interval.per_dark = static_cast<float>(1.0 / settings_.dark_intensity);
  if (!lag_.empty()) {
    interval.relaxations = static_cast<float>(std::min(
        2.0 * kPi * seconds * settings_.bandwidth_hz * settings_.dark_intensity / settings_.reference_intensity, 1e18));
  }
  if (!wait_.empty()) {
    interval.dark_waits = static_cast<float>(seconds * settings_.shot_rate_hz);
    interval.waits_fall = static_cast<float>(std::min(settings_.dark_intensity / settings_.shot_half_intensity, 1e18));
  }
  last_us_ = t_us;
  tbb::parallel_for(0, static_cast<int>(band_events_.size()), [&](int band) { watch_band(interval, intensity, band); });
  collected_.clear();
  for (const std::vector<Event>& of_band : band_events_) {
    collected_.insert(collected_.end(), of_band.begin(), of_band.end());
  }
  // Bands come in the order of (y, x, t, polarity); sorted by t and else left as it was, that is (t, y, x, polarity).
  sort_by_time(collected_, spare_, interval.begin_us, t_us);
  events.insert(events.end(), collected_.begin(), collected_.end());
}

void EventPixels::watch_band(const Interval& interval, const cv::Mat& intensity, int band) {
  std::vector<Event>& events = band_events_[static_cast<std::size_t>(band)];
  events.clear();
  const int end = std::min(size_.height, (band + 1) * kRowsOfBand);
  for (int row = band * kRowsOfBand; row < end; ++row) {
    const float* light = intensity.ptr<float>(row);
    if (lag_.empty() && wait_.empty()) watch_row<false, false>(interval, light, row, events);
    if (lag_.empty() && !wait_.empty()) watch_row<false, true>(interval, light, row, events);
    if (!lag_.empty() && wait_.empty()) watch_row<true, false>(interval, light, row, events);
    if (!lag_.empty() && !wait_.empty()) watch_row<true, true>(interval, light, row, events);
  }
}

template <bool kLagging, bool kNoisy>
void EventPixels::watch_row(const Interval& interval, const float* light, int row, std::vector<Event>& events) {
  const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(size_.width);
  std::array<std::int32_t, kBlock> rise;
  std::array<std::int32_t, kBlock> calls;  // to be checked
  std::array<float, kBlock> now, mean;     // photocurrent
  std::array<float, kBlock> exponent, gone, catch_up;
  std::array<float, kBlock> waits;
  for (int column = 0; column < size_.width; column += kBlock) {
    const int count = std::min(kBlock, size_.width - column);
    const std::size_t begin = first + static_cast<std::size_t>(column);
    const float* in = light + column;
    const std::int32_t* on = on_level_.data() + begin;
    const std::int32_t* off = off_level_.data() + begin;
    std::int32_t* level = level_.data() + begin;
    std::int32_t* change = change_.data() + begin;

    // Several short loops over small arrays: compilers make vector code of each.
    for (int i = 0; i < count; ++i) now[i] = 1.0F + in[i] * interval.per_dark;
    for (int i = 0; i < count; ++i) {
      const std::int32_t level_now = level_of(now[i]);
      rise[i] = level_now - level[i];
      level[i] = level_now;
    }
    if constexpr (kLagging || kNoisy) {
      float* photocurrent = photocurrent_.data() + begin;
      for (int i = 0; i < count; ++i) {
        mean[i] = 0.5F * (photocurrent[i] + now[i]);
        photocurrent[i] = now[i];
      }
    }
    if constexpr (kLagging) {
      // The exact answer to a straight line of the input, from dv/dE = u - v:
      // lag' = lag exp(-E) - step (1 - exp(-E)) / E, with the integral E of the rate over the interval.
      double* lag = lag_.data() + begin;
      for (int i = 0; i < count; ++i) exponent[i] = relaxation_exponent(interval.relaxations * mean[i]);
      for (int i = 0; i < count; ++i) {
        const Relaxation relaxed = relaxation(exponent[i]);
        gone[i] = relaxed.gone;
        catch_up[i] = relaxed.mean_left * (static_cast<float>(rise[i]) * static_cast<float>(1.0 / kLevelPerLog2));
      }
      for (int i = 0; i < count; ++i) {
        const double before = lag[i];
        const double after = before - before * gone[i] - catch_up[i];
        lag[i] = after;
        rise[i] += static_cast<std::int32_t>(after * kLevelPerLog2) - static_cast<std::int32_t>(before * kLevelPerLog2);
      }
    }

    std::int32_t any = interval.all_fire ? 1 : 0;
    for (int i = 0; i < count; ++i) {
      const std::int32_t after = change[i] + rise[i] + interval.small_leak;
      change[i] = after;
      calls[i] = static_cast<std::int32_t>(after >= on[i]) | static_cast<std::int32_t>(after <= -off[i]);
    }
    if constexpr (kNoisy) {
      double* wait = wait_.data() + begin;
      for (int i = 0; i < count; ++i) {
        waits[i] = interval.dark_waits / (1.0F + (mean[i] - 1.0F) * interval.waits_fall);
      }
      for (int i = 0; i < count; ++i) wait[i] -= waits[i];
      for (int i = 0; i < count; ++i) calls[i] |= static_cast<std::int32_t>(static_cast<float>(wait[i]) <= 0.0F);
    }
    if (!blind_us_.empty()) {
      const double* blind = blind_us_.data() + begin;
      for (int i = 0; i < count; ++i) calls[i] |= static_cast<std::int32_t>(static_cast<float>(blind[i]) > 0.0F);
    }
    for (int i = 0; i < count; ++i) any |= calls[i];
    if (any == 0) continue;

    for (int i = 0; i < count; ++i) {
      if (calls[i] == 0 && !interval.all_fire) continue;
      PixelChange pixel;
      pixel.pixel = begin + i;
      pixel.x = static_cast<std::uint16_t>(column + i);
      pixel.y = static_cast<std::uint16_t>(row);
      pixel.before = std::int64_t{change[i]} - rise[i] - interval.small_leak;
      pixel.rise = rise[i] + interval.leak;
      if constexpr (kNoisy) pixel.waits = waits[i];
      if (kNoisy || !blind_us_.empty()) {
        fire_with_noise(interval, pixel, events);
      } else {
        fire(interval, pixel, events);
      }
    }
  }
}

void EventPixels::fire(const Interval& interval, const PixelChange& change, std::vector<Event>& events) {
  // d rises from `before` by `rise`; the n-th event is where it has risen by n thresholds less `before`.
  const bool on = change.rise > 0;
  const std::int64_t threshold = on ? on_level_[change.pixel] : off_level_[change.pixel];
  const std::int64_t rise = on ? change.rise : -change.rise;
  std::int64_t to_go = threshold - (on ? change.before : -change.before);
  const auto whole_rise = static_cast<double>(rise);
  std::int64_t count = 0;
  for (; to_go <= rise && rise > 0; to_go += threshold) {
    const auto us = static_cast<std::int64_t>(std::ceil(static_cast<double>(to_go) * interval.length_us / whole_rise));
    // Rounding may take a crossing at the very end beyond it, or one at the begin before it.
    const std::int64_t inside = std::clamp(us, std::int64_t{1}, static_cast<std::int64_t>(interval.length_us));
    events.push_back({interval.begin_us + inside, change.x, change.y, on});
    ++count;
  }
  const std::int64_t left = change.before + change.rise - (on ? count : -count) * threshold;
  change_[change.pixel] = static_cast<std::int32_t>(left);
}

void EventPixels::fire_with_noise(const Interval& interval, const PixelChange& change, std::vector<Event>& events) {
  const double length = interval.length_us;
  const double slope = static_cast<double>(change.rise) / length;
  const double on = on_level_[change.pixel];
  const double off = off_level_[change.pixel];
  const std::size_t first_event = events.size();
  double level = static_cast<double>(change.before);
  double at = 0.0;
  double blind_until = blind_us_.empty() ? 0.0 : blind_us_[change.pixel];
  double blind_left = 0.0;

  std::uint32_t* number = wait_.empty() ? nullptr : &noise_count_[change.pixel];
  const double waits_per_us = change.waits / length;
  // `wait_` has already been taken down by this interval's part.
  double noise_at =
      number != nullptr && change.waits > 0.0 ? (wait_[change.pixel] + change.waits) / waits_per_us : kNever;
  const auto next_noise = [&] {
    *number = *number + 1 == kPhaseOfLeak ? 0 : *number + 1;
    noise_at += noise_event(noise_seed_, change.x, change.y, *number).wait / waits_per_us;
  };

  for (;;) {
    if (blind_until > at) {  // the level stays at 0, and noise that comes meanwhile is lost
      while (noise_at <= std::min(blind_until, length)) next_noise();
      if (blind_until >= length) {
        blind_left = blind_until - length;
        break;
      }
      at = blind_until;
    }
    double crossing = kNever;
    if (slope > 0.0) crossing = at + (on - level) / slope;
    if (slope < 0.0) crossing = at + (-off - level) / slope;
    const double when = std::min(crossing, noise_at);
    if (!(when <= length)) {
      level += slope * (length - at);
      break;
    }
    bool polarity = slope > 0.0;
    if (noise_at < crossing) {
      polarity = noise_event(noise_seed_, change.x, change.y, *number).on;
      next_noise();
    }
    const auto us = static_cast<std::int64_t>(std::ceil(when));
    const std::int64_t inside = std::clamp(us, std::int64_t{1}, static_cast<std::int64_t>(length));
    const Event event{interval.begin_us + inside, change.x, change.y, polarity};
    events.push_back(event);
    // Within one microsecond, OFF before ON.
    for (std::size_t i = events.size() - 1;
         i > first_event && events[i - 1].t_us == event.t_us && events[i - 1].on && !event.on; --i) {
      std::swap(events[i - 1], events[i]);
    }
    level = 0.0;
    at = std::max(at, when);
    blind_until = at + static_cast<double>(settings_.refractory_us);
  }
  // A rounded level mustn't stand at a threshold: its event would come at the begin of the next interval.
  change_[change.pixel] = static_cast<std::int32_t>(std::clamp(std::nearbyint(level), 1.0 - off, on - 1.0));
  if (!blind_us_.empty()) blind_us_[change.pixel] = blind_left;
  if (noise_at < kNever) wait_[change.pixel] = (noise_at - length) * waits_per_us;
}

}  // namespace touchstone::render
