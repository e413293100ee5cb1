// Videos as sources, beside the pictures that they were made of and beside OpenCV's own reader.

#include "datasets/sources/video_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "core/whole_file.h"
#include "datasets/sources/any_source.h"
#include "sim/files/image_file.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/written_video.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using test::VideoToWrite;
using test::write_video;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFrames = 20;

/// A disc that wanders over a slope, with noise, so that no two frames are alike.
cv::Mat painted(int i, int type = CV_8UC3) {
  cv::Mat picture(48, 64, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      picture.at<cv::Vec3b>(row, column) = {static_cast<unsigned char>(3 * column), static_cast<unsigned char>(4 * row),
                                            static_cast<unsigned char>(10 * i)};
    }
  }
  cv::circle(picture, {10 + 2 * i, 24}, 6, {20, 200, 240}, cv::FILLED);
  if (type == CV_8UC3) return picture;
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  if (type == CV_16UC1) grey.convertTo(grey, CV_16U, 257.0, 1.0 * i);
  return grey;
}

std::vector<cv::Mat> all_painted(int type = CV_8UC3) {
  std::vector<cv::Mat> frames;
  for (int i = 0; i < kFrames; ++i) frames.push_back(painted(i, type));
  return frames;
}

std::vector<SourceFrame> frames_in(const FrameStream& stream) {
  std::vector<SourceFrame> frames;
  for_each_frame({stream}, [&](const SourceFrame& frame) { frames.push_back(frame); });
  return frames;
}

/// What is wrong with frames, by their numbers.
std::vector<std::pair<int, std::string>> faults_in(const std::vector<SourceFrame>& frames) {
  std::vector<std::pair<int, std::string>> faults;
  for (const SourceFrame& frame : frames) {
    if (!frame.fault.empty()) faults.emplace_back(frame.label.frame, frame.fault);
  }
  return faults;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * static_cast<std::size_t>(a.channels()));
}

class VideoSource : public ::testing::Test {
 protected:
  fs::path written(const std::string& name, const std::vector<cv::Mat>& frames, const VideoToWrite& how = {}) const {
    write_video(folder_.path() / name, frames, how);
    return folder_.path() / name;
  }
  FrameStream whole(const std::string& name) const { return video_stream((folder_.path() / name).string()); }

  test::TemporaryFolder folder_;
};

TEST_F(VideoSource, LosslessFramesAreThePicturesThemselves) {
  for (const auto& [pixels, type] : {std::pair{"bgr0", CV_8UC3}, {"gray", CV_8UC1}, {"gray16le", CV_16UC1}}) {
    const std::vector<cv::Mat> frames = all_painted(type);
    written("clip.mkv", frames, {.pixels = pixels});
    const std::vector<SourceFrame> read = frames_in(whole("clip.mkv"));
    ASSERT_EQ(read.size(), frames.size()) << pixels;
    for (std::size_t i = 0; i < read.size(); ++i) {
      ASSERT_EQ(read[i].fault, "");
      ASSERT_EQ(read[i].image.type(), type) << pixels;
      EXPECT_EQ(cv::norm(read[i].image, frames[i], cv::NORM_INF), 0.0) << pixels << " " << i;
      EXPECT_EQ(read[i].label.t_us, 40000 * static_cast<std::int64_t>(i));
      EXPECT_TRUE(read[i].label.timed);
    }
    EXPECT_EQ(read[3].stem, "clip-000003");
    EXPECT_THAT(read[3].title, HasSubstr("clip.mkv: frame 3"));
  }
}

TEST_F(VideoSource, ReadsAsOpenCVDoes) {
  for (const auto& [name, fourcc] : {std::pair{"clip.avi", "MJPG"}, {"clip.mp4", "mp4v"}, {"huff.avi", "HFYU"}}) {
    const std::string file = (folder_.path() / name).string();
    {
      cv::VideoWriter writer(file, cv::CAP_FFMPEG, cv::VideoWriter::fourcc(fourcc[0], fourcc[1], fourcc[2], fourcc[3]),
                             30.0, {64, 48});
      ASSERT_TRUE(writer.isOpened()) << name;
      for (const cv::Mat& frame : all_painted()) writer.write(frame);
    }
    const FrameStream stream = whole(name);
    EXPECT_EQ(stream.frames, kFrames) << name;
    const std::vector<SourceFrame> read = frames_in(stream);
    ASSERT_EQ(read.size(), static_cast<std::size_t>(kFrames)) << name;
    cv::VideoCapture other(file, cv::CAP_FFMPEG);
    cv::Mat frame;
    for (const SourceFrame& one : read) {
      ASSERT_TRUE(other.read(frame));
      ASSERT_EQ(one.fault, "") << name;
      const cv::Mat truth = painted(one.label.frame);
      EXPECT_LT(mean_difference(one.image, frame), 2.5) << name;
      // OpenCV repeats colours that stand for several pixels; here they are interpolated.
      EXPECT_LT(mean_difference(one.image, truth), mean_difference(frame, truth) + 0.1) << name;
      EXPECT_NEAR(static_cast<double>(one.label.t_us), 1e3 * other.get(cv::CAP_PROP_POS_MSEC), 1.0) << name;
    }
  }
}

TEST_F(VideoSource, HasItsOwnTimesWhereTheRateVaries) {
  std::vector<std::int64_t> t_ms;
  for (int i = 0; i < kFrames; ++i) t_ms.push_back(10 * i + 3 * i * i);
  for (const char* name : {"clip.mkv", "clip.mp4"}) {
    written(name, all_painted(), {.codec = "mpeg4", .pixels = "yuv420p", .t_ms = t_ms});
    const std::vector<SourceFrame> read = frames_in(whole(name));
    ASSERT_EQ(read.size(), t_ms.size()) << name;
    for (std::size_t i = 0; i < read.size(); ++i) {
      EXPECT_EQ(read[i].fault, "");
      EXPECT_NEAR(static_cast<double>(read[i].label.t_us), 1e3 * static_cast<double>(t_ms[i]), 1000.0) << name;
    }
  }
}

TEST_F(VideoSource, IsTurnedAsAPlayerTurnsIt) {
  for (const int turn : {90, 180, 270}) {
    written("clip.mp4", all_painted(), {.codec = "mpeg4", .pixels = "yuv420p", .turned_deg = turn});
    const std::vector<SourceFrame> read = frames_in(whole("clip.mp4"));
    ASSERT_EQ(read.size(), static_cast<std::size_t>(kFrames));
    cv::Mat wanted;
    cv::rotate(painted(0), wanted,
               turn == 90    ? cv::ROTATE_90_CLOCKWISE
               : turn == 180 ? cv::ROTATE_180
                             : cv::ROTATE_90_COUNTERCLOCKWISE);
    ASSERT_EQ(read[0].image.size(), wanted.size()) << turn;
    EXPECT_LT(mean_difference(read[0].image, wanted), 8.0) << turn;
    if (turn != 90) continue;
    // As a phone writes it: right becomes down, and down becomes left (QuickTime's matrix 0 1 0 / -1 0 0 of 16.16).
    const std::string matrix("\0\0\0\0\0\1\0\0\0\0\0\0\xff\xff\0\0", 16);
    EXPECT_THAT(read_whole_file(folder_.path() / "clip.mp4"), HasSubstr(matrix));
  }
}

TEST_F(VideoSource, CutInTheMiddleKeepsWhatIsThere) {
  for (const auto& [name, codec, pixels] :
       {std::tuple{"clip.avi", "mjpeg", "yuvj420p"}, std::tuple{"clip.mkv", "ffv1", "bgr0"},
        std::tuple{"mpeg4.avi", "mpeg4", "yuv420p"}}) {
    const fs::path file = written(name, all_painted(), {.codec = codec, .pixels = pixels});
    const std::vector<SourceFrame> before = frames_in(whole(name));
    EXPECT_TRUE(faults_in(before).empty()) << name << ": " << faults_in(before)[0].second;
    fs::resize_file(file, fs::file_size(file) * 3 / 4);
    const std::vector<SourceFrame> read = frames_in(whole(name));
    const auto faults = faults_in(read);
    ASSERT_FALSE(faults.empty()) << name;
    EXPECT_THAT(faults.back().second, HasSubstr("the file ends within the video")) << name;
    EXPECT_LE(faults.size(), 2U) << name << ": the frame that is cut off, and the end";
    EXPECT_GE(read.size(), 5U) << name;
    EXPECT_LE(read.size(), 18U) << name;
    for (std::size_t i = 0; i + faults.size() < read.size(); ++i) {
      ASSERT_EQ(read[i].fault, "") << name;
      EXPECT_EQ(cv::norm(read[i].image, before[i].image, cv::NORM_INF), 0.0) << name << " " << i;
    }
  }
}

TEST_F(VideoSource, ADamagedFrameIsNamedAndThoseDrawnOverIt) {
  // Bytes within the seventh frame's data are overwritten.
  const auto damaged = [&](const std::string& name, const VideoToWrite& how) {
    const fs::path file = written(name, all_painted(), how);
    std::string bytes = read_whole_file(file);
    std::size_t at = bytes.find("movi");
    for (int i = 0; i < 7; ++i) at = bytes.find("00dc", at + 1);
    const std::size_t size =
        static_cast<unsigned char>(bytes[at + 4]) + 256U * static_cast<unsigned char>(bytes[at + 5]);
    for (std::size_t i = 0; i < 80; ++i) bytes[at + 8 + size / 2 + i] = static_cast<char>(i * 37);
    write_whole_file(file, bytes);
    return faults_in(frames_in(whole(name)));
  };
  const auto jpeg = damaged("clip.avi", {.codec = "mjpeg", .pixels = "yuvj420p"});
  ASSERT_EQ(jpeg.size(), 1U);
  EXPECT_EQ(jpeg[0].first, 6);
  EXPECT_THAT(jpeg[0].second, AllOf(HasSubstr("clip.avi: frame 6 is damaged"), HasSubstr("(")));
  const auto lossless = damaged("lossless.avi", {.codec = "ffv1", .key_every = 1});
  ASSERT_EQ(lossless.size(), 1U);
  EXPECT_EQ(lossless[0].first, 6);
}

TEST_F(VideoSource, WhatIsNoVideoIsRefusedByNameInOneLine) {
  const auto refused = [&](const std::string& name) {
    return message_of([&] { streams_of({.place = (folder_.path() / name).string()}); });
  };
  folder_.write("text.mp4", "this is no video at all\n");
  EXPECT_THAT(refused("text.mp4"), AllOf(HasSubstr("text.mp4: can't be read as a video: "), HasSubstr("moov")));
  folder_.write("empty.mp4", "");
  EXPECT_THAT(refused("empty.mp4"), HasSubstr("empty.mp4: is empty"));
  EXPECT_THAT(refused("none.mp4"), HasSubstr("none.mp4: there is no such folder or file; frames come from"));
  const fs::path cut = written("cut.mp4", all_painted(), {.codec = "mpeg4", .pixels = "yuv420p"});
  fs::resize_file(cut, fs::file_size(cut) / 2);
  EXPECT_THAT(refused("cut.mp4"), AllOf(HasSubstr("cut.mp4: can't be read as a video: "), HasSubstr("moov")))
      << "an MP4's table of frames stands at its end";
  ASSERT_EQ(mkfifo((folder_.path() / "pipe.avi").c_str(), 0600), 0);
  EXPECT_THAT(refused("pipe.avi"), HasSubstr("is a pipe or a device; only files are read"));
}

TEST_F(VideoSource, NoOtherFileIsReadThanTheOneThatIsNamed) {
  written("clip.avi", all_painted(), {.codec = "mjpeg", .pixels = "yuvj420p"});
  folder_.write("list.m3u8", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nclip.avi\n#EXT-X-ENDLIST\n");
  folder_.write("list.ffconcat", "ffconcat version 1.0\nfile clip.avi\n");
  for (const char* name : {"list.m3u8", "list.ffconcat"}) {
    EXPECT_THAT(message_of([&] { whole(name); }), HasSubstr("can't be read as a video")) << name;
  }
}

TEST_F(VideoSource, NamesThatMeanSomethingToFFmpegAreFiles) {
  for (const char* name : {"http:a.mkv", "a%03d.mkv", "a?b|c.mkv", "-i.mkv"}) {
    written(name, {painted(1), painted(2)});
    EXPECT_EQ(frames_in(whole(name)).size(), 2U) << name;
  }
}

TEST_F(VideoSource, NothingIsPrinted) {
  const fs::path file = written("clip.avi", all_painted(), {.codec = "mjpeg", .pixels = "yuvj420p"});
  fs::resize_file(file, fs::file_size(file) / 2);
  folder_.write("text.mp4", "no video");
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  frames_in(whole("clip.avi"));
  message_of([&] { whole("text.mp4"); });
  SourceFrame frame;
  message_of([&] { address_stream("http://127.0.0.1:9/stream.mjpg", {}).open()->next(frame); });
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(LiveSource, WhatIsntThereIsRefusedByName) {
  const auto refused = [](const std::string& place) {
    return message_of([&] {
      SourceFrame frame;
      for (const FrameStream& stream : streams_of({.place = place, .timeout_s = 2.0})) stream.open()->next(frame);
    });
  };
  EXPECT_THAT(refused("63"), HasSubstr("camera 63: there is no /dev/video63; this machine's cameras are:"));
  EXPECT_THAT(refused("640"), HasSubstr("camera 640: there are cameras 0 to 63 at most"));
  EXPECT_THAT(refused("http://127.0.0.1:9/stream.mjpg"),
              AllOf(HasSubstr("http://127.0.0.1:9/stream.mjpg: can't be read from: "), HasSubstr("refused")));
  EXPECT_THAT(refused("ftp://127.0.0.1/clip.avi"), HasSubstr("'ftp://' isn't read from; allowed are http://"));
}

}  // namespace
}  // namespace touchstone::datasets
