#include "render/direct/direct_error.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/error.h"
#include "render/direct/direct_fitness.h"
#include "render/paths/trace_twice.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {
namespace {

/// One pixel at random in each of about `count` equal fields.
cv::Mat spread_pixels(const Eigen::Vector2i& size, int count, std::uint64_t seed) {
  const double aspect = static_cast<double>(size.x()) / size.y();
  const int across = std::clamp(static_cast<int>(std::lround(std::sqrt(count * aspect))), 1, size.x());
  const int down = std::clamp(static_cast<int>(std::lround(static_cast<double>(count) / across)), 1, size.y());
  cv::Mat mask = cv::Mat::zeros(size.y(), size.x(), CV_8UC1);
  for (int j = 0; j < down; ++j) {
    for (int i = 0; i < across; ++i) {
      SampleSequence numbers(seed, static_cast<std::uint64_t>(j) * across + i, 0);
      const auto [u, v] = numbers.next_pair();
      mask.at<unsigned char>(static_cast<int>((j + v) / down * size.y()),
                             static_cast<int>((i + u) / across * size.x())) = 255;
    }
  }
  return mask;
}

struct Mean {
  double value = 0.0, error = 0.0;
};

Mean mean_of(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double sum = 0.0;
  for (double value : values) sum += value;
  double squares = 0.0;
  for (double value : values) squares += (value - sum / count) * (value - sum / count);
  return {sum / count, count > 1.0 ? std::sqrt(squares / (count - 1.0) / count) : INFINITY};
}

/// Of the mean square, from its root's.
double square_error_of(const DirectError& error) {
  if (std::isinf(error.rms)) return 0.0;
  const bool above_its_error = error.rms > error.rms_error;  // else rms_error is the square error's root
  return above_its_error ? 2.0 * error.rms * error.rms_error : error.rms_error * error.rms_error;
}

constexpr double kStandardErrors = 2.0;
constexpr std::array kTimesThePaths = {1, 4, 16};  // the last one of what is seen alone
constexpr double kWorthMoreRays = 0.9;             // of the error with fewer, where neither is within the tolerance

}  // namespace

double largest_rms(const DirectError& error) {
  return std::sqrt(error.rms * error.rms + kStandardErrors * square_error_of(error));
}

double smallest_rms(const DirectError& error) {
  return std::sqrt(std::max(0.0, error.rms * error.rms - kStandardErrors * square_error_of(error)));
}

namespace {

/// In parts of the traced pictures' root mean square, or in their own unit.
DirectError error_beside(const std::array<cv::Mat, 2>& traced, const cv::Mat& picture, const cv::Mat& mask,
                         bool in_parts) {
  const int bands = picture.channels();
  std::vector<double> products;
  std::vector<double> differences;
  std::vector<double> powers;
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      if (mask.at<unsigned char>(row, column) == 0) continue;
      double product = 0.0;
      double difference = 0.0;
      double power = 0.0;
      for (int k = bands * column; k < bands * (column + 1); ++k) {
        const double one = picture.ptr<float>(row)[k];
        const double a = traced[0].ptr<float>(row)[k];
        const double b = traced[1].ptr<float>(row)[k];
        product += (one - a) * (one - b) / bands;
        difference += (one - 0.5 * (a + b)) / bands;
        power += a * b / bands;
      }
      products.push_back(product);
      differences.push_back(difference);
      powers.push_back(power);
    }
  }
  const double power = in_parts ? mean_of(powers).value : 1.0;
  const Mean square = mean_of(products);
  const Mean shift = mean_of(differences);
  DirectError error;
  error.pixels = static_cast<int>(products.size());
  if (!(power > 0.0)) {  // a dark scene: right or endlessly wrong
    error.rms = square.value > 0.0 ? INFINITY : 0.0;
    return error;
  }
  error.rms = std::sqrt(std::max(0.0, square.value) / power);
  // The root's derivative, but for a root that can't be distinguished from zero.
  error.rms_error = square.value > square.error ? 0.5 * square.error / std::sqrt(square.value * power)
                                                : std::sqrt(square.error / power);
  error.mean = shift.value / std::sqrt(power);
  error.mean_error = shift.error / std::sqrt(power);
  return error;
}

}  // namespace

DirectError direct_error_beside(const std::array<cv::Mat, 2>& traced, const cv::Mat& picture, const cv::Mat& mask) {
  return error_beside(traced, picture, mask, true);
}

DirectError plain_error_beside(const std::array<cv::Mat, 2>& traced, const cv::Mat& picture, const cv::Mat& mask) {
  return error_beside(traced, picture, mask, false);
}

namespace {

/// Root mean square of one picture's noise, from the difference of two.
double noise_between(const std::array<cv::Mat, 2>& traced, const cv::Mat& mask, bool in_parts) {
  const int channels = traced[0].channels();
  double squares = 0.0;
  double power = 0.0;
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.cols; ++column) {
      if (mask.at<unsigned char>(row, column) == 0) continue;
      for (int k = channels * column; k < channels * (column + 1); ++k) {
        const double a = traced[0].ptr<float>(row)[k];
        const double b = traced[1].ptr<float>(row)[k];
        squares += 0.5 * (a - b) * (a - b);
        power += a * b;
      }
    }
  }
  return std::sqrt(squares / (in_parts ? power : static_cast<double>(cv::countNonZero(mask)) * channels));
}

/// A scene's pixels by paths, traced when first asked for: pictures of several renderers stand beside them.
class Reference {
 public:
  Reference(const Scene& scene, const Camera& camera, const DirectErrorSettings& settings)
      : scene_(scene), camera_(camera), settings_(settings) {
    if (settings.pixels < 2 || settings.samples < 1) {
      fail("direct error: {} pixels of {} samples; at least 2 and 1 are needed", settings.pixels, settings.samples);
    }
    mask_ = spread_pixels(size_of(camera), settings.pixels, settings.seed);
  }

  /// Beside so many times the paths of the settings.
  DirectError error_of(const cv::Mat& picture, int times) { return direct_error_beside(traced(times), picture, mask_); }
  /// The same as it is seen. @pre the settings say how
  DirectError seen_error_of(const cv::Mat& picture, int times) {
    const std::array<cv::Mat, 2>& both = traced(times);
    return plain_error_beside({settings_.seen(both[0]), settings_.seen(both[1])}, settings_.seen(picture), mask_);
  }

  /// What `paths` a pixel would leave, in the unit of the error that decides, from what was traced with the nearest
  /// number: stratified paths' noise falls faster than the root.
  double noise_of(int paths) const {
    const auto apart = [&](int times) {
      return std::abs(std::log(static_cast<double>(times) * settings_.samples / paths));
    };
    const auto nearest = std::min_element(
        traced_.begin(), traced_.end(), [&](const auto& a, const auto& b) { return apart(a.first) < apart(b.first); });
    const auto& [times, both] = *nearest;
    const double noise = settings_.seen
                             ? noise_between({settings_.seen(both[0]), settings_.seen(both[1])}, mask_, false)
                             : noise_between(both, mask_, true);
    return noise * std::sqrt(static_cast<double>(times) * settings_.samples / paths);
  }

 private:
  const std::array<cv::Mat, 2>& traced(int times) {
    std::array<cv::Mat, 2>& both = traced_[times];
    if (both[0].empty()) {
      both = trace_twice(scene_, camera_, mask_, times * settings_.samples, settings_.max_depth, settings_.seed);
    }
    return both;
  }

  const Scene& scene_;
  const Camera& camera_;
  DirectErrorSettings settings_;
  cv::Mat mask_;
  std::map<int, std::array<cv::Mat, 2>> traced_;
};

}  // namespace

DirectError measure_direct_error(const cv::Mat& picture, const Scene& scene, const Camera& camera,
                                 const DirectErrorSettings& settings) {
  const auto bands = static_cast<int>(scene.environment.size());
  const Eigen::Vector2i size = size_of(camera);
  if (picture.type() != CV_32FC(bands) || picture.cols != size.x() || picture.rows != size.y()) {
    fail("direct error: the picture has {} x {} pixels of {} channels; the camera has {} x {} of {} (32-bit floats)",
         picture.cols, picture.rows, picture.channels(), size.x(), size.y(), bands);
  }
  return Reference(scene, camera, settings).error_of(picture, 1);
}

LightFieldSettings light_field_settings(const Scene& rest, const Eigen::AlignedBox3d& reach,
                                        const DirectChoiceSettings& settings) {
  LightFieldSettings light;
  light.accuracy =
      settings.field_accuracy > 0.0 ? settings.field_accuracy : std::clamp(0.5 * settings.tolerance, 1e-4, 1e-2);
  light.guides = settings.guides;
  light.lit_radius = settings.lit_radius;
  light.walls = walls_round_sheet(rest, reach);
  return light;
}

DirectChoice choose_direct(const Scene& rest, const Scene& first, const Camera& camera,
                           const Eigen::AlignedBox3d& reach, const DirectChoiceSettings& settings) {
  if (!(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance)) {
    fail("direct choice: tolerance is {}; it must be above 0", settings.tolerance);
  }
  check_scene(rest);
  check_scene(first);
  make_ready(camera);
  DirectChoice choice;
  if (rest.interreflection != first.interreflection) {
    choice.reason = "one of the scenes asks for interreflection, the other doesn't";
    return choice;
  }
  Scene direct = rest;
  direct.interreflection = false;
  LightField field;
  try {
    field = make_light_field(direct, reach, light_field_settings(rest, reach, settings));
  } catch (const Error& error) {
    choice.reason = error.what();
    return choice;
  }
  for (const Scene* scene : {&rest, &first}) {
    Scene asked = *scene;
    asked.interreflection = false;
    choice.reason = unfit_for_direct(field, asked);
    if (!choice.reason.empty()) return choice;
  }
  std::vector<int> tried = settings.samples;
  if (tried.empty()) tried.push_back(settings.direct.samples);
  Reference reference(first, camera, settings.error);
  cv::Mat traced_rest;
  DirectChoice least;  // of those that aren't within the tolerance
  double least_rms = 0.0;
  for (const int samples : tried) {
    DirectSettings drawing = settings.direct;
    drawing.samples = choice.samples = samples;
    const bool whatever = settings.whatever && samples == tried.back();
    auto renderer = std::make_unique<DirectRenderer>(field, camera, direct, drawing);
    if (rest.interreflection) {
      if (traced_rest.empty()) traced_rest = trace_rest(rest, camera, settings.rest);
      choice.bounced = measure_rest_light(*renderer, rest, camera, traced_rest, settings.rest);
      renderer->set_bounced_light(choice.bounced, rest);
    }
    const cv::Mat picture = renderer->render(first).irradiance;
    DirectError deciding;
    for (const int times : kTimesThePaths) {
      if (times == kTimesThePaths.back() && !settings.error.seen) break;
      choice.error = deciding = reference.error_of(picture, times);
      if (settings.error.seen) choice.seen_error = deciding = reference.seen_error_of(picture, times);
      const bool open = largest_rms(deciding) > settings.tolerance && smallest_rms(deciding) < settings.tolerance;
      if (whatever || !open) break;
    }
    if (whatever || largest_rms(deciding) <= settings.tolerance) {
      choice.paths_noise.reset();
      choice.renderer = std::move(renderer);
      break;
    }
    if (settings.paths == 0) continue;
    choice.paths_noise = reference.noise_of(settings.paths);
    if (deciding.rms < *choice.paths_noise && (!least.renderer || deciding.rms < kWorthMoreRays * least_rms)) {
      least_rms = deciding.rms;
      least = {std::move(renderer), {},      choice.error, choice.seen_error,
               choice.paths_noise,  samples, {},           choice.bounced};
    }
  }
  if (!choice.renderer && least.renderer) choice = std::move(least);
  choice.field = std::move(field);
  if (!choice.renderer && choice.seen_error) {
    choice.reason = fmt::format("the picture is {:.2f} +- {:.2f} off, {:.2f} are asked for", choice.seen_error->rms,
                                choice.seen_error->rms_error, settings.tolerance);
  } else if (!choice.renderer) {
    choice.reason = fmt::format("the picture is {:.2f} +- {:.2f} % off, {:.2f} % are asked for", 100 * choice.error.rms,
                                100 * choice.error.rms_error, 100 * settings.tolerance);
  }
  return choice;
}

}  // namespace touchstone::render
