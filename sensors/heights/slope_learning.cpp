#include "sensors/heights/slope_learning.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "sensors/heights/ball_imprint.h"
#include "sensors/learning/feed_forward_network.h"

namespace touchstone::sensors {
namespace {

constexpr double kNear = 1.3;     // contact radii: where a quarter of the samples is from
constexpr double kRimFrom = 0.7;  // likewise
constexpr double kRimTo = 1.2;
constexpr Eigen::Index kBatch = 256;

/// The slope of a press's imprint at a pixel's centre.
Eigen::Vector2d slope_at(const BallImprint& imprint, const Eigen::Vector2d& centre, int u, int v, double mm_per_px) {
  const Eigen::Vector2d offset = mm_per_px * (Eigen::Vector2d(u + 0.5, v + 0.5) - centre);
  const double r = offset.norm();
  return r > 0.0 ? Eigen::Vector2d(imprint.slope(r) / r * offset) : Eigen::Vector2d::Zero();
}

BallImprint imprint_of(const LabelledPicture& press, double mm_per_px, double gel_thickness_mm) {
  return {press.ball_radius_mm, press.circle.radius * mm_per_px, gel_thickness_mm};
}

struct Pixel {
  int u, v;
};

/// Some pixels of a picture, in the order in which they were drawn; those without two channels of use are drawn again.
std::vector<Pixel> draw_pixels(const LabelledPicture& picture, int count, RandomStream& random) {
  std::vector<Pixel> pixels;
  const cv::Size size = picture.difference.size();
  const bool ball = picture.ball_radius_mm > 0.0;
  for (int tries = 0; tries < 20 * count && static_cast<int>(pixels.size()) < count; ++tries) {
    double u = random.uniform() * size.width;
    double v = random.uniform() * size.height;
    if (ball && tries % 2 == 0) {
      const double at = u / size.width;
      const double r =
          picture.circle.radius * (tries % 4 == 0 ? kRimFrom + (kRimTo - kRimFrom) * at : kNear * std::sqrt(at));
      const double angle = 2.0 * kPi * v / size.height;
      u = picture.circle.centre.x() + r * std::cos(angle);
      v = picture.circle.centre.y() + r * std::sin(angle);
    }
    if (!(u >= 0.0) || !(v >= 0.0) || u >= size.width || v >= size.height) continue;
    const Pixel pixel{static_cast<int>(u), static_cast<int>(v)};
    if (!picture.frame.empty() && saturated_channels(picture.frame.at<cv::Vec3b>(pixel.v, pixel.u)) > 1) continue;
    pixels.push_back(pixel);
  }
  return pixels;
}

/// Inputs of all samples, a column each, and both slopes there.
struct Samples {
  std::vector<float> inputs;
  std::vector<Eigen::Vector2d> slopes;
};

Samples draw_samples(std::span<const LabelledPicture> pictures, double mm_per_px, const SlopeLearning& how) {
  const auto untouched = std::count_if(pictures.begin(), pictures.end(),
                                       [](const LabelledPicture& one) { return !(one.ball_radius_mm > 0.0); });
  const auto pressed = static_cast<std::ptrdiff_t>(pictures.size()) - untouched;
  TS_ASSERT(pressed > 0);
  const double rest = untouched > 0 ? how.rest_share : 0.0;
  const cv::Size size = pictures.front().difference.size();
  Neighbourhoods neighbourhoods(size, mm_per_px);
  std::vector<float> row(static_cast<std::size_t>(SlopeNetwork::kInputs * size.width));
  Samples samples;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const LabelledPicture& picture = pictures[i];
    const bool ball = picture.ball_radius_mm > 0.0;
    const double share = ball ? (1.0 - rest) / static_cast<double>(pressed) : rest / static_cast<double>(untouched);
    RandomStream random(how.seed, i, Purpose::kFolds);
    std::vector<Pixel> pixels = draw_pixels(picture, std::max(1, static_cast<int>(share * how.samples)), random);
    std::stable_sort(pixels.begin(), pixels.end(), [](const Pixel& a, const Pixel& b) { return a.v < b.v; });
    neighbourhoods.take(picture.difference);
    std::optional<BallImprint> imprint;
    if (ball) imprint = imprint_of(picture, mm_per_px, how.gel_thickness_mm);
    int filled = -1;
    for (const Pixel& pixel : pixels) {
      if (pixel.v != filled) neighbourhoods.inputs_of_row(picture.difference, pixel.v, row.data());
      filled = pixel.v;
      for (int k = 0; k < SlopeNetwork::kInputs; ++k) {
        samples.inputs.push_back(row[static_cast<std::size_t>(k * size.width + pixel.u)]);
      }
      samples.slopes.push_back(imprint ? slope_at(*imprint, picture.circle.centre, pixel.u, pixel.v, mm_per_px)
                                       : Eigen::Vector2d::Zero());
    }
  }
  return samples;
}

/// Adam's mean gradients.
class Adam {
 public:
  explicit Adam(Eigen::Index parameters)
      : first_(Eigen::ArrayXd::Zero(parameters)), second_(Eigen::ArrayXd::Zero(parameters)) {}

  void step(Eigen::VectorXd& parameters, const Eigen::VectorXd& gradient, double rate) {
    constexpr double kFirst = 0.9;
    constexpr double kSecond = 0.999;
    constexpr double kLeast = 1e-8;
    ++steps_;
    first_ = kFirst * first_ + (1.0 - kFirst) * gradient.array();
    second_ = kSecond * second_ + (1.0 - kSecond) * gradient.array().square();
    const double unbiased = std::sqrt(1.0 - std::pow(kSecond, steps_)) / (1.0 - std::pow(kFirst, steps_));
    parameters.array() -= rate * unbiased * first_ / (second_.sqrt() + kLeast);
  }

 private:
  Eigen::ArrayXd first_, second_;
  int steps_ = 0;
};

}  // namespace

SlopeNetwork learn_slopes(std::span<const LabelledPicture> pictures, double mm_per_px, const SlopeLearning& how) {
  TS_ASSERT(!pictures.empty() && mm_per_px > 0.0 && how.units > 0 && how.samples > 0);
  const Samples samples = draw_samples(pictures, mm_per_px, how);
  const auto count = static_cast<Eigen::Index>(samples.slopes.size());
  const Eigen::Map<const Eigen::MatrixXf> inputs(samples.inputs.data(), SlopeNetwork::kInputs, count);
  SlopeNetwork learnt;
  RandomStream random(how.seed, 0, Purpose::kNetworkWeights);
  learnt.network =
      random_network({.inputs = SlopeNetwork::kInputs, .hidden_layers = 1, .units = how.units, .outputs = 2}, random);
  Eigen::VectorXd parameters = parameters_of(learnt.network);
  Adam adam(parameters.size());
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const Eigen::Index batch = std::min(kBatch, count);
  const Eigen::Index batches = count / batch;
  const auto steps = static_cast<double>(how.epochs * batches);
  Eigen::MatrixXd seen(SlopeNetwork::kInputs, batch);
  Eigen::MatrixXd wanted(2, batch);
  Eigen::Index step = 0;
  for (int epoch = 0; epoch < how.epochs; ++epoch) {
    for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
    for (Eigen::Index first = 0; first + batch <= batches * batch; first += batch, ++step) {
      for (Eigen::Index i = 0; i < batch; ++i) {
        const Eigen::Index at = order[static_cast<std::size_t>(first + i)];
        seen.col(i) = inputs.col(at).cast<double>();
        wanted.col(i) = samples.slopes[static_cast<std::size_t>(at)];
      }
      const LayerValues values = run_forward(learnt.network, seen);
      const Eigen::MatrixXd by_outputs = 2.0 / static_cast<double>(batch) * (values.back() - wanted);
      const Eigen::VectorXd gradient =
          sum_gradient(values, run_backward(learnt.network, values, by_outputs)) + 2.0 * how.decay * parameters;
      adam.step(parameters, gradient, how.rate * 0.5 * (1.0 + std::cos(kPi * static_cast<double>(step) / steps)));
      set_parameters(learnt.network, parameters);
    }
  }
  return learnt;
}

}  // namespace touchstone::sensors
