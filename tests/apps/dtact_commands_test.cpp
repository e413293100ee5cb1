// Frames that show depth as darkness to height maps by the built program. They are painted, not simulated.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "sim/files/image_file.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/heights/painted_darkness.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/written_video.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::DarkBall;
using sensors::fixtures::DarknessPainter;
using sensors::fixtures::Layer;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kHeader = "file,u_px,v_px,radius_px,ball_diameter_mm\n";

class DtactCommands : public ::testing::Test {
 protected:
  DtactCommands() {
    fs::create_directories(folder_.path() / "cal");
    fs::create_directories(folder_.path() / "new");
    const auto put = [&](const char* name, const cv::Mat& picture) { sim::write_png(folder_.path() / name, picture); };
    put("cal/rest.png", painter_.rest());
    put("cal/grey.png", cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
    put("cal/a.png", painter_.press({{8.1, 5.9}, 4.0, 1.4, Layer::thin}).frame);
    put("cal/b.png", painter_.press({{6.1, 6.4}, 4.0, 0.8, Layer::thin}).frame);
    put("new/ball.png", painter_.press(ball_).frame);
  }
  ProgramRun calibrate(const std::string& table, const std::string& rest = "rest.png") {
    const fs::path csv = folder_.write("table.csv", table);
    return run_program({"calibrate", "9dtact", "--frames", in("cal"), "--annotations", csv.string(), "--mm-per-px",
                        "0.05", "-o", in("m.dark"), "--rest", rest});
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void expect_refused(const ProgramRun& run, const std::string& part) {
    test::expect_refused(run, part);
    EXPECT_FALSE(fs::exists(in("m.dark")));
  }

  test::TemporaryFolder folder_;
  DarknessPainter painter_;
  DarkBall ball_{{9.1, 6.4}, 3.0, 1.0, Layer::thin};
};

TEST_F(DtactCommands, FramesGiveHeightMaps) {
  const ProgramRun made = calibrate(std::string(kHeader) + "a.png,162,118,60.7,8\nb.png,,,,8\n");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("b.png: contact found at"), HasSubstr("2 presses"), HasSubstr("held out")));
  const ProgramRun run =
      run_program({"estimate", "9dtact", "--model", in("m.dark"), "--frames", in("new"), "-o", in("out"), "--doubt"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 height maps"));
  const sim::LinearImage map = sim::read_exr(folder_.path() / "out/ball.exr");
  EXPECT_EQ(map.channel_names, std::vector<std::string>{"height_mm"});
  double squares = 0.0;
  int count = 0;
  for (int v = 0; v < map.image.rows; ++v) {
    for (int u = 0; u < map.image.cols; ++u) {
      const double truth = ball_.height_at(0.05 * Eigen::Vector2d(u + 0.5, v + 0.5));
      if (truth < 0.0) continue;
      squares += std::pow(static_cast<double>(map.image.at<float>(v, u)) - truth, 2.0);
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.03);
  EXPECT_EQ(sim::read_image(folder_.path() / "out/ball-doubt.png").type(), CV_8UC1);
  EXPECT_THAT(read_whole_file(folder_.path() / "out/heights.csv"),
              HasSubstr("file,highest_mm,volume_mm3,contact_mm2,exposure,exposure_followed,deeper_percent,"
                        "bulged_percent,saturated_percent,trusted,contact_at_border,fault\nball.png,"));
}

TEST_F(DtactCommands, MistakesAreRefusedByName) {
  const std::string header = kHeader;
  expect_refused(calibrate(header + "rest.png,,,,8\n"), "table.csv:2: rest.png: no contact is seen");
  expect_refused(calibrate(header + "grey.png,,,,8\n"), "grey.png: the frame is grey; the rest picture is in colour");
  expect_refused(calibrate(header + "rest.png,,,,8\n", "a.png"), "are the rest picture and the press changed over");
  expect_refused(calibrate(header + "a.png,,,,8\n", "none.png"), "none.png");
  expect_refused(
      run_program({"estimate", "9dtact", "--model", in("cal/rest.png"), "--frames", in("new"), "-o", in("out")}),
      "isn't a darkness model");
}

TEST_F(DtactCommands, AVideosFramesMakeTheModelOfTheirPictures) {
  ASSERT_EQ(calibrate(std::string(kHeader) + "a.png,162,118,60.7,8\nb.png,,,,8\n").exit_code, 0);
  std::vector<cv::Mat> frames;
  for (const char* const name : {"rest", "a", "b"}) {
    frames.push_back(sim::read_image(folder_.path() / "cal" / (std::string(name) + ".png")));
  }
  test::write_video(folder_.path() / "clip.mkv", frames);
  const auto by_video = [&](const std::string& lines, const std::string& rest) {
    const fs::path csv = folder_.write("video.csv", kHeader + lines);
    return run_program({"calibrate", "9dtact", "--frames", in("clip.mkv"), "--annotations", csv.string(), "--mm-per-px",
                        "0.05", "-o", in("v.dark"), "--rest", rest});
  };
  const ProgramRun made = by_video("clip-000001,162,118,60.7,8\nclip-000002,,,,8\n", "clip-000000");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("clip-000002: contact found at"), HasSubstr("2 presses")));
  EXPECT_EQ(read_whole_file(folder_.path() / "v.dark"), read_whole_file(folder_.path() / "m.dark"));
  const ProgramRun elsewhere = by_video("clip-000001,162,118,60.7,8\n", in("cal/rest.png"));
  EXPECT_EQ(elsewhere.exit_code, 0) << elsewhere.err;
  fs::remove(folder_.path() / "v.dark");
  test::expect_refused(by_video("clip-000009,162,118,60.7,8\n", "clip-000000"),
                       "video.csv:2: " + in("clip.mkv") + ": has no frame 'clip-000009'");
  test::expect_refused(by_video("clip-000001,162,118,60.7,8\n", "clip-000077"), "has no frame 'clip-000077'");
  test::expect_refused(by_video(",162,118,60.7,8\n", "clip-000000"), "video.csv:2: file: names no frame");
  EXPECT_FALSE(fs::exists(folder_.path() / "v.dark"));
  const ProgramRun live = run_program({"calibrate", "9dtact", "--frames", "0", "--annotations", in("video.csv"),
                                       "--mm-per-px", "0.05", "-o", in("v.dark"), "--rest", in("cal/rest.png")});
  test::expect_refused(live, "0: is live; a recording is needed");
}

}  // namespace
}  // namespace touchstone
