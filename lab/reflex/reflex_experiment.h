#pragma once
// The paper's experiments with reflex and explore mode [Knoop2013, sec. IV], and what it leaves open: other loads,
// shear, collisions.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lab/reflex/reflex_collision.h"
#include "lab/reflex/reflex_touches.h"
#include "sensors/reflex/explore_model.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/reflex_loop.h"
#include "sensors/reflex/reflex_training.h"

namespace touchstone::lab {

/// There and back between two places at one speed, beginning at the first.
ReflexMotion reciprocation(double from_mm, double to_mm, double speed_mm_s);
/// Straight on from one place to another, and then staying there.
ReflexMotion single_stroke(double from_mm, double to_mm, double speed_mm_s);

/// A frame's statistics and what was true in the middle of its exposure.
struct ReflexPoint {
  ChipStatistics statistics;
  ReflexTruth truth;
};

/// So many points, one each `every` frames: all frames are made, since DX and DY are of one after the other.
std::vector<ReflexPoint> record_points(const ReflexSetup& setup, const ReflexTouch& touch, const ReflexMotion& motion,
                                       int points, int every, std::uint64_t noise_seed);

/// Tree and force of a training set, as sec. III.D has them; forces of degree 1 or 2.
sensors::ReflexModel train_reflex(std::span<const ReflexPoint> points, int degree = 1,
                                  const sensors::ContactTreeSettings& tree = {});

/// How well a model does on points.
struct ReflexScore {
  int points = 0;
  double error_percent = 0.0;  ///< of the tree: both kinds, as shares of all points
  double missed_percent = 0.0;
  double false_percent = 0.0;
  double missed_below_N = 0.0;   ///< the largest force that was missed
  double missed_below_mm = 0.0;  ///< and the deepest press
  double rms_N = 0.0;            ///< of tree and force together, over all points
  double rms_below_1N_N = 0.0;   ///< over those in contact with less than 1 N
  double largest_error_N = 0.0;
};
/// Asks the model about each point.
ReflexScore score_reflex(const sensors::ReflexModel& model, std::span<const ReflexPoint> points);

/// A picture as it was grabbed, and what was true at the mean of its pixels' times.
struct ReflexPicture {
  GrabbedImage grabbed;
  ReflexTruth truth;
};
/// Shows the touch to the chip until it has given so many pictures.
std::vector<ReflexPicture> record_pictures(const ReflexSetup& setup, const ReflexTouch& touch,
                                           const ReflexMotion& motion, int pictures, std::uint64_t noise_seed);
/// One picture each at these places, nothing moving.
std::vector<ReflexPicture> record_still(const ReflexSetup& setup, const ReflexTouch& touch,
                                        std::span<const double> places_mm, std::uint64_t noise_seed);
/// The mean of some pictures without contact, CV_32FC1.
cv::Mat rest_picture(const ReflexSetup& setup, int pictures, std::uint64_t noise_seed);

/// What explore mode makes of pictures, in their order.
std::vector<sensors::ExploreReading> explore(const cv::Mat& rest, std::span<const ReflexPicture> pictures,
                                             const sensors::ExploreSettings& settings);

/// Press of dilation by least squares on a record; points whose reading was held are left out. Points without contact
/// count as no press.
sensors::DilationPress fit_press(std::span<const sensors::ExploreReading> readings,
                                 std::span<const ReflexPicture> pictures, int terms);
/// The law of eq. 1 from a touch's own states, as the paper has it from a force gauge.
sensors::ExponentialForce fit_law(const ReflexTouch& touch);

/// How well explore mode does on pictures with known truth.
struct ExploreScore {
  int pictures = 0, absolute = 0, relative = 0, held = 0;
  double rms_mm = 0.0, largest_mm = 0.0;  ///< of the press
  double rms_N = 0.0, largest_N = 0.0;    ///< of the normal force
  double shear_rms_N = 0.0;               ///< of both axes together, of pictures in contact
  double drift_mm = 0.0;                  ///< the largest press estimated without contact after the first contact
};
/// Press and force of each reading against the picture's truth.
ExploreScore score_explore(const sensors::ExploreModel& model, std::span<const sensors::ExploreReading> readings,
                           std::span<const ReflexPicture> pictures);

/// Shear of records in reflex mode: counts summed while the tree sees a force, against the true shear. Samples are
/// taken each `every` points, which must be of each frame.
std::vector<sensors::ShearSample> reflex_shear_samples(const sensors::ReflexModel& model,
                                                       std::span<const ReflexPoint> points, int every);
/// Shear of pictures in contact; the model's lateral displacement is used.
std::vector<sensors::ShearSample> explore_shear_samples(const sensors::ExploreModel& model,
                                                        std::span<const sensors::ExploreReading> readings,
                                                        std::span<const ReflexPicture> pictures);
/// Root mean square of what a law leaves, both axes together, N.
double shear_rms_N(const sensors::ShearLaw& law, std::span<const sensors::ShearSample> samples);
/// Root mean square of the true shear itself.
double shear_size_N(std::span<const sensors::ShearSample> samples);

/// Who watches a collision.
enum class Watcher { reflex, explore, nobody };

/// Who watches, and how late what it says arrives.
struct ReflexCollisionSettings {
  CollisionSettings collision;
  sensors::ReflexSettings reflex;
  sensors::ReflexBudget budget;
  /// Explore mode stops where its force exceeds this; a picture is evaluated after it's complete, over USB and through
  /// a program on a computer.
  double explore_stop_above_N = 0.3;
  double explore_after_s = 0.010;
};

/// Drives the fingertip at the plate of a touch straight down, from before its first frame on. The chip sees what is
/// true at each exposure's middle.
Collision collide(const ReflexSetup& setup, const ReflexTouch& touch, Watcher watcher,
                  const sensors::ReflexModel& reflex, const sensors::ExploreModel& explore, const cv::Mat& rest,
                  const ReflexCollisionSettings& settings, std::uint64_t noise_seed);

}  // namespace touchstone::lab
