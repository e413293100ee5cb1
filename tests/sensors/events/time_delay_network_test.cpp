#include "sensors/events/time_delay_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sensors/events/force_score.h"
#include "sensors/learning/leave_one_out.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

TimeDelayNetworkSettings small_settings() {
  TimeDelayNetworkSettings settings;
  settings.hidden_layers = 1;
  settings.units = 8;
  settings.training.most_steps = 60;
  return settings;
}

/// A force that only the delays tell: what was counted two windows ago, whatever has been counted since.
ForceSeries delayed_series(std::uint64_t index) {
  RandomStream random(9, index, Purpose::kTest);
  ForceSeries series{Eigen::MatrixXd(40, 1), Eigen::VectorXd(40), range(0, 40)};
  for (int i = 0; i < 40; ++i) {
    series.features(i, 0) = random.uniform();
    series.force_N[i] = i < 2 ? 0.0 : 2.0 * series.features(i - 2, 0);
  }
  return series;
}

TEST(TimeDelayNetwork, SeesAsFarBackAsItsDelays) {
  std::vector<ForceSeries> series;
  for (std::uint64_t i = 0; i < 8; ++i) series.push_back(delayed_series(i));
  TimeDelayNetworkSettings settings = small_settings();
  const auto error = [&](int delays) {
    settings.delays = delays;
    const TimeDelayNetwork model = train_time_delay_network(series, range(0, 6), range(6, 7), settings).model;
    return mean_squared_error(estimate_force(model, series[7].features), series[7].force_N);
  };
  // The force's variance is 4/12 N^2: two windows tell nothing of it, three tell all.
  EXPECT_GT(error(2), 0.2);
  EXPECT_LT(error(3), 1e-5);
}

TEST(TimeDelayNetwork, LearnsForceFromCounts) {
  // One material: then counts tell the force, but for their noise. (Of several, the same counts mean several forces.)
  std::vector<ForceSeries> series;
  for (int i = 0; i < 16; ++i) series.push_back(synthetic_series(synthetic_grasp(i, 1), false));
  const TrainedTimeDelayNetwork trained =
      train_time_delay_network(series, range(0, 12), range(12, 15), small_settings());
  EXPECT_EQ(fault_of(trained.model), "");
  const StackedSeries all = stack(series, range(0, 15));
  const double variance = (all.force_N.array() - all.force_N.mean()).square().mean();
  const Eigen::VectorXd estimate = estimate_force(trained.model, series[15].features);
  double square = 0.0;
  for (const int row : series[15].judged) square += std::pow(estimate[row] - series[15].force_N[row], 2);
  EXPECT_LT(square / static_cast<double>(series[15].judged.size()), 0.1 * variance);
}

TEST(TimeDelayNetwork, WindowByWindowIsTheWhole) {
  const std::vector<ForceSeries> series = synthetic_series(5, false);
  const TimeDelayNetwork model = train_time_delay_network(series, range(0, 4), {}, small_settings()).model;
  const Eigen::VectorXd whole = estimate_force(model, series[4].features);
  TimeDelayEstimator estimator(model);
  for (int pass = 0; pass < 2; ++pass) {
    estimator.begin();
    for (Eigen::Index row = 0; row < whole.size(); ++row) {
      const double window[] = {series[4].features(row, 0), series[4].features(row, 1)};
      EXPECT_EQ(estimator.next(window), whole[row]);
    }
  }
}

TEST(TimeDelayNetwork, SameSeedSameBytesOnAnyNumberOfThreads) {
  const std::vector<ForceSeries> series = synthetic_series(8, false);
  std::vector<double> peaks;
  for (const ForceSeries& one : series) peaks.push_back(one.force_N.maxCoeff());
  const std::vector<Fold> folds = folds_by_level(peaks, 2, 1);
  TimeDelayNetworkSettings settings = small_settings();
  settings.training.most_steps = 5;
  const auto run = [&](int threads) {
    std::vector<Eigen::VectorXd> estimates(folds.size());
    run_folds(static_cast<int>(folds.size()), threads, [&](int i) {
      const Fold& fold = folds[static_cast<std::size_t>(i)];
      const auto trained = train_time_delay_network(series, fold.training, fold.validation, settings, i);
      estimates[static_cast<std::size_t>(i)] =
          estimate_force(trained.model, series[static_cast<std::size_t>(fold.test)].features);
    });
    return estimates;
  };
  const auto one = run(1);
  EXPECT_EQ(run(4), one);
  settings.seed = 2;
  EXPECT_NE(run(1), one);
  // Each fold has first weights of its own.
  settings.training.most_steps = 1;
  const auto first = train_time_delay_network(series, range(0, 4), {}, settings, 0);
  const auto second = train_time_delay_network(series, range(0, 4), {}, settings, 1);
  EXPECT_NE(first.model.network.weights[0], second.model.network.weights[0]);
}

TEST(TimeDelayNetwork, FaultyInputIsNamed) {
  const std::vector<ForceSeries> series = synthetic_series(3, false);
  const auto message = [&](auto spoil, const std::vector<int>& training = {0, 1},
                           const std::vector<int>& validation = {2}) {
    TimeDelayNetworkSettings settings = small_settings();
    settings.training.most_steps = 1;
    std::vector<ForceSeries> some = series;
    int fold = 0;
    spoil(settings, some, fold);
    return message_of([&] { train_time_delay_network(some, training, validation, settings, fold); });
  };
  EXPECT_EQ(message([](auto&...) {}), "no error");
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s.delays = 0; }), HasSubstr("delays is 0"));
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s.units = 0; }), HasSubstr("units is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto& fold) { fold = -1; }), HasSubstr("fold is -1"));
  EXPECT_THAT(message([](auto&...) {}, {}), HasSubstr("no series to train on"));
  EXPECT_THAT(message([](auto&...) {}, {0, 3}), HasSubstr("series 3 is chosen"));
  EXPECT_THAT(message([](auto&, auto& some, auto&) { some[1].features(0, 0) = std::nan(""); }), HasSubstr("series 1"));
  EXPECT_THAT(message([](auto&, auto& some, auto&) { some[2].features = some[2].features.leftCols(1).eval(); }),
              HasSubstr("2 features to train on and 1 to validate on"));

  const TimeDelayNetwork model = train_time_delay_network(series, range(0, 3), {}, small_settings()).model;
  TimeDelayEstimator estimator(model);
  const double one[] = {1.0};
  const double infinite[] = {1.0, INFINITY};
  EXPECT_THAT(message_of([&] { estimator.next(one); }), HasSubstr("a window of 1 features, the model has 2"));
  EXPECT_THAT(message_of([&] { estimator.next(infinite); }), HasSubstr("a feature is inf"));
  const auto fault = [&](auto spoil) {
    TimeDelayNetwork faulty = model;
    spoil(faulty);
    EXPECT_THAT(message_of([&] { TimeDelayEstimator{faulty}; }), HasSubstr(fault_of(faulty)));
    return fault_of(faulty);
  };
  EXPECT_THAT(fault([](auto& m) { m.delays = 0; }), HasSubstr("0 windows"));
  EXPECT_THAT(fault([](auto& m) { m.delays = 4; }), HasSubstr("6 inputs; 2 features of 4 windows"));
  EXPECT_THAT(fault([](auto& m) { m.features.low[0] = 1e9; }), HasSubstr("features' ranges"));
  EXPECT_THAT(fault([](auto& m) { m.force_N = m.features; }), HasSubstr("force's range"));
  EXPECT_THAT(fault([](auto& m) { m.network.biases.clear(); }), HasSubstr("biases of 0"));
  EXPECT_THAT(fault([](auto& m) {
                m.network.weights.back().setZero(2, 8);
                m.network.biases.back().setZero(2);
              }),
              HasSubstr("2 outputs"));
}

}  // namespace
}  // namespace touchstone::sensors
