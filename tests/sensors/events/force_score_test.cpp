#include "sensors/events/force_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sensors/events/force_series.h"
#include "sensors/learning/confusion_matrix.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

TEST(ForceScore, MeanSquaredError) {
  EXPECT_DOUBLE_EQ(mean_squared_error(Eigen::Vector3d(1.0, 2.0, 3.0), Eigen::Vector3d(1.0, 1.0, 5.0)), 5.0 / 3.0);
  EXPECT_THAT(message_of([] { mean_squared_error({}, {}); }), HasSubstr("0 estimates"));
  EXPECT_THAT(message_of([] { mean_squared_error(Eigen::Vector2d(1, 2), Eigen::Vector3d(1, 2, 3)); }),
              HasSubstr("2 estimates and 3"));
  EXPECT_THAT(message_of([] { mean_squared_error(Eigen::Vector2d(1, std::nan("")), Eigen::Vector2d(1, 2)); }),
              HasSubstr("isn't finite"));
}

TEST(ForceScore, LeastChangeOfNeighboursAboveTheLevel) {
  const Eigen::VectorXd estimate = (Eigen::VectorXd(6) << 0.1, 0.15, 0.5, 0.56, 0.19, 0.58).finished();
  EXPECT_NEAR(*least_force_change(estimate, estimate), 0.06, 1e-12);  // 0.56 and 0.58 don't follow each other
  EXPECT_NEAR(*least_force_change(estimate, Eigen::VectorXd::Ones(6)), 0.05, 1e-12);
  EXPECT_FALSE(least_force_change(estimate, Eigen::VectorXd::Zero(6)).has_value());
  EXPECT_NEAR(*least_force_change(estimate, estimate, 0.15), 0.06, 1e-12);
}

TEST(ForceScore, SensitivityIsTheMeanOverFoldsThatHaveOne) {
  const std::vector<std::optional<double>> changes{0.01, std::nullopt, 0.03};
  EXPECT_DOUBLE_EQ(sensitivity(changes), 0.02);
  const std::vector<std::optional<double>> none(3);
  EXPECT_THAT(message_of([&] { sensitivity(none); }), HasSubstr("none of 3 folds"));
}

TEST(ConfusionMatrix, CountsAndAccuracies) {
  const std::vector<int> truth{0, 0, 1, 1, 1, 2};
  const std::vector<int> guesses{0, 1, 1, 1, 0, 2};
  const ConfusionMatrix matrix = confusion_matrix(truth, guesses, 3);
  EXPECT_EQ(matrix.counts, (Eigen::Matrix3i() << 1, 1, 0, 1, 2, 0, 0, 0, 1).finished());
  EXPECT_DOUBLE_EQ(matrix.accuracy(), 4.0 / 6.0);
  EXPECT_DOUBLE_EQ(matrix.accuracy(std::vector<int>{0, 1}), 3.0 / 5.0);
  EXPECT_TRUE(std::isnan(confusion_matrix({}, {}, 2).accuracy()));
  EXPECT_THAT(message_of([&] { confusion_matrix(truth, guesses, 2); }), HasSubstr("sample 5: class 2, there are 2"));
  EXPECT_THAT(message_of([&] { confusion_matrix(truth, guesses, 0); }), HasSubstr("0 classes"));
  EXPECT_THAT(message_of([&] { confusion_matrix(truth, {}, 3); }), HasSubstr("6 samples and 0 guesses"));
}

ForceSeries small_series() {
  ForceSeries series;
  series.features = (Eigen::MatrixXd(3, 2) << 1, 2, 3, 4, 5, 6).finished();
  series.force_N = Eigen::Vector3d(0.1, 0.2, 0.3);
  series.judged = {0, 2};
  return series;
}

TEST(ForceSeries, JudgedRowsAreStacked) {
  const std::vector<ForceSeries> series(2, small_series());
  const StackedSeries stacked = stack(series, std::vector<int>{1, 0});
  EXPECT_EQ(stacked.features.col(0), Eigen::Vector4d(1, 5, 1, 5));
  EXPECT_EQ(stacked.force_N, Eigen::Vector4d(0.1, 0.3, 0.1, 0.3));
}

TEST(ForceSeries, FaultsAreNamed) {
  const auto message = [](auto spoil) {
    std::vector<ForceSeries> series(2, small_series());
    spoil(series[1]);
    return message_of([&] { stack(series, std::vector<int>{0, 1}); });
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  EXPECT_THAT(message([](auto& s) { s.force_N.resize(2); }), HasSubstr("series 1: 3 windows of features and 2"));
  EXPECT_THAT(message([](auto& s) { s = {}; }), HasSubstr("no windows"));
  EXPECT_THAT(message([](auto& s) { s.judged = {}; }), HasSubstr("no window of it is judged"));
  EXPECT_THAT(message([](auto& s) { s.judged = {3}; }), HasSubstr("window 3 is judged, there are 3"));
  EXPECT_THAT(message([](auto& s) { s.features(2, 1) = std::nan(""); }), HasSubstr("a feature of window 2"));
  EXPECT_THAT(message([](auto& s) { s.force_N[1] = INFINITY; }), HasSubstr("the force of window 1"));
  EXPECT_THAT(message([](auto& s) { s.features = Eigen::MatrixXd::Ones(3, 3); }),
              HasSubstr("3 features, 2 are needed"));
  const std::vector<ForceSeries> one(1, small_series());
  EXPECT_THAT(message_of([&] { stack(one, std::vector<int>{1}); }), HasSubstr("series 1 is chosen, there are 1"));
}

}  // namespace
}  // namespace touchstone::sensors
