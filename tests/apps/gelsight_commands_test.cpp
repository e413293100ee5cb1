// Recorded frames to height maps by the built program. The frames are painted, not simulated (tests/sensors).

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "render/imager/jpeg.h"
#include "sim/files/image_file.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::Ball;
using sensors::fixtures::GelPainter;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kHeader = "file,u_px,v_px,radius_px,ball_diameter_mm\n";
constexpr double kScale = 0.053;

class GelsightCommands : public ::testing::Test {
 protected:
  GelsightCommands() {
    fs::create_directories(folder_.path() / "cal");
    fs::create_directories(folder_.path() / "new");
    sim::write_png(folder_.path() / "cal/rest.png", painter_.rest());
    sim::write_png(folder_.path() / "cal/grey.png", cv::Mat(90, 120, CV_8UC1, cv::Scalar(90)));
    int number = 0;
    for (const sensors::BallPress& press : painter_.presses(2, 2, 1.0, 0.7)) {
      const std::string name = fmt::format("{}.png", number++);
      sim::write_png(folder_.path() / "cal" / name, press.frame);
      lines_.push_back(fmt::format("{},{},{},{},2\n", name, press.circle->centre.x(), press.circle->centre.y(),
                                   press.circle->radius));
    }
    sim::write_png(folder_.path() / "new/ball.png", painter_.press(ball_).frame);
    sim::write_png(folder_.path() / "new/dark.png", cv::Mat(90, 120, CV_8UC3, cv::Scalar(0, 0, 0)));
  }

  ProgramRun calibrate(const std::string& table, const std::vector<std::string>& background) {
    const fs::path csv = folder_.write("table.csv", table);
    std::vector<std::string> words = {"calibrate",   "gelsight", "--frames", in("cal"),   "--annotations", csv.string(),
                                      "--mm-per-px", "0.053",    "-o",       in("m.gel"), "--background"};
    words.insert(words.end(), background.begin(), background.end());
    return run_program(words);
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void expect_refused(const ProgramRun& run, const std::string& part) {
    test::expect_refused(run, part);
    EXPECT_FALSE(fs::exists(in("m.gel")));
  }

  test::TemporaryFolder folder_;
  GelPainter painter_{120, 90, kScale, {}};
  Ball ball_{{3.1, 2.4}, 2.0, 0.8};
  std::vector<std::string> lines_;
};

TEST_F(GelsightCommands, RecordedFramesGiveHeightMaps) {
  // Three circles are given, one is to be found.
  const ProgramRun made = calibrate(kHeader + lines_[0] + lines_[1] + lines_[2] + "3.png,,,,2\n", {"rest.png"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out,
              AllOf(HasSubstr("3.png: contact found at"), HasSubstr("4 presses"), HasSubstr("correction 'fitted'")));
  const ProgramRun run =
      run_program({"estimate", "gelsight", "--model", in("m.gel"), "--frames", in("new"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("2 height maps"), HasSubstr("1 of them")));
  const sim::LinearImage map = sim::read_exr(folder_.path() / "out/ball.exr");
  EXPECT_EQ(map.channel_names, std::vector<std::string>{"height_mm"});
  const cv::Mat truth = painter_.heights([&](const Eigen::Vector2d& place) { return ball_.at(place); });
  EXPECT_LT(cv::norm(map.image, truth, cv::NORM_INF), 0.03);
  const std::string csv = read_whole_file(folder_.path() / "out/heights.csv");
  EXPECT_THAT(csv,
              HasSubstr("file,highest_mm,volume_mm3,contact_mm2,saturated_percent,trusted,contact_at_border,fault\n"));
  EXPECT_THAT(csv, HasSubstr("\ndark.png,"));

  const ProgramRun levels = run_program({"estimate", "gelsight", "--model", in("m.gel"), "--frames", in("new"), "-o",
                                         in("png"), "--format", "png16", "--live", "0", "--overlay"});
  ASSERT_EQ(levels.exit_code, 0) << levels.err;
  EXPECT_THAT(levels.err, HasSubstr("live: http://127.0.0.1:"));
  const cv::Mat drawn = sim::read_image(folder_.path() / "png/overlay/ball.png");
  EXPECT_EQ(drawn.size(), cv::Size(2 * map.image.cols, map.image.rows));
  cv::Mat from_levels;
  sim::read_image(folder_.path() / "png/ball.png").convertTo(from_levels, CV_32F, 1e-4, -1.0);
  EXPECT_LT(cv::norm(from_levels, map.image, cv::NORM_INF), 6e-5);
}

TEST_F(GelsightCommands, OtherFramesAtRestAndDriftingLightAreFollowed) {
  ASSERT_EQ(calibrate(kHeader + lines_[0] + lines_[1] + lines_[2], {"rest.png"}).exit_code, 0);
  const auto dimmed = [](const cv::Mat& frame, double share) {
    cv::Mat dimmed;
    frame.convertTo(dimmed, CV_8U, share);
    return dimmed;
  };
  fs::create_directories(folder_.path() / "drift");
  for (int k = 0; k < 40; ++k) {
    sim::write_png(folder_.path() / "drift" / fmt::format("{}.png", k), dimmed(painter_.rest(), 1.0 - 0.004 * k));
  }
  sim::write_png(folder_.path() / "drift/40.png", dimmed(painter_.press(ball_).frame, 0.84));
  sim::write_png(folder_.path() / "dim.png", dimmed(painter_.rest(), 0.84));
  const cv::Mat truth = painter_.heights([&](const Eigen::Vector2d& place) { return ball_.at(place); });
  const auto off = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"estimate", "gelsight",  "--model", in("m.gel"),
                                      "--frames", in("drift"), "-o",      in("out")};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramRun run = run_program(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return cv::norm(sim::read_exr(folder_.path() / "out/40.exr").image, truth, cv::NORM_INF);
  };
  const double still = off({"--rest", in("dim.png")});
  const double followed = off({"--follow", "4"});
  const double stale = off({});
  EXPECT_LT(still, 0.1);
  EXPECT_LT(followed, 0.1);
  EXPECT_GT(stale, 1.2 * std::max(still, followed));
  const auto refusal = [&](const std::string& rest) {
    const ProgramRun run = run_program(
        {"estimate", "gelsight", "--model", in("m.gel"), "--frames", in("new"), "-o", in("out"), "--rest", rest});
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_THAT(refusal(in("cal/grey.png")), AllOf(HasSubstr("grey.png"), HasSubstr("is grey")));
  EXPECT_THAT(refusal("http://127.0.0.1:1/"), HasSubstr("recorded frames"));
  EXPECT_THAT(refusal(in("nowhere")), HasSubstr("there is no such folder or file"));
}

TEST_F(GelsightCommands, ADamagedFrameIsRefusedAloneAndNamed) {
  ASSERT_EQ(calibrate(kHeader + lines_[0] + lines_[1] + lines_[2], {"rest.png"}).exit_code, 0);
  const cv::Mat frame = painter_.press(ball_).frame;
  const std::string jpeg = render::jpeg_bytes(frame, {.quality = 95});
  folder_.write("new/10.jpg", jpeg.substr(0, jpeg.size() * 65 / 100));
  folder_.write("new/2.jpg", jpeg);
  folder_.write("new/._2.jpg", "a Mac's");
  sim::write_png(folder_.path() / "new/small, grey.png", cv::Mat(9, 12, CV_8UC3, cv::Scalar(9, 9, 9)));
  const ProgramRun run =
      run_program({"estimate", "gelsight", "--model", in("m.gel"), "--frames", in("new"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("3 height maps"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("new/10.jpg: can't be read as an image (Premature end of JPEG file): left out"),
                             HasSubstr("new/small, grey.png: ")));
  EXPECT_FALSE(fs::exists(in("out/10.exr")));
  const std::string csv = read_whole_file(folder_.path() / "out/heights.csv");
  EXPECT_THAT(csv, HasSubstr("\n10.jpg,,,,,0,,"));
  EXPECT_THAT(csv, HasSubstr("\n\"small, grey.png\",,,,,0,,"));
  EXPECT_LT(csv.find("\n2.jpg,"), csv.find("\n10.jpg,"));
  EXPECT_THAT(csv, Not(HasSubstr("._2")));

  for (const char* name : {"ball.png", "dark.png", "2.jpg", "small, grey.png"})
    fs::remove(folder_.path() / "new" / name);
  test::expect_refused(
      run_program({"estimate", "gelsight", "--model", in("m.gel"), "--frames", in("new"), "-o", in("none")}),
      "none of 1 frames can be used; the first: ");
}

TEST_F(GelsightCommands, TablesAreRefusedWithLineAndField) {
  const std::string good = kHeader + lines_[0];
  const auto refused = [&](const std::string& table, const std::string& part) {
    expect_refused(calibrate(table, {"rest.png"}), part);
  };
  refused("file,u,v\n", "table.csv:1: the first line is 'file,u,v'; it must be 'file,u_px,v_px");
  refused(kHeader, "has no press");
  refused(good + "1.png,3,4\n", "table.csv:3: has 3 cells; 5 are needed");
  refused(good + "none.png,30,30,9,2\n", "table.csv:3: file: there is no file");
  refused(good + "1.png,30,x,9,2\n", "table.csv:3: v_px: 'x' isn't a finite number");
  refused(good + "1.png,,30,9,2\n", "table.csv:3: u_px: '' isn't a finite number");
  refused(good + "1.png,30,30,-9,2\n", "table.csv:3: radius_px: -9 must be above 0");
  refused(good + "1.png,30,30,9,0\n", "table.csv:3: ball_diameter_mm: 0 must be above 0");
}

TEST_F(GelsightCommands, PressesThatCantBeUsedAreLeftOutAndNamed) {
  const ProgramRun run =
      calibrate(kHeader + lines_[0] + "1.png,5,30,9,2\nrest.png,,,,2\ngrey.png,60,40,9,2\n", {"rest.png"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("left out: 1.png: the press at (5.0, 30.0) of radius 9.0 px reaches over the edge"),
                    HasSubstr("left out: rest.png: no contact is seen"),
                    HasSubstr("left out: grey.png: the frame is grey"), HasSubstr("m.gel: 1 presses")));
  fs::remove(in("m.gel"));
  expect_refused(calibrate(std::string(kHeader) + "rest.png,,,,2\ngrey.png,60,40,9,2\n", {"rest.png"}),
                 "none of 2 ball presses can be used; the first: rest.png: no contact is seen");
}

TEST_F(GelsightCommands, OtherMistakesAreRefused) {
  expect_refused(calibrate(kHeader + lines_[0], {"none.png"}), "none.png");
  expect_refused(calibrate(kHeader + lines_[0], {"rest.png", "grey.png"}), "grey.png: is grey");
  expect_refused(run_program({"calibrate", "gelsight", "--frames", in("cal")}), "--annotations");
  expect_refused(
      run_program({"estimate", "gelsight", "--model", in("cal/rest.png"), "--frames", in("new"), "-o", in("out")}),
      "isn't a height model");
}

TEST_F(GelsightCommands, ComparingRefusesADeviceWithAnotherPicture) {
  folder_.write("cal/presses.csv", kHeader + lines_[0]);
  const std::string device = std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/gelsight-flat.yaml";
  const std::vector<std::string> words = {"compare", device, in("cal"), "--mm-per-px", "0.053"};
  test::expect_refused(run_program(words), "its camera has 320 x 240 pixels, the recording 120 x 90");
  std::vector<std::string> learns = words;
  learns.insert(learns.end(), {"--learn", "9.png"});
  test::expect_refused(run_program(learns), "--learn: 9.png isn't a file of");
  test::expect_refused(run_program({"compare", device, in("new"), "--mm-per-px", "0.053"}), "presses.csv");
}

}  // namespace
}  // namespace touchstone
