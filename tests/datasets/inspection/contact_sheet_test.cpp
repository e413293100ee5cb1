#include "datasets/inspection/contact_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::datasets {
namespace {

const cv::Scalar kRed(0, 0, 255);

// Where the sheet isn't white.
cv::Rect inked(const cv::Mat& part) {
  int left = part.cols;
  int top = part.rows;
  int right = -1;
  int bottom = -1;
  for (int row = 0; row < part.rows; ++row) {
    for (int column = 0; column < part.cols; ++column) {
      if (part.at<cv::Vec3b>(row, column) == cv::Vec3b(255, 255, 255)) continue;
      left = std::min(left, column);
      right = std::max(right, column);
      top = std::min(top, row);
      bottom = std::max(bottom, row);
    }
  }
  return right < 0 ? cv::Rect() : cv::Rect(left, top, right - left + 1, bottom - top + 1);
}

TEST(ContactSheet, ShowsEachImageInItsPlaceInItsColour) {
  const std::vector<cv::Mat> images = {cv::Mat(60, 80, CV_8UC3, kRed), cv::Mat(60, 80, CV_8UC1, cv::Scalar(100)),
                                       cv::Mat(60, 80, CV_16UC1, cv::Scalar(200 * 257))};
  const cv::Mat sheet = contact_sheet(images, {"", "", ""}, 2, 160);
  ASSERT_EQ(sheet.type(), CV_8UC3);
  EXPECT_EQ(sheet.size(), cv::Size(8 + 2 * 168, 8 + 2 * 128));
  EXPECT_EQ(sheet.at<cv::Vec3b>(68, 88), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(sheet.at<cv::Vec3b>(68, 256), cv::Vec3b(100, 100, 100));
  EXPECT_EQ(sheet.at<cv::Vec3b>(196, 88), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(sheet.at<cv::Vec3b>(196, 256), cv::Vec3b(255, 255, 255)) << "no fourth image";
  EXPECT_EQ(sheet.at<cv::Vec3b>(4, 4), cv::Vec3b(255, 255, 255));
}

TEST(ContactSheet, KeepsProportions) {
  const cv::Mat sheet = contact_sheet({cv::Mat(300, 100, CV_8UC1, cv::Scalar(0))}, {""}, 3, 50);
  EXPECT_EQ(inked(sheet), cv::Rect(8, 8, 50, 150));
  EXPECT_EQ(sheet.size(), cv::Size(66, 166)) << "no columns without an image";
}

TEST(ContactSheet, CaptionsStandBelowTheirImageInsideTheTile) {
  const std::vector<cv::Mat> images(2, cv::Mat(100, 200, CV_8UC1, cv::Scalar(128)));
  const std::string text = "3.5 N on the probe, seen from the side of the pinhole camera";
  const cv::Mat sheet = contact_sheet(images, {text, ""}, 2, 200);
  const cv::Rect below_first(0, 108, 212, sheet.rows - 108);
  const cv::Rect ink = inked(sheet(below_first));
  ASSERT_FALSE(ink.empty());
  EXPECT_GE(ink.height, 18 + 10) << "broken in lines";
  EXPECT_GT(ink.width, 100);
  EXPECT_GE(ink.x, 8);
  EXPECT_LE(ink.x + ink.width, 209);
  EXPECT_LT(ink.y + ink.height, below_first.height) << "the last line isn't cut";
  EXPECT_TRUE(inked(sheet(cv::Rect(212, 108, sheet.cols - 212, sheet.rows - 108))).empty());
}

TEST(ContactSheet, LongWordsAreShrunkToTheTile) {
  const cv::Mat sheet = contact_sheet({cv::Mat(10, 64, CV_8UC1, cv::Scalar(0))}, {"anextraordinarilylongword"}, 1, 64);
  const cv::Rect ink = inked(sheet(cv::Rect(0, 18, sheet.cols, sheet.rows - 18)));
  EXPECT_GT(ink.width, 40);
  EXPECT_LE(ink.x + ink.width, 8 + 64 + 1);
}

TEST(ContactSheet, LineBreaksOfACaptionAreKept) {
  const cv::Mat image(10, 64, CV_8UC1, cv::Scalar(0));
  const int one = contact_sheet({image}, {"a"}, 1, 64).rows;
  EXPECT_EQ(contact_sheet({image}, {"a\nb"}, 1, 64).rows, one + 18);
  EXPECT_EQ(contact_sheet({image}, {"a b"}, 1, 64).rows, one);
}

TEST(ContactSheet, BadInputIsRefused) {
  const cv::Mat image(10, 10, CV_8UC1, cv::Scalar(0));
  EXPECT_THROW(contact_sheet({}, {}, 1, 64), Error);
  EXPECT_THROW(contact_sheet({image}, {}, 1, 64), Error);
  EXPECT_THROW(contact_sheet({image}, {"a"}, 0, 64), Error);
  EXPECT_THROW(contact_sheet({image}, {"a"}, 1, 0), Error);
  EXPECT_THROW(contact_sheet({image}, {"a"}, 1000000, 1000), Error);
  EXPECT_THROW(contact_sheet({cv::Mat()}, {"a"}, 1, 64), Error);
  EXPECT_THROW(contact_sheet({cv::Mat(4, 4, CV_32FC1)}, {"a"}, 1, 64), Error);
  EXPECT_THROW(contact_sheet({cv::Mat(100000, 1, CV_8UC1, cv::Scalar(0))}, {"a"}, 1, 64), Error);
}

}  // namespace
}  // namespace touchstone::datasets
