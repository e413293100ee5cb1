#include "lab/chroma/chroma_robustness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/colour/hue.h"
#include "sensors/colour/marker_size.h"

namespace touchstone::lab {

namespace {

constexpr double kLeastSize_px = 2.0;

cv::Mat as_float(const cv::Mat& picture) {
  cv::Mat values;
  picture.convertTo(values, CV_32F, picture.depth() == CV_8U ? 1.0 / 255.0 : 1.0);
  return values;
}

void check(const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings) {
  if (rungs.size() < 4) fail("chroma robustness: {} displacements, 4 are needed", rungs.size());
  if (!(settings.smallest_px >= kLeastSize_px)) {
    fail("chroma robustness: the smallest size is {} px, it must be at least 2", settings.smallest_px);
  }
  if (!(settings.filter_px >= settings.smallest_px)) {
    fail("chroma robustness: the filter is {} px wide, at least the smallest size of {} is needed", settings.filter_px,
         settings.smallest_px);
  }
  for (const RobustnessRung& rung : rungs) {
    const auto is_of = [](const cv::Mat& picture, int channels) {
      return !picture.empty() && picture.channels() == channels &&
             (picture.depth() == CV_8U || picture.depth() == CV_32F);
    };
    if (!is_of(rung.colour, 3) || !is_of(rung.black_white, 1)) {
      fail("chroma robustness: a colour and a grey picture of 8 bit or float are needed for displacement {}",
           rung.displacement);
    }
    if (rung.colour.size() != rungs[0].colour.size() || rung.black_white.size() != rungs[0].colour.size()) {
      fail("chroma robustness: the pictures of displacement {} have another size than the first", rung.displacement);
    }
  }
}

/// Sizes down to the smallest: the largest that the pictures have, of the smallest times 1, 2, 4, ...
std::vector<double> marker_sizes(const RobustnessSettings& settings) {
  std::vector<double> sizes;
  for (double size = settings.smallest_px; size <= settings.filter_px; size *= 2.0) sizes.insert(sizes.begin(), size);
  return sizes;
}

cv::Mat reduced(const cv::Mat& picture, const RobustnessSettings& settings, double marker_px) {
  cv::Mat out = as_float(picture);
  const double first = marker_sizes(settings).front() / settings.filter_px;
  if (first < 1.0) cv::resize(out, out, {}, first, first, cv::INTER_AREA);
  for (double size = first * settings.filter_px; size > 1.5 * marker_px; size *= 0.5) {
    cv::pyrDown(out, out);
  }
  const double sigma = settings.blur * std::max(out.cols, out.rows);
  if (sigma > 0.0) cv::GaussianBlur(out, out, {0, 0}, sigma, sigma, cv::BORDER_REPLICATE);
  return out;
}

void lay_gradient(cv::Mat& picture, const RobustnessSettings& settings) {
  const int channels = picture.channels();
  for (int y = 0; y < picture.rows; ++y) {
    float* row = picture.ptr<float>(y);
    for (int x = 0; x < picture.cols; ++x) {
      const double across = (x + 0.5) / picture.cols;
      const double gain =
          settings.kind == LightGradient::light ? 1.0 - settings.gradient * (1.0 - across) : 1.0 - settings.gradient;
      const double added = settings.kind == LightGradient::light ? 0.0 : settings.gradient * across;
      for (int channel = 0; channel < channels; ++channel) {
        float& value = row[x * channels + channel];
        value = static_cast<float>(gain * value + added);
      }
    }
  }
}

/// As a camera of 8 bit gives it.
void round_to_bytes(cv::Mat& picture) {
  cv::Mat bytes;
  picture.convertTo(bytes, CV_8U, 255.0);
  picture = bytes;
}

/// Circular mean over pixels of enough saturation.
double mean_hue(const cv::Mat& bgr, double least_saturation, double displacement) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const cv::Vec3b& pixel = bgr.at<cv::Vec3b>(y, x);
      const auto [lowest, highest] = std::minmax({pixel[0], pixel[1], pixel[2]});
      if (highest - lowest > least_saturation * highest) sum += sensors::hue_direction(pixel[0], pixel[1], pixel[2]);
    }
  }
  if (sum.isZero(0.0))
    fail("chroma robustness: displacement {} has no pixel of saturation above {}", displacement, least_saturation);
  return sensors::hue_of(sum);
}

/// What is measured at one displacement.
struct Measured {
  double hue = 0.0;  ///< radians, against the first displacement's
  double size = 0.0;
  double darkness = 0.0;
};

std::vector<Measured> measure(const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings,
                              double marker_px, bool with_gradient, double reference_hue) {
  std::vector<Measured> all;
  for (const RobustnessRung& rung : rungs) {
    cv::Mat colour = reduced(rung.colour, settings, marker_px);
    cv::Mat grey = reduced(rung.black_white, settings, marker_px);
    if (with_gradient) {
      lay_gradient(colour, settings);
      lay_gradient(grey, settings);
    }
    round_to_bytes(colour);
    round_to_bytes(grey);
    const sensors::MarkerSize size = sensors::marker_size(grey, settings.size_threshold);
    const double hue = mean_hue(colour, settings.least_saturation, rung.displacement);
    all.push_back({sensors::hue_difference(hue, reference_hue), static_cast<double>(size.pixels), size.darkness_px});
  }
  return all;
}

double hue_of_first(const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings, double marker_px) {
  cv::Mat colour = reduced(rungs[0].colour, settings, marker_px);
  round_to_bytes(colour);
  return mean_hue(colour, settings.least_saturation, rungs[0].displacement);
}

/// R2 of the displacement by a polynomial of second order of a measurement.
double r2_of_fit(const std::vector<RobustnessRung>& rungs, const std::vector<Measured>& measured,
                 double Measured::*member) {
  const auto count = static_cast<Eigen::Index>(rungs.size());
  Eigen::VectorXd x(count), y(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    x[i] = measured[static_cast<std::size_t>(i)].*member;
    y[i] = rungs[static_cast<std::size_t>(i)].displacement;
  }
  const double spread = std::sqrt((x.array() - x.mean()).square().mean());
  const double total = (y.array() - y.mean()).square().sum();
  if (!(spread > 0.0) || !(total > 0.0)) return 0.0;
  x = (x.array() - x.mean()) / spread;
  Eigen::MatrixX3d terms(count, 3);
  terms << Eigen::VectorXd::Ones(count), x, x.cwiseAbs2();
  const Eigen::Vector3d fit = terms.colPivHouseholderQr().solve(y);
  return 1.0 - (y - terms * fit).squaredNorm() / total;
}

}  // namespace

bool size_is_lost(const PixelRobustness& few) {
  return 1.0 - few.size_r2 >= 0.5 * (1.0 - kPublishedSizeR2);
}

std::vector<PixelRobustness> pixel_robustness(const std::vector<RobustnessRung>& rungs,
                                              const RobustnessSettings& settings) {
  check(rungs, settings);
  std::vector<PixelRobustness> rows;
  for (const double size : marker_sizes(settings)) {
    const std::vector<Measured> measured = measure(rungs, settings, size, false, hue_of_first(rungs, settings, size));
    rows.push_back({size, r2_of_fit(rungs, measured, &Measured::hue), r2_of_fit(rungs, measured, &Measured::size),
                    r2_of_fit(rungs, measured, &Measured::darkness)});
  }
  return rows;
}

GradientRobustness gradient_robustness(const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings,
                                       double marker_px) {
  check(rungs, settings);
  const std::vector<double> sizes = marker_sizes(settings);
  const double size = *std::min_element(sizes.begin(), sizes.end(), [&](double a, double b) {
    return std::abs(std::log(a / marker_px)) < std::abs(std::log(b / marker_px));
  });
  const double reference = hue_of_first(rungs, settings, size);
  const std::vector<Measured> even = measure(rungs, settings, size, false, reference);
  const std::vector<Measured> bent = measure(rungs, settings, size, true, reference);
  const auto range = [&](double Measured::*member) {
    const auto [low, high] = std::minmax_element(
        even.begin(), even.end(), [&](const Measured& a, const Measured& b) { return a.*member < b.*member; });
    return (*high).*member - (*low).*member;
  };
  const double hue_range = range(&Measured::hue), size_range = range(&Measured::size),
               darkness_range = range(&Measured::darkness);
  if (!(hue_range > 0.0) || !(darkness_range > 0.0))
    fail("chroma robustness: hue or darkness is one over all displacements");
  GradientRobustness result;
  for (std::size_t i = 0; i < rungs.size(); ++i) {
    const GradientShift shift{rungs[i].displacement, 100.0 * std::abs(bent[i].hue - even[i].hue) / hue_range,
                              size_range > 0.0 ? 100.0 * std::abs(bent[i].size - even[i].size) / size_range : 0.0,
                              100.0 * std::abs(bent[i].darkness - even[i].darkness) / darkness_range};
    result.shifts.push_back(shift);
    for (double GradientShift::*member :
         {&GradientShift::hue_percent, &GradientShift::size_percent, &GradientShift::darkness_percent}) {
      result.mean.*member += shift.*member / static_cast<double>(rungs.size());
      result.worst.*member = std::max(result.worst.*member, shift.*member);
    }
  }
  return result;
}

std::vector<RobustnessRung> drawn_robustness_rungs(double smallest, double largest, int count) {
  constexpr int kSide = 512;
  constexpr double kYellow = 256.0;
  TS_ASSERT(count >= 2 && smallest > 0.0 && largest * kYellow <= kSide);
  // What a square of a side, centred, covers of a pixel.
  const auto cover = [](double side, int at) {
    const double low = 0.5 * (kSide - side), high = 0.5 * (kSide + side);
    return std::clamp(std::min(at + 1.0, high) - std::max<double>(at, low), 0.0, 1.0);
  };
  std::vector<RobustnessRung> rungs;
  for (int i = 0; i < count; ++i) {
    RobustnessRung rung;
    rung.displacement = smallest + (largest - smallest) * i / (count - 1);
    rung.colour.create(kSide, kSide, CV_32FC3);
    rung.black_white.create(kSide, kSide, CV_32FC1);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const double magenta = cover(rung.displacement * kYellow, x) * cover(rung.displacement * kYellow, y);
        const double yellow = 0.5 * cover(kYellow, x) * cover(kYellow, y);
        const double green = 1.0 - magenta;
        rung.colour.at<cv::Vec3f>(y, x) = {static_cast<float>(1.0 - yellow),
                                           static_cast<float>((1.0 - yellow) * green + yellow), 1.0F};
        rung.black_white.at<float>(y, x) = static_cast<float>(green);
      }
    }
    rungs.push_back(rung);
  }
  return rungs;
}

RobustnessSettings drawn_robustness_settings() {
  RobustnessSettings settings;
  settings.least_saturation = 0.25;
  return settings;
}

}  // namespace touchstone::lab
