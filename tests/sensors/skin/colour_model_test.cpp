#include "sensors/skin/colour_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/cie_colour.h"
#include "tests/sensors/models/payload_file_laws.h"
#include "tests/sensors/skin/painted_card.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::seen;
using fixtures::seen_card;
using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr int kPatches = 6;

/// Columns of six colours, as parts of sRGB's light.
Eigen::Vector3d albedo_of(int patch) {
  const Eigen::Vector3d colours[kPatches] = {{0.7, 0.2, 0.2}, {0.2, 0.6, 0.2}, {0.15, 0.2, 0.7},
                                             {0.7, 0.6, 0.2}, {0.3, 0.3, 0.3}, {0.6, 0.3, 0.6}};
  return colours[patch];
}
cv::Rect place_of(int patch) {
  return {26 * patch + 6, 15, 16, 30};
}
cv::Mat chart() {
  return seen_card([](const cv::Point& place) { return albedo_of(std::min(place.x / 26, kPatches - 1)); });
}
Eigen::Vector3d lab_of(const Eigen::Vector3d& albedo) {
  return lab_from_xyz(xyz_from_linear_srgb(albedo));
}

std::vector<ColourPatch> patches(const FlatField& field) {
  std::vector<ColourPatch> seen_patches;
  for (int k = 0; k < kPatches; ++k) {
    const cv::Mat mask = rectangle_mask({160, 120}, place_of(k));
    seen_patches.push_back({mean_of_white(chart(), field, mask), lab_of(albedo_of(k))});
  }
  return seen_patches;
}

ColourModel model() {
  const cv::Mat white = seen({1, 1, 1});
  const FlatField field = flat_field({&white, 1}, 2.0);
  return calibrate_colour(field, patches(field));
}

TEST(ColourModel, KnowsColoursThatItWasntFittedTo) {
  const ColourModel made = model();
  EXPECT_EQ(made.patches, kPatches);
  EXPECT_LT(made.largest_error_de2000, 1.0) << "steps of a number are left";
  const Eigen::Vector3d albedo(0.5, 0.35, 0.25);
  const RegionColour colour = colour_of(made, seen(albedo), rectangle_mask({160, 120}, {60, 40, 40, 40}));
  EXPECT_LT(ciede2000(colour.lab, lab_of(albedo)), 1.0);
  EXPECT_LT(colour.trusted_share, 1.0) << "there is a bead";
  EXPECT_GT(colour.trusted_share, 0.7);
  const std::vector<ColourPatch> known = patches(made.field);
  const std::vector<double> errors = cross_validate_colour(known);
  ASSERT_EQ(errors.size(), kPatches);
  for (const double error : errors) EXPECT_LT(error, 2.0);
  EXPECT_TRUE(cross_validate_colour(std::span(known).first(3)).empty());
}

TEST(ColourModel, WhatIsAt255HasNoSay) {
  const ColourModel made = model();
  cv::Mat glaring = seen({0.5, 0.35, 0.25});
  glaring(cv::Rect(20, 20, 10, 10)).setTo(cv::Scalar::all(255));
  const cv::Mat mask = rectangle_mask(glaring.size(), {15, 15, 20, 20});
  const RegionColour colour = colour_of(made, glaring, mask);
  EXPECT_LT(ciede2000(colour.lab, lab_of({0.5, 0.35, 0.25})), 1.0);
  EXPECT_NEAR(colour.trusted_share, 0.75, 0.01);
  EXPECT_THAT(message_of([&] {
                colour_of(made, glaring, rectangle_mask(glaring.size(), {21, 21, 5, 5}));
              }),
              HasSubstr("no pixel of the mask"));
}

TEST(ColourModel, IsKeptToTheBit) {
  const ColourModel made = model();
  const std::string bytes = to_bytes(made);
  const auto read = [](const std::string& text) { return colour_model_from_bytes(text, "a.colour"); };
  EXPECT_EQ(to_bytes(read(bytes)), bytes);
  EXPECT_EQ(cv::norm(read(bytes).field.white, made.field.white, cv::NORM_INF), 0.0);
  fixtures::expect_damage_is_noticed(read, bytes);
  const auto changed = [&](const std::string& from, const std::string& to) {
    return message_of([&] { read(fixtures::with_line_changed(bytes, from, to)); });
  };
  EXPECT_THAT(changed("\"version\":1", "\"version\":2"), HasSubstr("a.colour: version: is 2"));
  EXPECT_THAT(changed("\"width_px\":160", "\"width_px\":161"), HasSubstr("cut short or damaged"));
  EXPECT_THAT(changed("\"patches\":6", "\"patches\":2"), HasSubstr("patches: is 2"));
  EXPECT_THAT(changed("\"patches\"", "\"patch\""), HasSubstr("'patch' isn't known"));
}

TEST(ColourModel, WhatMakesNoSenseIsNamed) {
  const ColourModel made = model();
  const cv::Mat mask = rectangle_mask({160, 120}, {0, 0, 9, 9});
  EXPECT_THAT(message_of([&] { colour_of(made, cv::Mat(120, 160, CV_8UC1), mask); }),
              HasSubstr("160 x 120 with 1 channels"));
  EXPECT_THAT(message_of([&] { colour_of(made, cv::Mat(10, 16, CV_8UC3), mask); }), HasSubstr("is 16 x 10"));
  for (const cv::Rect& bad : {cv::Rect(-1, 0, 5, 5), {0, 0, 0, 5}, {156, 0, 5, 5}, {0, 118, 5, 3}}) {
    EXPECT_THAT(message_of([&] { rectangle_mask({160, 120}, bad); }), HasSubstr("isn't within the picture's"));
  }
  std::vector<ColourPatch> some = patches(made.field);
  EXPECT_THAT(message_of([&] { calibrate_colour(made.field, std::span(some).first(2)); }), HasSubstr("2 measured"));
  some[1].lab.x() = std::nan("");
  EXPECT_THAT(message_of([&] { calibrate_colour(made.field, some); }), HasSubstr("known colour isn't finite"));
  ColourModel bad = made;
  bad.field.white = cv::Mat();
  EXPECT_THAT(message_of([&] { to_bytes(bad); }), HasSubstr("no white card"));
}

}  // namespace
}  // namespace touchstone::sensors
