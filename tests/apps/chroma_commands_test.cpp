// Recorded frames of coloured markers to displacements and forces by the built program. The frames are painted, not
// simulated (tests/sensors).

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "core/whole_file.h"
#include "sensors/tractions/marker_compliance_file.h"
#include "sim/files/image_file.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/colour/painted_colour_markers.h"
#include "tests/sensors/tractions/half_space_markers.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::ColourPicture;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kHeader = "file,marker_column,marker_row,x_mm,y_mm,z_mm,series\n";
constexpr int kSide = 5;  // markers

ColourPicture resting() {
  ColourPicture picture = sensors::fixtures::small_colour_picture(16.0);
  picture.columns = picture.rows = kSide;
  return picture;
}

cv::Mat paint(const std::vector<Eigen::Vector3d>& displacements) {
  ColourPicture picture = resting();
  sensors::fixtures::displace(picture, displacements);
  return sensors::fixtures::paint_colour_markers(picture);
}

std::vector<Eigen::Vector3d> all_by(const Eigen::Vector3d& displacement) {
  return std::vector<Eigen::Vector3d>(kSide * kSide, displacement);
}

/// A table's lines, cut into cells.
std::vector<std::vector<std::string>> table_of(const fs::path& csv) {
  std::vector<std::vector<std::string>> table;
  std::istringstream lines(read_whole_file(csv));
  for (std::string line; std::getline(lines, line);) {
    table.emplace_back();
    std::istringstream cells(line + ",");
    for (std::string cell; std::getline(cells, cell, ',');) table.back().push_back(cell);
  }
  return table;
}

/// The frames of calibration: the same press and shear of all markers, of which three are in the table.
struct Calibration {
  struct Frame {
    std::string name;
    cv::Mat picture;
  };
  std::vector<Frame> frames;
  std::string lines;
};
const Calibration& calibration() {
  static const Calibration painted = [] {
    Calibration made;
    int number = 0;
    for (const double press : {0.4, 0.8, 1.2, 1.6}) {
      for (const double x : {0.0, 0.3, 0.6}) {
        made.frames.push_back({fmt::format("{}.png", number), paint(all_by({x, 0.0, -press}))});
        for (const int marker : {1, 2, 3}) {
          made.lines += fmt::format("{}.png,{},2,{},0,{},{}\n", number, marker, x, -press, number / 3);
        }
        ++number;
      }
    }
    return made;
  }();
  return painted;
}

class ChromaCommands : public ::testing::Test {
 protected:
  ChromaCommands() {
    for (const char* name : {"cal", "new"}) fs::create_directories(folder_.path() / name);
    sim::write_png(folder_.path() / "rest.png", sensors::fixtures::paint_colour_markers(resting()));
    sim::write_png(folder_.path() / "grey.png", cv::Mat(168, 192, CV_8UC1, cv::Scalar(90)));
    sim::write_png(folder_.path() / "cal/grey.png", cv::Mat(168, 192, CV_8UC1, cv::Scalar(90)));
    sim::write_png(folder_.path() / "cal/small.png", cv::Mat(100, 120, CV_8UC3, cv::Scalar(90, 90, 200)));
    sim::write_png(folder_.path() / "cal/white.png", cv::Mat(168, 192, CV_8UC3, cv::Scalar::all(255)));
    for (const Calibration::Frame& frame : calibration().frames) {
      sim::write_png(folder_.path() / "cal" / frame.name, frame.picture);
    }
  }

  ProgramRun calibrate(const std::string& table, const std::vector<std::string>& more = {},
                       const std::string& rest = "rest.png", const std::string& grid = "5x5") {
    const fs::path csv = folder_.write("table.csv", table);
    std::vector<std::string> words = {"calibrate",  "chroma", "--frames", in("cal"),      "--presses",
                                      csv.string(), "--rest", in(rest),   "--spacing-mm", "3",
                                      "--grid",     grid,     "-o",       in("m.json")};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }
  ProgramRun estimate(const std::vector<std::string>& more = {}, const std::string& grid = "5x5") {
    std::vector<std::string> words = {"estimate", "chroma",  "--model", in("m.json"), "--rest", in("rest.png"),
                                      "--frames", in("new"), "--grid",  grid,         "-o",     in("out")};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void expect_refused(const ProgramRun& run, const std::string& part) {
    test::expect_refused(run, part);
    EXPECT_FALSE(fs::exists(in("out")));
  }

  test::TemporaryFolder folder_;
  const std::string& lines_ = calibration().lines;
};

TEST_F(ChromaCommands, RecordedFramesGiveDisplacements) {
  for (const char* form : {"isotropic", "polynomial", "equation4"}) {
    const ProgramRun made = calibrate(kHeader + lines_ + "white.png,2,2,0,0,0,9\n", {"--form", form});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_THAT(made.out, AllOf(HasSubstr("left out: white.png: marker (2, 2): "), HasSubstr("36 samples"),
                                HasSubstr("on series left out in turn")));
  }
  const ProgramRun best = calibrate(kHeader + lines_, {"--form", "best"});
  ASSERT_EQ(best.exit_code, 0) << best.err;
  EXPECT_THAT(best.out, HasSubstr("polynomial of degree"));
  expect_refused(calibrate(kHeader + std::string("0.png,1,2,0,0,-1,0\n"), {"--form", "best"}), "no form fits");
  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  const Eigen::Vector3d truth(0.25, -0.35, -1.0);
  sim::write_png(folder_.path() / "new/a.png", paint(all_by(truth)));
  sim::write_png(folder_.path() / "new/b.png", cv::Mat(168, 192, CV_8UC3, cv::Scalar::all(255)));
  const ProgramRun run = estimate();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("25 of 50 markers measured"));
  EXPECT_FALSE(fs::exists(in("out/forces.csv")));
  const auto table = table_of(in("out/displacements.csv"));
  ASSERT_EQ(table.size(), 51u);
  EXPECT_THAT(table[0],
              ::testing::ElementsAre("file", "marker", "x_mm", "y_mm", "z_mm", "measured", "extrapolated", "flaw"));
  for (std::size_t i = 1; i < table.size(); ++i) {
    ASSERT_EQ(table[i].size(), 8u);
    EXPECT_EQ(table[i][1], std::to_string((i - 1) % 25));
    if (i <= 25) {
      EXPECT_EQ(table[i][0], "a.png");
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(std::stod(table[i][2 + axis]), truth[axis], 0.1) << i;
      EXPECT_EQ(table[i][5], "1");
      EXPECT_EQ(table[i][7], "none");
    } else {
      EXPECT_THAT(table[i], ::testing::ElementsAre("b.png", ::testing::_, "", "", "", "0", "0", ::testing::Ne("none")));
    }
  }
}

TEST_F(ChromaCommands, WithAComplianceThereAreForces) {
  const sensors::MarkerCompliance gel = sensors::fixtures::half_space_markers(kSide, 9, 1.5);
  sensors::save(gel, folder_.path() / "gel.compliance");
  Eigen::VectorXd tractions = Eigen::VectorXd::Zero(3 * gel.patches());
  double force = 0.0;
  for (int p = 0; p < gel.patches(); ++p) {
    if (gel.patch_centre(p).cwiseAbs().maxCoeff() > 3.1) continue;
    tractions[3 * p + 2] = -0.06;
    force += 0.06 * gel.patch_area();
  }
  const Eigen::VectorXd moved = gel.displacement * tractions;
  std::vector<Eigen::Vector3d> displacements;
  for (int m = 0; m < gel.markers(); ++m) displacements.emplace_back(moved.segment<3>(3 * m));
  sim::write_png(folder_.path() / "new/a.png", paint(displacements));
  sim::write_png(folder_.path() / "new/b.png", cv::Mat(168, 192, CV_8UC3, cv::Scalar::all(255)));
  sim::write_png(folder_.path() / "new/c.png", paint(all_by(Eigen::Vector3d::Zero())));
  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  const ProgramRun run = estimate({"--compliance", in("gel.compliance"), "--normal-noise-mm", "0.05"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("1 frames with too few markers"));
  const auto table = table_of(in("out/forces.csv"));
  ASSERT_EQ(table.size(), 4u);
  for (const auto& line : table) ASSERT_EQ(line.size(), 20u);
  EXPECT_EQ(table[0][4], "force_z_N");
  EXPECT_EQ(table[0][10], "sigma_force_z_N");
  EXPECT_EQ(table[0][15], "slip");
  const double error = std::stod(table[1][4]) - force;
  EXPECT_LT(std::abs(error), 0.15 * force);
  EXPECT_LT(std::abs(error), 4.0 * std::stod(table[1][10]));
  EXPECT_NE(table[1][15], "no contact");
  EXPECT_EQ(table[2][1], "0");
  EXPECT_EQ(table[2][4], "");
  EXPECT_EQ(table[2][15], "too few markers");
  EXPECT_EQ(table[3][15], "no contact");
  EXPECT_EQ(std::stod(table[3][4]), 0.0);
  // Displacements under these tractions: of all markers, as they moved; of none where there were no tractions.
  const auto moves = table_of(in("out/displacements.csv"));
  ASSERT_EQ(moves.size(), 1u + 3u * displacements.size());
  EXPECT_EQ(moves[0][8], "elastic_x_mm");
  for (std::size_t m = 0; m < displacements.size(); ++m) {
    ASSERT_EQ(moves[1 + m].size(), 11u);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(std::stod(moves[1 + m][8 + axis]), displacements[m][axis], 0.1);
    EXPECT_EQ(moves[1 + displacements.size() + m][8], "");
    EXPECT_EQ(std::stod(moves[1 + 2 * displacements.size() + m][10]), 0.0);
  }
}

TEST_F(ChromaCommands, MarkersBeyondCalibrationTakeNoPartInForces) {
  sensors::save(sensors::fixtures::half_space_markers(kSide, 5, 3.0), folder_.path() / "gel.compliance");
  std::vector<Eigen::Vector3d> displacements = all_by(Eigen::Vector3d::Zero());
  displacements[12] = {0.0, -0.8, -0.4};  // sheared by 0.6 at the most in calibration
  sim::write_png(folder_.path() / "new/a.png", paint(displacements));
  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  const ProgramRun run = estimate({"--compliance", in("gel.compliance")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("25 of 25 markers measured, 1 of them beyond what calibration saw"));
  EXPECT_EQ(table_of(in("out/displacements.csv"))[13][6], "1");
  const auto forces = table_of(in("out/forces.csv"));
  EXPECT_EQ(forces[1][1], "24");
  EXPECT_EQ(forces[1][15], "no contact");
}

TEST_F(ChromaCommands, AFrameThatCantBeReadHasALineOfItsOwn) {
  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  sim::write_png(folder_.path() / "new/10.png", paint(all_by(Eigen::Vector3d::Zero())));
  folder_.write("new/2.png", "damaged");
  const ProgramRun run = estimate();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("new/2.png: can't be read as an image"), HasSubstr("left out")));
  EXPECT_THAT(run.out, HasSubstr("displacements.csv of 1 frames"));
  const auto table = table_of(in("out/displacements.csv"));
  ASSERT_EQ(table.size(), 27u);
  EXPECT_EQ(table[1][0], "2.png");
  EXPECT_EQ(table[1][1], "");
  EXPECT_EQ(table[1][5], "0");
  EXPECT_EQ(table[2][0], "10.png");
}

TEST_F(ChromaCommands, AMarkerMissingAtRestIsNamed) {
  ColourPicture picture = resting();
  picture.stretch.assign(picture.count(), 1.0);
  picture.stretch[11] = 0.0;
  sim::write_png(folder_.path() / "without.png", sensors::fixtures::paint_colour_markers(picture));
  expect_refused(calibrate(kHeader + lines_, {}, "without.png"),
                 "table.csv:2: marker (1, 2) isn't sound in the picture at rest: missing");
}

TEST_F(ChromaCommands, TablesAreRefusedWithLineAndField) {
  const auto refused = [&](const std::string& table, const std::string& part) {
    expect_refused(calibrate(table), part);
    EXPECT_FALSE(fs::exists(in("m.json")));
  };
  refused("file,x_mm\n", "table.csv:1: the first line is 'file,x_mm'; it must be 'file,marker_column,marker_row,x_mm");
  refused(kHeader, "has no marker");
  const std::string good = std::string(kHeader) + "0.png,1,2,0,0,-1,0\n";
  refused(good + "0.png,1,2,0,0,-1\n", "table.csv:3: has 6 cells; 7 are needed");
  refused(good + "none.png,1,2,0,0,-1,0\n", "table.csv:3: file: there is no file");
  refused(good + "0.png,5,2,0,0,-1,0\n", "table.csv:3: marker_column: 5 isn't in the grid, which has 5: 0 to 4");
  refused(good + "0.png,1,-1,0,0,-1,0\n", "table.csv:3: marker_row: -1 isn't in the grid");
  refused(good + "0.png,1.5,2,0,0,-1,0\n", "table.csv:3: marker_column: '1.5' isn't a whole number");
  refused(good + "0.png,1,2,0,nan,-1,0\n", "table.csv:3: y_mm: 'nan' isn't a finite number");
  refused(good + "0.png,1,2,0,0,-1,a\n", "table.csv:3: series: 'a' isn't a whole number");
  refused(good + "grey.png,1,2,0,0,-1,0\n", "cal/grey.png: coloured markers: the picture has 1 channels");
  refused(good + "small.png,1,2,0,0,-1,0\n",
          "small.png: coloured markers: the picture is 120 x 100 px, the one at rest");
  refused(good, "1 samples, at least 8 are needed");
}

TEST_F(ChromaCommands, OtherMistakesAreRefused) {
  expect_refused(calibrate(kHeader + lines_, {}, "grey.png"), "grey.png: coloured markers: the picture has 1 channels");
  expect_refused(calibrate(kHeader + lines_, {}, "none.png"), "none.png");
  expect_refused(calibrate(kHeader + lines_, {}, "rest.png", "6x5"), "rest.png: coloured markers");
  expect_refused(calibrate(kHeader + lines_, {}, "rest.png", "5"), "--grid: '5' must be COLUMNSxROWS");
  expect_refused(calibrate(kHeader + lines_, {}, "rest.png", "5x65"), "--grid: '5x65' must be COLUMNSxROWS");
  EXPECT_FALSE(fs::exists(in("m.json")));

  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  expect_refused(estimate(), "has no picture");
  fs::copy(in("grey.png"), in("new/a.png"));
  expect_refused(estimate({}, "4x5"), "rest.png: coloured markers");
  expect_refused(estimate({"--compliance", in("rest.png")}), "rest.png");
  sensors::save(sensors::fixtures::half_space_markers(4, 4, 3.0), folder_.path() / "four.compliance");
  expect_refused(estimate({"--compliance", in("four.compliance")}),
                 "a grid of 4 x 4 markers, the pictures are of 5 x 5");
  sensors::MarkerCompliance wide = sensors::fixtures::half_space_markers(kSide, 4, 3.0);
  for (Eigen::Vector3d& place : wide.marker_rest) place *= 1.5;
  sensors::save(wide, folder_.path() / "wide.compliance");
  expect_refused(estimate({"--compliance", in("wide.compliance")}), "4.500 mm apart, the model's 3.000 mm");
}

TEST_F(ChromaCommands, AGreyFrameIsNamed) {
  ASSERT_EQ(calibrate(kHeader + lines_).exit_code, 0);
  fs::copy(in("grey.png"), in("new/a.png"));
  const ProgramRun run = estimate();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("new/a.png: coloured markers: the picture has 1 channels"));
  EXPECT_FALSE(fs::exists(in("out/displacements.csv")));
}

}  // namespace
}  // namespace touchstone
