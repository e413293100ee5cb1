#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/error.h"
#include "sensors/colour/colour_marker_finder.h"
#include "tests/sensors/colour/painted_colour_markers.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::ColourPicture;
using fixtures::expose;
using fixtures::paint_colour_light;
using fixtures::paint_colour_markers;
using fixtures::small_colour_picture;
using touchstone::test::message_of;

/// A finder that has seen `picture` as the one at rest.
ColourMarkerFinder at_rest(const ColourPicture& picture) {
  ColourMarkerFinder finder({.grid = {picture.columns, picture.rows}});
  finder.find_rest(paint_colour_markers(picture));
  return finder;
}

int count(const ColourMarkerReading& reading, MarkerFlaw flaw) {
  return static_cast<int>(std::count_if(reading.markers.begin(), reading.markers.end(),
                                        [&](const ColourMarker& one) { return one.flaw == flaw; }));
}

TEST(ColourMarkerFaults, AMarkerUnderTwoFiltersIsSaid) {
  ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  picture.shift_px.assign(picture.count(), Eigen::Vector2d::Zero());
  picture.shift_px[14] = {12.0, 0.0};  // half a spacing
  const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
  EXPECT_EQ(reading.markers[14].flaw, MarkerFlaw::kTwoFilters);
  EXPECT_EQ(reading.markers[15].flaw, MarkerFlaw::kTwoFilters);
  EXPECT_EQ(count(reading, MarkerFlaw::kNone), 28);
}

TEST(ColourMarkerFaults, NoShearOfTheWholeGridIsTakenForASmallerOne) {
  const ColourPicture rest = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(rest);
  for (double shift = 0.0; shift <= 28.0; shift += 1.0) {
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.0, -1.0)}) {
      ColourPicture picture = rest;
      picture.shift_px.assign(picture.count(), shift * direction);
      const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
      for (std::size_t i = 0; i < picture.count(); ++i) {
        if (reading.markers[i].flaw != MarkerFlaw::kNone) continue;
        EXPECT_LT((reading.markers[i].ink_centroid_px - picture.place(i)).norm(), 1.0) << i << " at " << shift;
      }
      if (shift <= 8.0) {
        EXPECT_EQ(count(reading, MarkerFlaw::kNone), 30) << shift;
      }
    }
  }
}

TEST(ColourMarkerFaults, NoShearOfTheGridsMiddleIsTakenForASmallerOne) {
  ColourPicture rest = small_colour_picture(16.0);
  rest.columns = rest.rows = 10;
  rest.width = rest.height = 12 * 24;
  rest.middle_px = {144.2, 143.7};
  ColourMarkerFinder finder = at_rest(rest);
  for (double shift = 2.0; shift <= 28.0; shift += 2.0) {
    ColourPicture picture = rest;
    for (std::size_t i = 0; i < picture.count(); ++i) {
      const double far = (picture.rest(i) - picture.middle_px).norm() / (5.0 * 24.0);
      picture.shift_px.push_back(Eigen::Vector2d(shift, 0.3 * shift) * std::max(0.0, 1.0 - far * far));
    }
    const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
    for (std::size_t i = 0; i < picture.count(); ++i) {
      if (reading.markers[i].flaw != MarkerFlaw::kNone) continue;
      EXPECT_LT((reading.markers[i].ink_centroid_px - picture.place(i)).norm(), 1.0) << i << " at " << shift;
    }
  }
}

TEST(ColourMarkerFaults, MissingMarkersAreSaidAndTheOthersAreFound) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.stretch.assign(picture.count(), 1.0);
  for (const std::size_t gone : {0u, 7u, 8u, 29u}) picture.stretch[gone] = 0.0;
  picture.no_film = {0, 8, 20};
  ColourMarkerFinder finder({.grid = {6, 5}});
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  for (const std::size_t gone : {0u, 7u, 8u, 20u, 29u})
    EXPECT_EQ(rest.markers[gone].flaw, MarkerFlaw::kMissing) << gone;
  EXPECT_EQ(count(rest, MarkerFlaw::kNone), 25);
  picture.shift_px.assign(picture.count(), {4.0, 1.0});
  const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
  EXPECT_EQ(count(reading, MarkerFlaw::kNone), 25);
  for (std::size_t i = 0; i < picture.count(); ++i) {
    if (reading.markers[i].flaw != MarkerFlaw::kNone) continue;
    EXPECT_LT((reading.markers[i].ink_centroid_px - picture.place(i)).norm(), 0.3) << i;
  }
}

TEST(ColourMarkerFaults, AMarkerThatLosesItsInkIsMissing) {
  ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  picture.stretch.assign(picture.count(), 1.0);
  picture.stretch[14] = 0.0;
  const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
  EXPECT_EQ(reading.markers[14].flaw, MarkerFlaw::kMissing);
  EXPECT_EQ(count(reading, MarkerFlaw::kNone), 29);
}

TEST(ColourMarkerFaults, AMarkerThatIsPaintedWhiteIsMissingAndOnePaintedGreyIsColourless) {
  const ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  cv::Mat image = paint_colour_markers(picture);
  const auto cover = [&](std::size_t marker, const cv::Scalar& colour) {
    const Eigen::Vector2d place = picture.rest(marker);
    cv::rectangle(image, cv::Rect(static_cast<int>(place.x()) - 11, static_cast<int>(place.y()) - 11, 23, 23), colour,
                  cv::FILLED);
  };
  cover(8, cv::Scalar(190, 205, 200));
  cover(21, cv::Scalar(90, 95, 92));
  const ColourMarkerReading reading = finder.find(image);
  EXPECT_EQ(reading.markers[8].flaw, MarkerFlaw::kMissing);
  EXPECT_EQ(reading.markers[21].flaw, MarkerFlaw::kColourless);
  EXPECT_EQ(count(reading, MarkerFlaw::kNone), 28);
}

TEST(ColourMarkerFaults, OverexposureOfAllOfIt) {
  const ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  const ColourMarkerReading reading = finder.find(expose(paint_colour_light(picture), 2.0));
  EXPECT_EQ(count(reading, MarkerFlaw::kOverexposed), 30);
  const ColourMarkerReading burnt = finder.find(cv::Mat(picture.height, picture.width, CV_8UC3, cv::Scalar::all(255)));
  EXPECT_EQ(burnt.light, FrameLight::kSaturated);
  EXPECT_EQ(count(burnt, MarkerFlaw::kOverexposed), 30);
}

TEST(ColourMarkerFaults, OverexposureOfAPartSparesTheRest) {
  ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  picture.gradient = {0.6, 0.0};  // white runs into the full scale right of the middle
  const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
  EXPECT_EQ(reading.light, FrameLight::kNormal);
  for (std::size_t row = 0; row < 5; ++row) {
    EXPECT_EQ(reading.markers[6 * row + 1].flaw, MarkerFlaw::kNone) << row;
    EXPECT_EQ(reading.markers[6 * row + 5].flaw, MarkerFlaw::kOverexposed) << row;
  }
}

TEST(ColourMarkerFaults, Underexposure) {
  const ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  const ColourMarkerReading dim = finder.find(expose(paint_colour_light(picture), 0.08));
  EXPECT_EQ(count(dim, MarkerFlaw::kUnderexposed), 30);
  const ColourMarkerReading black = finder.find(cv::Mat(picture.height, picture.width, CV_8UC3, cv::Scalar::all(0)));
  EXPECT_EQ(black.light, FrameLight::kDark);
  EXPECT_EQ(count(black, MarkerFlaw::kUnderexposed), 30);
}

TEST(ColourMarkerFaults, GreyPictures) {
  const ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  cv::Mat grey, three;
  cv::cvtColor(paint_colour_markers(picture), grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey, three, cv::COLOR_GRAY2BGR);
  EXPECT_NE(message_of([&] { finder.find(grey); }).find("1 channels"), std::string::npos);
  const ColourMarkerReading reading = finder.find(three);
  EXPECT_EQ(count(reading, MarkerFlaw::kColourless), 30);
  const ColourMarkerReading flat = finder.find(cv::Mat(grey.size(), CV_8UC3, cv::Scalar::all(90)));
  EXPECT_EQ(flat.light, FrameLight::kFlat);
  EXPECT_EQ(count(flat, MarkerFlaw::kColourless), 30);
  ColourMarkerFinder other({.grid = {6, 5}});
  EXPECT_NE(message_of([&] { other.find_rest(three); }).find("no coloured region"), std::string::npos);
  EXPECT_THROW(other.find_rest(grey), Error);
}

TEST(ColourMarkerFaults, WrongGridSizeSaysWhatIsSeenAndWhatWasAsked) {
  const cv::Mat image = paint_colour_markers(small_colour_picture(16.0));
  for (const Eigen::Vector2i& grid : {Eigen::Vector2i(10, 10), Eigen::Vector2i(5, 6), Eigen::Vector2i(6, 4)}) {
    ColourMarkerFinder finder({.grid = grid});
    const std::string message = message_of([&] { finder.find_rest(image); });
    EXPECT_NE(message.find("6 x 5"), std::string::npos) << message;
    EXPECT_NE(message.find(std::to_string(grid.x()) + " x " + std::to_string(grid.y())), std::string::npos) << message;
  }
}

TEST(ColourMarkerFaults, WrongSpacingIsRefused) {
  const ColourPicture picture = small_colour_picture(16.0);
  const cv::Mat image = paint_colour_markers(picture);
  ColourMarkerFinder right({.grid = {6, 5}, .spacing_px = 26.0}), wrong({.grid = {6, 5}, .spacing_px = 48.0});
  right.find_rest(image);
  EXPECT_NE(message_of([&] { wrong.find_rest(image); }).find("apart"), std::string::npos);
}

TEST(ColourMarkerFaults, PicturesOfAnotherSizeOrKindAreRefused) {
  const ColourPicture picture = small_colour_picture(16.0);
  const cv::Mat image = paint_colour_markers(picture);
  ColourMarkerFinder finder({.grid = {6, 5}});
  EXPECT_NE(message_of([&] { finder.find(image); }).find("find_rest"), std::string::npos);
  finder.find_rest(image);
  EXPECT_NE(message_of([&] { finder.find(image(cv::Rect(0, 0, 150, 100))); }).find("150 x 100"), std::string::npos);
  cv::Mat deep;
  image.convertTo(deep, CV_16UC3, 257.0);
  EXPECT_THROW(finder.find(deep), Error);
  EXPECT_THROW(finder.find_rest(deep), Error);
  EXPECT_THROW(finder.find(cv::Mat()), Error);
  EXPECT_THROW(finder.find_rest(cv::Mat()), Error);
  // It is as it was.
  EXPECT_EQ(count(finder.find(image), MarkerFlaw::kNone), 30);
}

TEST(ColourMarkerFaults, NoGridIsRefused) {
  ColourMarkerFinder finder({.grid = {6, 5}});
  const cv::Size size(192, 168);
  EXPECT_THROW(finder.find_rest(cv::Mat(size, CV_8UC3, cv::Scalar::all(0))), Error);
  EXPECT_THROW(finder.find_rest(cv::Mat(size, CV_8UC3, cv::Scalar::all(255))), Error);
  EXPECT_THROW(finder.find_rest(cv::Mat(size, CV_8UC3, cv::Scalar(40, 60, 200))), Error);
  EXPECT_THROW(finder.find_rest(cv::Mat(1, 1, CV_8UC3, cv::Scalar(40, 60, 200))), Error);
  cv::Mat noise(size, CV_8UC3);
  RandomStream random(3, 0, Purpose::kTest);
  for (int y = 0; y < noise.rows; ++y) {
    for (int x = 0; x < 3 * noise.cols; ++x) noise.ptr(y)[x] = static_cast<std::uint8_t>(random() & 255u);
  }
  EXPECT_THROW(finder.find_rest(noise), Error);
  ColourPicture yellow = small_colour_picture(16.0);
  yellow.stretch.assign(yellow.count(), 0.0);
  EXPECT_NE(message_of([&] { finder.find_rest(paint_colour_markers(yellow)); }).find("magenta"), std::string::npos);
}

TEST(ColourMarkerFaults, MarkersThatThePicturesEdgeCutsAreCutOff) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.middle_px.x() -= 31.0;  // the first column's left edges are outside
  ColourMarkerFinder finder({.grid = {6, 5}});
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  EXPECT_EQ(count(rest, MarkerFlaw::kCutOff), 5);
  EXPECT_EQ(count(rest, MarkerFlaw::kNone), 25);
  EXPECT_EQ(rest.markers[6].flaw, MarkerFlaw::kCutOff);
}

TEST(ColourMarkerFaults, NonsenseAfterRestIsNeverRead) {
  const ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = at_rest(picture);
  cv::Mat noise(picture.height, picture.width, CV_8UC3);
  RandomStream random(4, 0, Purpose::kTest);
  for (int y = 0; y < noise.rows; ++y) {
    for (int x = 0; x < 3 * noise.cols; ++x) noise.ptr(y)[x] = static_cast<std::uint8_t>(random() & 255u);
  }
  EXPECT_EQ(count(finder.find(noise), MarkerFlaw::kNone), 0);
  // A sheet of one colour.
  EXPECT_EQ(count(finder.find(cv::Mat(noise.size(), CV_8UC3, cv::Scalar(60, 40, 200))), MarkerFlaw::kNone), 0);
}

TEST(ColourMarkerFaults, SettingsOutOfTheirRangesAreNamed) {
  const auto message = [](const ColourMarkerAppearance& appearance) {
    return message_of([&] { ColourMarkerFinder finder(appearance); });
  };
  EXPECT_NE(message({.grid = {1, 10}}).find("columns"), std::string::npos);
  EXPECT_NE(message({.grid = {10, 100}}).find("rows"), std::string::npos);
  EXPECT_NE(message({.spacing_px = -3.0}).find("spacing_px"), std::string::npos);
  EXPECT_NE(message({.least_saturation = 1.5}).find("least_saturation"), std::string::npos);
  EXPECT_NE(message({.most_under_neighbour = 0.6}).find("most_under_neighbour"), std::string::npos);
  EXPECT_NE(message({.least_white = 0.0}).find("least_white"), std::string::npos);
  EXPECT_EQ(message({}), "no error");
}

}  // namespace
}  // namespace touchstone::sensors
