#include "sensors/beads/bead_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "tests/sensors/beads/rendered_beads.h"

namespace touchstone::sensors {
namespace {

using fixtures::BeadPainter;
using fixtures::BeadPicture;
using fixtures::grid_positions;

constexpr std::int64_t kIntervalUs = 1663;  // 601.25 frames/s

struct Errors {
  Eigen::Vector2d bias = Eigen::Vector2d::Zero();
  double rms = 0.0;
};

/// Errors of single measurements, over beads placed at random sub-pixel positions.
Errors measure_errors(const BeadPicture& picture, const BeadTrackerSettings& settings) {
  BeadPainter painter(picture);
  RandomStream random(7, 0, Purpose::kTest);
  Errors errors;
  int count = 0;
  for (int trial = 0; trial < 40; ++trial) {
    auto beads = grid_positions(3, 70.0, {0.5 * picture.width, 0.5 * picture.height});
    for (Eigen::Vector2d& bead : beads) {
      bead += Eigen::Vector2d(4.0 * random.uniform() - 2.0, 4.0 * random.uniform() - 2.0);
    }
    BeadTracker tracker(settings);
    const TrackedBeads& tracked = tracker.track({painter.paint(beads), 0});
    for (std::size_t i = 0; i < beads.size(); ++i) {
      EXPECT_EQ(tracked.status[i], BeadStatus::kFound);
      const Eigen::Vector2d error = tracked.measured[i] - beads[i];
      errors.bias += error;
      errors.rms += 0.5 * error.squaredNorm();
      ++count;
    }
  }
  errors.bias /= count;
  errors.rms = std::sqrt(errors.rms / count);
  return errors;
}

const BeadPicture kSmall = {.width = 320, .height = 320};

TEST(BeadTracker, CentroidIsUnbiased) {
  for (const double fall_off : {0.0, 400.0}) {
    for (const double noise : {0.0, 3.0}) {
      BeadPicture picture = kSmall;
      picture.fall_off_px = fall_off;
      picture.noise = noise;
      const Errors errors = measure_errors(picture, {});
      EXPECT_LT(errors.bias.cwiseAbs().maxCoeff(), 0.02) << "fall-off " << fall_off << ", noise " << noise;
      EXPECT_LT(errors.rms, 0.1) << "fall-off " << fall_off << ", noise " << noise;
    }
  }
}

TEST(BeadTracker, WeightedCentroidIsThreeTimesBetter) {
  BeadPicture picture = kSmall;
  picture.noise = 3.0;
  BeadTrackerSettings settings;
  const double binary = measure_errors(picture, settings).rms;
  settings.centroid = CentroidKind::kWeighted;
  const double weighted = measure_errors(picture, settings).rms;
  EXPECT_LT(weighted, binary / 3.0);
}

TEST(BeadTracker, BrightBeadsAreFoundAsDarkOnes) {
  BeadPicture picture = kSmall;
  picture.background = 60.0;
  picture.bead = 220.0;
  BeadTrackerSettings settings;
  settings.appearance.polarity = BeadPolarity::kBright;
  const Errors errors = measure_errors(picture, settings);
  EXPECT_LT(errors.bias.cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT(errors.rms, 0.1);
}

TEST(BeadTracker, EveryKindOfImageGivesTheSamePositions) {
  BeadPainter painter({.noise = 1.0});
  const cv::Mat grey = painter.paint(grid_positions(3, 71.3, {318.2, 241.9}));
  cv::Mat bgr, grey16, bgr16;
  cv::merge(std::vector<cv::Mat>{grey, grey, grey}, bgr);
  grey.convertTo(grey16, CV_16U, 16.0);  // 12 bit in 16
  bgr.convertTo(bgr16, CV_16U, 16.0);
  BeadTracker reference({});
  const TrackedBeads expected = reference.track({grey, 0});
  ASSERT_EQ(expected.found(), 9);
  for (const cv::Mat& image : {bgr, grey16, bgr16}) {
    BeadTracker tracker({});
    const TrackedBeads& tracked = tracker.track({image, 0});
    for (std::size_t i = 0; i < 9; ++i) EXPECT_LT((tracked.positions[i] - expected.positions[i]).norm(), 1e-9);
  }
}

TEST(BeadTracker, BrightnessOfTheFrameHasNoSay) {
  BeadPainter painter({.background = 120.0, .bead = 30.0});
  const auto beads = grid_positions(3, 71.3, {318.2, 241.9});
  BeadTracker tracker({});
  const TrackedBeads first = tracker.track({painter.paint(beads), 0});
  ASSERT_EQ(first.found(), 9);
  std::int64_t t_us = 0;
  for (const double gain : {0.3, 1.9, 0.15, 1.0}) {  // sudden changes
    const TrackedBeads& tracked = tracker.track({painter.paint(beads, gain), t_us += kIntervalUs});
    EXPECT_EQ(tracked.found(), 9) << "gain " << gain;
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_LT((tracked.measured[i] - beads[i]).norm(), 0.25) << "gain " << gain;
      EXPECT_EQ(tracked.status[i], BeadStatus::kFound);
    }
  }
}

TEST(BeadTracker, LoadCycleIsFollowedWithoutALoss) {
  // The pattern widens under normal load, moves with shear along x and y, and bends round the pressed square, at 30
  // frames/s: the cycle of [VisioHaptic2024, sec. 4.3] with noise and the fall-off of a pinhole.
  BeadPicture picture = kSmall;
  picture.fall_off_px = 400.0;
  picture.noise = 3.0;
  BeadPainter painter(picture);
  BeadTracker tracker({});
  const auto rest = grid_positions(3, 66.0, {163.0, 158.5});
  double squares = 0.0;
  constexpr int kFrames = 600;
  for (int frame = 0; frame < kFrames; ++frame) {
    const double phase = 2.0 * 3.14159265358979 * frame / kFrames;
    const double normal = 1.0 - std::cos(phase);  // 0..2
    const Eigen::Vector2d shear(8.0 * std::sin(3.0 * phase), 8.0 * std::sin(4.0 * phase));
    std::vector<Eigen::Vector2d> beads;
    for (const Eigen::Vector2d& place : rest) {
      const Eigen::Vector2d from_load = place - Eigen::Vector2d(130.0, 125.0);
      const double near = std::exp(-from_load.squaredNorm() / (2.0 * 80.0 * 80.0));
      beads.push_back(place + near * (0.09 * normal * from_load + shear));
    }
    const TrackedBeads& tracked = tracker.track({painter.paint(beads), frame * 33333});
    ASSERT_EQ(tracked.found(), 9) << "frame " << frame;
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_EQ(tracked.status[i], BeadStatus::kFound) << "frame " << frame << " bead " << i;
      squares += 0.5 * (tracked.positions[i] - beads[i]).squaredNorm();
      EXPECT_LT((tracked.positions[i] - beads[i]).norm(), 0.6) << "frame " << frame << " bead " << i;
    }
  }
  EXPECT_LT(std::sqrt(squares / (9.0 * kFrames)), 0.1);
}

struct Worst {
  double error_px = 0.0;
  int lost = 0;
};

/// As where the slope of the gel beside a pressed object crosses a bead: a stripe about as wide as the bead and `depth`
/// as dark runs past the middle column of beads.
Worst track_past_a_stripe(double depth, const BeadTrackerSettings& settings) {
  BeadPicture picture = kSmall;
  picture.noise = 3.0;
  picture.blur_px = 3.0;
  BeadPainter painter(picture);
  const auto beads = grid_positions(3, 70.0, {160.0, 160.0});
  BeadTracker tracker(settings);
  tracker.track({painter.paint(beads), 0});
  Worst worst;
  for (int frame = 1; frame <= 60; ++frame) {
    cv::Mat image = painter.paint(beads);
    const double stripe_at = 160.0 - 30.0 + frame;
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double across = (x + 0.5 - stripe_at) / 6.0;
        const double behind =
            picture.background - depth * (picture.background - picture.bead) * std::exp(-across * across);
        auto& value = image.at<std::uint8_t>(y, x);  // the stripe lies behind the beads
        value = std::min(value, static_cast<std::uint8_t>(behind + 0.5));
      }
    }
    const TrackedBeads& tracked = tracker.track({image, frame * kIntervalUs});
    for (std::size_t i = 0; i < beads.size(); ++i) {
      if (!is_found(tracked.status[i])) {
        ++worst.lost;
        continue;
      }
      worst.error_px = std::max(worst.error_px, (tracked.measured[i] - beads[i]).norm());
    }
  }
  return worst;
}

TEST(BeadTracker, AHalfDarkStripeDoesNotDragABead) {
  const double depth = 0.8;
  const Worst with_core = track_past_a_stripe(depth, {});
  EXPECT_EQ(with_core.lost, 0);
  EXPECT_LT(with_core.error_px, 0.5);
  BeadTrackerSettings whole_region;
  whole_region.appearance.least_core = 1.0;  // a core is never that large
  const Worst without = track_past_a_stripe(depth, whole_region);
  EXPECT_TRUE(without.lost > 0 || without.error_px > 3.0 * with_core.error_px)
      << "the stripe is no trial: " << without.lost << " lost, " << without.error_px << " px";
}

TEST(BeadTracker, RoiAFollowsTheMeanBead) {
  // All beads drift further than a cell is wide: only a grid that moves with them keeps each in its cell.
  BeadPainter painter({.width = 480, .height = 320});
  BeadTracker tracker({.first_centre_px = Eigen::Vector2d(120.0, 160.0)});
  for (int frame = 0; frame <= 120; ++frame) {
    const auto beads = grid_positions(3, 70.0, {120.0 + 2.0 * frame, 160.0});
    const TrackedBeads& tracked = tracker.track({painter.paint(beads), frame * kIntervalUs});
    ASSERT_EQ(tracked.found(), 9) << "frame " << frame;
    for (std::size_t i = 0; i < 9; ++i) ASSERT_LT((tracked.measured[i] - beads[i]).norm(), 0.3) << "frame " << frame;
  }
}

TEST(BeadTracker, LargerGridsAreInRowMajorOrder) {
  BeadPainter painter({.radius_px = 4.0});
  const auto beads = grid_positions(10, 40.0, {320.0, 240.0});
  BeadTracker tracker({.grid = 10, .roi_a_px = 400, .roi_b_px = 20});
  const TrackedBeads& tracked = tracker.track({painter.paint(beads), 0});
  ASSERT_EQ(tracked.positions.size(), 100u);
  EXPECT_EQ(tracked.found(), 100);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_LT((tracked.positions[i] - beads[i]).norm(), 0.3) << i;
}

TEST(BeadTracker, FirstFrameFindsBeadsFarFromTheirCellsCentres) {
  // "Even if their locations differ slightly": here by more than the window reaches.
  BeadPainter painter({.noise = 2.0});
  auto beads = grid_positions(3, 73.0, {320.0, 240.0});
  for (std::size_t i = 0; i < 9; ++i) beads[i] += (i % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector2d(22.0, -19.0);
  BeadTracker tracker({});
  const TrackedBeads& tracked = tracker.track({painter.paint(beads), 0});
  ASSERT_EQ(tracked.found(), 9);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(tracked.status[i], BeadStatus::kFoundAgain);
    EXPECT_LT((tracked.positions[i] - beads[i]).norm(), 0.3) << i;
  }
}

TEST(BeadTracker, OneRunIsTheOtherBitForBit) {
  BeadPainter painter({.width = 320, .height = 320, .noise = 4.0});
  std::vector<cv::Mat> images;
  for (int i = 0; i < 20; ++i) images.push_back(painter.paint(grid_positions(3, 70.0 + 0.1 * i, {160.0, 160.0})));
  BeadTracker one({}), other({});
  other.track({images[7], -5});  // restarted: what came before leaves no trace
  other.restart();
  for (int i = 0; i < 20; ++i) {
    const TrackedBeads& a = one.track({images[static_cast<std::size_t>(i)], i * kIntervalUs});
    const TrackedBeads& b = other.track({images[static_cast<std::size_t>(i)], i * kIntervalUs});
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.measured, b.measured);
    EXPECT_EQ(a.status, b.status);
  }
}

TEST(BeadTracker, PartOfALargerImageIsReadAsIfItWereWhole) {
  BeadPainter painter({});
  const cv::Mat image = painter.paint(grid_positions(3, 70.0, {330.0, 250.0}));
  const cv::Mat part = image(cv::Rect(101, 77, 420, 360));
  BeadTracker inside({}), alone({});
  EXPECT_EQ(inside.track({part, 0}).positions, alone.track({part.clone(), 0}).positions);
}

}  // namespace
}  // namespace touchstone::sensors
