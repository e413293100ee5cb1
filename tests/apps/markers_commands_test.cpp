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

TEST_F(MarkersCommand, AFirstFrameThatIsTouchedGivesWayToALaterOne) {
  const auto touched = [&](double most_px) {
    std::vector<Eigen::Vector2d> places = moved({0.0, 0.0});
    for (Eigen::Vector2d& place : places) {
      const Eigen::Vector2d from = (place - Eigen::Vector2d(150.0, 120.0)) / 40.0;
      place += 1.65 * most_px * from * std::exp(-0.5 * from.squaredNorm());
    }
    return paint_markers(picture_, places);
  };
  for (const char* const name : {"touched", "untouched"}) fs::create_directories(folder_.path() / name);
  const std::vector<double> presses = {5.0, 4.0, 2.0, 0.0, 0.0, 3.0};
  for (std::size_t i = 0; i < presses.size(); ++i) {
    sim::write_png(folder_.path() / fmt::format("touched/{}.png", i), touched(presses[i]));
    sim::write_png(folder_.path() / fmt::format("untouched/{}.png", i), touched(presses[presses.size() - 2 - i % 5]));
  }
  const auto run = run_program({"estimate", "markers", in("touched"), "-o", in("out"), "--touch"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, ::testing::ContainsRegex("touched: the first frame is touched: frame [34], whose rows are "
                                                "straightest, is taken for the gel at rest"));
  std::istringstream csv(read_whole_file(folder_.path() / "out/markers.csv"));
  std::string line;
  std::getline(csv, line);
  double most_first = 0.0, most_at_rest = 0.0;
  int lines = 0;
  while (std::getline(csv, line)) {
    const std::vector<std::string> cells = cells_of(line);
    const double moved_px = std::hypot(std::stod(cells[7]), std::stod(cells[8]));
    if (cells[1] == "0") most_first = std::max(most_first, moved_px);
    if (cells[1] == "3" || cells[1] == "4") most_at_rest = std::max(most_at_rest, moved_px);
    ++lines;
  }
  EXPECT_EQ(lines, 6 * kMarkers);
  EXPECT_NEAR(most_first, 5.0, 0.4);
  EXPECT_LT(most_at_rest, 0.3);
  const auto other = run_program({"estimate", "markers", in("untouched"), "-o", in("other"), "--touch"});
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_THAT(other.err, Not(HasSubstr("is touched")));
}

TEST_F(MarkersCommand, PicturesMakeAVideoAndTablesAReport) {
  const auto run = run_program({"estimate", "markers", in("frames"), "-o", in("out"), "--touch", "--overlay", "--video",
                                in("seen.mp4"), "--rate", "25"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("seen.mp4: shown as fast as it was"));
  EXPECT_GT(fs::file_size(folder_.path() / "seen.mp4"), 1000U);
  const auto report = run_program({"inspect", in("out"), "-o", in("report.html")});
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(report.out, HasSubstr("report.html: 2 tables, pictures of "));
  EXPECT_THAT(read_whole_file(folder_.path() / "report.html"),
              AllOf(HasSubstr("size of displacement"), HasSubstr("touch.csv"), HasSubstr("4 of 4 frames")));
  const auto one = run_program({"inspect", in("out/touch.csv"), "-o", in("one.html")});
  EXPECT_THAT(one.out, HasSubstr("one.html: 1 table, pictures of "));
  test::expect_refused(run_program({"inspect", in("out"), "-o", in("sheet.png")}), "is an .html file");
  test::expect_refused(run_program({"inspect", in("frames"), "-o", in("r.html")}), "nor a folder with tables");
  test::expect_refused(run_program({"estimate", "markers", in("frames"), "-o", in("o2"), "--video", in("a.avi")}),
                       "must end in .mp4");
}

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
