#include "render/imager/motion_chip.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "render/imager/mouse_statistics.h"

namespace touchstone::render {
namespace {

constexpr double kClock_Hz = 24e6;
constexpr int kLargest = 63;
constexpr int kMostTicks = 65535;
constexpr int kStepParts = 16;  // a change of the shutter is by such a part of it
constexpr std::int64_t kMostFrames = std::int64_t{1} << 32;

int ticks_of(double exposure_s) {
  return static_cast<int>(std::round(exposure_s * kClock_Hz));
}

}  // namespace

void check(const MotionChipSettings& settings) {
  check(settings.imager);
  if (settings.imager.bits != 6 || settings.imager.bayer != BayerPattern::none) {
    fail("motion chip: its imager has {} bits{}; it must have 6 and be grey", settings.imager.bits,
         settings.imager.bayer == BayerPattern::none ? "" : " and colour filters");
  }
  const double rate = settings.frame_rate_Hz;
  if (!(rate > 0.0) || !std::isfinite(rate)) {
    fail("motion chip: frame_rate_Hz is {}; allowed is a finite number above 0", rate);
  }
  const double longest = std::min(1.0 / rate, kMostTicks / kClock_Hz);
  if (!(settings.imager.exposure_s >= 1.0 / kClock_Hz && settings.imager.exposure_s <= longest)) {
    fail("motion chip: exposure_s is {}; allowed is from {} (a tick) to {} (a frame, 65535 ticks)",
         settings.imager.exposure_s, 1.0 / kClock_Hz, longest);
  }
  const ChipShutter& shutter = settings.shutter;
  // A step of 1/16 must not jump over the range.
  const double narrowest = 1.0 + 2.0 / kStepParts;
  if (shutter.darkest_maximum < 1 || shutter.brightest_maximum >= kLargest ||
      shutter.brightest_maximum < narrowest * shutter.darkest_maximum) {
    fail(
        "motion chip: the shutter keeps the maximum from {} to {}; allowed is from 1 to {}, the upper one at least "
        "{} times the lower one",
        shutter.darkest_maximum, shutter.brightest_maximum, kLargest - 1, narrowest);
  }
}

MotionChip::MotionChip(const MotionChipSettings& settings, std::uint64_t unit_seed, std::uint64_t noise_seed)
    : settings_(settings), noise_seed_(noise_seed) {
  check(settings);
  pattern_ = fixed_pattern(settings.imager, {kChipSide, kChipSide}, unit_seed);
  longest_ = shutter_ = ticks_of(settings.imager.exposure_s);
}

double MotionChip::next_middle_s() const {
  return static_cast<double>(next_) / settings_.frame_rate_Hz + 0.5 * shutter_ / kClock_Hz;
}

ChipFrame MotionChip::expose(const cv::Mat& irradiance) {
  if (irradiance.rows != kChipSide || irradiance.cols != kChipSide) {
    fail("motion chip: the light has {}x{} pixels; it must have {}x{}", irradiance.cols, irradiance.rows, kChipSide,
         kChipSide);
  }
  TS_ASSERT(next_ < kMostFrames);  // 33 days; more have no noise of their own
  ChipFrame frame;
  frame.index = next_++;
  frame.shutter = shutter_;
  const double exposure_s = shutter_ / kClock_Hz;
  settings_.imager.exposure_s = exposure_s;
  frame.raw =
      render::expose(irradiance, settings_.imager, pattern_, noise_seed_, static_cast<std::uint64_t>(frame.index));
  const MouseStatistics statistics = mouse_statistics(frame.raw, exposure_s);
  const Eigen::Vector2i moved = motion_.count(frame.raw, statistics.squal);
  const double end_s = static_cast<double>(frame.index) / settings_.frame_rate_Hz + exposure_s;
  frame.statistics = {.t_us = std::llround(end_s * kMicrosecondsPerSecond),
                      .dx = moved.x(),
                      .dy = moved.y(),
                      .maximum = statistics.maximum,
                      .minimum = statistics.minimum,
                      .squal = statistics.squal,
                      .average = statistics.average};
  if (settings_.shutter.automatic) {
    const int step = std::max(1, shutter_ / kStepParts);
    if (statistics.maximum > settings_.shutter.brightest_maximum) shutter_ = std::max(1, shutter_ - step);
    if (statistics.maximum < settings_.shutter.darkest_maximum) shutter_ = std::min(longest_, shutter_ + step);
  }
  return frame;
}

std::optional<GrabbedImage> PixelGrabber::add(const ChipFrame& frame) {
  if (next_ == 0) growing_ = {cv::Mat(kChipSide, kChipSide, CV_8UC1, cv::Scalar(0)), frame.statistics.t_us, 0};
  const ChipPlace place = grabbed_place(next_);
  growing_.image.at<std::uint8_t>(place.row, place.column) = frame.raw.at<std::uint8_t>(place.row, place.column);
  if (++next_ < kChipPixels) return std::nullopt;
  next_ = 0;
  growing_.last_us = frame.statistics.t_us;
  return growing_;
}

}  // namespace touchstone::render
