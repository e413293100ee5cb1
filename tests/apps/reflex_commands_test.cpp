// A fingertip's registers and pictures of dots to models, and others to forces, by the built program. Registers are
// those of formulas, dots are painted.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/random.h"
#include "core/units.h"
#include "sim/files/image_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/reflex/painted_fingertip.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kRegisters = "t_us,dx,dy,squal,maximum,minimum,average";
constexpr const char* kForces = ",force_x_N,force_y_N,force_z_N";
constexpr const char* kPresses = "file,press_mm,force_x_N,force_y_N,force_z_N,lateral_x_mm,lateral_y_mm\n";

class ReflexCommands : public ::testing::Test {
 protected:
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void expect_refused(const std::vector<std::string>& words, const std::string& part) const {
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad")));
  }

  test::TemporaryFolder folder_;
};

struct KnownFrame {
  std::string registers;
  Eigen::Vector3d force_N;
};

/// 600 frames: rest, a press up to some force during which the skin is sheared by 40 counts along `towards_rad` and
/// back, rest. Statistics follow the force as a rendered fingertip's do.
std::vector<KnownFrame> recording(int number, double peak_N, double towards_rad) {
  RandomStream random(static_cast<std::uint64_t>(number), 0, Purpose::kTest);
  std::vector<KnownFrame> frames;
  Eigen::Vector2i sum(0, 0);
  for (int k = 0; k < 600; ++k) {
    const double part = (k - 100) / 400.0;
    const double force_N = part > 0.0 && part < 1.0 ? peak_N * std::sin(kPi * part) : 0.0;
    const double reach = part > 0.2 && part < 0.8 ? 40.0 * (1.0 - std::abs(part - 0.5) / 0.3) : 0.0;
    const Eigen::Vector2i now(static_cast<int>(std::lround(reach * std::cos(towards_rad))),
                              static_cast<int>(std::lround(reach * std::sin(towards_rad))));
    const Eigen::Vector2i step = now - sum;
    sum = now;
    const auto whole = [&](double value) { return std::lround(value + 0.3 * random.normal()); };
    const Eigen::Vector2d shear = (0.01 + 0.002 * force_N) * sum.cast<double>();
    frames.push_back(
        {fmt::format("{},{},{},{},{},{},{:.3f}", 1000 + 667 * k, step.x(), step.y(), whole(90.0 - 4.0 * force_N),
                     whole(36.0 + 2.0 * force_N), whole(6.0 + 0.5 * force_N), 15.0 + 1.5 * force_N),
         {shear.x(), shear.y(), force_N}});
  }
  return frames;
}

std::string table_of(const std::vector<KnownFrame>& frames, bool forces) {
  std::string csv = std::string(kRegisters) + (forces ? kForces : "") + "\n";
  for (const KnownFrame& frame : frames) {
    csv += frame.registers;
    if (forces) csv += fmt::format(",{:.6f},{:.6f},{:.6f}", frame.force_N.x(), frame.force_N.y(), frame.force_N.z());
    csv += "\n";
  }
  return csv;
}

TEST_F(ReflexCommands, RegistersWithForcesGiveAModelThatReadsOthers) {
  std::vector<std::string> words = {"calibrate", "reflex", "-o", in("reflex.json"), "--registers"};
  for (int i = 0; i < 4; ++i) {
    const std::string name = fmt::format("known-{}.csv", i);
    folder_.write(name, table_of(recording(i, 2.0 + i, 0.5 * kPi * (i % 2)), true));
    words.push_back(in(name));
  }
  folder_.write("torn.csv", "no registers");
  words.push_back(in("torn.csv"));
  const auto made = run_program(words);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("2400 frames of 4 recordings"), HasSubstr("a force is present if"),
                              HasSubstr("on recordings left out in turn"), Not(HasSubstr("no shear"))));
  EXPECT_THAT(made.err, HasSubstr("torn.csv:1: the first line is 'no registers'"));

  const std::vector<KnownFrame> other = recording(10, 3.5, 0.25 * kPi);
  std::string blind = table_of(other, false);
  blind += "500000,0,0,0,0,0,0\n500667,0,0,90,36,99,15\n";  // no lamp; a disturbed line
  folder_.write("other.csv", blind);
  folder_.write("checked.csv", table_of(other, true));
  const auto run = run_program({"estimate", "reflex", "--model", in("reflex.json"), "--registers", in("other.csv"),
                                in("torn.csv"), in("checked.csv"), "--stop-above-N", "2", "-o", in("forces.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("torn.csv:1"));
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("602 frames"), HasSubstr("2 frames can't be believed"), HasSubstr("off by 0.0")));
  const auto rows = test::csv_table(folder_.path() / "forces.csv");
  ASSERT_EQ(rows.size(), 602U + 1U + 600U);
  double squares_N2 = 0.0;
  int wrong = 0;
  bool stopped = false;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const auto& row = rows[i];
    EXPECT_EQ(row.at("file") + row.at("fault") + row.at("true_z_N"), "other.csv");
    EXPECT_EQ(row.at("t_us"), std::to_string(1000 + 667 * i));
    const Eigen::Vector3d force(std::stod(row.at("force_x_N")), std::stod(row.at("force_y_N")),
                                std::stod(row.at("force_z_N")));
    squares_N2 += (force - other[i].force_N).squaredNorm();
    wrong += (row.at("force_present") == "1") != (other[i].force_N.z() > 0.02) ? 1 : 0;
    stopped = stopped || force.z() > 2.0;
    EXPECT_EQ(row.at("stop"), stopped ? "1" : "0") << i;
    EXPECT_EQ(rows[603 + i].at("force_z_N"), row.at("force_z_N")) << "each table has a loop of its own";
  }
  EXPECT_LT(std::sqrt(squares_N2 / 600.0), 0.05) << "of forces up to 3.5 N";
  EXPECT_LT(wrong, 12);
  EXPECT_EQ(rows[600].at("fault"), "dark");
  EXPECT_EQ(rows[601].at("fault"), "impossible statistics");
  EXPECT_EQ(rows[601].at("force_z_N") + rows[601].at("force_present"), "");
  EXPECT_THAT(rows[602].at("fault"), HasSubstr("torn.csv:1"));
}

/// Pictures of dots under a press and a shift sideways, with what is known of each. One sequence: every step is small.
class DotPictures : public ReflexCommands {
 protected:
  struct Press {
    double press_mm = 0.0;
    Eigen::Vector2d lateral_mm = Eigen::Vector2d::Zero();
  };
  static double force_N(double press_mm) { return press_mm > 0.0 ? 1.1293 * std::expm1(0.4677 * press_mm) : 0.0; }

  /// Down to each depth, sideways to and fro there, and up again.
  static std::vector<Press> presses(const std::vector<std::pair<double, double>>& depths_and_towards) {
    std::vector<Press> all(3);
    for (const auto& [depth_mm, towards_rad] : depths_and_towards) {
      const Eigen::Vector2d towards(std::cos(towards_rad), std::sin(towards_rad));
      for (double press = 0.25; press < depth_mm; press += 0.25) all.push_back({press});
      for (const double side : {0.0, 0.3, 0.6, 0.9, 0.6, 0.3, 0.0, -0.3, -0.6, -0.3}) {
        all.push_back({depth_mm, side * towards});
      }
      for (double press = depth_mm; press > 0.0; press -= 0.25) all.push_back({press});
      all.push_back({});
    }
    return all;
  }
  cv::Mat picture(const Press& press, int number) const {
    sensors::fixtures::FingertipPainter painter{.spacing_px = 4.3, .radius_px = 1.06, .ground = 3.0, .dot = 36.0};
    painter.noise = 0.3;
    const double dilation = sensors::fixtures::dilation_of(press.press_mm);
    return painter.paint(sensors::DotsMotion{dilation, dilation / 0.47 * press.lateral_mm},
                         static_cast<std::uint64_t>(number));
  }
  /// Writes the pictures, and gives the table's lines.
  std::string write(const std::string& name, const std::vector<Press>& presses, int noise) const {
    fs::create_directories(folder_.path() / name);
    std::string csv = kPresses;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      const std::string file = fmt::format("{:03}.png", i);
      sim::write_png(folder_.path() / name / file, picture(presses[i], noise + static_cast<int>(i)));
      const Eigen::Vector2d& side = presses[i].lateral_mm;
      csv += fmt::format("{},{},{:.5f},{:.5f},{:.5f},{},{}\n", file, presses[i].press_mm, 0.5 * side.x(),
                         0.5 * side.y(), force_N(presses[i].press_mm), side.x(), side.y());
    }
    return csv;
  }
};

TEST_F(DotPictures, KnownPressesGiveAModelThatReadsOthers) {
  folder_.write("presses.csv",
                write("known", presses({{2.0, 0.0}, {4.0, 0.5 * kPi}, {2.5, 0.5 * kPi}, {4.0, 0.0}}), 0));
  const auto made = run_program(
      {"calibrate", "reflex", "--frames", in("known"), "--presses", in("presses.csv"), "-o", in("explore.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("learned from 1"), Not(HasSubstr("no shear"))));

  const std::vector<Press> others = presses({{3.0, 0.25 * kPi}, {3.5, -0.25 * kPi}});
  write("new", others, 1000);
  sim::write_png(folder_.path() / "new/100-dark.png", cv::Mat(18, 18, CV_8UC1, cv::Scalar(0)));
  folder_.write("new/101-torn.png", "no picture");
  const auto run = run_program({"estimate", "reflex", "--model", in("explore.json"), "--frames", in("new"), "--rate",
                                "5", "-o", in("forces.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("100-dark.png: dark: left out"), HasSubstr("101-torn.png")));
  const auto rows = test::csv_table(folder_.path() / "forces.csv");
  ASSERT_EQ(rows.size(), others.size() + 2);
  double press_mm2 = 0.0, force_N2 = 0.0, shear_N2 = 0.0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const auto number = [&](const char* column) { return std::stod(rows[i].at(column)); };
    EXPECT_EQ(rows[i].at("t_us"), std::to_string(200000 * i));
    EXPECT_EQ(rows[i].at("mode"), "absolute");
    press_mm2 += std::pow(number("press_mm") - others[i].press_mm, 2);
    force_N2 += std::pow(number("force_z_N") - force_N(others[i].press_mm), 2);
    shear_N2 += (Eigen::Vector2d(number("force_x_N"), number("force_y_N")) - 0.5 * others[i].lateral_mm).squaredNorm();
  }
  const auto rms = [&](double squares) { return std::sqrt(squares / static_cast<double>(others.size())); };
  // docs/sensors/reflex.md has 0.05 mm and 0.015 N for the rendered fingertip.
  EXPECT_LT(rms(press_mm2), 0.1);
  EXPECT_LT(rms(force_N2), 0.2) << "of forces up to 4.7 N";
  EXPECT_LT(rms(shear_N2), 0.05) << "of shear up to 0.45 N";
  for (const std::size_t k : {others.size(), others.size() + 1}) {
    EXPECT_EQ(rows[k].at("mode"), "held");
    EXPECT_EQ(rows[k].at("press_mm") + rows[k].at("force_z_N"), "");
    EXPECT_NE(rows[k].at("fault"), "");
  }
  // The same, with the rest picture named, and with pixels that came one after the other: nothing moved within them.
  const auto skewed = run_program({"estimate", "reflex", "--model", in("explore.json"), "--frames", in("new"), "--rate",
                                   "0.1", "--rest", in("known/000.png"), in("known/001.png"), "--pixel-rate", "1500",
                                   "--count", "12", "-o", in("skewed.csv")});
  ASSERT_EQ(skewed.exit_code, 0) << skewed.err;
  EXPECT_NEAR(std::stod(test::csv_table(folder_.path() / "skewed.csv")[8].at("press_mm")), others[8].press_mm, 0.3);
}

TEST_F(DotPictures, WhatCantBeUsedIsRefusedByName) {
  const std::string row = "1,0,0,90,36,6,15.0", forces = std::string(kRegisters) + kForces + "\n";
  const auto registers = [&](const std::string& table, const std::string& part) {
    folder_.write("table.csv", table);
    expect_refused({"calibrate", "reflex", "--registers", in("table.csv"), "-o", in("bad")}, part);
  };
  registers("t_us,dx\n", "table.csv:1: the first line is 't_us,dx'; it must be one of 't_us,dx,dy,squal");
  registers(forces, "table.csv: has no frame");
  registers(std::string(kRegisters) + "\n" + row + "\n", "table.csv:1: there are no forces to learn from");
  registers(forces + row + ",0,0\n", "table.csv:2: has 9 cells");
  registers(forces + row + ",0,0,x\n", "table.csv:2: force_z_N: 'x' isn't a finite number");
  registers(forces + row + ",,0,1\n", "table.csv:2: force_x_N: ''");
  registers(forces + row + ",,,1\n" + row + ",,,1\n", "table.csv:3: t_us: 1 isn't after the line before's, 1");
  registers(forces + row + ",,,1\n2" + row.substr(1) + ",0,0,1\n", "table.csv:3: force_x_N, force_y_N: are given");
  registers(forces + "1,0,0.5,90,36,6,15.0,,,1\n", "table.csv:2: dy: '0.5' isn't a whole number");
  registers(forces + row + ",,,1\n", "1 samples with a force and 0 without");
  folder_.write("one.csv", write("frames", {{}, {1.0}, {2.0}}, 0));
  expect_refused({"calibrate", "reflex", "-o", in("bad")}, "give either --registers CSV or --frames SOURCE");
  expect_refused({"calibrate", "reflex", "--frames", in("frames"), "-o", in("bad")}, "--frames needs --presses");
  expect_refused({"calibrate", "reflex", "--frames", in("frames"), "--presses", in("one.csv"), "-o", in("bad")},
                 "3 samples, at least 9 are needed");
  const auto presses = [&](const std::string& lines, const std::string& part) {
    folder_.write("presses.csv", kPresses + lines);
    expect_refused({"calibrate", "reflex", "--frames", in("frames"), "--presses", in("presses.csv"), "-o", in("bad")},
                   part);
  };
  presses("", "presses.csv: has no picture");
  presses("000.png,0,,,0,,\nno.png,0,,,0,,\n", "presses.csv:3: file: there is no picture 'no.png'");
  presses("000.png,0,,,0,,\n000.png,0,,,0,,\n", "presses.csv:3: file: '000.png' stands in line 2, too");
  presses("000.png,deep,,,0,,\n", "presses.csv:2: press_mm: 'deep'");
  folder_.write("model.json", "{}");
  expect_refused({"estimate", "reflex", "--model", in("model.json"), "--frames", in("frames"), "-o", in("bad")},
                 "model.json");
  folder_.write("table.csv", std::string(kRegisters) + "\n" + row + "\n");
  expect_refused({"estimate", "reflex", "--model", in("model.json"), "--registers", in("table.csv"), "-o", in("bad")},
                 "model.json");
  expect_refused({"estimate", "reflex", "--model", in("model.json"), "--registers", in("table.csv"), "--rest",
                  in("frames/000.png"), "-o", in("bad")},
                 "--rest and --pixel-rate are for --frames");
}

}  // namespace
}  // namespace touchstone
