#include "sensors/heights/ball_press.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kScale = 0.053;
constexpr double kRadius = 1.0;  // the ball of 2 mm of [Li2015]

class BallPressTest : public ::testing::Test {
 protected:
  fixtures::GelPainter painter_{200, 160, kScale, {}};
  Background background_ = painter_.background();
  fixtures::Ball ball_{{5.2, 4.1}, kRadius, 0.7};
  BallPress press_ = painter_.press(ball_);

  PressSettings settings_{.mm_per_px = kScale};

  std::vector<ColourSample> samples(const BallPress& press) const {
    return samples_of(press, see_press(press, background_, {1.0, 1.0, 1.0}, settings_), settings_);
  }
  auto taking_samples(const BallPress& press) {
    return [this, press] { samples(press); };
  }
  ContactCircle found(const cv::Mat& frame) const {
    return find_contact_circle(difference_to(background_, frame), background_, kRadius, settings_, "frame 3");
  }
  auto finding(const cv::Mat& frame) {
    return [this, frame] { found(frame); };
  }
};

TEST(BallSlope, IsTheSpheresDerivative) {
  const double radius = 1.7;
  const auto height = [&](const Eigen::Vector2d& x) { return std::sqrt(radius * radius - x.squaredNorm()); };
  for (const Eigen::Vector2d& x : {Eigen::Vector2d(0.0, 0.0), {0.5, -0.3}, {-1.2, 0.9}}) {
    const double h = 1e-5;
    const Eigen::Vector2d slope = ball_slope(x, radius);
    EXPECT_NEAR(slope.x(), (height(x + Eigen::Vector2d(h, 0)) - height(x - Eigen::Vector2d(h, 0))) / (2 * h), 1e-7);
    EXPECT_NEAR(slope.y(), (height(x + Eigen::Vector2d(0, h)) - height(x - Eigen::Vector2d(0, h))) / (2 * h), 1e-7);
  }
}

TEST_F(BallPressTest, SamplesAreTheTouchedPartOnly) {
  const std::vector<ColourSample> taken = samples(press_);
  const double radius_px = 0.7 / kScale - 1.0;
  EXPECT_NEAR(static_cast<double>(taken.size()), kPi * radius_px * radius_px, 25.0);
  for (const ColourSample& sample : taken) {
    const fixtures::Relief truth = ball_.at(kScale * sample.place.cast<double>());
    EXPECT_LT((truth.slope - sample.slope.cast<double>()).norm(), 1e-4);
  }
}

TEST_F(BallPressTest, CircleIsFoundWhereverItIs) {
  for (const Eigen::Vector2d& centre : {Eigen::Vector2d(5.2, 4.1), {2.5, 2.0}, {8.03, 6.27}}) {
    for (const double contact : {0.45, 0.6, 0.8}) {
      const BallPress press = painter_.press({centre, kRadius, contact});
      const ContactCircle circle = found(press.frame);
      EXPECT_LT((circle.centre - press.circle->centre).norm(), 0.6) << centre.transpose() << ", " << contact;
      EXPECT_NEAR(circle.radius, press.circle->radius, 1.0) << centre.transpose() << ", " << contact;
    }
  }
}

TEST_F(BallPressTest, PressOverTheEdgeIsRefused) {
  BallPress press = painter_.press({{0.5, 4.0}, kRadius, 0.7});
  EXPECT_THAT(taking_samples(press),
              ThrowsMessage<Error>(HasSubstr("reaches over the edge of the picture of 200 x 160")));
  EXPECT_THAT(finding(press.frame), ThrowsMessage<Error>(HasSubstr("frame 3: the contact touches the edge")));
}

TEST_F(BallPressTest, TwoBallsAreRefused) {
  for (const double distance : {1.9, 2.5, 4.0}) {
    const fixtures::Ball other{{5.2 + distance, 4.1}, kRadius, 0.7};
    press_.frame = painter_.paint([&](const Eigen::Vector2d& place) {
      const fixtures::Relief a = ball_.at(place);
      const fixtures::Relief b = other.at(place);
      return a.height > b.height ? a : b;
    });
    EXPECT_THAT(taking_samples(press_), ThrowsMessage<Error>(HasSubstr("second contact"))) << distance;
    BallPress without = press_;
    without.circle.reset();
    EXPECT_THROW(samples(without), Error) << distance;
  }
}

TEST_F(BallPressTest, NothingPressedIsRefused) {
  press_.frame = painter_.rest();
  EXPECT_THAT(taking_samples(press_), ThrowsMessage<Error>(HasSubstr("nothing is pressed")));
  EXPECT_THAT(finding(press_.frame), ThrowsMessage<Error>(HasSubstr("no contact is seen")));
}

TEST_F(BallPressTest, UnfitFiguresAreNamed) {
  const auto with = [&](auto change) {
    BallPress press = press_;
    change(press);
    return taking_samples(press);
  };
  EXPECT_THAT(with([](BallPress& p) { p.circle->radius = 20.0; }),
              ThrowsMessage<Error>(HasSubstr("must be below the ball's")));
  EXPECT_THAT(with([](BallPress& p) { p.circle->radius = 2.0; }), ThrowsMessage<Error>(HasSubstr("at least 4")));
  EXPECT_THAT(with([](BallPress& p) { p.circle->radius = NAN; }), ThrowsMessage<Error>(HasSubstr("isn't finite")));
  EXPECT_THAT(with([](BallPress& p) { p.ball_radius_mm = 0.0; }), ThrowsMessage<Error>(HasSubstr("above 0")));
  EXPECT_THAT(with([](BallPress& p) { cv::extractChannel(p.frame, p.frame, 0); }),
              ThrowsMessage<Error>(HasSubstr("grey")));
  EXPECT_THAT(with([](BallPress& p) { p.frame = p.frame.rowRange(0, 100); }),
              ThrowsMessage<Error>(HasSubstr("200 x 100 px")));
}

TEST_F(BallPressTest, PixelsWithTwoSaturatedChannelsAreLeftOutOrTooMany) {
  BallPress press = press_;
  const int u = static_cast<int>(press.circle->centre.x());
  const int v = static_cast<int>(press.circle->centre.y());
  const std::size_t all = samples(press).size();
  const auto paint = [&](int half, const cv::Scalar& colour) {
    press.frame = press_.frame.clone();
    cv::rectangle(press.frame, cv::Rect(u - half, v - half, 2 * half, 2 * half), colour, cv::FILLED);
  };
  paint(2, {255, 255, 90});
  EXPECT_EQ(samples(press).size(), all - 16);
  paint(2, {255, 90, 90});  // one channel: the others still show the slope
  const std::vector<ColourSample> kept = samples(press);
  EXPECT_EQ(kept.size(), all);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](const ColourSample& one) { return one.saturated; }), 16);
  paint(9, {255, 255, 90});
  EXPECT_THAT(taking_samples(press), ThrowsMessage<Error>(HasSubstr("two channels at 255; at most 50 %")));
}

}  // namespace
}  // namespace touchstone::sensors
