// Videos that are written, beside what is read back from them.

#include "datasets/sources/video_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/sources/video_frames.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using ::testing::HasSubstr;

/// A disc that wanders over a slope.
cv::Mat disc_at(int i, cv::Size size = {98, 64}) {
  cv::Mat picture(size, CV_8UC3, cv::Scalar(60, 90, 120));
  cv::circle(picture, {16 + 3 * i, size.height / 2}, 9, {20, 200, 240}, cv::FILLED);
  return picture;
}

std::vector<SourceFrame> frames_in(const fs::path& file) {
  std::vector<SourceFrame> frames;
  const auto source = video_stream(file.string()).open();
  for (SourceFrame frame; source->next(frame);) frames.push_back(frame);
  return frames;
}

class VideoFileTest : public ::testing::Test {
 protected:
  fs::path in(const std::string& name) const { return folder_.path() / name; }
  test::TemporaryFolder folder_;
};

TEST_F(VideoFileTest, PicturesComeBackAtTheirTimes) {
  const std::vector<std::int64_t> times = {5'000'000, 5'040'000, 5'080'000, 5'200'000, 5'240'000};  // one was dropped
  VideoFile video(in("a.mp4"));
  for (std::size_t i = 0; i < times.size(); ++i) video.add(disc_at(static_cast<int>(i)), times[i]);
  EXPECT_FALSE(fs::exists(in("a.mp4")));
  video.finish();
  EXPECT_EQ(video.slowed(), 1.0);
  const std::vector<SourceFrame> frames = frames_in(in("a.mp4"));
  ASSERT_EQ(frames.size(), times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    ASSERT_TRUE(frames[i].fault.empty()) << frames[i].fault;
    EXPECT_NEAR(static_cast<double>(frames[i].label.t_us), static_cast<double>(times[i] - times[0]), 1000.0) << i;
    cv::Mat off;
    cv::absdiff(frames[i].image, disc_at(static_cast<int>(i)), off);
    EXPECT_LT(cv::mean(off.reshape(1))[0], 4.0) << i;  // lossy, and colours at half the resolution
  }
}

TEST_F(VideoFileTest, AThousandFramesASecondAreSlowedDownAndASecondSequenceFollows) {
  VideoFile video(in("fast.mp4"));
  for (int sequence = 0; sequence < 2; ++sequence) {
    for (int i = 0; i < 5; ++i) video.add(disc_at(i), 1000 * i);
  }
  video.finish();
  EXPECT_EQ(video.slowed(), 40.0);
  const std::vector<SourceFrame> frames = frames_in(in("fast.mp4"));
  ASSERT_EQ(frames.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(static_cast<double>(frames[static_cast<std::size_t>(i)].label.t_us), 40'000.0 * i, 1000.0) << i;
  }
}

TEST_F(VideoFileTest, OneShortIntervalSlowsNothingDown) {
  VideoFile video(in("a.mp4"));
  std::int64_t t_us = 0;
  for (int i = 0; i < 8; ++i)
    video.add(disc_at(i), t_us += i == 1 ? 500 : 40'000);  // as a live camera's first ones may be
  video.finish();
  EXPECT_EQ(video.slowed(), 1.0);
  EXPECT_EQ(frames_in(in("a.mp4")).size(), 8U);
}

TEST_F(VideoFileTest, WithoutTimesTwentyFiveASecondAndOddSizesLoseARow) {
  VideoFile video(in("odd.mp4"));
  for (int i = 0; i < 3; ++i) video.add(disc_at(i, {99, 65}), std::nullopt);
  video.add(disc_at(3, {198, 130}), std::nullopt);  // another size
  video.finish();
  const std::vector<SourceFrame> frames = frames_in(in("odd.mp4"));
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[0].image.size(), cv::Size(98, 64));
  EXPECT_NEAR(static_cast<double>(frames[3].label.t_us), 120'000.0, 1000.0);
}

// Memory that was used before isn't zero: what an encoder reads of it without having set it shows in the bytes.
TEST_F(VideoFileTest, TheSamePicturesMakeTheSameBytes) {
  for (const char* const name : {"a.mp4", "b.mp4", "c.mp4"}) {
    {
      std::vector<std::vector<unsigned char>> used;
      for (int i = 0; i < 200; ++i) {
        used.emplace_back(static_cast<std::size_t>(1000 + 997 * i), static_cast<unsigned char>(31 * i + name[0]));
      }
    }
    VideoFile video(in(name));
    for (int i = 0; i < 9; ++i) video.add(disc_at(i), 40'000 * i);
    video.finish();
  }
  EXPECT_EQ(read_whole_file(in("a.mp4")), read_whole_file(in("b.mp4")));
  EXPECT_EQ(read_whole_file(in("a.mp4")), read_whole_file(in("c.mp4")));
}

TEST_F(VideoFileTest, WhatIsntFinishedOrHasNoPictureIsntThere) {
  { VideoFile(in("none.mp4")).finish(); }
  {
    VideoFile video(in("left.mp4"));
    for (int i = 0; i < 5; ++i) video.add(disc_at(i), 40'000 * i);
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  VideoFile one(in("one.mp4"));
  one.add(disc_at(0), 7);
  one.finish();
  EXPECT_EQ(frames_in(in("one.mp4")).size(), 1U);
}

TEST_F(VideoFileTest, NamesAndPlacesThatCantBeAreNamed) {
  EXPECT_THAT(message_of([&] { VideoFile(in("a.avi")); }), HasSubstr("a.avi: a video's name must end in .mp4"));
  EXPECT_THAT(message_of([&] { VideoFile(in("no-such-folder/a.mp4")); }), HasSubstr("a.mp4: can't be written"));
  VideoFile video(in("grey.mp4"));
  EXPECT_THAT(message_of([&] { video.add(cv::Mat(8, 8, CV_8UC1, cv::Scalar(0)), 0); }), HasSubstr("grey.mp4"));
  EXPECT_THAT(message_of([&] { video.add(cv::Mat(1, 8, CV_8UC3, cv::Scalar(0)), 0); }), HasSubstr("2 x 2 pixels"));
}

}  // namespace
}  // namespace touchstone::datasets
