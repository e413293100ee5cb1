#pragma once
// Localisation by touch [Li2015, sec. 3.3.3]: a map is made of an object by several touches, then touches at known
// poses are localised on it.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "lab/gelsight/gelsight_touches.h"
#include "sensors/touch_map/tactile_map.h"

namespace touchstone::lab {

/// A map and where the object was when its root was touched, which a robot must have measured (sec. 3.4.2).
struct ObjectMap {
  sensors::TactileMap map;
  sensors::PlanarPose map_from_object;
  int offered = 0;  ///< touches; those that weren't localised aren't in the map

  /// The object under the sensor, from where the touch lies on the map.
  sensors::PlanarPose touch_from_object(const sensors::PlanarPose& map_from_touch) const {
    return map_from_touch.inverse() * map_from_object;
  }
};

/// Touches in their order; the first becomes the root. @throws Error if the first one has no contact
ObjectMap build_map(std::span<const TouchSample> touches, const sensors::TactileMapSettings& settings = {});

/// One touch on the map.
struct Localisation {
  sensors::Outcome outcome = sensors::Outcome::no_contact;
  double confidence = 0.0;
  int inliers = 0;
  sensors::PlanarPose touch_from_object;                     ///< estimated
  Eigen::Vector2d error_place_mm = Eigen::Vector2d::Zero();  ///< of the touch's place on the object, touch frame
  double error_mm = 0.0;                                     ///< its length
  double error = 0.0;                                        ///< of the angle, radians
  /// The same of the pose by features alone, as in the thesis.
  Eigen::Vector2d features_place_mm = Eigen::Vector2d::Zero();
  double features_mm = 0.0, features = 0.0;

  bool found() const { return outcome == sensors::Outcome::localised; }
};

/// Localises one touch and compares with its true pose.
Localisation localise(const ObjectMap& map, const TouchSample& touch);

/// Chance in how an object is held: each uniform within +- its bound.
struct GripPlay {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();
  double angle = 0.0;
  double tilt = 0.0;  ///< about either axis
  double depth_mm = 0.0;
};

/// Grip `index` of a series about `middle`: a pure function.
Grip held(const Grip& middle, const GripPlay& play, std::uint64_t seed, std::uint64_t index);

/// Mean of the absolute values, and the standard deviation of repeats about the mean of their own setting, averaged
/// over the settings (what the thesis calls average standard deviation). Not localised touches are left out and
/// counted.
struct SeriesError {
  double mean_absolute = 0.0;
  double mean_deviation = 0.0;  ///< 0 with one repeat
  double half_ci95 = 0.0;       ///< of mean_absolute: 1.96 standard errors over all touches
  int touches = 0, lost = 0;
};

/// `values[i]` are the repeats of setting i, signed errors, NaN where not localised.
SeriesError series_error(std::span<const std::vector<double>> values);

/// The thesis's two series.
struct MapExperimentSettings {
  int repeats = 3;
  int step = 1;  ///< every step-th displacement and angle
  std::uint64_t seed = 2014;
  sensors::TactileMapSettings map;
};

/// Maps of a coin and a plug, and how well touches are localised on them.
struct MapExperiment {
  ObjectMap coin, plug;
  SeriesError along_mm, turn_deg;                    ///< displacement along x, angle
  SeriesError place_mm;                              ///< of the coin: the whole vector's length
  SeriesError features_along_mm, features_turn_deg;  ///< by features alone
  std::vector<std::string> lost;                     ///< "displacement -3: ambiguous"
};

/// The quarter at displacements -6..6 mm in steps of 1 mm, the plug at -90..90 degrees in steps of 10.
MapExperiment run_map_experiment(const TouchSetup& setup, const sim::TouchObject& coin, const sim::TouchObject& plug,
                                 const MapExperimentSettings& settings);

}  // namespace touchstone::lab
