#pragma once
// Force from accumulated event counts by a time delay neural network: [Naeini2020, sec. III.C, fig. 4].
//
// What the network sees of a window is its features and those of the windows before it, `delays` in all (3 of 7 ms: the
// paper's 21 ms). Before the first window nothing has been counted: there the features are 0. Features and force are
// scaled to [-1, 1] by their ranges in training (sensors/learning/range_scaling.h), as MATLAB's toolbox does unless
// asked not to; the paper doesn't say.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "sensors/events/force_series.h"
#include "sensors/learning/feed_forward_network.h"
#include "sensors/learning/levenberg_marquardt.h"
#include "sensors/learning/range_scaling.h"

namespace touchstone::sensors {

/// A trained network: features of the last windows in, force out.
struct TimeDelayNetwork {
  int delays = 3;              ///< windows that are looked at, the newest with them
  RangeScaling features;       ///< of each feature
  RangeScaling force_N;        ///< of the force
  FeedForwardNetwork network;  ///< inputs: the newest window's features, then the one before's, ...; one output
};

/// What is wrong with a model (sizes, ranges, the network), or nothing.
std::string fault_of(const TimeDelayNetwork& model);

/// The network's size and how it is trained.
struct TimeDelayNetworkSettings {
  int delays = 3;         ///< 1 to 1000
  int hidden_layers = 4;  ///< k; the paper's best
  int units = 40;         ///< n
  Sigmoid sigmoid = Sigmoid::kTanh;
  LevenbergMarquardtSettings training;
  std::uint64_t seed = 1;  ///< of the first weights
};

/// What training gives.
struct TrainedTimeDelayNetwork {
  TimeDelayNetwork model;
  NetworkTrainingReport report;  ///< losses are of the scaled force
};

/// Trains on the judged windows of the series `training`, with early stopping on those of `validation` (which may be
/// empty: then it trains until it no longer gets better). A pure function of its arguments.
/// @param fold which of several trainings it is: each has first weights of its own
/// @throws Error for a faulty series, no training series, or a setting out of its range
TrainedTimeDelayNetwork train_time_delay_network(std::span<const ForceSeries> series, std::span<const int> training,
                                                 std::span<const int> validation,
                                                 const TimeDelayNetworkSettings& settings, int fold = 0);

/// Force of one window after the other, without allocating. One object is for one thread.
class TimeDelayEstimator {
 public:
  /// @throws Error for a faulty model (fault_of)
  explicit TimeDelayEstimator(TimeDelayNetwork model);

  /// Forgets all windows: the next one is a grasp's first.
  void begin();
  /// Takes the next window's features, gives its force in N. @throws Error for another number of features than the
  /// model's, or one that isn't finite; it then counts as not given
  double next(std::span<const double> features);
  /// Whether one of the windows that the last force is from has a feature outside of its range in training, as more
  /// events than any grasp had: that force is then no more than a guess. What flicker adds to the counts may stay
  /// within the ranges; that is seen before the touch (sensors/events/mains_flicker.h).
  bool extrapolates() const { return strange_windows_ > 0; }

 private:
  TimeDelayNetwork model_;
  NetworkRunner runner_;
  Eigen::VectorXd inputs_;
  int strange_windows_ = 0;  ///< for so many windows on, one that is outside of the ranges is looked at
};

/// Force of each window (row) of a whole grasp, N: the same as that of TimeDelayEstimator. @throws Error as it does
Eigen::VectorXd estimate_force(const TimeDelayNetwork& model, const Eigen::MatrixXd& features);

}  // namespace touchstone::sensors
