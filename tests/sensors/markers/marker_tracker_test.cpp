// Marker positions and displacements against painted pictures, whose positions are known.

#include "sensors/markers/marker_tracker.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <set>

#include "core/error.h"
#include "sensors/markers/marker_filling.h"
#include "sensors/markers/marker_overlay.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {
namespace {

using fixtures::marker_grid;
using fixtures::MarkerPicture;
using fixtures::paint_markers;

/// Index of the marker that was at `home` in the first frame.
std::size_t marker_at(const TrackedMarkers& markers, const Eigen::Vector2d& home) {
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    if ((markers.rest[i] - home).norm() < 1.0) return i;
  }
  ADD_FAILURE() << "no marker at " << home.transpose();
  return 0;
}

/// Root mean square of (measured - true) displacement, over found markers.
double rms_error_px(const TrackedMarkers& markers, const std::vector<Eigen::Vector2d>& rest,
                    const std::vector<Eigen::Vector2d>& now) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const std::size_t marker = marker_at(markers, rest[i]);
    if (!is_found(markers.status[marker])) continue;
    sum += (markers.displacement(marker) - (now[i] - rest[i])).squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count);
}

/// A smooth field: a translation that dies away from the middle.
std::vector<Eigen::Vector2d> sheared(std::vector<Eigen::Vector2d> places, const Eigen::Vector2d& motion) {
  for (Eigen::Vector2d& place : places) {
    place += motion * std::exp(-(place - Eigen::Vector2d(160, 120)).squaredNorm() / (2.0 * 60.0 * 60.0));
  }
  return places;
}

TEST(MarkerFinder, CentroidsAreSubPixelWithoutNoise) {
  std::vector<Eigen::Vector2d> places = marker_grid();
  RandomStream random(3, 0, Purpose::kTest);
  for (Eigen::Vector2d& place : places) place += Eigen::Vector2d(random.uniform(), random.uniform());
  MarkerFinder finder({});
  const auto& blobs = finder.find(paint_markers({}, places));
  ASSERT_EQ(blobs.size(), places.size());
  for (const Eigen::Vector2d& place : places) {
    double least = 1e9;
    for (const MarkerBlob& blob : blobs) least = std::min(least, (blob.centroid - place).norm());
    EXPECT_LT(least, 0.03) << place.transpose();
  }
}

TEST(MarkerTracker, DisplacementsAreMeasuredInNoise) {
  const auto rest = marker_grid();
  MarkerPicture picture;
  picture.noise = 2.0;
  MarkerTracker tracker({});
  tracker.track({paint_markers(picture, rest, 1), 0});
  EXPECT_NEAR(tracker.spacing_px(), 22.6, 0.1);
  for (int i = 1; i <= 10; ++i) {
    const auto now = sheared(rest, {1.5 * i, -0.7 * i});
    const TrackedMarkers& markers = tracker.track({paint_markers(picture, now, static_cast<std::uint64_t>(1 + i)), i});
    EXPECT_EQ(markers.found(), static_cast<int>(rest.size()));
    EXPECT_EQ(markers.unclaimed, 0);
    EXPECT_LT(rms_error_px(markers, rest, now), 0.06) << "frame " << i;
  }
}

TEST(MarkerTracker, RestartForgetsAllFrames) {
  const auto rest = marker_grid();
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  tracker.restart();
  EXPECT_TRUE(tracker.tracked().positions.empty());
  EXPECT_TRUE(tracker.tracked().status.empty());
  EXPECT_EQ(tracker.spacing_px(), 0.0);
  const auto moved = sheared(rest, {3.0, 1.0});
  EXPECT_EQ(tracker.track({paint_markers({}, moved), 0}).found(), static_cast<int>(rest.size()));
  EXPECT_LT(tracker.tracked().displacement(0).norm(), 1e-12) << "the next frame is the gel at rest";
}

TEST(MarkerTracker, ThresholdFollowsTheLight) {
  // A third of the light, a steep fall-off and a shadow in which the membrane is as dark as markers are elsewhere.
  const auto rest = marker_grid();
  MarkerPicture picture;
  picture.noise = 1.0;
  MarkerTracker tracker({});
  tracker.track({paint_markers(picture, rest), 0});
  picture.shading = 0.6;
  picture.brightness = 50.0;
  picture.shadow = {100, 70, 130, 90};
  const auto now = sheared(rest, {3, 2});
  const TrackedMarkers& markers = tracker.track({paint_markers(picture, now, 2), 1});
  EXPECT_GE(markers.found(), static_cast<int>(rest.size()) - 8);  // those on the shadow's edge
  EXPECT_LT(rms_error_px(markers, rest, now), 0.25);
}

TEST(MarkerTracker, GreyAndColourOfTheSameLightAgree) {
  const auto rest = marker_grid();
  MarkerPicture picture;
  picture.shading = 0.0;  // then the three channels are equal
  const cv::Mat first = paint_markers(picture, rest);
  const cv::Mat second = paint_markers(picture, sheared(rest, {4, 1}));
  MarkerTracker colour({}), grey({});
  colour.track({first, 0});
  const TrackedMarkers a = colour.track({second, 1});
  cv::Mat first_grey, second_grey;
  cv::extractChannel(first, first_grey, 0);
  cv::extractChannel(second, second_grey, 0);
  grey.track({first_grey, 0});
  const TrackedMarkers b = grey.track({second_grey, 1});
  EXPECT_EQ(a.positions, b.positions);
}

TEST(MarkerTracker, AHiddenMarkerIsHeldWithItsNeighboursAndFoundAgain) {
  const auto rest = marker_grid();
  const std::size_t hidden = 4 * 14 + 7;
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  const std::size_t marker = marker_at(tracker.track({paint_markers({}, rest), 1}), rest[hidden]);
  for (int i = 2; i < 12; ++i) {  // in all it goes farther than a spacing
    auto now = sheared(rest, {2.8 * (i - 1), 0});
    const Eigen::Vector2d place = now[hidden];
    if (i < 11) now[hidden].setConstant(std::nan(""));
    const TrackedMarkers& markers = tracker.track({paint_markers({}, now), i});
    EXPECT_EQ(markers.status[marker], i < 11 ? MarkerStatus::kHidden : MarkerStatus::kFoundAgain);
    EXPECT_LT((markers.positions[marker] - place).norm(), i < 11 ? 3.0 : 0.05);
    EXPECT_EQ(markers.found(), static_cast<int>(rest.size()) - (i < 11 ? 1 : 0));
    EXPECT_FALSE(markers.jumped);
  }
}

TEST(MarkerTracker, MergedMarkersAreReportedAndNotMeasured) {
  const auto rest = marker_grid();
  const std::size_t left = 4 * 14 + 7;
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  for (int i = 1; i <= 8; ++i) {  // two neighbours approach to less than their diameter
    auto now = rest;
    now[left].x() += 1.0 * i;
    now[left + 1].x() -= 1.0 * i;
    const TrackedMarkers& markers = tracker.track({paint_markers({}, now), i});
    for (const std::size_t one : {left, left + 1}) {
      const std::size_t marker = marker_at(markers, rest[one]);
      if (is_found(markers.status[marker])) {
        EXPECT_LT((markers.positions[marker] - now[one]).norm(), 0.5) << "frame " << i;
      } else {
        EXPECT_EQ(markers.status[marker], MarkerStatus::kMerged) << "frame " << i;
      }
    }
    if (i == 8) {
      EXPECT_EQ(markers.found(), static_cast<int>(rest.size()) - 2);
    }
  }
  const TrackedMarkers& apart = tracker.track({paint_markers({}, rest), 9});
  EXPECT_EQ(apart.found(), static_cast<int>(rest.size()));
  EXPECT_LT(rms_error_px(apart, rest, rest), 0.01);
}

TEST(MarkerTracker, AJumpIsNeverTakenForACleanFrame) {
  // A bonded gel's middle jumps by a part of the spacing in one frame. Up to the longest step all is right; beyond it a
  // wrong displacement may come out, but not without `jumped`.
  const auto rest = marker_grid();
  int wrong = 0;
  for (double part = 0.1; part < 2.05; part += 0.1) {
    const auto now = sheared(rest, {part * 22.6, 0});
    MarkerTracker tracker({});
    tracker.track({paint_markers({}, rest), 0});
    const TrackedMarkers& markers = tracker.track({paint_markers({}, now), 1});
    const bool right = rms_error_px(markers, rest, now) < 0.5;
    wrong += right ? 0 : 1;
    EXPECT_TRUE(right || markers.jumped) << "a jump of " << part << " spacings";
    if (part < 0.4) {
      EXPECT_TRUE(right && !markers.jumped) << "a jump of " << part << " spacings";
    }
    // The gel comes back to rest: the names are right again, and the tracker says so.
    const TrackedMarkers& back = tracker.track({paint_markers({}, rest), 2});
    EXPECT_FALSE(back.jumped);
    EXPECT_EQ(back.found(), static_cast<int>(rest.size()));
    EXPECT_LT(rms_error_px(back, rest, rest), 0.01);
  }
  EXPECT_GT(wrong, 0) << "the test has no case that can fail";
}

TEST(MarkerTracker, NoTwoMarkersShareABlob) {
  // A field that turns upside down: nearest neighbours are wrong everywhere.
  const auto rest = marker_grid();
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  std::vector<Eigen::Vector2d> now;
  RandomStream random(5, 0, Purpose::kTest);
  for (const Eigen::Vector2d& place : rest)
    now.push_back(place + 12.0 * Eigen::Vector2d(random.normal(), random.normal()));
  const TrackedMarkers& markers = tracker.track({paint_markers({}, now), 1});
  std::set<std::pair<double, double>> places;
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    if (!is_found(markers.status[i])) continue;
    EXPECT_TRUE(places.emplace(markers.positions[i].x(), markers.positions[i].y()).second);
    EXPECT_LE(markers.displacement(i).norm(), 0.4 * tracker.spacing_px());
  }
  EXPECT_LT(markers.found(), static_cast<int>(rest.size()));
}

TEST(MarkerTracker, AMarkerThatIsCutByTheEdgeIsReported) {
  const auto rest = marker_grid();
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  TrackedMarkers last;
  for (int i = 1; i <= 4; ++i) {
    auto now = rest;
    for (Eigen::Vector2d& place : now) place.x() -= 2.5 * i;
    last = tracker.track({paint_markers({}, now), i});
  }
  for (std::size_t row = 0; row < 10; ++row) {
    EXPECT_EQ(last.status[marker_at(last, rest[row * 14])], MarkerStatus::kAtBorder);
  }
}

TEST(MarkerTracker, FramesWithoutLightHoldAllMarkers) {
  const auto rest = marker_grid();
  const auto moved = sheared(rest, {2, 1});
  const std::vector<std::pair<int, FrameLight>> bad = {
      {0, FrameLight::kDark}, {255, FrameLight::kSaturated}, {90, FrameLight::kFlat}};
  for (const auto& [value, light] : bad) {
    MarkerTracker tracker({});
    tracker.track({paint_markers({}, rest), 0});
    const TrackedMarkers before = tracker.track({paint_markers({}, moved), 1});
    const TrackedMarkers& held = tracker.track({cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(value)), 2});
    EXPECT_EQ(held.light, light);
    EXPECT_EQ(held.found(), 0);
    EXPECT_EQ(held.positions, before.positions);
    const TrackedMarkers& after = tracker.track({paint_markers({}, moved), 3});
    EXPECT_EQ(after.found(), static_cast<int>(rest.size()));
    EXPECT_LT(rms_error_px(after, rest, moved), 0.05);
  }
}

TEST(MarkerTracker, BadInputIsRefusedAndChangesNothing) {
  const auto rest = marker_grid();
  const cv::Mat good = paint_markers({}, rest);
  MarkerTracker tracker({});
  EXPECT_THROW(tracker.track({cv::Mat(), 0}), Error);
  EXPECT_THROW(tracker.track({cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(0)), 0}), Error);    // dark
  EXPECT_THROW(tracker.track({cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(255)), 0}), Error);  // saturated
  EXPECT_THROW(tracker.track({cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(120)), 0}), Error);  // flat
  EXPECT_THROW(tracker.track({paint_markers({}, {}), 0}), Error);                             // a gel without markers
  EXPECT_THROW(tracker.track({cv::Mat(10, 10, CV_8UC3, cv::Scalar::all(120)), 0}), Error);
  cv::Mat other;
  good.convertTo(other, CV_32F);
  EXPECT_THROW(tracker.track({other, 0}), Error);
  const TrackedMarkers first = tracker.track({good, 0});  // of a size other than the refused ones'
  EXPECT_EQ(first.rest.size(), rest.size());
  EXPECT_THROW(tracker.track({good, 0}), Error);  // no time has passed
  cv::resize(good, other, {640, 480});
  EXPECT_THROW(tracker.track({other, 1}), Error);
  EXPECT_EQ(tracker.track({good, 1}).positions, first.positions);

  const auto refuses = [](auto change) {
    MarkerTrackerSettings settings = {.appearance = MarkerAppearance()};
    change(settings);
    EXPECT_THROW(MarkerTracker{settings}, Error);
  };
  refuses([](auto& s) { s.appearance->diameter_px = 1.0; });
  refuses([](auto& s) { s.appearance->spacing_px = 5.0; });
  refuses([](auto& s) { s.appearance->darkness = std::nan(""); });
  refuses([](auto& s) { s.appearance->least_difference = -1.0; });
  refuses([](auto& s) { s.appearance->least_area = 2.0; });
  refuses([](auto& s) { s.longest_step = 0.6; });
  refuses([](auto& s) { s.max_area_change = 1.0; });
}

TEST(MarkerFinder, NoiseEndsAtTheMostBlobs) {
  cv::Mat noise(480, 640, CV_8UC1);
  RandomStream random(1, 0, Purpose::kTest);
  for (auto& value : cv::Mat_<std::uint8_t>(noise)) value = random.uniform() < 0.1 ? 0 : 200;
  MarkerFinder finder({.diameter_px = 2.0, .spacing_px = 8.0, .least_area = 0.0});
  EXPECT_EQ(finder.find(noise).size(), MarkerFinder::kMostBlobs);
}

TEST(MarkerOverlay, RingsAreGreenWhereTrustedAndRedWhereHeld) {
  const auto rest = marker_grid();
  const std::size_t hidden = 4 * 14 + 7;
  MarkerTracker tracker({});
  tracker.track({paint_markers({}, rest), 0});
  auto now = rest;
  for (Eigen::Vector2d& place : now) place += Eigen::Vector2d(5.0, 2.0);
  now[hidden].setConstant(std::nan(""));
  const cv::Mat frame = paint_markers({}, now);
  const cv::Mat before = frame.clone();
  const TrackedMarkers& markers = tracker.track({frame, 1});
  cv::Mat picture;
  draw_overlay(frame, markers, *tracker.appearance(), picture);
  EXPECT_EQ(cv::norm(frame, before, cv::NORM_INF), 0.0) << "the frame itself is drawn upon";
  const auto drawn = [&](std::size_t place, bool red) {  // pixels of a colour that no frame has
    const Eigen::Vector2d at = rest[place] + Eigen::Vector2d(5.0, 2.0);
    int count = 0;
    for (int y = static_cast<int>(at.y()) - 8; y < static_cast<int>(at.y()) + 8; ++y) {
      for (int x = static_cast<int>(at.x()) - 8; x < static_cast<int>(at.x()) + 8; ++x) {
        const cv::Vec3b& pixel = picture.at<cv::Vec3b>(y, x);
        count += red ? pixel[2] > 200 && pixel[1] < 80 : pixel[1] > 200 && pixel[2] < 120;
      }
    }
    return count;
  };
  EXPECT_GT(drawn(hidden, true), 10);
  EXPECT_EQ(drawn(hidden, false), 0);
  EXPECT_GT(drawn(hidden + 3, false), 5);
  EXPECT_EQ(drawn(hidden + 3, true), 0);
  cv::Mat grey;
  cv::extractChannel(frame, grey, 1);
  draw_overlay(grey, markers, *tracker.appearance(), picture);
  EXPECT_EQ(picture.type(), CV_8UC3);
  grey.convertTo(grey, CV_32F);
  EXPECT_THROW(draw_overlay(grey, markers, *tracker.appearance(), picture), Error);
  EXPECT_THROW(draw_overlay(frame, markers, *tracker.appearance(), picture, {.arrow_scale = 0.0}), Error);
}

TEST(FillMarkers, AFilledPictureIsOneWithoutMarkers) {
  const auto rest = marker_grid();
  cv::Mat filled = paint_markers({}, rest);
  const cv::Mat bare = paint_markers({}, {});
  EXPECT_GT(cv::norm(filled, bare, cv::NORM_INF), 100.0);
  fill_markers(filled, rest, 6.0);
  EXPECT_LE(cv::norm(filled, bare, cv::NORM_INF), 2.0);
  const std::vector<Eigen::Vector2d> outside = {{-50.0, 10.0}, {std::nan(""), 0.0}, {1e9, 1e9}, {0.0, 0.0}};
  fill_markers(filled, outside, 6.0);
  EXPECT_LE(cv::norm(filled, bare, cv::NORM_INF), 3.0);
  cv::Mat grey(20, 20, CV_8UC1, cv::Scalar(0));
  EXPECT_THROW(fill_markers(grey, rest, 6.0), Error);
  EXPECT_THROW(fill_markers(filled, rest, 0.0), Error);
}

}  // namespace
}  // namespace touchstone::sensors
