#include "sensors/texture/texture_squares.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using touchstone::test::message_of;

TEST(TextureSquares, AsManyAsFitAboutTheMiddle) {
  cv::Mat heights(70, 110, CV_32FC1);
  for (int v = 0; v < heights.rows; ++v) {
    for (int u = 0; u < heights.cols; ++u) heights.at<float>(v, u) = static_cast<float>(1000 * v + u);
  }
  const std::vector<cv::Mat> squares = squares_of(heights, 30);
  ASSERT_EQ(squares.size(), 6U);  // 3 x 2, with margins of 10 and 5 px
  EXPECT_EQ(squares[0].at<float>(0, 0), 5010.0F);
  EXPECT_EQ(squares[2].at<float>(29, 29), 34099.0F);
  EXPECT_EQ(squares[3].at<float>(0, 0), 35010.0F);
  EXPECT_EQ(squares_of(heights, 70).size(), 1U);
  EXPECT_THAT(message_of([&] { squares_of(heights, 71); }), HasSubstr("110 x 70 px doesn't hold a square of 71 px"));
  EXPECT_THAT(message_of([&] { squares_of(heights, 0); }), HasSubstr("at least 1"));
}

TEST(TextureSquares, MostDecideAndTheNearestWhereTheyAreAsMany) {
  const std::array<TextureMatch, 3> most = {
      {{.label = 2, .distance = 0.3}, {.label = 0, .distance = 0.1}, {.label = 2, .distance = 0.5}}};
  const TextureVote vote_of_most = vote(most);
  EXPECT_EQ(vote_of_most.label, 2);
  EXPECT_EQ(vote_of_most.squares, 3);
  EXPECT_EQ(vote_of_most.agreeing, 2);
  EXPECT_NEAR(vote_of_most.distance, 0.4, 1e-12);
  EXPECT_EQ(vote(std::span(most).first(2)).label, 0) << "one each";
  EXPECT_THROW(vote({}), Error);
}

}  // namespace
}  // namespace touchstone::sensors
