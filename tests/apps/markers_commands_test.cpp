// Recorded frames to displacements of markers by the built program. The frames are painted, not simulated.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <sstream>

#include "core/whole_file.h"
#include "render/imager/jpeg.h"
#include "sim/files/image_file.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/markers/painted_markers.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::MarkerPicture;
using sensors::fixtures::paint_markers;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kColumns = 11, kRows = 9;
constexpr int kMarkers = kColumns * kRows;

std::vector<Eigen::Vector2d> moved(const Eigen::Vector2d& by) {
  std::vector<Eigen::Vector2d> places;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      places.emplace_back(30.4 + 26.0 * column + by.x(), 25.7 + 24.0 * row + by.y());
    }
  }
  return places;
}

/// The cells of a line.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

class MarkersCommand : public ::testing::Test {
 protected:
  MarkersCommand() {
    fs::create_directories(folder_.path() / "frames");
    for (const int i : {0, 1, 2, 10}) {
      sim::write_png(folder_.path() / "frames" / fmt::format("{}.png", i), frame(0.9 * i));
    }
  }
  cv::Mat frame(double x) const { return paint_markers(picture_, moved({x, -0.5 * x})); }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }

  test::TemporaryFolder folder_;
  MarkerPicture picture_ = {.diameter_px = 9.0, .noise = 1.0};
};

TEST_F(MarkersCommand, FramesGiveDisplacementsAndPictures) {
  const auto run = run_program({"estimate", "markers", in("frames"), "-o", in("out"), "--overlay", "--rate", "25"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("markers.csv of 4 frames"), HasSubstr("frames: 99 dark markers, "),
                             HasSubstr("; 100.0 % of their places trusted")));
  std::istringstream csv(read_whole_file(folder_.path() / "out/markers.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "sequence,frame,file,t_us,marker,x_px,y_px,dx_px,dy_px,trusted,status");
  int lines = 0;
  double sum = 0.0;
  while (std::getline(csv, line)) {
    const std::vector<std::string> cells = cells_of(line);
    ASSERT_EQ(cells.size(), 11U) << line;
    const int number = lines / kMarkers;
    const double x = 0.9 * std::vector<int>{0, 1, 2, 10}[static_cast<std::size_t>(number)];
    EXPECT_EQ(cells[1], std::to_string(number));
    EXPECT_EQ(cells[2], number == 3 ? "10.png" : fmt::format("{}.png", number));
    EXPECT_EQ(cells[3], std::to_string(40000 * number));
    EXPECT_EQ(cells[4], std::to_string(lines % kMarkers));
    EXPECT_EQ(cells[9] + cells[10], "1found");
    sum += std::pow(std::stod(cells[7]) - x, 2) + std::pow(std::stod(cells[8]) + 0.5 * x, 2);
    ++lines;
  }
  EXPECT_EQ(lines, 4 * kMarkers);
  EXPECT_LT(std::sqrt(sum / lines), 0.1);
  for (const char* name : {"0", "1", "2", "10"}) {
    const cv::Mat drawn = sim::read_image(folder_.path() / "out/overlay" / fmt::format("{}.png", name));
    const cv::Mat bare = sim::read_image(folder_.path() / "frames" / fmt::format("{}.png", name));
    ASSERT_EQ(drawn.size(), bare.size());
    EXPECT_GT(cv::norm(drawn, bare, cv::NORM_L1), 1e4) << "nothing is drawn over it";
  }
}

TEST_F(MarkersCommand, ARestFrameOfItsOwnAndNoTimes) {
  sim::write_png(folder_.path() / "rest.png", frame(-3.0));
  const auto run = run_program({"estimate", "markers", in("frames"), "-o", in("out"), "--rest", in("rest.png")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(fs::exists(in("out/overlay")));
  const std::string csv = read_whole_file(folder_.path() / "out/markers.csv");
  const std::vector<std::string> first = cells_of(csv.substr(csv.find('\n') + 1));
  EXPECT_EQ(first[3], "") << "nobody knows when it was taken";
  EXPECT_NEAR(std::stod(first[7]), 3.0, 0.3);
  EXPECT_NEAR(std::stod(first[8]), -1.5, 0.3);
}

TEST_F(MarkersCommand, ADamagedFrameIsLeftOutAloneAndNamed) {
  const std::string jpeg = render::jpeg_bytes(frame(3.0), {.quality = 95});
  folder_.write("frames/3.jpg", jpeg.substr(0, jpeg.size() / 2));
  sim::write_png(folder_.path() / "frames/4.png", cv::Mat(50, 60, CV_8UC3, cv::Scalar::all(90)));
  const auto run = run_program({"estimate", "markers", in("frames"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("markers.csv of 4 frames"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("frames/3.jpg: "), HasSubstr("frames/4.png: "), HasSubstr("left out")));
  const std::string csv = read_whole_file(folder_.path() / "out/markers.csv");
  EXPECT_THAT(csv, AllOf(HasSubstr("\nframes,3,3.jpg,,,,,,,0,"), HasSubstr("\nframes,4,4.png,,,,,,,0,"),
                         HasSubstr("\nframes,5,10.png,,98,")));
}

TEST_F(MarkersCommand, WhatCantBeUsedIsRefusedByName) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words = {"estimate", "markers", "-o", in("out")};
    words.insert(words.end(), more.begin(), more.end());
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("out")));
  };
  refused({in("none")}, "none: there is no such folder or file");
  refused({in("frames"), "--rest", in("none.png")}, "none.png");
  sim::write_png(folder_.path() / "white.png", cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(255)));
  refused({in("frames"), "--rest", in("white.png")}, "white.png: markers: the frame at rest is saturated");
  sim::write_png(folder_.path() / "bare.png", paint_markers(picture_, {}));
  refused({in("frames"), "--rest", in("bare.png")}, "bare.png: markers: the frame at rest shows none");
  sim::write_png(folder_.path() / "frames/0.png", paint_markers(picture_, {{150.0, 100.0}}));
  refused({in("frames")}, "frames/0.png: markers: the frame at rest shows none");
  refused({in("frames"), "--rate", "0"}, "--rate");
  refused({in("frames"), "--arrow-scale", "-1"}, "--arrow-scale");
}

}  // namespace
}  // namespace touchstone
