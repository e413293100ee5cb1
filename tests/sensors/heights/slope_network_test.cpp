#include "sensors/heights/slope_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/heights/height_model_file.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kScale = 0.053;

SlopeNetwork some_network() {
  RandomStream random(5, 0, Purpose::kTest);
  return {random_network({.inputs = SlopeNetwork::kInputs, .hidden_layers = 1, .units = 7, .outputs = 2}, random)};
}

cv::Mat some_difference(const cv::Size& size) {
  RandomStream random(6, 0, Purpose::kTest);
  cv::Mat difference(size, CV_32FC3);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      for (int c = 0; c < 3; ++c) difference.at<cv::Vec3f>(v, u)[c] = static_cast<float>(40.0 * random.normal());
    }
  }
  return difference;
}

TEST(SlopeReader, IsTheNetworkPixelByPixel) {
  const SlopeNetwork network = some_network();
  const cv::Size size(61, 43);
  const cv::Mat difference = some_difference(size);
  SlopeReader reader(network, size, kScale);
  cv::Mat slope_u;
  cv::Mat slope_v;
  reader.read(difference, slope_u, slope_v);
  Neighbourhoods neighbourhoods(size, kScale);
  neighbourhoods.take(difference);
  std::vector<float> row(static_cast<std::size_t>(SlopeNetwork::kInputs * size.width));
  for (int v = 0; v < size.height; ++v) {
    neighbourhoods.inputs_of_row(difference, v, row.data());
    for (int u = 0; u < size.width; ++u) {
      Eigen::MatrixXd inputs(SlopeNetwork::kInputs, 1);
      for (int i = 0; i < SlopeNetwork::kInputs; ++i) {
        inputs(i, 0) = row[static_cast<std::size_t>(i * size.width + u)];
      }
      const Eigen::MatrixXd wanted = evaluate(network.network, inputs);
      ASSERT_NEAR(slope_u.at<float>(v, u), wanted(0, 0), 5e-4);
      ASSERT_NEAR(slope_v.at<float>(v, u), wanted(1, 0), 5e-4);
    }
  }
}

/// Blue light of a Gaussian's shape in a square picture's middle, and the inputs of row v there.
std::vector<float> inputs_by_a_blob(int side, double mm_per_px, double blob_mm, int v) {
  cv::Mat difference = cv::Mat::zeros(side, side, CV_32FC3);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double r = mm_per_px * std::hypot(x + 0.5 - 0.5 * side, y + 0.5 - 0.5 * side);
      difference.at<cv::Vec3f>(y, x)[0] =
          static_cast<float>(SlopeNetwork::kColourUnit_DN * std::exp(-0.5 * r * r / (blob_mm * blob_mm)));
    }
  }
  Neighbourhoods neighbourhoods(difference.size(), mm_per_px);
  neighbourhoods.take(difference);
  std::vector<float> row(static_cast<std::size_t>(SlopeNetwork::kInputs * side));
  neighbourhoods.inputs_of_row(difference, v, row.data());
  return row;
}

TEST(Neighbourhoods, AreGaussianMeans) {
  // The mean of a Gaussian over a Gaussian is one again: their variances add up.
  constexpr int kSide = 240;
  constexpr double kBlob_mm = 0.4;
  constexpr int kRow = 112;
  const std::vector<float> row = inputs_by_a_blob(kSide, kScale, kBlob_mm, kRow);
  const auto expect = [&](int input, double width_mm, const Eigen::Vector2d& off_mm) {
    const double variance = width_mm * width_mm + kBlob_mm * kBlob_mm;
    const double peak = kBlob_mm * kBlob_mm / variance;
    for (int u = 60; u < 180; u += 7) {
      const Eigen::Vector2d at = kScale * Eigen::Vector2d(u + 0.5 - 0.5 * kSide, kRow + 0.5 - 0.5 * kSide) + off_mm;
      EXPECT_NEAR(row[static_cast<std::size_t>(input * kSide + u)], peak * std::exp(-0.5 * at.squaredNorm() / variance),
                  0.03 * peak)
          << input << ", " << u;
    }
  };
  expect(3, SlopeNetwork::kFine_mm, {0.0, 0.0});
  for (std::size_t i = 0; i < SlopeNetwork::kContext.size(); ++i) {
    const SlopeNetwork::Mean& mean = SlopeNetwork::kContext[i];
    expect(SlopeNetwork::kNear + 3 * static_cast<int>(i), mean.width_mm, {mean.right_mm, mean.down_mm});
  }
}

TEST(SlopeReader, FaultyNetworksAreRefused) {
  const auto with = [](auto change) {
    SlopeNetwork network = some_network();
    change(network);
    return [network] { SlopeReader(network, {20, 20}, kScale); };
  };
  EXPECT_THAT(with([](SlopeNetwork& n) { n.network.sigmoid = Sigmoid::kLogistic; }),
              ThrowsMessage<Error>(HasSubstr("one hidden layer of tanh")));
  EXPECT_THAT(with([](SlopeNetwork& n) { n.network.weights[0](1, 1) = NAN; }),
              ThrowsMessage<Error>(HasSubstr("finite")));
  EXPECT_THAT(with([](SlopeNetwork& n) { n.network.weights[0].conservativeResize(Eigen::NoChange, 3); }),
              ThrowsMessage<Error>(HasSubstr("3 inputs")));
}

/// A calibration whose frames each have another white balance, as a camera that sets it by itself.
class OtherBalances : public ::testing::Test {
 protected:
  static cv::Mat balanced(const cv::Mat& frame, int number) {
    RandomStream random(8, static_cast<std::uint64_t>(number), Purpose::kTest);
    const cv::Scalar factors(0.9 + 0.2 * random.uniform(), 0.9 + 0.2 * random.uniform(), 0.9 + 0.2 * random.uniform());
    cv::Mat other;
    cv::multiply(frame, factors, other);
    return other;
  }
  static HeightCalibrationSettings quick(SlopeRegressor slopes) {
    HeightCalibrationSettings settings;
    settings.mm_per_px = kScale;
    settings.table.most_cells = 1U << 15U;
    settings.slopes = slopes;
    settings.learning.samples = 6000;
    settings.learning.epochs = 20;
    return settings;
  }
  std::vector<BallPress> presses() {
    std::vector<BallPress> all = painter_.presses(3, 2, 1.5, 1.0);
    for (std::size_t i = 0; i < all.size(); ++i) all[i].frame = balanced(all[i].frame, static_cast<int>(i));
    return all;
  }
  fixtures::GelPainter painter_{200, 160, kScale, {.fall_off = 0.2}};
  Background background_ = painter_.background();
  fixtures::Ball test_{{5.3, 4.4}, 1.5, 0.9};
};

TEST_F(OtherBalances, AreTakenOut) {
  const HeightCalibration calibration = calibrate_height(presses(), background_, quick(SlopeRegressor::table));
  EXPECT_TRUE(calibration.model.white_balance);
  HeightEstimator estimator(calibration.model);
  const auto field = [&](const Eigen::Vector2d& place) { return test_.at(place); };
  const cv::Mat frame = painter_.paint(field);
  const cv::Mat truth = painter_.heights(field);
  const cv::Mat plain = estimator.estimate(frame).height_mm.clone();
  const double own = cv::norm(plain, truth) / std::sqrt(static_cast<double>(truth.total()));
  for (int number = 20; number < 24; ++number) {
    const cv::Mat& other = estimator.estimate(balanced(frame, number)).height_mm;
    EXPECT_LT(cv::norm(other, plain) / std::sqrt(static_cast<double>(truth.total())), 0.01) << number;
  }
  EXPECT_LT(own, 0.02);  // of 0.7 mm
}

TEST_F(OtherBalances, NetworkLearnsThem) {
  const std::vector<BallPress> all = presses();
  const HeightCalibration calibration = calibrate_height(all, background_, quick(SlopeRegressor::network));
  ASSERT_TRUE(calibration.model.network.has_value());
  ASSERT_TRUE(calibration.network_left_out.has_value());
  EXPECT_LT(*calibration.network_left_out, 0.1);
  HeightEstimator estimator(calibration.model);
  const auto field = [&](const Eigen::Vector2d& place) { return test_.at(place); };
  const HeightResult& result = estimator.estimate(balanced(painter_.paint(field), 30));
  const int u = static_cast<int>(5.3 / kScale);
  const int v = static_cast<int>(4.4 / kScale);
  EXPECT_NEAR(result.height_mm.at<float>(v, u), painter_.heights(field).at<float>(v, u), 0.1);
  EXPECT_LT(std::abs(result.height_mm.at<float>(10, 10)), 0.05);

  // The file keeps it, and the same calibration gives the same bytes.
  const std::string bytes = to_bytes(calibration.model);
  EXPECT_EQ(to_bytes(height_model_from_bytes(bytes, "m.gel")), bytes);
  EXPECT_EQ(to_bytes(calibrate_height(all, background_, quick(SlopeRegressor::network)).model), bytes);
}

TEST_F(OtherBalances, BestIsTheTableWhereItIsGood) {
  const HeightCalibration calibration = calibrate_height(presses(), background_, quick(SlopeRegressor::best));
  EXPECT_FALSE(calibration.model.network.has_value());
}

TEST_F(OtherBalances, FlawedPressesAreLeftOutAndNamed) {
  std::vector<BallPress> all = presses();
  all[1].name = "turned";
  cv::flip(all[1].frame, all[1].frame, -1);
  all[2].name = "untouched";
  all[2].frame = painter_.rest();
  all[3].name = "small";
  all[3].frame = all[3].frame.rowRange(0, 100).clone();
  all[4].name = "twice";
  cv::Mat shifted;
  cv::warpAffine(all[4].frame, shifted, cv::Matx23d(1, 0, -75, 0, 1, 0), all[4].frame.size(), cv::INTER_NEAREST,
                 cv::BORDER_REFLECT);
  shifted(cv::Rect(0, 0, 70, 160)).copyTo(all[4].frame(cv::Rect(0, 0, 70, 160)));
  const HeightCalibration calibration = calibrate_height(all, background_, quick(SlopeRegressor::table));
  EXPECT_EQ(calibration.model.presses, 2);
  EXPECT_TRUE(calibration.presses[0].flaw.empty());
  EXPECT_THAT(calibration.presses[1].flaw, HasSubstr("turned: only"));
  EXPECT_THAT(calibration.presses[2].flaw, HasSubstr("untouched: nothing is pressed"));
  EXPECT_THAT(calibration.presses[3].flaw, HasSubstr("small: the frame is 200 x 100 px"));
  EXPECT_THAT(calibration.presses[4].flaw, HasSubstr("twice: there's a second contact"));
  EXPECT_TRUE(calibration.presses[5].flaw.empty());
  EXPECT_THAT([&] { require_all_used(calibration); }, ThrowsMessage<Error>(HasSubstr("turned")));
  const std::vector<BallPress> bad(all.begin() + 1, all.begin() + 5);
  EXPECT_THAT([&] { calibrate_height(bad, background_, quick(SlopeRegressor::table)); },
              ThrowsMessage<Error>(HasSubstr("none of 4 ball presses can be used; the first: turned")));
}

TEST_F(OtherBalances, DoubtsAreToldPixelByPixel) {
  HeightEstimator estimator(calibrate_height(presses(), background_, quick(SlopeRegressor::table)).model);
  cv::Mat frame = painter_.rest();
  cv::rectangle(frame, cv::Rect(20, 20, 10, 10), cv::Scalar(255, 60, 60), cv::FILLED);
  cv::rectangle(frame, cv::Rect(60, 20, 10, 10), cv::Scalar(255, 255, 60), cv::FILLED);
  cv::rectangle(frame, cv::Rect(100, 20, 10, 10), cv::Scalar(0, 0, 0), cv::FILLED);
  const cv::Mat doubts = estimator.doubts(frame);
  EXPECT_EQ(doubts.at<unsigned char>(25, 25) & (kSlopeOfTwo | kSlopeLost), kSlopeOfTwo);
  EXPECT_EQ(doubts.at<unsigned char>(25, 65) & (kSlopeOfTwo | kSlopeLost), kSlopeLost);
  EXPECT_EQ(doubts.at<unsigned char>(25, 105) & (kSlopeOfTwo | kSlopeLost), kSlopeLost);
  EXPECT_NE(doubts.at<unsigned char>(25, 65) & kSlopeUnseen, 0);
  EXPECT_EQ(doubts.at<unsigned char>(100, 100), 0);
}

}  // namespace
}  // namespace touchstone::sensors
