#include "sensors/beads/bead_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/sensors/beads/rendered_beads.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using touchstone::test::message_of;

struct Drawn {
  cv::Mat frame;
  TrackedBeads beads;
  ForceEstimate force;
};

Drawn one_lost_bead() {
  fixtures::BeadPainter painter({.width = 320, .height = 320});
  auto beads = fixtures::grid_positions(3, 70.0, {160.0, 150.0});
  BeadTracker tracker({});
  tracker.track({painter.paint(beads), 0});
  beads[4] = {std::nan(""), 0.0};
  Drawn drawn;
  drawn.frame = painter.paint(beads);
  drawn.beads = tracker.track({drawn.frame, 1663});
  drawn.force.force = {1.5, -0.5, 3.0};
  drawn.force.beads_missing = 1;
  return drawn;
}

/// Whether one of the channels (blue, green, red) stands out near a place, where the frame is grey.
bool is_coloured(const cv::Mat& picture, const Eigen::Vector2d& place, int channel) {
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const cv::Vec3b& pixel =
          picture.at<cv::Vec3b>(static_cast<int>(place.y()) + dy, static_cast<int>(place.x()) + dx);
      if (pixel[channel] > 60 + std::max(pixel[(channel + 1) % 3], pixel[(channel + 2) % 3])) return true;
    }
  }
  return false;
}

TEST(BeadOverlay, RingsTellFoundFromMissingAndTheArrowTellsTheForce) {
  const Drawn drawn = one_lost_bead();
  ASSERT_EQ(drawn.beads.found(), 8);
  cv::Mat picture;
  draw_overlay(drawn.frame, drawn.beads, drawn.force, picture);
  ASSERT_EQ(picture.type(), CV_8UC3);
  const Eigen::Vector2d ring(0.0, 12.0);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(is_coloured(picture, drawn.beads.positions[i] + ring, 1), i != 4) << i;
    EXPECT_EQ(is_coloured(picture, drawn.beads.positions[i] + ring, 2), i == 4) << i;
  }
  const Eigen::Vector2d tip = drawn.beads.positions[4] + 40.0 * Eigen::Vector2d(1.5, -0.5);
  EXPECT_TRUE(is_coloured(picture, tip, 0));
  EXPECT_FALSE(is_coloured(picture, drawn.beads.positions[4] - 40.0 * Eigen::Vector2d(1.5, -0.5), 0));
}

TEST(BeadOverlay, EveryKindOfFrameGivesTheSamePicture) {
  const Drawn drawn = one_lost_bead();
  cv::Mat expected;
  draw_overlay(drawn.frame, drawn.beads, drawn.force, expected);
  cv::Mat colour, words;
  cv::cvtColor(drawn.frame, colour, cv::COLOR_GRAY2BGR);
  drawn.frame.convertTo(words, CV_16U, 257.0);
  for (const cv::Mat& frame : {colour, words}) {
    cv::Mat picture(320, 320, CV_8UC3);
    const uchar* const memory = picture.data;
    draw_overlay(frame, drawn.beads, drawn.force, picture);
    EXPECT_EQ(cv::norm(picture, expected, cv::NORM_INF), 0.0);
    EXPECT_EQ(picture.data, memory) << "memory of the right kind is used again";
  }
  draw_overlay(colour, drawn.beads, drawn.force, colour);  // over the frame itself
  EXPECT_EQ(cv::norm(colour, expected, cv::NORM_INF), 0.0);
}

TEST(BeadOverlay, BeadsFarOutsideAreDrawnNowhere) {
  Drawn drawn = one_lost_bead();
  for (Eigen::Vector2d& position : drawn.beads.positions) position = {1e12, -1e12};
  drawn.force.force = {-1e15, 1e15, 0.0};
  cv::Mat picture;
  EXPECT_NO_THROW(draw_overlay(drawn.frame, drawn.beads, drawn.force, picture));
}

TEST(BeadOverlay, WrongImagesAndSettingsAreRefused) {
  const Drawn drawn = one_lost_bead();
  cv::Mat picture;
  const auto refused = [&](const cv::Mat& frame, const BeadOverlay& how) {
    return message_of([&] { draw_overlay(frame, drawn.beads, drawn.force, picture, how); });
  };
  EXPECT_THAT(refused(cv::Mat(), {}), HasSubstr("none"));
  EXPECT_THAT(refused(cv::Mat(9, 9, CV_32F, cv::Scalar(1)), {}), HasSubstr("CV_32FC1"));
  EXPECT_THAT(refused(drawn.frame, {.px_per_N = 0.0}), HasSubstr("px_per_N is 0"));
  EXPECT_THAT(refused(drawn.frame, {.ring_px = 0}), HasSubstr("ring_px is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
