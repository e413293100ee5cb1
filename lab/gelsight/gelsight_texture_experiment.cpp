#include "lab/gelsight/gelsight_texture_experiment.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <variant>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/transform.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/texture/height_gray.h"

namespace touchstone::lab {
namespace {

constexpr int kSquares = 4;  // of one image

/// The state under a force, pressed straight from above without friction: a face that covers the whole view has nothing
/// to slide on.
fem::PressState pressed(const sim::VirtualSensor& sensor, const sim::TouchObject& object, const Eigen::Vector2d& place,
                        double turn_deg, double force_N) {
  fem::Press press(sensor.gel(), object.shape(), 0.0);
  fem::PressTarget target;
  target.rotation = rotation_from_xyz({0.0, 0.0, turn_deg * kRadiansPerDegree});
  target.axis = {fem::AxisControl::at(place.x()), fem::AxisControl::at(place.y()),
                 fem::AxisControl::with_force(force_N)};
  return press.step(target);
}

/// The middle of a picture.
cv::Mat view_of(const cv::Mat& picture) {
  if (picture.cols < kTextureView_px || picture.rows < kTextureView_px) {
    fail("a picture of {} x {} px is smaller than the view of {} px a side", picture.cols, picture.rows,
         kTextureView_px);
  }
  return picture(cv::Rect((picture.cols - kTextureView_px) / 2, (picture.rows - kTextureView_px) / 2, kTextureView_px,
                          kTextureView_px))
      .clone();
}

/// A random order of 0 to n - 1 (Fisher and Yates).
std::vector<int> shuffled(int n, RandomStream& random) {
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  for (int i = n - 1; i > 0; --i) std::swap(order[i], order[static_cast<int>(random.uniform() * (i + 1))]);
  return order;
}

/// Indices of the samples of each class.
std::vector<std::vector<int>> by_class(const std::vector<TextureSample>& samples) {
  int classes = 0;
  for (const TextureSample& sample : samples) classes = std::max(classes, sample.texture + 1);
  std::vector<std::vector<int>> result(classes);
  for (std::size_t i = 0; i < samples.size(); ++i) result[samples[i].texture].push_back(static_cast<int>(i));
  return result;
}

/// Which of one class's samples train.
std::set<int> chosen(const std::vector<TextureSample>& samples, const std::vector<int>& of_class, int training,
                     TextureSplit split, RandomStream& random) {
  const int count = static_cast<int>(of_class.size());
  if (training < 1 || training >= count) {
    fail("{} training samples of {} of a class; at least one must train and one must test", training, count);
  }
  std::set<int> result;
  if (split == TextureSplit::by_sample) {
    const std::vector<int> order = shuffled(count, random);
    for (int k = 0; k < training; ++k) result.insert(of_class[order[k]]);
    return result;
  }
  std::map<int, std::vector<int>> images;
  for (const int i : of_class) images[samples[i].image].push_back(i);
  std::vector<std::vector<int>> groups;
  for (auto& [image, group] : images) groups.push_back(group);
  for (const int k : shuffled(static_cast<int>(groups.size()), random)) {
    if (static_cast<int>(result.size()) == training) break;
    result.insert(groups[k].begin(), groups[k].end());
  }
  if (static_cast<int>(result.size()) != training) fail("whole images don't make up {} training samples", training);
  return result;
}

}  // namespace

std::vector<sim::ObjectSpec> texture_objects(const std::filesystem::path& scenes) {
  const std::filesystem::path folder = scenes / "objects" / "textures";
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  if (files.empty()) fail("{}: holds no texture objects", folder.string());
  std::sort(files.begin(), files.end());
  std::vector<sim::ObjectSpec> objects;
  for (const auto& file : files) objects.push_back(sim::read_object(file));
  return objects;
}

sim::ObjectSpec another_patch(const sim::ObjectSpec& object, std::uint64_t seed) {
  sim::ObjectSpec patch = object;
  bool random = false;
  if (patch.relief) {
    std::visit(
        [&](auto& kind) {
          if constexpr (requires { kind.seed; }) {
            kind.seed = seed;
            random = true;
          }
        },
        patch.relief->kind);
  }
  if (!random) fail("object {}: has no random relief", object.name);
  return patch;
}

sensors::HeightModel calibrate_view(const sim::VirtualSensor& sensor, std::uint64_t noise_seed) {
  constexpr int kBackgrounds = 8, kPlaces = 3;
  constexpr double kBall_mm = 2.0;  // [Li2015, sec. 2.2.2]
  constexpr double kDepths_mm[] = {0.2, 0.3};
  // Places, so that circles and their shadows stay within the view.
  const double between_mm = 0.28 * kTextureView_px * sensor.mm_per_px();
  std::vector<cv::Mat> rest;
  for (int i = 0; i < kBackgrounds; ++i) rest.push_back(view_of(sensor.background(noise_seed, i)));
  const sensors::Background background = sensors::mean_background(rest);
  const sim::TouchObject ball = sensor.object(ball_of(kBall_mm));
  std::vector<sensors::BallPress> balls;
  for (int k = 0; k < kPlaces * kPlaces; ++k) {
    const Eigen::Vector2d place = between_mm * Eigen::Vector2d(k % kPlaces - 1, k / kPlaces - 1);
    for (const double depth : kDepths_mm) {
      sensors::BallPress press;
      press.name = fmt::format("ball press {}", balls.size() + 1);
      press.frame = view_of(sensor
                                .press(ball, {.place_mm = place, .depth_mm = depth},
                                       {.truth = false, .noise_seed = noise_seed + balls.size() + 1})
                                .frame);
      press.ball_radius_mm = 0.5 * kBall_mm;
      balls.push_back(std::move(press));
    }
  }
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = sensor.mm_per_px();
  sensors::HeightCalibration calibration = sensors::calibrate_height(balls, background, settings);
  sensors::require_all_used(calibration);
  return std::move(calibration.model);
}

HeightsOf estimated_heights(const sim::VirtualSensor& sensor, const sensors::HeightModel& model,
                            std::uint64_t noise_seed) {
  sensors::HeightSettings settings;
  settings.border = sensors::HeightBorder::free;  // the object covers the whole picture
  // An estimator serves one thread at a time; each thread gets a copy of this one.
  auto estimators = std::make_shared<tbb::enumerable_thread_specific<sensors::HeightEstimator>>(
      [model, settings] { return sensors::HeightEstimator(model, settings); });
  estimators->local();  // a faulty model shows here
  return [&sensor, estimators, noise_seed](const sim::TouchObject& object, const fem::PressState& press, int number) {
    const sim::Touch touch = sensor.capture(object, press, noise_seed, number);
    return PressedHeights{estimators->local().estimate(view_of(touch.frame)).height_mm.clone(), view_of(touch.height)};
  };
}

PressedHeights press_texture(const sim::VirtualSensor& sensor, const sim::ObjectSpec& object,
                             const TexturePresses& presses, int texture, int image, const HeightsOf& heights_of) {
  const auto number = (static_cast<std::uint64_t>(texture) << 16) + static_cast<std::uint64_t>(image);
  RandomStream random(presses.seed, number, Purpose::kPlacement);
  const std::uint64_t piece = next_seed(random);
  const double turn_deg = 360.0 * random.uniform();
  const Eigen::Vector2d place = presses.shift_mm * normal_pair(random);
  const double force = presses.force_N * std::max(0.2, 1.0 + presses.force_spread * random.normal());
  const sim::TouchObject touching = sensor.object(another_patch(object, piece));
  return heights_of(touching, pressed(sensor, touching, place, turn_deg, force), static_cast<int>(number));
}

std::vector<cv::Mat> middle_squares(const cv::Mat& image, int side) {
  if (image.cols < 2 * side || image.rows < 2 * side) {
    fail("an image of {} x {} px doesn't hold four squares of {} px", image.cols, image.rows, side);
  }
  const int left = image.cols / 2 - side, top = image.rows / 2 - side;
  std::vector<cv::Mat> squares;
  for (int k = 0; k < kSquares; ++k) {
    squares.push_back(image(cv::Rect(left + side * (k % 2), top + side * (k / 2), side, side)).clone());
  }
  return squares;
}

TextureSamples texture_samples(const sim::VirtualSensor& sensor, const std::vector<sim::ObjectSpec>& objects,
                               const TexturePresses& presses, const HeightsOf& heights_of, const Progress& progress) {
  constexpr int kSide = 200;
  const int images = static_cast<int>(objects.size()) * presses.images;
  std::vector<std::vector<cv::Mat>> estimated(images), membrane(images);
  std::atomic<int> done = 0;
  tbb::parallel_for(0, images, [&](int k) {
    const int texture = k / presses.images;
    const PressedHeights heights =
        press_texture(sensor, objects[texture], presses, texture, k % presses.images, heights_of);
    estimated[k] = middle_squares(heights.estimated, kSide);
    membrane[k] = middle_squares(heights.membrane, kSide);
    if (progress) progress("pressing textures", ++done, images);
  });
  const auto listed = [&](const std::vector<std::vector<cv::Mat>>& squares) {
    std::vector<TextureSample> samples;
    for (int k = 0; k < images; ++k) {
      for (const cv::Mat& square : squares[k]) samples.push_back({k / presses.images, k % presses.images, square});
    }
    return samples;
  };
  return {listed(estimated), listed(membrane)};
}

TextureScore score_textures(const std::vector<TextureSample>& samples, const sensors::TextureOperator& op,
                            double gray_step_mm, int training, TextureSplit split, int splits, std::uint64_t seed) {
  TS_ASSERT(splits >= 1);
  std::vector<Eigen::VectorXf> features(samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    features[i] = sensors::texture_feature(sensors::height_gray(samples[i].heights, gray_step_mm), op);
  });
  const std::vector<std::vector<int>> classes = by_class(samples);
  const auto count = static_cast<Eigen::Index>(classes.size());
  std::vector<double> percents(splits);
  std::vector<Eigen::MatrixXi> confusions(splits, Eigen::MatrixXi::Zero(count, count));
  tbb::parallel_for(0, splits, [&](int trial) {
    RandomStream random(seed, static_cast<std::uint64_t>(trial), Purpose::kPlacement);
    sensors::TextureModel model;
    model.op = op;
    model.gray_step_mm = gray_step_mm;
    std::vector<int> tested;
    std::vector<int> trained;
    for (const std::vector<int>& of_class : classes) {
      const std::set<int> trains = chosen(samples, of_class, training, split, random);
      for (const int i : of_class) (trains.contains(i) ? trained : tested).push_back(i);
    }
    model.features.resize(static_cast<Eigen::Index>(trained.size()), sensors::feature_size(op));
    for (std::size_t k = 0; k < trained.size(); ++k) {
      model.labels.push_back(samples[trained[k]].texture);
      model.features.row(static_cast<Eigen::Index>(k)) = features[trained[k]].transpose();
    }
    for (const int i : tested) ++confusions[trial](samples[i].texture, classify(model, features[i]).label);
    percents[trial] = 100.0 * confusions[trial].trace() / static_cast<double>(tested.size());
  });
  TextureScore score;
  score.percent = std::accumulate(percents.begin(), percents.end(), 0.0) / splits;
  double squares = 0.0;
  for (const double percent : percents) squares += (percent - score.percent) * (percent - score.percent);
  score.standard_error = splits > 1 ? std::sqrt(squares / (splits - 1) / splits) : 0.0;
  score.worst = *std::min_element(percents.begin(), percents.end());
  score.best = *std::max_element(percents.begin(), percents.end());
  score.confusion = Eigen::MatrixXi::Zero(count, count);
  for (const Eigen::MatrixXi& one : confusions) score.confusion += one;
  return score;
}

std::vector<std::string> worst_confusions(const Eigen::MatrixXi& confusion, const std::vector<std::string>& names,
                                          std::size_t most) {
  struct Pair {
    int times;
    Eigen::Index truth, answer;
  };
  std::vector<Pair> pairs;
  for (Eigen::Index i = 0; i < confusion.rows(); ++i) {
    for (Eigen::Index j = 0; j < confusion.cols(); ++j) {
      if (i != j && confusion(i, j) > 0) pairs.push_back({confusion(i, j), i, j});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.times > b.times; });
  std::vector<std::string> texts;
  for (std::size_t k = 0; k < std::min(most, pairs.size()); ++k) {
    texts.push_back(fmt::format("{} taken for {}: {}", names[pairs[k].truth], names[pairs[k].answer], pairs[k].times));
  }
  return texts;
}

}  // namespace touchstone::lab
