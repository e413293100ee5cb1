// Estimates of videos and of a served camera by the built program, beside those of the same pictures.

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <opencv2/core.hpp>
#include <thread>

#include "core/whole_file.h"
#include "render/imager/jpeg.h"
#include "sim/files/image_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/mjpeg_server.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/markers/painted_markers.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/written_video.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::MarkerPicture;
using sensors::fixtures::paint_markers;
using test::csv_table;
using test::expect_refused;
using test::MjpegServer;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

cv::Mat frame(double x) {
  std::vector<Eigen::Vector2d> places;
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 9; ++column) places.emplace_back(30.4 + 26.0 * column + x, 25.7 + 24.0 * row);
  }
  const MarkerPicture picture = {.width = 280, .height = 200, .diameter_px = 9.0, .noise = 1.0};
  return paint_markers(picture, places);
}

class SourceCommand : public ::testing::Test {
 protected:
  SourceCommand() {
    fs::create_directories(folder_.path() / "frames");
    std::vector<cv::Mat> frames;
    for (int i = 0; i < 6; ++i) {
      frames.push_back(frame(0.7 * i));
      sim::write_png(folder_.path() / fmt::format("frames/{}.png", i), frames.back());
    }
    test::write_video(in("clip.mkv"), frames);
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  test::ProgramRun markers(const std::string& source, std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"--quiet", "estimate", "markers", source, "-o", in("out")};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }

  test::TemporaryFolder folder_;
};

TEST_F(SourceCommand, AVideosEstimatesAreThoseOfItsPictures) {
  const auto pictures = markers(in("frames"), {"--rate", "25"});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  const auto of_pictures = csv_table(folder_.path() / "out/markers.csv");
  const auto video = markers(in("clip.mkv"), {"--overlay"});
  ASSERT_EQ(video.exit_code, 0) << video.err;
  EXPECT_EQ(video.err, "");
  const auto of_video = csv_table(folder_.path() / "out/markers.csv");
  ASSERT_EQ(of_video.size(), 6U * 63U);
  ASSERT_EQ(of_video.size(), of_pictures.size());
  for (std::size_t i = 0; i < of_video.size(); ++i) {
    for (const char* column : {"frame", "t_us", "marker", "x_px", "y_px", "dx_px", "dy_px", "trusted", "status"}) {
      EXPECT_EQ(of_video[i].at(column), of_pictures[i].at(column)) << column << " of line " << i + 2;
    }
  }
  EXPECT_EQ(of_video[0].at("sequence"), "clip");
  EXPECT_EQ(of_video.back().at("file"), "clip-000005");
  EXPECT_TRUE(fs::exists(in("out/overlay/clip-000005.png")));
}

TEST_F(SourceCommand, ACutVideoIsReadAsFarAsItGoesAndSaysSo) {
  fs::resize_file(in("clip.mkv"), fs::file_size(in("clip.mkv")) * 2 / 3);
  const auto run = markers(in("clip.mkv"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("clip.mkv: frame "), HasSubstr("the file ends within the video")));
  const auto table = csv_table(folder_.path() / "out/markers.csv");
  EXPECT_EQ(table.front().at("status"), "found");
  EXPECT_THAT(table.back().at("status"), HasSubstr("the file ends within the video"));
  EXPECT_EQ(table.back().at("trusted"), "0");
}

TEST_F(SourceCommand, WhatIsNoSourceIsRefusedInOneLine) {
  folder_.write("notes.txt", "no frames\n");
  expect_refused(markers(in("notes.txt")), "notes.txt: can't be read as a video");
  expect_refused(markers(in("nothing")), "there is no such folder or file; frames come from");
  expect_refused(markers("63"), "camera 63: there is no /dev/video63");
  expect_refused(markers("http://127.0.0.1:9/x", {"--timeout", "2"}), "http://127.0.0.1:9/x: can't be read from: ");
  expect_refused(markers(in("clip.mkv"), {"--rate", "0"}), "--rate");
  expect_refused(markers(in("clip.mkv"), {"--count", "0"}), "--count");
}

TEST_F(SourceCommand, ALiveStreamIsReadUntilItsCountIsThere) {
  MjpegServer server([](int i) { return render::jpeg_bytes(frame(0.1 * (i % 20)), {.quality = 95}); });
  const auto run = markers(server.url(), {"--count", "8"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto table = csv_table(folder_.path() / "out/markers.csv");
  ASSERT_EQ(table.size(), 8U * 63U);
  EXPECT_EQ(table[0].at("t_us"), "0") << "times begin with the first frame";
  EXPECT_GT(std::stoll(table.back().at("t_us")), 0);
  EXPECT_EQ(table[0].at("file"), "stream-000000");
}

TEST_F(SourceCommand, ADamagedFrameOfAStreamIsNamedAndTheNextOnesRead) {
  MjpegServer server([](int i) {
    const std::string jpeg = render::jpeg_bytes(frame(0.1 * (i % 20)), {.quality = 95});
    return i == 3 ? jpeg.substr(0, jpeg.size() / 2) : jpeg;
  });
  const auto run = markers(server.url(), {"--count", "6"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("frame 3 is damaged"), Not(HasSubstr("frame 4"))));
  EXPECT_EQ(csv_table(folder_.path() / "out/markers.csv").size(), 5U * 63U + 1U);
}

TEST_F(SourceCommand, AFrameOfAnotherSizeIsNamedAndTheNextOnesRead) {
  MjpegServer server([](int i) {
    const cv::Mat picture = frame(0.1 * (i % 20));
    return render::jpeg_bytes(i == 2 ? picture.rowRange(0, 160).clone() : picture, {.quality = 95});
  });
  const auto run = markers(server.url(), {"--count", "5"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("frame 2: "), HasSubstr("160"), Not(HasSubstr("frame 3"))));
  EXPECT_EQ(csv_table(folder_.path() / "out/markers.csv").size(), 4U * 63U + 1U);
}

TEST_F(SourceCommand, AStreamThatEndsOrStallsLeavesWholeTables) {
  for (const bool stalls : {false, true}) {
    MjpegServer server([](int i) { return i < 5 ? render::jpeg_bytes(frame(0.1 * i), {.quality = 95}) : ""; }, stalls);
    const auto run = markers(server.url(), {"--timeout", "1"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr(stalls ? "frame 5 isn't there: nothing came for 1 s"
                                          : "frame 5 isn't there: the stream ended"));
    const auto table = csv_table(folder_.path() / "out/markers.csv");
    ASSERT_EQ(table.size(), 5U * 63U + 1U);
    EXPECT_EQ(table[4 * 63].at("trusted"), "1");
  }
}

TEST_F(SourceCommand, CtrlCLeavesWholeTables) {
  std::atomic<int> sent{0};
  MjpegServer server([&](int i) {
    sent = i;
    return render::jpeg_bytes(frame(0.1 * (i % 20)), {.quality = 95});
  });
  const std::string url = server.url(), out = in("out");
  const pid_t child = fork();
  if (child == 0) {
    dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
    execl(TOUCHSTONE_PROGRAM, TOUCHSTONE_PROGRAM, "--quiet", "estimate", "markers", url.c_str(), "-o", out.c_str(),
          nullptr);
    _exit(127);
  }
  while (sent < 10) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_EQ(kill(child, SIGINT), 0);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  const auto table = csv_table(folder_.path() / "out/markers.csv");
  ASSERT_GT(table.size(), 0U);
  EXPECT_EQ(table.size() % 63, 0U) << "each frame has all of its lines";
}

TEST_F(SourceCommand, ALiveViewShowsEachFrameWithItsMarkers) {
  std::atomic<bool> watched{false};
  MjpegServer server([&](int i) { return watched ? "" : render::jpeg_bytes(frame(0.1 * (i % 20)), {.quality = 95}); });
  int out[2];
  ASSERT_EQ(pipe2(out, O_CLOEXEC), 0);
  const std::string url = server.url(), folder = in("out");
  const pid_t child = fork();
  if (child == 0) {
    dup2(out[1], STDERR_FILENO);
    execl(TOUCHSTONE_PROGRAM, TOUCHSTONE_PROGRAM, "--quiet", "estimate", "markers", url.c_str(), "-o", folder.c_str(),
          "--live", "0", nullptr);
    _exit(127);
  }
  ::close(out[1]);
  std::string said;
  char letter = 0;
  while (::read(out[0], &letter, 1) == 1 && letter != '\n') said += letter;
  EXPECT_THAT(said, HasSubstr("live: http://127.0.0.1:"));
  const std::string address = said.substr(said.find("http"));
  // Watched as any camera is: by the program itself, whose markers are then those of the drawn pictures.
  const auto run = run_program({"--quiet", "estimate", "markers", address + "stream.mjpg", "-o", in("seen"), "--rest",
                                in("frames/0.png"), "--count", "3"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto table = csv_table(folder_.path() / "seen/markers.csv");
  EXPECT_EQ(table.size(), 3U * 63U);
  watched = true;
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  ::close(out[0]);
}

}  // namespace
}  // namespace touchstone
