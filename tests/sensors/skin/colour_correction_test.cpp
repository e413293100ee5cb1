#include "sensors/skin/colour_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/cie_colour.h"
#include "tests/sensors/skin/painted_card.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::seen;
using ::testing::HasSubstr;
using touchstone::test::message_of;

cv::Mat disc(const cv::Point& centre, int radius) {
  cv::Mat mask(120, 160, CV_8UC1, cv::Scalar(0));
  cv::circle(mask, centre, radius, cv::Scalar(255), cv::FILLED);
  return mask;
}

TEST(FlatField, TakesLightAndItsColourOut) {
  const cv::Mat white = seen({1, 1, 1});
  const FlatField field = flat_field({&white, 1}, 2.0);
  const Eigen::Vector3d albedo(0.8, 0.4, 0.3);
  for (const cv::Point& place : {cv::Point(20, 20), cv::Point(80, 75), cv::Point(140, 100)}) {
    EXPECT_NEAR((mean_of_white(seen(albedo), field, disc(place, 8)) - albedo).norm(), 0.0, 0.01) << place;
  }
  // Without the field the rim is dark.
  const Eigen::Vector3d rim = mean_of_one_white(seen(albedo), field, disc({8, 8}, 5));
  EXPECT_NEAR(rim.x() / albedo.x(), (220 - 0.6 * std::hypot(72, 52)) / 208.0, 0.02);
}

TEST(FlatField, LeavesBeadsOut) {
  const cv::Mat white = seen({1, 1, 1});
  const FlatField field = flat_field({&white, 1}, 2.0);
  EXPECT_EQ(field.trusted.at<std::uint8_t>(60, 80), 0);
  EXPECT_EQ(field.trusted.at<std::uint8_t>(60, 120), 255);
  EXPECT_NEAR((mean_of_white(seen({0.5, 0.5, 0.5}), field, disc({80, 60}, 20)) - Eigen::Vector3d::Constant(0.5)).norm(),
              0.0, 0.01);
  EXPECT_THAT(message_of([&] { mean_of_white(white, field, disc({80, 60}, 4)); }), HasSubstr("no pixel of the mask"));
  EXPECT_THAT(message_of([&] {
                mean_of_one_white(white, field, disc({80, 60}, 4));
              }),
              HasSubstr("no pixel of the mask"));
}

TEST(ColourMatrix, OfACombinationOfTheEyesCurvesIsExact) {
  Eigen::Matrix3d truth;
  truth << 0.5, 0.3, 0.15, 0.25, 0.65, 0.1, 0.02, 0.1, 0.95;
  Eigen::MatrixX3d rgb(5, 3);
  rgb << 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0.5, 0.5, 0.9, 0.2, 0.4;
  const Eigen::MatrixX3d xyz = rgb * truth.transpose();
  const ColourMatrix fit = fit_colour_matrix(rgb, xyz);
  EXPECT_NEAR((fit.xyz_from_rgb - truth).norm(), 0.0, 1e-12);
  const Eigen::Vector3d measured(0.3, 0.6, 0.2);
  EXPECT_NEAR((fit.lab(measured) - lab_from_xyz(truth * measured)).norm(), 0.0, 1e-9);
}

TEST(ColourCorrection, InputsThatMakeNoSenseAreRefused) {
  EXPECT_THAT(message_of([] { flat_field({}, 1.0); }), HasSubstr("no picture of a white card"));
  const cv::Mat grey(10, 10, CV_8UC1, cv::Scalar(9));
  EXPECT_THAT(message_of([&] { flat_field({&grey, 1}, 1.0); }), HasSubstr("three bytes a pixel"));
  const cv::Mat black(20, 20, CV_8UC3, cv::Scalar::all(0));
  EXPECT_THAT(message_of([&] { flat_field({&black, 1}, 1.0); }), HasSubstr("neither dark nor at 255"));
  const cv::Mat white = seen({1, 1, 1});
  const FlatField field = flat_field({&white, 1}, 2.0);
  EXPECT_THAT(message_of([&] { mean_of_white(black, field, disc({9, 9}, 3)); }), HasSubstr("a picture of 20 x 20"));
  EXPECT_THAT(message_of([&] { mean_of_white(white, field, grey); }), HasSubstr("a mask of 10 x 10"));
  const Eigen::MatrixX3d two = Eigen::MatrixX3d::Random(2, 3);
  EXPECT_THAT(message_of([&] { fit_colour_matrix(two, two); }), HasSubstr("three or more"));
  const Eigen::MatrixX3d alike = Eigen::MatrixX3d::Constant(4, 3, 0.5);
  EXPECT_THAT(message_of([&] { fit_colour_matrix(alike, alike); }), HasSubstr("are alike"));
  Eigen::MatrixX3d broken = Eigen::MatrixX3d::Random(4, 3);
  broken(1, 1) = std::nan("");
  EXPECT_THAT(message_of([&] { fit_colour_matrix(broken, alike); }), HasSubstr("isn't finite"));
}

}  // namespace
}  // namespace touchstone::sensors
