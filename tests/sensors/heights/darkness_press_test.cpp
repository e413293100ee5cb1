#include "sensors/heights/darkness_press.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/sensors/heights/painted_darkness.h"

namespace touchstone::sensors {
namespace {

using fixtures::DarkBall;
using fixtures::Layer;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class DarknessPress : public ::testing::Test {
 protected:
  RestPicture rest_of(const cv::Mat& frame) { return mean_rest(std::vector<cv::Mat>{frame}); }
  ContactCircle find(const cv::Mat& frame) { return find_dark_circle(frame, rest_, {}, 4.0, {scale_}, "frame 3"); }
  auto finding(const cv::Mat& frame) {
    return [this, frame] { find(frame); };
  }
  cv::Mat two_balls(const DarkBall& a, const DarkBall& b) {
    return painter_.frame(
        [&](const Eigen::Vector2d& place) { return std::max(a.height_at(place), b.height_at(place)); });
  }
  fixtures::DarknessPainter painter_;
  double scale_ = painter_.mm_per_px;
  RestPicture rest_ = rest_of(painter_.rest());
  DarkBall ball_{{7.2, 6.4}, 4.0, 1.0, Layer::thin};
};

TEST_F(DarknessPress, CirclesAreFoundOnThickAndThinGels) {
  for (const Layer layer : {Layer::thick, Layer::thin}) {
    for (const double depth : {0.3, 0.7, 1.2}) {
      const DarkBall ball{{7.2, 6.4}, 4.0, depth, layer};
      const ContactCircle found = find(painter_.press(ball).frame);
      SCOPED_TRACE(depth);
      EXPECT_LT((found.centre - ball.centre / scale_).norm(), 0.6);
      EXPECT_NEAR(found.radius, ball.contact_radius() / scale_, 3.0);
    }
  }
}

TEST_F(DarknessPress, ExposureMovesNoCircle) {
  const ContactCircle as_it_is = find(painter_.press(ball_).frame);
  const ContactCircle darker = find(painter_.press(ball_, 0.8).frame);
  EXPECT_LT((as_it_is.centre - darker.centre).norm(), 0.3);
  EXPECT_NEAR(as_it_is.radius, darker.radius, 0.5);
}

TEST_F(DarknessPress, DustThatMovedHidesNoBall) {
  cv::Mat before = painter_.rest();
  cv::Mat after = painter_.press(ball_).frame;
  for (const cv::Point& speck : {cv::Point(40, 40), {250, 60}, {60, 200}, {150, 120}, {280, 210}}) {
    before(cv::Rect(speck, cv::Size(3, 3))).setTo(cv::Scalar(40, 40, 40));
    after(cv::Rect(speck + cv::Point(2, 1), cv::Size(3, 3))).setTo(cv::Scalar(40, 40, 40));
  }
  const ContactCircle found = find_dark_circle(after, rest_of(before), {}, 4.0, {scale_}, "dusty");
  EXPECT_LT((found.centre - ball_.centre / scale_).norm(), 1.0);
  EXPECT_NEAR(found.radius, ball_.contact_radius() / scale_, 3.0);
}

TEST_F(DarknessPress, RingsHoldTheCapAndItsDarkening) {
  DarkPress press = measure_press(painter_.press(ball_), rest_, {}, {scale_});
  const std::vector<PressRing> rings = rings_of(press);
  ASSERT_GT(rings.size(), 40U);
  for (const PressRing& ring : rings) {
    EXPECT_NEAR(ring.darkening, painter_.darkening_of(ball_.depth + ring.cap_mm), 0.006);
  }
  // Dust over a tenth of the contact, in one direction, doesn't move the rings.
  for (int v = 0; v < press.map.rows; ++v) {
    for (int u = 0; u < press.map.cols; ++u) {
      const Eigen::Vector2d offset = Eigen::Vector2d(u + 0.5, v + 0.5) - press.circle.centre;
      if (std::abs(std::atan2(offset.y(), offset.x())) < 0.3) press.map.at<float>(v, u) = 0.9F;
    }
  }
  for (const PressRing& ring : rings_of(press)) {
    if (ring.pixels < 20) continue;
    EXPECT_NEAR(ring.darkening, painter_.darkening_of(ball_.depth + ring.cap_mm), 0.01);
  }
  std::size_t all = 0;
  std::size_t halves = 0;
  for (const PressRing& ring : rings_of(press)) all += static_cast<std::size_t>(ring.pixels);
  for (const double angle : {0.3, 0.3 + CV_PI}) {
    for (const PressRing& ring : rings_of(press, angle)) halves += static_cast<std::size_t>(ring.pixels);
  }
  EXPECT_EQ(halves, all);
}

TEST_F(DarknessPress, BadFramesAreNamed) {
  EXPECT_THAT(finding(painter_.rest(4)), ThrowsMessage<Error>(HasSubstr("frame 3: no contact is seen")));
  const RestPicture pressed = rest_of(painter_.press(ball_).frame);
  EXPECT_THAT([&] { find_dark_circle(painter_.rest(), pressed, {}, 4.0, {scale_}, "x"); },
              ThrowsMessage<Error>(HasSubstr("x: where it's touched it is brighter than the rest picture")));
  EXPECT_THAT(finding(two_balls({{4.0, 6.0}, 2.0, 0.5, Layer::thin}, {{11.5, 6.0}, 2.0, 0.5, Layer::thin})),
              ThrowsMessage<Error>(HasSubstr("second contact near pixel")));
  const auto bar = [](const Eigen::Vector2d& place) {
    const Eigen::Vector2d offset = place - Eigen::Vector2d(8.0, 6.0);
    return std::max(0.0, 0.8 - 0.1 * offset.x() * offset.x() - 0.7 * offset.y() * offset.y());
  };
  EXPECT_THAT(finding(painter_.frame(bar)), ThrowsMessage<Error>(HasSubstr("isn't round")));
  EXPECT_THAT(finding(painter_.press({{1.0, 6.0}, 4.0, 1.0, Layer::thin}).frame),
              ThrowsMessage<Error>(HasSubstr("reaches the edge of the picture")));
  EXPECT_THAT(
      [&] {
        find_dark_circle(painter_.press({{8.0, 6.0}, 30.0, 2.0, Layer::thin}).frame, rest_, {}, 30.0, {scale_}, "wide");
      },
      ThrowsMessage<Error>(HasSubstr("wide: the contact reaches the edge of the picture")));
  EXPECT_THAT([&] { find_dark_circle(painter_.press(ball_).frame, rest_, {}, 1.0, {scale_}, "x"); },
              ThrowsMessage<Error>(HasSubstr("more than the ball's 40 px across")));
  EXPECT_THAT([&] { find_dark_circle(painter_.press(ball_).frame, rest_, {}, 2.0, {scale_}, "x"); },
              ThrowsMessage<Error>(HasSubstr("doesn't end within the ball's radius of 40 px")));
  EXPECT_THAT([&] { find_dark_circle(painter_.press(ball_).frame, rest_, {}, 4.0, {1e-7}, "x"); },
              ThrowsMessage<Error>(HasSubstr("mm_per_px 1e-07")));
}

TEST_F(DarknessPress, GivenCirclesAreChecked) {
  const auto measuring = [&](double u, double v, double radius, double ball_mm = 4.0) {
    return [=, this] {
      BallPress press = painter_.press(ball_);
      press.circle = ContactCircle{{u, v}, radius};
      press.ball_radius_mm = ball_mm;
      measure_press(press, rest_, {}, {scale_});
    };
  };
  EXPECT_NO_THROW(measuring(144.0, 128.0, 52.0)());
  EXPECT_THAT(measuring(144.0, 128.0, 3.0), ThrowsMessage<Error>(HasSubstr("at least 6 are needed")));
  EXPECT_THAT(measuring(144.0, 128.0, 81.0), ThrowsMessage<Error>(HasSubstr("must be below the ball's")));
  EXPECT_THAT(measuring(40.0, 128.0, 52.0), ThrowsMessage<Error>(HasSubstr("reaches the edge of the picture")));
  EXPECT_THAT(measuring(NAN, 128.0, 52.0), ThrowsMessage<Error>(HasSubstr("isn't finite")));
  EXPECT_THAT(measuring(290.0, 30.0, 20.0), ThrowsMessage<Error>(HasSubstr("nothing is pressed at (290, 30)")));
  EXPECT_THAT(measuring(144.0, 128.0, 52.0, -1.0), ThrowsMessage<Error>(HasSubstr("ball radius -1 mm")));
}

TEST_F(DarknessPress, RestPicturesAreChecked) {
  using Frames = std::vector<cv::Mat>;
  EXPECT_THAT([] { mean_rest(Frames{}); }, ThrowsMessage<Error>(HasSubstr("no rest picture")));
  EXPECT_THAT(
      [&] {
        mean_rest(Frames{painter_.rest(), cv::Mat(9, 9, CV_8UC3)});
      },
      ThrowsMessage<Error>(HasSubstr("rest frame 2: the frame is 9 x 9 px; the rest picture is 320 x 240")));
  EXPECT_THAT(
      [&] {
        mean_rest(Frames{painter_.rest(), cv::Mat(240, 320, CV_8UC1)});
      },
      ThrowsMessage<Error>(HasSubstr("rest frame 2: the frame is grey; the rest picture is in colour")));
  EXPECT_THAT([] { mean_rest(Frames{cv::Mat(9, 9, CV_16UC3)}); }, ThrowsMessage<Error>(HasSubstr("isn't of 8 bits")));
  EXPECT_THAT([] { mean_rest(Frames{cv::Mat(9, 9, CV_8UC3, cv::Scalar(9, 255, 9))}); },
              ThrowsMessage<Error>(HasSubstr("100.0 % of its pixels are saturated")));
  EXPECT_THAT([] { mean_rest(Frames{cv::Mat(9, 9, CV_8UC1, cv::Scalar(3))}); },
              ThrowsMessage<Error>(HasSubstr("are the lamps on?")));
  EXPECT_THAT(
      finding(cv::Mat(240, 321, CV_8UC3, cv::Scalar(9, 9, 9))),
      ThrowsMessage<Error>(HasSubstr("is 321 x 240 px; the rest picture is 320 x 240: is it another sensor's?")));
  const RestPicture two = mean_rest(Frames{painter_.rest(1), painter_.rest(2)});
  EXPECT_EQ(two.frames, 2);
  // The mean of three channels' noise, and of three roundings'.
  EXPECT_NEAR(*two.noise_DN, std::sqrt((1.5 * 1.5 + 1.0 / 12.0) / 3.0), 0.03);
}

}  // namespace
}  // namespace touchstone::sensors
