// Frames with known forces to a force model, and other frames to forces, by the built program. The frames are painted,
// and their forces are those of a formula: 0.2 N for a mm^3 of the dent, 10 N for a mm that the
// markers go.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "sensors/heights/height_model_file.h"
#include "sensors/markers/linear_force.h"
#include "sim/files/image_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/markers/painted_marked_gel.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::fixtures::Relief;
using test::csv_table;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

struct PaintedTouch {
  double contact_mm = 0.0;  ///< 0: untouched
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
};

class TouchCommands : public ::testing::Test {
 protected:
  TouchCommands() {
    save(sensors::small_height_model(gel_.painter), folder_.path() / "gel.model");
    write("train", {{0.0}, {1.3}, {1.6}, {1.9}, {2.2}, {2.2, {1, 0}}, {2.2, {2, 1}}, {2.2, {1, 2}}, {2.2, {-1, 2}}});
    write("other", {{0.0}, {1.8}, {2.0, {1.5, 1.5}}, {2.6}});
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }

  Eigen::Vector3d force_of(const PaintedTouch& touch) {
    const double volume = touch.contact_mm > 0.0
                              ? sensors::height_sum_mm3(gel_.painter.heights(field(touch)), sensors::kGelScale_mm)
                              : 0.0;
    return {-10.0 * sensors::kGelScale_mm * touch.shift_px.x(), -10.0 * sensors::kGelScale_mm * touch.shift_px.y(),
            0.2 * volume};
  }
  static sensors::fixtures::Field field(const PaintedTouch& touch) {
    if (touch.contact_mm == 0.0) return [](const Eigen::Vector2d&) { return Relief{}; };
    const sensors::fixtures::Ball ball{sensors::kGelScale_mm * Eigen::Vector2d(120, 90), 6.0, touch.contact_mm};
    return [ball](const Eigen::Vector2d& place) { return ball.at(place); };
  }
  /// A folder of frames, and NAME.csv with their forces.
  void write(const std::string& name, const std::vector<PaintedTouch>& touches) {
    fs::create_directories(folder_.path() / name);
    std::string csv = "file,t_us,force_x_N,force_y_N,force_z_N\n";
    for (std::size_t i = 0; i < touches.size(); ++i) {
      sensors::MarkedGel moved = gel_;
      for (Eigen::Vector2d& place : moved.markers) place += touches[i].shift_px;
      moved.ink = sensors::fixtures::paint_markers(
          {.width = sensors::kGelWidth, .height = sensors::kGelHeight, .brightness = 255, .shading = 0}, moved.markers);
      sim::write_png(folder_.path() / name / fmt::format("{}.png", i), moved.frame(field(touches[i])));
      const Eigen::Vector3d force = force_of(touches[i]);
      csv += fmt::format("{}.png,{},{},{},{}\n", i, 40000 * i, force.x(), force.y(), force.z());
    }
    folder_.write(name + ".csv", csv);
  }
  test::ProgramRun calibrate(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"calibrate", "markers",       in("train"), "--forces",      in("train.csv"),
                                      "--heights", in("gel.model"), "-o",        in("force.json")};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }

  test::TemporaryFolder folder_;
  sensors::MarkedGel gel_;
};

TEST_F(TouchCommands, KnownForcesGiveAModelThatReadsOthers) {
  const auto made = calibrate({"--indenter", "ball 12 mm"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("forces of 8 frames in contact, of 9"), HasSubstr("normal force: "),
                              HasSubstr("shear force: ")));
  const auto run = run_program({"estimate", "markers", in("other"), "--forces", in("other.csv"), "--heights",
                                in("gel.model"), "--force", in("force.json"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("markers.csv and touch.csv of 4 frames"), HasSubstr("touched in 3 frames"),
                             HasSubstr("in 1 the force is beyond what the model was fitted to"),
                             HasSubstr("within two standard errors")));
  const auto rows = csv_table(folder_.path() / "out/touch.csv");
  ASSERT_EQ(rows.size(), 4U);
  const std::vector<PaintedTouch> touches = {{0.0}, {1.8}, {2.0, {1.5, 1.5}}, {2.6}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto number = [&](const char* name) { return std::stod(rows[i].at(name)); };
    const Eigen::Vector3d force = force_of(touches[i]);
    EXPECT_EQ(rows[i].at("touched"), i == 0 ? "0" : "1");
    EXPECT_EQ(rows[i].at("t_us"), std::to_string(40000 * i));
    EXPECT_EQ(rows[i].at("extrapolated"), i == 3 ? "1" : "0");
    EXPECT_EQ(rows[i].at("trusted") + rows[i].at("status"), "1normal");
    EXPECT_NEAR(number("force_x_N"), force.x(), 0.05);  // 0.1 px
    EXPECT_NEAR(number("force_y_N"), force.y(), 0.05);
    EXPECT_NEAR(number("force_z_N"), force.z(), 0.1 * force.z());
    EXPECT_NEAR(number("true_x_N"), force.x(), 1e-5);
    EXPECT_NEAR(number("true_z_N"), force.z(), 1e-5);
    EXPECT_GT(number("sigma_force_x_N"), 0.0);
    EXPECT_GT(number("sigma_force_z_N"), 0.0);
    if (i == 0) {
      EXPECT_EQ(rows[i].at("slip"), "no contact");
      continue;
    }
    EXPECT_NEAR(number("u_px"), 120.0, 3.0);
    EXPECT_NEAR(number("v_px"), 90.0, 3.0);
    EXPECT_NEAR(number("moved_u_px"), touches[i].shift_px.x(), 0.1);
    EXPECT_LT(std::abs(number("turn_deg")), 1.0);
    EXPECT_GT(number("highest_mm"), 0.1);
  }
}

TEST_F(TouchCommands, TablesGoIntoOneHdf5FileWithUnits) {
  ASSERT_EQ(run_program({"estimate", "markers", in("other"), "--touch", "-o", in("out")}).exit_code, 0);
  const auto run = run_program({"export", "tables", in("out"), "-o", in("out.h5")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("touch (32 columns, 4 lines)"));
  {
    const Hdf5Reader file(folder_.path() / "out.h5");
    const auto rows = csv_table(folder_.path() / "out/touch.csv");
    const std::vector<double> u_px = file.read<double>("/touch/u_px").values;
    const std::vector<std::string> slip = file.read_texts("/touch/slip");
    ASSERT_EQ(u_px.size(), rows.size());
    EXPECT_TRUE(std::isnan(u_px[0])) << "nothing touches";
    EXPECT_EQ(u_px[2], std::stod(rows[2].at("u_px")));
    EXPECT_EQ(slip[2], rows[2].at("slip"));
    EXPECT_EQ(file.read_texts("/touch/file")[3], "3.png");
    EXPECT_EQ(file.text_attribute("/touch/u_px", "unit"), "px");
    EXPECT_EQ(file.text_attribute("/touch/lag", "unit"), "1");
    EXPECT_TRUE(std::isnan(file.read<double>("/touch/true_x_N").values[1])) << "an empty column is one of numbers";
    EXPECT_EQ(file.extents("/markers/dx_px")[0],
              static_cast<std::int64_t>(csv_table(folder_.path() / "out/markers.csv").size()));
  }
  ASSERT_EQ(run_program({"export", "tables", in("out"), "-o", in("again.h5")}).exit_code, 0);
  EXPECT_EQ(read_whole_file(folder_.path() / "again.h5"), read_whole_file(folder_.path() / "out.h5"));
  folder_.write("odd/a.csv", "file,x/y_N\n0.png,1\n");
  const auto odd = run_program({"export", "tables", in("odd"), "-o", in("odd.h5")});
  EXPECT_EQ(odd.exit_code, 2);
  EXPECT_THAT(odd.err, AllOf(HasSubstr("odd/a.csv"), HasSubstr("'x/y_N' can't be a name in HDF5")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "odd.h5"));
}

TEST_F(TouchCommands, WithoutHeightsShearContactAndSlipAreRead) {
  const auto made = run_program({"calibrate", "markers", in("train"), "--forces", in("train.csv"), "--mm-per-px",
                                 "0.053", "-o", in("force.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto run = run_program({"estimate", "markers", in("other"), "--force", in("force.json"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto rows = csv_table(folder_.path() / "out/touch.csv");
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[2].at("force_z_N") + rows[2].at("sigma_force_z_N") + rows[2].at("highest_mm") + rows[2].at("t_us"),
            "");
  EXPECT_NEAR(std::stod(rows[2].at("force_x_N")), -10.0 * 0.053 * 1.5, 0.05);
  EXPECT_EQ(rows[2].at("force_ratio") + rows[2].at("ratios_slip"), "");

  const auto bare = run_program({"estimate", "markers", in("other"), "--touch", "-o", in("bare")});
  ASSERT_EQ(bare.exit_code, 0) << bare.err;
  const auto seen = csv_table(folder_.path() / "bare/touch.csv");
  EXPECT_EQ(seen[2].at("force_x_N") + seen[2].at("extrapolated"), "");
  EXPECT_EQ(seen[2].at("moved_u_px"), rows[2].at("moved_u_px"));
  EXPECT_EQ(read_whole_file(folder_.path() / "bare/markers.csv"), read_whole_file(folder_.path() / "out/markers.csv"));
}

TEST_F(TouchCommands, ADamagedFrameIsLeftOutAloneAndNamed) {
  folder_.write("other/1.png", "no picture");
  folder_.write("train/4.png", "no picture");
  const auto made = calibrate();
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr("train/4.png"));
  EXPECT_THAT(made.out, HasSubstr("forces of 7 frames in contact, of 8"));
  const auto run = run_program(
      {"estimate", "markers", in("other"), "--heights", in("gel.model"), "--force", in("force.json"), "-o", in("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto rows = csv_table(folder_.path() / "out/touch.csv");
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[1].at("force_z_N") + rows[1].at("slip") + rows[1].at("touched"), "");
  EXPECT_EQ(rows[1].at("trusted"), "0");
  EXPECT_THAT(rows[1].at("status"), HasSubstr("1.png"));
  EXPECT_EQ(rows[2].at("trusted"), "1");
}

TEST_F(TouchCommands, WhatDoesntFitTogetherIsRefusedByName) {
  const auto calibration = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words = {"calibrate", "markers", in("train"), "-o", in("bad.json")};
    words.insert(words.end(), more.begin(), more.end());
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad.json")));
  };
  calibration({"--forces", in("train.csv")}, "--heights MODEL or --mm-per-px MM is needed");
  calibration({"--mm-per-px", "0.053"}, "0.png: its force isn't known");
  calibration({"--forces", in("none.csv"), "--mm-per-px", "0.053"}, "none.csv");
  calibration({"--forces", in("train.csv"), "--mm-per-px", "-1"}, "--mm-per-px");
  calibration({"--forces", in("train.csv"), "--heights", in("train.csv")}, "train.csv");
  calibration({"--forces", in("train.csv"), "--mm-per-px", "0.053", "--rest", in("none.png")}, "none.png");
  calibration({"--forces", in("train.csv"), "--rate", "25", "--mm-per-px", "0.053"}, "--rate");
  folder_.write("short.csv", "file,t_us,force_x_N,force_y_N\n0.png,0,0,0\n");
  calibration({"--forces", in("short.csv"), "--mm-per-px", "0.053"}, "short.csv:1: ");
  folder_.write("text.csv", "file,t_us,force_x_N,force_y_N,force_z_N\n0.png,0,0,0,0\n1.png,1,0,heavy,0\n");
  calibration({"--forces", in("text.csv"), "--mm-per-px", "0.053"}, "text.csv:3: force_y_N: 'heavy'");
  // Forces along other axes than the picture's: y up instead of down, and x and y exchanged.
  folder_.write("axes.csv",
                "file,t_us,force_x_N,force_y_N,force_z_N\n0.png,0,0,0,0\n5.png,1,0,0.16,1\n6.png,2,-0.16,0.32,1\n"
                "7.png,3,-0.32,0.16,1\n");
  calibration({"--forces", in("axes.csv"), "--mm-per-px", "0.053"}, "x must point to the picture's right and y down");

  ASSERT_EQ(calibrate({"--indenter", "ball"}).exit_code, 0);
  const auto estimation = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words = {"estimate", "markers", in("other"), "-o", in("bad")};
    words.insert(words.end(), more.begin(), more.end());
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad")));
  };
  estimation({"--force", in("none.json")}, "none.json");
  estimation({"--force", in("gel.model")}, "gel.model");
  estimation({"--indenter", "ball"}, "--indenter");
  estimation({"--force", in("force.json"), "--mm-per-px", "0.06"}, "0.053 mm a pixel, these pictures have 0.06");
  estimation({"--force", in("force.json"), "--heights", in("gel.model"), "--indenter", "bal"}, "did you mean 'ball'");
  folder_.write("changed.json", [&] {
    std::string text = read_whole_file(folder_.path() / "force.json");
    return text.replace(text.find("\"samples\": "), 11, "\"samples\": -");
  }());
  estimation({"--force", in("changed.json")}, "changed.json");
  fs::create_directories(in("grey"));
  cv::Mat grey;
  cv::extractChannel(sim::read_image(folder_.path() / "other/0.png"), grey, 1);
  sim::write_png(folder_.path() / "grey/0.png", grey);
  test::expect_refused(run_program({"estimate", "markers", in("grey"), "--heights", in("gel.model"), "-o", in("bad")}),
                       "grey/0.png: the gel at rest: is grey");
}

}  // namespace
}  // namespace touchstone
