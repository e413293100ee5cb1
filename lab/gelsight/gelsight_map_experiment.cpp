#include "lab/gelsight/gelsight_map_experiment.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// How a jig or gripper holds the object a little otherwise each time: half a millimetre, two degrees, tilted by a
/// quarter of a degree, a fifth of the depth.
const GripPlay kJigPlay = {{0.0, 0.5}, 2.0 * kRadiansPerDegree, 0.25 * kRadiansPerDegree, 0.05};

/// One series: settings with their repeats, touched and localised.
struct Series {
  std::vector<std::vector<Localisation>> found;
};

Series run_series(const TouchSetup& setup, const sim::TouchObject& object, const ObjectMap& map,
                  std::span<const Grip> settings, const GripPlay& play, int repeats, std::uint64_t seed) {
  std::vector<Grip> grips;
  for (const Grip& setting : settings) {
    for (int repeat = 0; repeat < repeats; ++repeat) grips.push_back(held(setting, play, seed, grips.size()));
  }
  const std::vector<TouchSample> touches = setup.touches(object, grips, seed);
  Series series;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (i % static_cast<std::size_t>(repeats) == 0) series.found.emplace_back();
    series.found.back().push_back(localise(map, touches[i]));
  }
  return series;
}

template <typename Value>
SeriesError error_of(const Series& series, const Value& value) {
  std::vector<std::vector<double>> values;
  for (const auto& repeats : series.found) {
    values.emplace_back();
    for (const Localisation& one : repeats) values.back().push_back(one.found() ? value(one) : kMissing);
  }
  return series_error(values);
}

void note_lost(const Series& series, std::span<const double> settings, const std::string& what,
               std::vector<std::string>& lost) {
  for (std::size_t i = 0; i < series.found.size(); ++i) {
    for (const Localisation& one : series.found[i]) {
      if (!one.found()) lost.push_back(fmt::format("{} {}: {}", what, settings[i], sensors::name_of(one.outcome)));
    }
  }
}

/// Touches that make a map: the object at these places, turned so.
std::vector<TouchSample> map_touches(const TouchSetup& setup, const sim::TouchObject& object,
                                     const std::vector<std::pair<Eigen::Vector2d, double>>& places,
                                     std::uint64_t seed) {
  std::vector<Grip> grips;
  for (const auto& [place, degrees] : places) {
    grips.push_back(held({.place_mm = place, .angle = degrees * kRadiansPerDegree}, kJigPlay, seed, grips.size()));
  }
  return setup.touches(object, grips, seed);
}

}  // namespace

ObjectMap build_map(std::span<const TouchSample> touches, const sensors::TactileMapSettings& settings) {
  ObjectMap result{sensors::TactileMap(settings), {}, 0};
  for (const TouchSample& touch : touches) {
    const bool root = result.map.empty();
    const sensors::Registration added = result.map.add(touch.image);
    ++result.offered;
    if (!root) continue;
    if (!added.localised()) fail("the map's first touch has no contact");
    result.map_from_object = touch.touch_from_object;
  }
  return result;
}

Localisation localise(const ObjectMap& map, const TouchSample& touch) {
  const sensors::Registration found = map.map.localise(touch.image);
  const sensors::PlanarPose true_map_from_touch = map.map_from_object * touch.touch_from_object.inverse();
  Localisation result;
  result.outcome = found.outcome;
  result.confidence = found.confidence;
  result.inliers = found.inliers;
  result.touch_from_object = map.touch_from_object(found.to_from_from);
  const auto judge = [&](const sensors::PlanarPose& pose, Eigen::Vector2d& place, double& mm, double& angle) {
    const sensors::PlanarPose error = true_map_from_touch.inverse() * pose;
    place = error.translation;
    mm = error.translation.norm();
    angle = error.angle;
  };
  judge(found.to_from_from, result.error_place_mm, result.error_mm, result.error);
  judge(found.feature_pose, result.features_place_mm, result.features_mm, result.features);
  return result;
}

Grip held(const Grip& middle, const GripPlay& play, std::uint64_t seed, std::uint64_t index) {
  RandomStream random(seed, index, Purpose::kPlacement);
  const auto within = [&](double bound) { return bound * (2.0 * random.uniform() - 1.0); };
  Grip grip = middle;
  grip.place_mm.x() += within(play.place_mm.x());
  grip.place_mm.y() += within(play.place_mm.y());
  grip.angle += within(play.angle);
  grip.tilt.x() += within(play.tilt);
  grip.tilt.y() += within(play.tilt);
  grip.depth_mm += within(play.depth_mm);
  return grip;
}

SeriesError series_error(std::span<const std::vector<double>> values) {
  SeriesError result;
  double sum = 0.0, squares = 0.0, deviations = 0.0;
  int settings = 0;
  for (const std::vector<double>& repeats : values) {
    double here = 0.0, here_squares = 0.0;
    int found = 0;
    for (const double value : repeats) {
      ++result.touches;
      if (!std::isfinite(value)) {
        ++result.lost;
        continue;
      }
      ++found;
      here += value, here_squares += value * value;
      sum += std::abs(value), squares += value * value;
    }
    if (found < 2) continue;
    ++settings;
    deviations += std::sqrt(std::max(0.0, here_squares - here * here / found) / (found - 1));
  }
  const int found = result.touches - result.lost;
  if (settings > 0) result.mean_deviation = deviations / settings;
  if (found == 0) {
    result.mean_absolute = kMissing;
    return result;
  }
  result.mean_absolute = sum / found;
  if (found > 1) {
    const double variance = std::max(0.0, squares - sum * sum / found) / (found - 1);
    result.half_ci95 = kNormal95 * std::sqrt(variance / found);
  }
  return result;
}

MapExperiment run_map_experiment(const TouchSetup& setup, const sim::TouchObject& coin, const sim::TouchObject& plug,
                                 const MapExperimentSettings& settings) {
  // The maps are made of touches elsewhere than those that are localised afterwards.
  const ObjectMap coin_map = build_map(
      map_touches(setup, coin, {{{0.4, 0}, 3}, {{3.6, 0}, -8}, {{-3.3, 0}, 6}, {{6.3, 0}, 5}, {{-6.4, 0}, -4}},
                  settings.seed),
      settings.map);
  // Every touch of the plug is turned by some 30 degrees against one before it: what the estimator gets wrong at steep
  // edges stays with the sensor and not with the plug, so touches far apart in angle agree less.
  const ObjectMap plug_map = build_map(map_touches(setup, plug,
                                                   {{{0.3, 0.2}, 4},
                                                    {{0, 0.5}, 31},
                                                    {{0.5, -0.5}, -26},
                                                    {{0, 0.3}, 57},
                                                    {{-0.3, 0}, -55},
                                                    {{0.2, -0.4}, 84},
                                                    {{0, 0.2}, -84}},
                                                   settings.seed + 1),
                                       settings.map);

  std::vector<double> displacements, angles;
  std::vector<Grip> displaced, turned;
  for (int mm = -6; mm <= 6; mm += settings.step) {
    displacements.push_back(mm);
    displaced.push_back({.place_mm = {mm, 0.0}});
  }
  for (int degrees = -90; degrees <= 90; degrees += 10 * settings.step) {
    angles.push_back(degrees);
    turned.push_back({.angle = degrees * kRadiansPerDegree});
  }
  const Series along = run_series(setup, coin, coin_map, displaced, kJigPlay, settings.repeats, settings.seed + 1000);
  const Series turn = run_series(setup, plug, plug_map, turned, kJigPlay, settings.repeats, settings.seed + 2000);

  MapExperiment result{coin_map, plug_map, {}, {}, {}, {}, {}, {}};
  const auto degrees_of = [](double radians) { return radians / kRadiansPerDegree; };
  result.along_mm = error_of(along, [](const Localisation& one) { return one.error_place_mm.x(); });
  result.place_mm = error_of(along, [](const Localisation& one) { return one.error_mm; });
  result.turn_deg = error_of(turn, [&](const Localisation& one) { return degrees_of(one.error); });
  result.features_along_mm = error_of(along, [](const Localisation& one) { return one.features_place_mm.x(); });
  result.features_turn_deg = error_of(turn, [&](const Localisation& one) { return degrees_of(one.features); });
  note_lost(along, displacements, "displacement", result.lost);
  note_lost(turn, angles, "angle", result.lost);
  return result;
}

}  // namespace touchstone::lab
