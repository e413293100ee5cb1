#include "lab/reflex/reflex_experiment.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kFar_mm = -1e3;  // a place without contact

double mean_of_times(const GrabbedImage& grabbed) {
  return 0.5e-6 * static_cast<double>(grabbed.first_us + grabbed.last_us);
}

/// What a model learns from.
sensors::ReflexRecording samples_of(std::span<const ReflexPoint> points, bool with_shear) {
  sensors::ReflexRecording recording;
  for (const ReflexPoint& one : points) {
    sensors::ReflexSample& sample = recording.emplace_back();
    sample = {one.statistics, one.truth.contact, one.truth.normal_N};
    if (with_shear) sample.shear_N = one.truth.shear_N;
  }
  return recording;
}

}  // namespace

ReflexMotion reciprocation(double from_mm, double to_mm, double speed_mm_s) {
  TS_ASSERT(to_mm > from_mm && speed_mm_s > 0.0);
  const double travel_mm = to_mm - from_mm;
  return [=](double t_s) {
    const double gone_mm = std::fmod(speed_mm_s * std::max(t_s, 0.0), 2.0 * travel_mm);
    return from_mm + std::min(gone_mm, 2.0 * travel_mm - gone_mm);
  };
}

ReflexMotion single_stroke(double from_mm, double to_mm, double speed_mm_s) {
  TS_ASSERT(to_mm > from_mm && speed_mm_s > 0.0);
  return [=](double t_s) { return std::min(from_mm + speed_mm_s * std::max(t_s, 0.0), to_mm); };
}

std::vector<ReflexPoint> record_points(const ReflexSetup& setup, const ReflexTouch& touch, const ReflexMotion& motion,
                                       int points, int every, std::uint64_t noise_seed) {
  TS_ASSERT(every >= 1);
  render::MotionChip chip = setup.start_chip(noise_seed);
  std::vector<ReflexPoint> record;
  cv::Mat light;
  for (int frame = 1; static_cast<int>(record.size()) < points; ++frame) {
    const double place_mm = motion(chip.next_middle_s());
    touch.path_light.light_at(place_mm, light);
    const ChipStatistics statistics = chip.expose(light).statistics;
    if (frame % every == 0) record.push_back({statistics, touch.truth(place_mm)});
  }
  return record;
}

sensors::ReflexModel train_reflex(std::span<const ReflexPoint> points, int degree,
                                  const sensors::ContactTreeSettings& tree) {
  const sensors::ReflexRecording recording = samples_of(points, false);
  return sensors::train_reflex({&recording, 1}, {.degree = degree, .tree = tree}).model;
}

ReflexScore score_reflex(const sensors::ReflexModel& model, std::span<const ReflexPoint> points) {
  ReflexScore score;
  int missed = 0, alarms = 0, light_touches = 0;
  double squares = 0.0, light_squares = 0.0;
  for (const ReflexPoint& one : points) {
    const bool says = sensors::force_present(model.tree, one.statistics);
    const double error_N = (says ? model.force.force_N(one.statistics) : 0.0) - one.truth.normal_N;
    if (one.truth.contact && !says) {
      ++missed;
      score.missed_below_N = std::max(score.missed_below_N, one.truth.normal_N);
      score.missed_below_mm = std::max(score.missed_below_mm, one.truth.press_mm);
    }
    if (!one.truth.contact && says) ++alarms;
    squares += error_N * error_N;
    if (one.truth.contact && one.truth.normal_N < 1.0) {
      ++light_touches;
      light_squares += error_N * error_N;
    }
    score.largest_error_N = std::max(score.largest_error_N, std::abs(error_N));
  }
  score.points = static_cast<int>(points.size());
  if (points.empty()) return score;
  const auto n = static_cast<double>(points.size());
  score.missed_percent = 100.0 * missed / n;
  score.false_percent = 100.0 * alarms / n;
  score.error_percent = score.missed_percent + score.false_percent;
  score.rms_N = std::sqrt(squares / n);
  if (light_touches > 0) score.rms_below_1N_N = std::sqrt(light_squares / light_touches);
  return score;
}

std::vector<ReflexPicture> record_pictures(const ReflexSetup& setup, const ReflexTouch& touch,
                                           const ReflexMotion& motion, int pictures, std::uint64_t noise_seed) {
  render::MotionChip chip = setup.start_chip(noise_seed);
  std::vector<ReflexPicture> record;
  for (GrabbedImage& grabbed : record_images(touch.path_light, motion, chip, pictures)) {
    const double middle_s = mean_of_times(grabbed);
    record.push_back({std::move(grabbed), touch.truth(motion(middle_s))});
  }
  return record;
}

std::vector<ReflexPicture> record_still(const ReflexSetup& setup, const ReflexTouch& touch,
                                        std::span<const double> places_mm, std::uint64_t noise_seed) {
  render::MotionChip chip = setup.start_chip(noise_seed);
  std::vector<ReflexPicture> record;
  for (const double place_mm : places_mm) {
    const ReflexMotion still = [place_mm](double) { return place_mm; };
    record.push_back({std::move(record_images(touch.path_light, still, chip, 1).front()), touch.truth(place_mm)});
  }
  return record;
}

cv::Mat rest_picture(const ReflexSetup& setup, int pictures, std::uint64_t noise_seed) {
  TS_ASSERT(pictures >= 1);
  cv::Mat sum = cv::Mat::zeros(kChipSide, kChipSide, CV_32FC1);
  const std::vector<double> places(static_cast<std::size_t>(pictures), kFar_mm);
  for (const ReflexPicture& one : record_still(setup, setup.touches.front(), places, noise_seed)) {
    cv::Mat numbers;
    one.grabbed.image.convertTo(numbers, CV_32F);
    sum += numbers;
  }
  return sum / pictures;
}

std::vector<sensors::ExploreReading> explore(const cv::Mat& rest, std::span<const ReflexPicture> pictures,
                                             const sensors::ExploreSettings& settings) {
  sensors::ExploreTracker tracker(rest, settings);
  std::vector<sensors::ExploreReading> readings;
  for (const ReflexPicture& one : pictures) {
    readings.push_back(tracker.next({one.grabbed.image, one.grabbed.first_us}));
  }
  return readings;
}

sensors::DilationPress fit_press(std::span<const sensors::ExploreReading> readings,
                                 std::span<const ReflexPicture> pictures, int terms) {
  TS_ASSERT(readings.size() == pictures.size());
  std::vector<sensors::DilationSample> samples;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings[i].mode == sensors::ExploreMode::held) continue;
    samples.push_back({readings[i].motion.dilation, std::max(pictures[i].truth.press_mm, 0.0)});
  }
  return sensors::fit_dilation_press(samples, terms);
}

sensors::ExponentialForce fit_law(const ReflexTouch& touch) {
  std::vector<sensors::PressSample> samples;
  for (const ReflexTruth& one : touch.states) samples.push_back({one.press_mm, one.normal_N});
  return sensors::fit_exponential_force(samples);
}

ExploreScore score_explore(const sensors::ExploreModel& model, std::span<const sensors::ExploreReading> readings,
                           std::span<const ReflexPicture> pictures) {
  TS_ASSERT(readings.size() == pictures.size());
  ExploreScore score;
  double squares_mm = 0.0, squares_N = 0.0, shear = 0.0;
  int touched = 0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const ReflexTruth& truth = pictures[i].truth;
    const sensors::ExploreForce estimate = sensors::estimate(model, readings[i].motion);
    const double error_mm = std::abs(estimate.press_mm - std::max(truth.press_mm, 0.0));
    const double error_N = std::abs(estimate.force_N - truth.normal_N);
    squares_mm += error_mm * error_mm;
    squares_N += error_N * error_N;
    score.largest_mm = std::max(score.largest_mm, error_mm);
    score.largest_N = std::max(score.largest_N, error_N);
    if (truth.contact) {
      ++touched;
      shear += (estimate.shear_N - truth.shear_N).squaredNorm();
    } else if (touched > 0) {
      score.drift_mm = std::max(score.drift_mm, std::abs(estimate.press_mm));
    }
    score.absolute += readings[i].mode == sensors::ExploreMode::absolute ? 1 : 0;
    score.relative += readings[i].mode == sensors::ExploreMode::relative ? 1 : 0;
    score.held += readings[i].mode == sensors::ExploreMode::held ? 1 : 0;
  }
  score.pictures = static_cast<int>(readings.size());
  if (readings.empty()) return score;
  const auto n = static_cast<double>(readings.size());
  score.rms_mm = std::sqrt(squares_mm / n);
  score.rms_N = std::sqrt(squares_N / n);
  if (touched > 0) score.shear_rms_N = std::sqrt(shear / touched);
  return score;
}

std::vector<sensors::ShearSample> reflex_shear_samples(const sensors::ReflexModel& model,
                                                       std::span<const ReflexPoint> points, int every) {
  return sensors::shear_samples(model, samples_of(points, true), every);
}

std::vector<sensors::ShearSample> explore_shear_samples(const sensors::ExploreModel& model,
                                                        std::span<const sensors::ExploreReading> readings,
                                                        std::span<const ReflexPicture> pictures) {
  TS_ASSERT(readings.size() == pictures.size());
  std::vector<sensors::ShearSample> samples;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (!pictures[i].truth.contact || readings[i].mode == sensors::ExploreMode::held) continue;
    const sensors::ExploreForce estimate = sensors::estimate(model, readings[i].motion);
    samples.push_back({estimate.lateral_mm, estimate.force_N, pictures[i].truth.shear_N});
  }
  return samples;
}

double shear_rms_N(const sensors::ShearLaw& law, std::span<const sensors::ShearSample> samples) {
  double squares = 0.0;
  for (const auto& one : samples) squares += (law.force_N(one.displacement, one.normal_N) - one.shear_N).squaredNorm();
  return samples.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(samples.size()));
}

double shear_size_N(std::span<const sensors::ShearSample> samples) {
  return shear_rms_N({}, samples);
}

Collision collide(const ReflexSetup& setup, const ReflexTouch& touch, Watcher watcher,
                  const sensors::ReflexModel& reflex, const sensors::ExploreModel& explore, const cv::Mat& rest,
                  const ReflexCollisionSettings& settings, std::uint64_t noise_seed) {
  const PlateForce plate = [&](double, double press_mm) { return touch.truth(press_mm).normal_N; };
  CollisionSettings collision = settings.collision;
  collision.most_press_mm = std::min(collision.most_press_mm, touch.end());
  collision.frame_s = 1.0 / setup.chip.frame_rate_Hz;
  if (watcher == Watcher::nobody) {
    return play_collision(collision, plate, [](double, double) { return std::optional<double>(); });
  }
  render::MotionChip chip = setup.start_chip(noise_seed);
  render::PixelGrabber grabber;
  sensors::ReflexLoop loop(reflex, settings.reflex);
  sensors::ExploreTracker tracker(rest, {});
  cv::Mat light;
  return play_collision(collision, plate, [&](double t_s, double press_mm) -> std::optional<double> {
    touch.path_light.light_at(press_mm, light);
    const render::ChipFrame frame = chip.expose(light);
    if (watcher == Watcher::reflex) {
      if (!loop.next(frame.statistics).stop) return {};
      return t_s + 1e-6 * settings.budget.after_frame_us();
    }
    const std::optional<GrabbedImage> picture = grabber.add(frame);
    if (!picture) return {};
    const sensors::ExploreReading& reading = tracker.next({picture->image, picture->first_us});
    const double force_N = sensors::estimate(explore, reading.motion).force_N;
    if (force_N <= settings.explore_stop_above_N) return {};
    return t_s + settings.explore_after_s;
  });
}

}  // namespace touchstone::lab
