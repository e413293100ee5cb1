#include "sensors/reflex/explore_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr double kDarkPart = 0.03, kFlatPart = 0.05, kWhitePixels = 0.5;
constexpr double kLeastStructure = 0.25;  // of that at rest

/// The standard deviation of what differs from the mean of 5x5 pixels round it: dots, not the light's slow changes.
double fine_structure(const cv::Mat& picture) {
  cv::Mat numbers, smooth;
  picture.convertTo(numbers, CV_32F);
  cv::blur(numbers, smooth, {5, 5}, {-1, -1}, cv::BORDER_REPLICATE);
  cv::Scalar mean, deviation;
  cv::meanStdDev(numbers - smooth, mean, deviation);
  return deviation[0];
}

PictureFault fault_of_light(const cv::Mat& picture, double white) {
  double least = 0.0, most = 0.0;
  cv::minMaxLoc(picture, &least, &most);
  if (!(most > kDarkPart * white)) return PictureFault::dark;
  const int full = cv::countNonZero(picture >= white);
  if (full > kWhitePixels * static_cast<double>(picture.total())) return PictureFault::saturated;
  return most - least < kFlatPart * white ? PictureFault::flat : PictureFault::none;
}

}  // namespace

std::string name_of(ExploreMode mode) {
  switch (mode) {
    case ExploreMode::absolute:
      return "absolute";
    case ExploreMode::relative:
      return "relative";
    case ExploreMode::held:
      return "held";
  }
  TS_ASSERT(false);
  return {};
}

std::string name_of(PictureFault fault) {
  switch (fault) {
    case PictureFault::none:
      return "none";
    case PictureFault::foreign:
      return "another size or type than the picture at rest";
    case PictureFault::dark:
      return "dark";
    case PictureFault::saturated:
      return "saturated";
    case PictureFault::flat:
      return "flat";
    case PictureFault::no_dots:
      return "no dots";
    case PictureFault::jump:
      return "neither rest nor the last picture is recognised";
  }
  TS_ASSERT(false);
  return {};
}

ExploreSettings text_explore_settings() {
  ExploreSettings settings;
  settings.flow.most_step_px = 1e9;
  settings.step_by_match = false;
  settings.step_correlation = -1.0;
  settings.key_correlation = 2.0;
  settings.search_reach_px = 0.0;
  return settings;
}

void check(const ExploreSettings& s) {
  if (!(s.absolute_from > 0.0 && s.absolute_from <= 1.0)) {
    fail("absolute_from is {}, it must be above 0 and at most 1", s.absolute_from);
  }
  if (!(s.step_correlation >= -1.0 && s.step_correlation <= 1.0)) {
    fail("step_correlation is {}, it must be from -1 to 1", s.step_correlation);
  }
  if (!std::isfinite(s.key_correlation)) fail("key_correlation is {}, it must be finite", s.key_correlation);
  if (!(s.search_reach_px >= 0.0 && s.search_reach_px <= 100.0)) {
    fail("search_reach_px is {}, it must be from 0 to 100", s.search_reach_px);
  }
  if (!(s.blur_px >= 0.0 && s.blur_px <= 10.0)) fail("blur_px is {}, it must be from 0 to 10", s.blur_px);
  if (!(s.white > 0.0 && s.white <= 255.0)) fail("white is {}, it must be above 0 and at most 255", s.white);
}

ExploreTracker::ExploreTracker(const cv::Mat& rest, const ExploreSettings& settings)
    : settings_(settings), rest_(rest, settings.blur_px) {
  check(settings_);
  if (const PictureFault fault = fault_of_light(rest, settings_.white); fault != PictureFault::none) {
    fail("the picture at rest can't be used: {}", name_of(fault));
  }
  rest_structure_ = fine_structure(rest);
  if (!settings_.times.empty()) {
    if (settings_.times.type() != CV_32FC1 || settings_.times.size() != rest.size()) {
      fail("pixel times of {}x{} for pictures of {}x{} pixels; as many are needed", settings_.times.cols,
           settings_.times.rows, rest.cols, rest.rows);
    }
    middle_s_ = cv::mean(settings_.times)[0];
  }
  match_dots(rest_, rest_, std::vector<DotsMotion>(1), settings_.match);  // refuses settings that make no sense
  dots_flow(rest_, rest_, settings_.flow);
  key_ = last_ = {rest_, {}};
}

PictureFault ExploreTracker::find_fault(const cv::Mat& picture) const {
  if (picture.type() != CV_8UC1 || picture.rows != rest_.rows() || picture.cols != rest_.columns()) {
    return PictureFault::foreign;
  }
  if (const PictureFault fault = fault_of_light(picture, settings_.white); fault != PictureFault::none) return fault;
  return fine_structure(picture) < kLeastStructure * rest_structure_ ? PictureFault::no_dots : PictureFault::none;
}

bool ExploreTracker::take_absolute(const DotsPicture& picture) {
  std::vector<DotsMotion> starts = {{}, last_.motion};
  if (has_before_last_) starts.push_back(then(last_.motion, between(before_last_, last_.motion)));
  if (settings_.search_reach_px > 0.0 && reading_.mode == ExploreMode::held && has_last_) {
    const DotsMatch found = search_dots(picture, rest_, settings_.search_reach_px, settings_.match);
    if (found.correlation > 0.0) starts.push_back(found.motion);
  }
  const double interval_s = has_last_ ? 1e-6 * static_cast<double>(reading_.t_us - last_t_us_) : 0.0;
  const DotsMatch match = settings_.times.empty() ? match_dots(picture, rest_, starts, settings_.match)
                                                  : match_skewed_dots(picture, rest_, starts, settings_.match,
                                                                      settings_.times, {last_.motion, interval_s});
  reading_.correlation = match.correlation;
  reading_.overlap = match.overlap;
  if (match.correlation < settings_.absolute_from) return false;
  reading_.mode = ExploreMode::absolute;
  reading_.motion = match.motion;
  return true;
}

bool ExploreTracker::take_step(const DotsPicture& picture) {
  const auto take = [&](const Key& key, double least) {
    const DotsMotion so_far = between(key.motion, last_.motion);
    const std::optional<DotsMotion> flow =
        dots_flow(key.picture, picture, settings_.flow, settings_.step_by_match ? so_far : DotsMotion{});
    DotsMatch step;
    if (settings_.step_by_match) {
      std::vector<DotsMotion> starts = {so_far};
      if (flow) starts.push_back(*flow);
      if (has_before_last_) starts.push_back(then(so_far, between(before_last_, last_.motion)));
      step = match_dots(picture, key.picture, starts, settings_.match);
    } else if (flow && flow->dilation > 0.0) {
      const DotsCorrelation found = correlate(picture, key.picture, *flow);
      step = {*flow, found.correlation, found.overlap};
    } else {
      return false;
    }
    if (step.correlation < least) return false;
    reading_.mode = ExploreMode::relative;
    reading_.motion = then(key.motion, step.motion);
    reading_.step_correlation = step.correlation;
    return true;
  };
  if (settings_.key_correlation <= 1.0 && take(key_, settings_.key_correlation)) return true;
  if (!take(last_, settings_.step_correlation)) return false;
  key_ = last_;
  return true;
}

void ExploreTracker::hold(PictureFault fault) {
  reading_.mode = ExploreMode::held;
  reading_.fault = fault;
  has_before_last_ = false;
}

const ExploreReading& ExploreTracker::next(const Frame& frame) {
  constexpr std::int64_t kLargestTime_us = std::int64_t{1} << 61;
  if (frame.t_us < -kLargestTime_us || frame.t_us > kLargestTime_us) {
    fail("explore tracker: the picture's time is {} us; allowed is {} to {}", frame.t_us, -kLargestTime_us,
         kLargestTime_us);
  }
  const std::int64_t t_us = frame.t_us + static_cast<std::int64_t>(std::llround(1e6 * middle_s_));
  if (has_begun_ && t_us <= reading_.t_us) {
    const std::int64_t before_us = frame.t_us - (t_us - reading_.t_us);
    fail("explore tracker: a picture at t = {} us follows one at t = {} us; times must increase", frame.t_us,
         before_us);
  }
  const ExploreMode mode_before = reading_.mode;
  has_begun_ = true;
  reading_.t_us = t_us;
  reading_.correlation = reading_.overlap = reading_.step_correlation = 0.0;
  reading_.fault = find_fault(frame.image);
  if (reading_.fault != PictureFault::none) {
    hold(reading_.fault);
    return reading_;
  }
  const DotsPicture picture(frame.image, settings_.blur_px);
  reading_.mode = mode_before;
  if (!take_absolute(picture) && !take_step(picture)) {
    hold(PictureFault::jump);
    return reading_;
  }
  before_last_ = last_.motion;
  has_before_last_ = has_last_ && mode_before != ExploreMode::held;
  last_ = {picture, reading_.motion};
  if (reading_.mode == ExploreMode::absolute) key_ = last_;
  last_t_us_ = reading_.t_us;
  has_last_ = true;
  return reading_;
}

}  // namespace touchstone::sensors
