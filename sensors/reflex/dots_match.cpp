#include "sensors/reflex/dots_match.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/optim.hpp>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

void check(const DotsPicture& picture, const DotsPicture& rest, const DotsMatchSettings& s) {
  if (picture.rows() != rest.rows() || picture.columns() != rest.columns()) {
    fail("dots: a picture of {}x{} pixels and one at rest of {}x{}; both must be of one size", picture.columns(),
         picture.rows(), rest.columns(), rest.rows());
  }
  if (!(s.least_overlap > 0.0 && s.least_overlap <= 1.0)) {
    fail("least_overlap is {}, it must be above 0 and at most 1", s.least_overlap);
  }
  if (!(s.first_step_px > 0.0) || !std::isfinite(s.first_step_px)) {
    fail("first_step_px is {}, it must be above 0 and finite", s.first_step_px);
  }
  if (s.most_steps < 1) fail("most_steps is {}, it must be at least 1", s.most_steps);
  if (!(s.least_dilation > 0.0 && s.least_dilation < 1.0 && s.most_dilation > 1.0) || !std::isfinite(s.most_dilation)) {
    fail("dilations from {} to {}; the least must be from 0 to 1, the most above 1", s.least_dilation, s.most_dilation);
  }
}

double mean_of(const PixelTimes& times) {
  double sum = 0.0;
  for (int row = 0; row < times.rows; ++row) {
    for (int column = 0; column < times.cols; ++column) sum += static_cast<double>(times.at<float>(row, column));
  }
  return sum / static_cast<double>(times.total());
}

/// What the simplex goes down: three numbers in pixels, dilation as what it moves the picture's edge by.
class Descent : public cv::MinProblemSolver::Function {
 public:
  Descent(const DotsPicture& picture, const DotsPicture& rest, const DotsMatchSettings& settings,
          const PixelTimes* times, const KeyFrameHistory& past)
      : picture_(picture), rest_(rest), settings_(settings), times_(times), past_(past), half_(0.5 * rest.columns()) {
    if (times_ != nullptr) middle_s_ = mean_of(*times_);
  }

  int getDims() const override { return 3; }
  double calc(const double* x) const override {
    const DotsMotion motion = motion_of(x);
    const double outside =
        std::max(settings_.least_dilation - motion.dilation, motion.dilation - settings_.most_dilation);
    if (outside > 0.0) return 2.0 + outside;
    const DotsCorrelation found = correlate(picture_, rest_, motion, skew_of(motion));
    if (found.overlap < settings_.least_overlap) return 1.0 + settings_.least_overlap - found.overlap;
    return -found.correlation;
  }

  DotsMotion motion_of(const double* x) const { return {1.0 + x[0] / half_, {x[1], x[2]}}; }
  cv::Mat place_of(const DotsMotion& motion) const {
    return cv::Mat(cv::Matx13d((motion.dilation - 1.0) * half_, motion.shift_px.x(), motion.shift_px.y()));
  }
  DotsSkew skew_of(const DotsMotion& motion) const {
    DotsSkew skew;
    if (times_ == nullptr || past_.interval_s <= 0.0) return skew;
    skew.times = times_;
    skew.middle_s = middle_s_;
    skew.velocity = {(motion.dilation - past_.before.dilation) / past_.interval_s,
                     (motion.shift_px - past_.before.shift_px) / past_.interval_s};
    return skew;
  }

 private:
  const DotsPicture& picture_;
  const DotsPicture& rest_;
  const DotsMatchSettings& settings_;
  const PixelTimes* times_;
  KeyFrameHistory past_;
  double half_;
  double middle_s_ = 0.0;
};

DotsMatch match(const DotsPicture& picture, const DotsPicture& rest, std::span<const DotsMotion> starts,
                const DotsMatchSettings& settings, const PixelTimes* times, const KeyFrameHistory& past) {
  constexpr double kExact = 1e-6;
  check(picture, rest, settings);
  TS_ASSERT(!starts.empty());
  const cv::Ptr<Descent> descent = cv::makePtr<Descent>(picture, rest, settings, times, past);
  const double step = settings.first_step_px;
  const cv::Ptr<cv::DownhillSolver> simplex = cv::DownhillSolver::create(
      descent, cv::Mat(cv::Matx13d(step, step, step)),
      cv::TermCriteria(cv::TermCriteria::MAX_ITER + cv::TermCriteria::EPS, settings.most_steps, kExact));
  DotsMatch best;
  for (const DotsMotion& start : starts) {
    cv::Mat place = descent->place_of(start);
    simplex->minimize(place);
    const DotsMotion motion = descent->motion_of(place.ptr<double>());
    const DotsCorrelation found = correlate(picture, rest, motion, descent->skew_of(motion));
    const bool allowed = motion.dilation >= settings.least_dilation && motion.dilation <= settings.most_dilation &&
                         found.overlap >= settings.least_overlap;
    if (allowed && found.correlation > best.correlation) best = {motion, found.correlation, found.overlap};
  }
  return best;
}

}  // namespace

Eigen::Vector2d DotsSkew::seen(const DotsMotion& motion, const Eigen::Vector2d& place) const {
  Eigen::Vector2d at = motion(place);
  if (times == nullptr) return at;
  // The time depends on the place and the place on the time: the motion within a picture is small, so two rounds will
  // do.
  for (int round = 0; round < 2; ++round) {
    const double column = std::clamp(at.x() + 0.5 * (times->cols - 1), 0.0, static_cast<double>(times->cols - 1));
    const double row = std::clamp(at.y() + 0.5 * (times->rows - 1), 0.0, static_cast<double>(times->rows - 1));
    const int left = std::min(static_cast<int>(column), times->cols - 2);
    const int top = std::min(static_cast<int>(row), times->rows - 2);
    const double right = column - left, down = row - top;
    const auto time = [&](int y, int x) { return static_cast<double>(times->at<float>(y, x)); };
    const double after = (1.0 - down) * ((1.0 - right) * time(top, left) + right * time(top, left + 1)) +
                         down * ((1.0 - right) * time(top + 1, left) + right * time(top + 1, left + 1)) - middle_s;
    at = DotsMotion{motion.dilation + after * velocity.dilation_per_s,
                    motion.shift_px + after * velocity.px_per_s}(place);
  }
  return at;
}

DotsCorrelation correlate(const DotsPicture& picture, const DotsPicture& rest, const DotsMotion& motion,
                          const DotsSkew& skew) {
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, ab = 0.0, bb = 0.0, all = 0.0;
  for (int row = 0; row < rest.rows(); ++row) {
    for (int column = 0; column < rest.columns(); ++column) {
      const Eigen::Vector2d place = rest.place_of(row, column);
      all += rest.inside(place);
      const Eigen::Vector2d at = skew.times == nullptr ? motion(place) : skew.seen(motion, place);
      const double weight = picture.inside(at);
      if (weight <= 0.0) continue;
      const double now = picture.at(at), then = rest.at(row, column);
      n += weight;
      a += weight * now;
      b += weight * then;
      aa += weight * now * now;
      ab += weight * now * then;
      bb += weight * then * then;
    }
  }
  DotsCorrelation result;
  result.overlap = n / all;
  if (n <= 0.0) return result;
  const double var_a = aa - a * a / n, var_b = bb - b * b / n;
  const double least = 1e-9 * n;
  if (var_a > least && var_b > least) result.correlation = (ab - a * b / n) / std::sqrt(var_a * var_b);
  return result;
}

DotsMatch match_dots(const DotsPicture& picture, const DotsPicture& rest, std::span<const DotsMotion> starts,
                     const DotsMatchSettings& settings) {
  return match(picture, rest, starts, settings, nullptr, {});
}

DotsMatch match_skewed_dots(const DotsPicture& picture, const DotsPicture& rest, std::span<const DotsMotion> starts,
                            const DotsMatchSettings& settings, const PixelTimes& times, const KeyFrameHistory& past) {
  if (times.type() != CV_32FC1 || times.rows != picture.rows() || times.cols != picture.columns()) {
    fail("dots: pixel times of {}x{} and type {} for a picture of {}x{} pixels; as many of type CV_32FC1 are needed",
         times.cols, times.rows, times.type(), picture.columns(), picture.rows());
  }
  return match(picture, rest, starts, settings, &times, past);
}

DotsMatch search_dots(const DotsPicture& picture, const DotsPicture& rest, double reach_px,
                      const DotsMatchSettings& settings) {
  constexpr double kStep_px = 0.75;
  check(picture, rest, settings);
  if (!(reach_px >= 0.0) || !std::isfinite(reach_px)) fail("reach_px is {}, it must be at least 0", reach_px);
  const double step = kStep_px / (0.5 * rest.columns());
  const int shifts = static_cast<int>(std::ceil(reach_px / kStep_px));
  DotsMatch best;
  const int first = static_cast<int>(std::ceil((settings.least_dilation - 1.0) / step));
  const int last = static_cast<int>(std::floor((settings.most_dilation - 1.0) / step));
  for (int k = first; k <= last; ++k) {
    for (int y = -shifts; y <= shifts; ++y) {
      for (int x = -shifts; x <= shifts; ++x) {
        const DotsMotion motion{1.0 + k * step, {kStep_px * x, kStep_px * y}};
        const DotsCorrelation found = correlate(picture, rest, motion);
        if (found.overlap < settings.least_overlap || found.correlation <= best.correlation) continue;
        best = {motion, found.correlation, found.overlap};
      }
    }
  }
  return best;
}

}  // namespace touchstone::sensors
