// What the tracker does with frames that show no beads, or not all, or aren't what they should be.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "sensors/beads/bead_tracker.h"
#include "tests/sensors/beads/rendered_beads.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::BeadPainter;
using fixtures::grid_positions;
using testing::Each;
using testing::HasSubstr;
using touchstone::test::message_of;

constexpr std::int64_t kIntervalUs = 1663;
const Eigen::Vector2d kGone(std::nan(""), 0.0);

void expect_finite(const TrackedBeads& tracked) {
  for (std::size_t i = 0; i < tracked.positions.size(); ++i) {
    EXPECT_TRUE(tracked.positions[i].allFinite() && tracked.measured[i].allFinite()) << i;
  }
  EXPECT_TRUE(std::isfinite(tracked.mean_grey));
}

class BeadTrackerFaults : public testing::Test {
 protected:
  const TrackedBeads& next(const std::vector<Eigen::Vector2d>& beads) { return next(painter.paint(beads)); }
  const TrackedBeads& next(const cv::Mat& image) { return tracker.track({image, t_us += kIntervalUs}); }

  BeadPainter painter{{.noise = 2.0}};
  const std::vector<Eigen::Vector2d> rest = grid_positions(3, 71.0, {320.0, 240.0});
  BeadTracker tracker{{}};
  std::int64_t t_us = 0;
};

TEST_F(BeadTrackerFaults, HiddenBeadIsHeldThenResetThenFoundAgain) {
  auto beads = rest;
  for (Eigen::Vector2d& bead : beads) bead += Eigen::Vector2d(4.0, -3.0);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(next(beads).found(), 9);
  const Eigen::Vector2d last = next(beads).positions[4];
  auto hidden = beads;
  hidden[4] = kGone;
  for (int i = 0; i < tracker.settings().max_hidden_frames; ++i) {
    const TrackedBeads& tracked = next(hidden);
    ASSERT_EQ(tracked.status[4], BeadStatus::kHidden) << i;
    EXPECT_LT((tracked.positions[4] - last).norm(), 0.2);  // it goes along with its neighbours, which are still
    EXPECT_EQ(tracked.area_px[4], 0.0);
    EXPECT_EQ(tracked.found(), 8);
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(next(hidden).status[4], BeadStatus::kReset);
  // It comes back where the window round the cell's centre doesn't reach it.
  beads[4] += Eigen::Vector2d(20.0, 24.0);
  const TrackedBeads& tracked = next(beads);
  EXPECT_EQ(tracked.status[4], BeadStatus::kFoundAgain);
  EXPECT_LT((tracked.positions[4] - beads[4]).norm(), 0.3);
  EXPECT_EQ(next(beads).status[4], BeadStatus::kFound);
}

TEST_F(BeadTrackerFaults, BeadThatLeavesItsCellIsReset) {
  auto beads = rest;
  bool reset = false;
  for (int step = 0; step < 40 && !reset; ++step) {
    const TrackedBeads& tracked = next(beads);
    const BeadStatus status = tracked.status[8];
    if (status == BeadStatus::kReset) {
      reset = true;
      // The corner cell's centre, seen from the mean bead, is a cell's side away.
      EXPECT_LT((tracked.positions[8] - rest[8]).norm(), 10.0);
      EXPECT_GT((tracked.positions[8] - beads[8]).norm(), 25.0);
    } else {
      ASSERT_EQ(status, BeadStatus::kFound) << step;
    }
    beads[8] += Eigen::Vector2d(2.0, 0.0);
  }
  EXPECT_TRUE(reset);
  beads[8] = rest[8] + Eigen::Vector2d(8.0, 0.0);
  next(beads);
  EXPECT_EQ(next(beads).status[8], BeadStatus::kFound);
}

TEST_F(BeadTrackerFaults, JumpOfOneBeadIsDoubtedUnlessSetOtherwise) {
  auto beads = rest;
  beads[0] += Eigen::Vector2d(-22.0, 25.0);
  for (const bool consistent : {false, true}) {
    BeadTracker fresh({.consistency = {.on = consistent}});
    ASSERT_EQ(fresh.track({painter.paint(rest), 0}).found(), 9);
    const int doubted = consistent ? fresh.settings().max_hidden_frames : 0;
    for (int frame = 1; frame <= doubted + 2; ++frame) {
      const TrackedBeads& tracked = fresh.track({painter.paint(beads), frame * kIntervalUs});
      if (frame <= doubted) {  // gel doesn't move like that: something else is seen, and the bead isn't
        EXPECT_EQ(tracked.status[0], BeadStatus::kHidden) << frame;
        EXPECT_LT((tracked.positions[0] - rest[0]).norm(), 0.3) << frame;
      } else if (frame == doubted + 2) {
        EXPECT_TRUE(is_found(tracked.status[0]));
        EXPECT_LT((tracked.positions[0] - beads[0]).norm(), 0.3);
        EXPECT_EQ(tracked.found(), 9);
      }
    }
  }
}

TEST_F(BeadTrackerFaults, HiddenBeadGoesWhereItsNeighboursGo) {
  ASSERT_EQ(next(rest).found(), 9);
  auto beads = rest;
  for (int frame = 1; frame <= 8; ++frame) {
    for (std::size_t i = 0; i < 9; ++i) beads[i] = rest[i] + frame * Eigen::Vector2d(1.5, -1.0);
    auto seen = beads;
    seen[4] = kGone;
    const TrackedBeads& tracked = next(seen);
    EXPECT_EQ(tracked.status[4], BeadStatus::kHidden);
    EXPECT_LT((tracked.positions[4] - beads[4]).norm(), 0.5) << frame;
  }
  EXPECT_EQ(next(beads).status[4], BeadStatus::kFound) << "it comes back where it's expected";
}

TEST_F(BeadTrackerFaults, BeadCutByTheWindowIsMeasuredWhole) {
  ASSERT_EQ(next(rest).found(), 9);
  auto beads = rest;
  for (Eigen::Vector2d& bead : beads) bead += Eigen::Vector2d(11.0, -10.0);  // a few px of each leave the window
  const TrackedBeads& tracked = next(beads);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(tracked.status[i], BeadStatus::kFound);
    EXPECT_LT((tracked.measured[i] - beads[i]).norm(), 0.3);
  }
}

TEST_F(BeadTrackerFaults, DroppedFramesOnlyMakeTheStepLonger) {
  RandomStream random(3, 0, Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    auto beads = rest;
    for (Eigen::Vector2d& bead : beads) bead += Eigen::Vector2d(6.0 * std::sin(0.1 * i), 6.0 * std::cos(0.1 * i));
    t_us += kIntervalUs;
    if (random.uniform() < 0.3) continue;
    const TrackedBeads& tracked = tracker.track({painter.paint(beads), t_us});
    ASSERT_EQ(tracked.found(), 9);
    for (std::size_t k = 0; k < 9; ++k) ASSERT_LT((tracked.positions[k] - beads[k]).norm(), 0.5) << "frame " << i;
  }
}

TEST_F(BeadTrackerFaults, TimeThatJumpsIsAsAnyOther) {
  // Beads sway at 20 Hz; 1, 2 and 100 intervals pass unseen, 30 px apart at most.
  for (const int intervals : {2, 100}) {
    BeadTracker fresh({});
    double seconds = 0.0;
    const auto beads = [&] {
      auto moved = rest;
      for (Eigen::Vector2d& bead : moved) bead.x() += 15.0 * std::sin(2.0 * 3.14159265358979 * 20.0 * seconds);
      return moved;
    };
    for (int frame = 0; frame < 60; ++frame) {
      seconds += 1e-6 * static_cast<double>(kIntervalUs) * (frame == 40 ? intervals : 1);
      const TrackedBeads& tracked = fresh.track({painter.paint(beads()), std::llround(1e6 * seconds)});
      ASSERT_EQ(tracked.found(), 9) << "frame " << frame;
      const auto truth = beads();
      for (std::size_t i = 0; i < 9; ++i) EXPECT_LT((tracked.positions[i] - truth[i]).norm(), 0.6) << "frame " << frame;
    }
  }
}

TEST_F(BeadTrackerFaults, LightThatJumpsOrDriftsCostsNoBead) {
  // Beads 60 levels darker than what is behind them, 18 at the least light; noise of half a level.
  BeadPainter dim({.background = 80.0, .bead = 20.0, .noise = 0.5});
  std::vector<double> gains = {1.0, 0.3, 1.0, 3.0, 0.3, 3.0, 1.0};
  for (int i = 0; i <= 60; ++i) gains.push_back(0.3 * std::pow(10.0, i / 60.0));  // a ramp of 4 % a frame
  for (const double gain : gains) {
    const TrackedBeads& tracked = next(dim.paint(rest, gain));
    EXPECT_THAT(tracked.status, Each(tracked.t_us == kIntervalUs ? tracked.status[0] : BeadStatus::kFound)) << gain;
    for (std::size_t i = 0; i < 9; ++i) EXPECT_LT((tracked.measured[i] - rest[i]).norm(), 0.3) << "gain " << gain;
  }
}

TEST_F(BeadTrackerFaults, TooMuchLightHidesBeadsUntilItIsGone) {
  ASSERT_EQ(next(rest).found(), 9);
  const TrackedBeads& white = next(painter.paint(rest, 20.0));  // beads are at 40 of 255
  EXPECT_EQ(white.light, FrameLight::kSaturated);
  EXPECT_THAT(white.status, Each(BeadStatus::kHidden));
  EXPECT_THAT(next(rest).status, Each(BeadStatus::kFound));
}

TEST_F(BeadTrackerFaults, JumpOfAllBeadsIsFollowedUpToACell) {
  // 71 px apart, in cells of 73 px: beyond half of it each cell sees a neighbour's bead.
  for (const double length : {20.0, 30.0, 34.0, 36.0, 37.0, 45.0, 60.0, 71.0}) {
    for (int direction = 0; direction < 8; ++direction) {
      BeadTracker fresh({});
      const double angle = direction * 3.14159265358979 / 4.0;
      Eigen::Vector2d step(std::cos(angle), std::sin(angle));
      step *= length / step.cwiseAbs().maxCoeff();
      auto moved = rest;
      for (Eigen::Vector2d& bead : moved) bead += step;
      ASSERT_EQ(fresh.track({painter.paint(rest), 0}).found(), 9);
      for (int frame = 1; frame <= 3; ++frame) {
        const TrackedBeads& tracked = fresh.track({painter.paint(moved), frame * kIntervalUs});
        ASSERT_EQ(tracked.found(), 9) << length << " px, direction " << direction;
        for (std::size_t i = 0; i < 9; ++i) EXPECT_LT((tracked.positions[i] - moved[i]).norm(), 0.5) << length;
      }
    }
  }
}

TEST_F(BeadTrackerFaults, BlackWhiteAndFlatFramesAreSaidSoAndSurvived) {
  for (int i = 0; i < 3; ++i) ASSERT_EQ(next(rest).found(), 9);
  const struct {
    int value;
    FrameLight light;
  } cases[] = {{0, FrameLight::kDark}, {1, FrameLight::kDark}, {120, FrameLight::kFlat}, {255, FrameLight::kSaturated}};
  for (const auto& [value, light] : cases) {
    const TrackedBeads& tracked = next(cv::Mat(480, 640, CV_8U, cv::Scalar(value)));
    EXPECT_EQ(tracked.light, light) << value;
    EXPECT_EQ(tracked.found(), 0);
    EXPECT_THAT(tracked.status, Each(BeadStatus::kHidden));
    expect_finite(tracked);
  }
  const TrackedBeads& tracked = next(rest);
  EXPECT_EQ(tracked.light, FrameLight::kNormal);
  EXPECT_THAT(tracked.status, Each(BeadStatus::kFound));
}

TEST_F(BeadTrackerFaults, LongDarknessResetsAndLightFindsAll) {
  next(rest);
  for (int i = 0; i < 50; ++i) expect_finite(next(cv::Mat::zeros(480, 640, CV_8U)));
  EXPECT_THAT(tracker.track({cv::Mat::zeros(480, 640, CV_8U), t_us += kIntervalUs}).status, Each(BeadStatus::kReset));
  EXPECT_EQ(next(rest).found(), 9);
}

TEST_F(BeadTrackerFaults, FramesThatNeverShowABeadAreReset) {
  RandomStream random(4, 0, Purpose::kTest);
  for (int i = 0; i < 10; ++i) {
    cv::Mat image(480, 640, CV_8U);
    for (auto& value : cv::Mat_<std::uint8_t>(image)) {
      value = cv::saturate_cast<std::uint8_t>(140.0 + 8.0 * random.normal());
    }
    const TrackedBeads& tracked = next(image);
    EXPECT_EQ(tracked.found(), 0);
    EXPECT_THAT(tracked.status, Each(BeadStatus::kReset));
    EXPECT_EQ(tracked.light, FrameLight::kNormal);
    expect_finite(tracked);
  }
}

TEST_F(BeadTrackerFaults, SpeckBesideABeadIsNotTakenForIt) {
  for (int i = 0; i < 3; ++i) next(rest);
  cv::Mat image = painter.paint(rest);
  cv::circle(image, {static_cast<int>(rest[4].x()) + 13, static_cast<int>(rest[4].y()) + 3}, 2, cv::Scalar(10), -1);
  const TrackedBeads& tracked = next(image);
  EXPECT_EQ(tracked.status[4], BeadStatus::kFound);
  EXPECT_LT((tracked.measured[4] - rest[4]).norm(), 0.25);

  auto hidden = rest;  // nor when the bead itself is gone
  hidden[4] = kGone;
  image = painter.paint(hidden);
  cv::circle(image, {static_cast<int>(rest[4].x()) + 6, static_cast<int>(rest[4].y()) + 3}, 3, cv::Scalar(10), -1);
  EXPECT_EQ(next(image).status[4], BeadStatus::kHidden);
}

/// Black specks of a bead's size on what touches the gel, under beads that sway.
struct Specks {
  int count = 0;
  double px_per_frame = 0.0;          ///< each goes straight on, where chance sends it
  double least_from_beads_px = 20.0;  ///< at first: bead and speck are 9 px in radius
};

struct SpeckScore {
  int measured = 0, wrong = 0, lost = 0;  ///< wrong: more than 6 px off
};

struct SpeckScores {
  SpeckScore with, without;  ///< BeadConsistency
};

SpeckScores track_among_specks(const Specks& specks) {
  SpeckScores scores;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    BeadPainter painter({.width = 400, .height = 400, .noise = 2.0}, seed);
    RandomStream random(seed, 1, Purpose::kTest);
    const auto rest = grid_positions(3, 71.0, {200.0, 200.0});
    std::vector<Eigen::Vector2d> at, step;
    while (at.size() < static_cast<std::size_t>(specks.count)) {
      const Eigen::Vector2d place(90.0 + 220.0 * random.uniform(), 90.0 + 220.0 * random.uniform());
      const double angle = 6.283 * random.uniform();
      if (std::any_of(rest.begin(), rest.end(), [&](const Eigen::Vector2d& bead) {
            return (bead - place).norm() < specks.least_from_beads_px;
          })) {
        continue;
      }
      at.push_back(place);
      step.emplace_back(specks.px_per_frame * std::cos(angle), specks.px_per_frame * std::sin(angle));
    }
    BeadTracker with({}), without({.consistency = {.on = false}});
    for (int frame = 0; frame < 60; ++frame) {
      auto beads = rest;
      for (Eigen::Vector2d& bead : beads) {
        bead += 8.0 * Eigen::Vector2d(std::sin(0.08 * frame), std::cos(0.08 * frame) - 1.0);
      }
      auto dark = beads;  // as dark as each other: where both are there's no edge
      for (std::size_t k = 0; k < at.size(); ++k) dark.push_back(at[k] + frame * step[k]);
      const cv::Mat image = painter.paint(dark);
      const auto judge = [&](BeadTracker& tracker, SpeckScore& score) {
        const TrackedBeads& tracked = tracker.track({image, frame * kIntervalUs});
        expect_finite(tracked);
        for (std::size_t i = 0; i < 9; ++i) {
          const bool found = is_found(tracked.status[i]);
          ++(found ? score.measured : score.lost);
          if (found && (tracked.positions[i] - beads[i]).norm() > 6.0) ++score.wrong;
        }
      };
      judge(with, scores.with);
      judge(without, scores.without);
    }
  }
  return scores;
}

TEST_F(BeadTrackerFaults, SpecksThatLookLikeBeadsAreFoundByTheirMotion) {
  for (const double px_per_frame : {0.0, 2.5}) {
    for (const int count : {5, 20}) {
      const auto [with, without] = track_among_specks({count, px_per_frame});
      EXPECT_GT(without.wrong, 10) << count << " specks at " << px_per_frame << " px a frame are no trial";
      EXPECT_LE(3 * with.wrong, without.wrong) << count << " specks at " << px_per_frame << " px a frame";
      EXPECT_LE(with.lost + with.wrong, without.lost + without.wrong) << "no bead is lost but wrong ones";
    }
    const auto [with, without] = track_among_specks({1, px_per_frame});
    EXPECT_LT(with.wrong, with.measured / 100) << "a speck alone";
    EXPECT_LE(with.lost, without.lost);
  }
}

TEST_F(BeadTrackerFaults, ConsistencyChangesNothingWhereOnlyBeadsAreSeen) {
  BeadTracker with({}), without({.consistency = {.on = false}});
  for (int frame = 0; frame < 60; ++frame) {
    auto beads = rest;  // pressed and sheared: up to 0.1 of a cell away from their neighbours' mean
    for (Eigen::Vector2d& bead : beads) {
      const Eigen::Vector2d from_load = bead - Eigen::Vector2d(290.0, 210.0);
      const double near = std::exp(-from_load.squaredNorm() / 8000.0);
      bead += near * std::sin(0.1 * frame) * (0.2 * from_load + Eigen::Vector2d(6.0, -3.0));
    }
    const cv::Mat image = painter.paint(beads);
    const TrackedBeads& a = with.track({image, frame * kIntervalUs});
    const TrackedBeads& b = without.track({image, frame * kIntervalUs});
    ASSERT_EQ(a.positions, b.positions) << frame;
    ASSERT_EQ(a.status, b.status) << frame;
  }
}

TEST_F(BeadTrackerFaults, BeadsAtTheImagesBorderAreNoTrouble) {
  BeadTracker corner({.first_centre_px = Eigen::Vector2d(2.0, 478.0)});
  BeadPainter plain({});
  for (int i = 0; i < 30; ++i) {
    const TrackedBeads& tracked = corner.track({plain.paint(rest), i});
    expect_finite(tracked);
  }
  BeadTracker beside({.first_centre_px = Eigen::Vector2d(-1e9, 1e9)});
  expect_finite(beside.track({plain.paint(rest), 0}));
}

TEST_F(BeadTrackerFaults, WrongFramesAreRefusedAndLeaveNoTrace) {
  next(rest);
  BeadTracker untouched({});
  // A copy of the tracker's history, without the frames that are refused.
  RandomStream random(5, 0, Purpose::kTest);
  const cv::Mat good = painter.paint(rest);
  BeadTracker disturbed({});
  untouched.track({good, 100});
  disturbed.track({good, 100});

  const auto refused = [&](const cv::Mat& image, std::int64_t at) {
    return message_of([&] { disturbed.track({image, at}); });
  };
  EXPECT_THAT(refused(cv::Mat(), 200), HasSubstr("empty"));
  EXPECT_THAT(refused(cv::Mat(240, 320, CV_8U, cv::Scalar(100)), 200), HasSubstr("320 x 240"));
  EXPECT_THAT(refused(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(100)), 200), HasSubstr("CV_8UC3"));
  EXPECT_THAT(refused(cv::Mat(480, 640, CV_32F, cv::Scalar(100)), 200), HasSubstr("CV_32FC1"));
  EXPECT_THAT(refused(cv::Mat(480, 640, CV_8UC4, cv::Scalar::all(100)), 200), HasSubstr("CV_8UC4"));
  EXPECT_THAT(refused(good, 100), HasSubstr("t = 100 us follows one at t = 100 us"));
  EXPECT_THAT(refused(good, 99), HasSubstr("times must increase"));
  EXPECT_THAT(refused(good, std::numeric_limits<std::int64_t>::min()), HasSubstr("times must increase"));

  const cv::Mat later = painter.paint(grid_positions(3, 72.0, {321.0, 240.0}));
  EXPECT_EQ(untouched.track({later, 300}).positions, disturbed.track({later, 300}).positions);

  const cv::Mat last = painter.paint(rest);
  const TrackedBeads& tracked = untouched.track({last, std::numeric_limits<std::int64_t>::max()});
  expect_finite(tracked);
}

TEST_F(BeadTrackerFaults, TooSmallAFirstFrameIsRefused) {
  BeadTracker fresh({});
  EXPECT_THAT(message_of([&] { fresh.track({cv::Mat(20, 640, CV_8U, cv::Scalar(100)), 0}); }), HasSubstr("640 x 20"));
  EXPECT_EQ(fresh.track({painter.paint(rest), 0}).found(), 9);
}

TEST_F(BeadTrackerFaults, SettingsOutOfRangeAreRefusedByName) {
  const auto refused = [](auto change) {
    BeadTrackerSettings settings;
    change(settings);
    return message_of([&] { BeadTracker refusing(settings); });
  };
  const double nan = std::nan("");
  EXPECT_THAT(refused([](auto& s) { s.grid = 1; }), HasSubstr("grid is 1"));
  EXPECT_THAT(refused([](auto& s) { s.roi_b_px = 65; }), HasSubstr("roi_b_px is 65"));
  EXPECT_THAT(refused([](auto& s) { s.roi_a_px = 60; }), HasSubstr("roi_b_px is 30"));
  EXPECT_THAT(refused([](auto& s) { s.morphology_px = 2; }), HasSubstr("morphology_px is 2"));
  EXPECT_THAT(refused([&](auto& s) { s.mean_brightness = nan; }), HasSubstr("mean_brightness is nan"));
  EXPECT_THAT(refused([&](auto& s) { s.contrast = nan; }), HasSubstr("contrast"));
  EXPECT_THAT(refused([](auto& s) { s.appearance.max_area_fraction = 1.5; }),
              HasSubstr("appearance.max_area_fraction"));
  EXPECT_THAT(refused([&](auto& s) { s.appearance.min_difference = nan; }), HasSubstr("appearance.min_difference"));
  EXPECT_THAT(refused([](auto& s) { s.filter.measurement_px = 0.0; }), HasSubstr("filter.measurement_px"));
  EXPECT_THAT(refused([](auto& s) { s.filter.acceleration_px_per_s2 = -1.0; }), HasSubstr("filter.acceleration"));
  EXPECT_THAT(refused([](auto& s) { s.consistency.lone_motion = 0.0; }), HasSubstr("consistency.lone_motion is 0"));
  EXPECT_THAT(refused([](auto& s) { s.consistency.lone_displacement = 2.0; }),
              HasSubstr("consistency.lone_displacement is 2"));
  EXPECT_THAT(refused([&](auto& s) { s.consistency.first_offset = nan; }), HasSubstr("consistency.first_offset"));
  EXPECT_THAT(refused([](auto& s) { s.max_hidden_frames = -1; }), HasSubstr("max_hidden_frames"));
  EXPECT_THAT(refused([&](auto& s) { s.first_centre_px = Eigen::Vector2d(1.0, nan); }), HasSubstr("first_centre_px"));
}

}  // namespace
}  // namespace touchstone::sensors
