// Markers in any layout, of which nothing is known but a picture: painted pictures, whose positions are known.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/markers/marker_tracker.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {
namespace {

using fixtures::MarkerPicture;
using fixtures::paint_markers;
using Places = std::vector<Eigen::Vector2d>;

const Eigen::Vector2d kMiddle(320.0, 240.0);

Places rows(int columns, int rows, double pitch_px) {
  Places places;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      places.push_back(kMiddle + pitch_px * Eigen::Vector2d(column - 0.5 * (columns - 1), row - 0.5 * (rows - 1)));
    }
  }
  return places;
}

Places rings(int count, double pitch_px) {
  Places places = {kMiddle};
  for (int ring = 1; ring <= count; ++ring) {
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = std::numbers::pi / 3.0 * i / ring + 0.2 * ring;
      places.push_back(kMiddle + ring * pitch_px * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  return places;
}

/// In no order, none nearer to another than `least_px`, none so near to the edge that it is cut.
Places scattered(int count, double least_px, double diameter_px = 30.0) {
  const double edge = 0.6 * diameter_px + 2.0;
  RandomStream random(11, 0, Purpose::kTest);
  Places places;
  while (static_cast<int>(places.size()) < count) {
    const Eigen::Vector2d place(edge + (639.0 - 2.0 * edge) * random.uniform(),
                                edge + (479.0 - 2.0 * edge) * random.uniform());
    const bool is_free = std::all_of(places.begin(), places.end(),
                                     [&](const Eigen::Vector2d& other) { return (other - place).norm() >= least_px; });
    if (is_free) places.push_back(place);
  }
  return places;
}

/// Moves all off the pixels' grid, each by another part of a pixel.
Places off_grid(Places places) {
  RandomStream random(3, 0, Purpose::kTest);
  for (Eigen::Vector2d& place : places) place += Eigen::Vector2d(random.uniform(), random.uniform());
  return places;
}

/// The middle goes by `motion`, the rim stays.
Places dragged(Places places, const Eigen::Vector2d& motion, double reach_px = 150.0) {
  for (Eigen::Vector2d& place : places) {
    place += motion * std::exp(-(place - kMiddle).squaredNorm() / (2.0 * reach_px * reach_px));
  }
  return places;
}

MarkerPicture uneven_light(double diameter_px) {
  return {.width = 640,
          .height = 480,
          .diameter_px = diameter_px,
          .blur_px = 0.8,
          .shading = 0.35,
          .vignette = 0.6,
          .noise = 2.0};
}

MarkerPicture bright_on_black(double diameter_px) {
  MarkerPicture picture = uneven_light(diameter_px);
  picture.brightness = 12.0;
  picture.marker = 12.0;
  return picture;
}

cv::Mat as_jpeg(const cv::Mat& image, int quality) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return cv::imdecode(bytes, cv::IMREAD_COLOR);
}

/// Which marker of the tracker each place is. Each is to be one, and no other.
std::vector<std::size_t> numbers_of(const TrackedMarkers& markers, const Places& places) {
  std::vector<std::size_t> numbers;
  for (const Eigen::Vector2d& place : places) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < markers.rest.size(); ++i) {
      if ((markers.rest[i] - place).norm() < (markers.rest[nearest] - place).norm()) nearest = i;
    }
    numbers.push_back(nearest);
  }
  std::vector<std::size_t> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(std::unique(sorted.begin(), sorted.end()), sorted.end()) << "two places are one marker";
  return numbers;
}

struct Errors {
  double rms = 0.0, worst = 0.0;
  int untrusted = 0;
};

/// Of displacements of trusted markers, px.
Errors displacement_errors(const TrackedMarkers& markers, const std::vector<std::size_t>& numbers, const Places& rest,
                           const Places& now) {
  Errors errors;
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (!markers.trusted(numbers[i])) {
      ++errors.untrusted;
      continue;
    }
    const double error = (markers.displacement(numbers[i]) - (now[i] - rest[i])).norm();
    sum += error * error;
    errors.worst = std::max(errors.worst, error);
    ++count;
  }
  errors.rms = std::sqrt(sum / std::max(count, 1));
  return errors;
}

struct Case {
  const char* name;
  Places rest;
  MarkerPicture picture;
  double pitch_px;
};

std::vector<Case> cases() {
  return {{"nine_by_nine", off_grid(rows(9, 9, 46.0)), uneven_light(16.0), 46.0},
          {"eleven_by_nine", off_grid(rows(11, 9, 46.0)), uneven_light(12.0), 46.0},
          {"small_and_dense", off_grid(rows(26, 20, 15.0)), uneven_light(5.0), 15.0},
          {"few_and_large", off_grid(rows(3, 2, 150.0)), uneven_light(60.0), 150.0},
          {"rings", off_grid(rings(6, 34.0)), uneven_light(11.0), 34.0},
          {"bright_rings", off_grid(rings(6, 34.0)), bright_on_black(11.0), 34.0},
          {"bright_rows", off_grid(rows(11, 9, 46.0)), bright_on_black(14.0), 46.0},
          {"scattered", off_grid(scattered(100, 30.0)), uneven_light(10.0), 30.0},
          {"bright_scattered", off_grid(scattered(100, 30.0)), bright_on_black(10.0), 30.0}};
}

TEST(MarkerLayout, EachMarkerOfAnyLayoutIsFoundAndNothingElse) {
  for (const Case& one : cases()) {
    for (const int quality : {0, 90}) {
      SCOPED_TRACE(std::string(one.name) + (quality > 0 ? ", JPEG" : ""));
      cv::Mat image = paint_markers(one.picture, one.rest);
      if (quality > 0) image = as_jpeg(image, quality);
      MarkerTracker tracker({});
      const TrackedMarkers& markers = tracker.track({image, 0});
      ASSERT_EQ(markers.rest.size(), one.rest.size());
      const auto numbers = numbers_of(markers, one.rest);
      double sum = 0.0;
      for (std::size_t i = 0; i < one.rest.size(); ++i) sum += (markers.rest[numbers[i]] - one.rest[i]).squaredNorm();
      const double rms = std::sqrt(sum / static_cast<double>(one.rest.size()));
      RecordProperty(std::string(one.name) + (quality > 0 ? "_jpeg" : "") + "_rms_px", std::to_string(rms));
      EXPECT_LT(rms, 0.1);
      const MarkerAppearance appearance = tracker.appearance().value();
      EXPECT_EQ(appearance.polarity, one.picture.marker > 1.0 ? MarkerPolarity::kBright : MarkerPolarity::kDark);
      EXPECT_NEAR(appearance.diameter_px, one.picture.diameter_px, 0.25 * one.picture.diameter_px);
    }
  }
}

TEST(MarkerLayout, RandomPicturesAreReadToo) {
  // Sizes, distances, contrast, light and noise drawn at random: nothing is tuned to the cases above.
  RandomStream random(21, 0, Purpose::kTest);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  for (int i = 0; i < 40; ++i) {
    const double pitch_px = between(14.0, 110.0);
    const double diameter_px = std::max(pitch_px * between(0.18, 0.55), 3.5);
    const bool bright = i % 3 == 0;
    MarkerPicture picture = {.width = 640, .height = 480, .diameter_px = diameter_px, .blur_px = between(0.5, 1.2)};
    picture.shading = between(0.0, 0.4);
    picture.vignette = between(0.0, 0.7);
    picture.noise = between(0.0, 3.0);
    picture.brightness = bright ? between(5.0, 30.0) : between(60.0, 220.0);
    picture.marker = bright ? between(4.0, 8.0) : between(0.02, 0.7);
    const Places rest =
        i % 2 == 0 ? off_grid(rows(std::max(static_cast<int>((560.0 - diameter_px) / pitch_px), 2),
                                   std::max(static_cast<int>((400.0 - diameter_px) / pitch_px), 2), pitch_px))
                   : off_grid(scattered(std::min(static_cast<int>(0.4 * 600 * 440 / (pitch_px * pitch_px)), 150),
                                        pitch_px, diameter_px));
    SCOPED_TRACE(fmt::format("picture {}: {} markers of {:.1f} px, {:.1f} px apart, bright {}, marker {:.2f}", i,
                             rest.size(), diameter_px, pitch_px, bright, picture.marker));
    MarkerTracker tracker({});
    const TrackedMarkers& markers = tracker.track({paint_markers(picture, rest, static_cast<std::uint64_t>(1 + i)), 0});
    ASSERT_EQ(markers.rest.size(), rest.size());
    numbers_of(markers, rest);
    EXPECT_EQ(tracker.appearance()->polarity, bright ? MarkerPolarity::kBright : MarkerPolarity::kDark);
  }
}

TEST(MarkerLayout, ADragOfMoreThanHalfAPitchIsFollowed) {
  constexpr int kFrames = 10;
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    MarkerTracker tracker({});
    tracker.track({paint_markers(one.picture, one.rest), 0});
    ASSERT_EQ(tracker.tracked().rest.size(), one.rest.size());
    const auto numbers = numbers_of(tracker.tracked(), one.rest);
    Errors worst;
    for (int i = 1; i <= kFrames; ++i) {
      const Places now = dragged(one.rest, 0.9 * one.pitch_px * i / kFrames * Eigen::Vector2d(0.8, -0.6));
      const cv::Mat image = paint_markers(one.picture, now, static_cast<std::uint64_t>(1 + i));
      const Errors errors = displacement_errors(tracker.track({image, 40000 * i}), numbers, one.rest, now);
      EXPECT_EQ(errors.untrusted, 0) << "frame " << i;
      worst.rms = std::max(worst.rms, errors.rms);
      worst.worst = std::max(worst.worst, errors.worst);
    }
    RecordProperty(std::string(one.name) + "_rms_px", std::to_string(worst.rms));
    RecordProperty(std::string(one.name) + "_worst_px", std::to_string(worst.worst));
    EXPECT_LT(worst.rms, 0.1);
    EXPECT_LT(worst.worst, 0.5);
  }
}

TEST(MarkerLayout, ADroppedFrameLosesNothing) {
  // A third of the pitch from frame to frame: two of them are nearer to the neighbour's place.
  for (const Case& one : cases()) {
    if (one.rest.size() < 20) continue;  // so large a pitch takes them out of the picture
    for (const bool clock_knows : {true, false}) {
      SCOPED_TRACE(one.name);
      MarkerTracker tracker({});
      tracker.track({paint_markers(one.picture, one.rest), 0});
      const auto numbers = numbers_of(tracker.tracked(), one.rest);
      std::int64_t t_us = 0;
      for (const int i : {1, 2, 4, 5}) {
        t_us = clock_knows ? 40000 * i : t_us + 40000;
        const Places now = dragged(one.rest, one.pitch_px / 3.0 * i * Eigen::Vector2d(0.6, 0.8), 250.0);
        const cv::Mat image = paint_markers(one.picture, now, static_cast<std::uint64_t>(1 + i));
        const Errors errors = displacement_errors(tracker.track({image, t_us}), numbers, one.rest, now);
        EXPECT_LT(errors.rms, 0.1) << "frame " << i;
        EXPECT_LE(errors.untrusted, static_cast<int>(one.rest.size() / 20)) << "frame " << i;
      }
    }
  }
}

TEST(MarkerLayout, AContactHidesSomeAndTheRestGoOn) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    if (one.rest.size() < 20) continue;
    MarkerTracker tracker({});
    tracker.track({paint_markers(one.picture, one.rest), 0});
    const auto numbers = numbers_of(tracker.tracked(), one.rest);
    constexpr int kFrames = 10;
    for (int i = 1; i <= kFrames; ++i) {
      const Places now = dragged(one.rest, 0.8 * one.pitch_px * i / kFrames * Eigen::Vector2d(1.0, 0.0));
      Places shown = now;
      std::size_t hidden = 0;
      if (i > 2 && i < kFrames) {
        for (Eigen::Vector2d& place : shown) {
          if ((place - kMiddle).norm() > 1.2 * one.pitch_px) continue;
          place.setConstant(std::nan(""));
          ++hidden;
        }
        ASSERT_GT(hidden, 0U);
      }
      const cv::Mat image = paint_markers(one.picture, shown, static_cast<std::uint64_t>(1 + i));
      const TrackedMarkers& markers = tracker.track({image, 40000 * i});
      const Errors errors = displacement_errors(markers, numbers, one.rest, now);
      EXPECT_EQ(errors.untrusted, static_cast<int>(hidden)) << "frame " << i;
      EXPECT_LT(errors.rms, 0.1) << "frame " << i;
      for (std::size_t m = 0; m < now.size(); ++m) {
        if (std::isfinite(shown[m].x())) continue;
        EXPECT_FALSE(is_found(markers.status[numbers[m]]));
        EXPECT_LT((markers.positions[numbers[m]] - now[m]).norm(), 0.4 * one.pitch_px) << "held far from where it is";
      }
    }
  }
}

TEST(MarkerLayout, MarkersOfSomewhatDifferentSizesAreAllFound) {
  MarkerPicture picture = uneven_light(12.0);
  picture.diameter_spread = 0.2;
  const Places rest = off_grid(scattered(100, 30.0));
  MarkerTracker tracker({});
  EXPECT_EQ(tracker.track({paint_markers(picture, rest), 0}).rest.size(), rest.size());
}

TEST(MarkerLayout, AFaintPrintIsFound) {
  MarkerPicture picture = uneven_light(12.0);
  picture.marker = 0.75;
  const Places rest = off_grid(rows(11, 9, 46.0));
  MarkerTracker tracker({});
  const TrackedMarkers& markers = tracker.track({paint_markers(picture, rest), 0});
  ASSERT_EQ(markers.rest.size(), rest.size());
  numbers_of(markers, rest);
}

TEST(MarkerLayout, AHousingDustAndAHighlightInViewAreNoMarkers) {
  const Places rest = off_grid(rows(9, 7, 52.0));
  MarkerPicture picture = uneven_light(16.0);
  picture.marker = 0.5;
  for (const bool with_corners : {false, true}) {
    cv::Mat image = paint_markers(picture, rest);
    const cv::Rect gel = with_corners ? cv::Rect(80, 60, 490, 365) : cv::Rect(80, 0, 490, 480);
    cv::Mat housing(image.size(), CV_8UC3, cv::Scalar::all(5));
    image(gel).copyTo(housing(gel));
    for (const cv::Point place : {cv::Point(140, 110), {300, 214}, {400, 310}}) {
      cv::circle(housing, place, 2, cv::Scalar::all(30), cv::FILLED, cv::LINE_AA);
    }
    cv::circle(housing, {242, 318}, 9, cv::Scalar::all(255), cv::FILLED, cv::LINE_AA);
    MarkerTracker tracker({});
    const TrackedMarkers& markers = tracker.track({as_jpeg(housing, 85), 0});
    ASSERT_EQ(markers.rest.size(), rest.size());
    const auto numbers = numbers_of(markers, rest);
    for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_LT((markers.rest[numbers[i]] - rest[i]).norm(), 1.0);
  }
}

TEST(MarkerLayout, ALargePictureIsLearntFromASmallerOne) {
  const Places rest = off_grid(rows(9, 7, 46.0));
  cv::Mat large;
  cv::resize(paint_markers(uneven_light(16.0), rest), large, {2560, 1920}, 0.0, 0.0, cv::INTER_CUBIC);
  MarkerTracker tracker({});
  const TrackedMarkers& markers = tracker.track({large, 0});
  ASSERT_EQ(markers.rest.size(), rest.size());
  for (const std::size_t i : numbers_of(markers, [&] {
         Places scaled = rest;
         for (Eigen::Vector2d& place : scaled) place *= 4.0;
         return scaled;
       }())) {
    EXPECT_LT(i, rest.size());
  }
  EXPECT_NEAR(tracker.appearance()->diameter_px, 64.0, 16.0);
}

TEST(MarkerLayout, AStrayBlobIsNoMarkersPlace) {
  // One marker disappears, and a speck of its size comes up beside where its neighbours are.
  const Places rest = off_grid(rows(9, 9, 46.0));
  const MarkerPicture picture = uneven_light(12.0);
  MarkerTracker tracker({});
  tracker.track({paint_markers(picture, rest), 0});
  const auto numbers = numbers_of(tracker.tracked(), rest);
  Places now = rest;
  for (int i = 1; i <= 2; ++i) {  // it creeps off between the others, each step short enough to be followed
    now[40] += Eigen::Vector2d(12.0, 12.0);
    tracker.track({paint_markers(picture, now, static_cast<std::uint64_t>(1 + i)), i});
  }
  EXPECT_EQ(tracker.tracked().status[numbers[40]], MarkerStatus::kStray);
  EXPECT_FALSE(tracker.tracked().trusted(numbers[40]));
  EXPECT_EQ(tracker.tracked().found(), 80);
  tracker.track({paint_markers(picture, rest, 9), 3});
  EXPECT_TRUE(tracker.tracked().trusted(numbers[40])) << "it's back, and found again";
}

/// What a tracker says of a picture as the frame at rest.
std::string refusal_of(const cv::Mat& image) {
  MarkerTracker tracker({});
  try {
    tracker.track({image, 0});
  } catch (const Error& error) {
    EXPECT_TRUE(tracker.tracked().rest.empty());
    return error.what();
  }
  return "taken";
}

TEST(MarkerLayout, PicturesWithoutMarkersAreRefused) {
  const auto holds = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  const std::string white = refusal_of(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255)));
  EXPECT_TRUE(holds(white, "saturated")) << white;
  const std::string black = refusal_of(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0)));
  EXPECT_TRUE(holds(black, "dark")) << black;
  const std::string bare = refusal_of(paint_markers(uneven_light(12.0), {}));
  EXPECT_TRUE(holds(bare, "shows none")) << bare;
  const std::string one = refusal_of(paint_markers(uneven_light(12.0), {kMiddle}));
  EXPECT_TRUE(holds(one, "shows none") && holds(one, "4")) << one;
  const std::string empty = refusal_of(cv::Mat());
  EXPECT_TRUE(holds(empty, "empty")) << empty;
  const std::string tiny = refusal_of(cv::Mat(3, 3, CV_8UC1, cv::Scalar(100)));
  EXPECT_NE(tiny, "taken");
}

}  // namespace
}  // namespace touchstone::sensors
