// Colours and marks of what a clear gel touches, by the built program. Pictures are painted.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/cie_colour.h"
#include "core/whole_file.h"
#include "sim/files/image_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/skin/invented_presses.h"
#include "tests/sensors/skin/painted_card.h"
#include "tests/sensors/skin/painted_skin.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using namespace sensors::fixtures;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kPatchHead = "file,left_px,top_px,width_px,height_px,L,a,b\n";

class SkinCommands : public ::testing::Test {
 protected:
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const cv::Mat& picture) const {
    fs::create_directories((folder_.path() / name).parent_path());
    sim::write_png(folder_.path() / name, picture);
  }
  void expect_refused(const std::vector<std::string>& words, const std::string& part) const {
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad")));
  }

  test::TemporaryFolder folder_;
};

Eigen::Vector3d lab_of(const Eigen::Vector3d& albedo) {
  return lab_from_xyz(xyz_from_linear_srgb(albedo));
}

class ColourCommands : public SkinCommands {
 protected:
  ColourCommands() {
    write("card.png", seen({1, 1, 1}));
    const Eigen::Vector3d colours[] = {{0.7, 0.2, 0.2}, {0.2, 0.6, 0.2}, {0.15, 0.2, 0.7}, {0.3, 0.3, 0.3}};
    std::string table = kPatchHead;
    for (int k = 0; k < 4; ++k) {
      write(fmt::format("charts/{}.png", k), seen(colours[k]));
      const Eigen::Vector3d lab = lab_of(colours[k]);
      table += fmt::format("{}.png,20,20,30,30,{},{},{}\n", k, lab.x(), lab.y(), lab.z());
    }
    folder_.write("patches.csv", table);
  }
  std::vector<std::string> calibration(const std::string& out, const std::string& patches = "patches.csv") const {
    return {"calibrate", "colour",       "--frames",       in("charts"), "--patches", in(patches),
            "--card",    in("card.png"), "--smoothing-px", "2",          "-o",        in(out)};
  }
};

TEST_F(ColourCommands, KnownPatchesGiveAModelThatReadsOthers) {
  const auto made = run_program(calibration("m.colour"));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("4 patches"), HasSubstr("off by 0."), HasSubstr("left out in turn")));

  const Eigen::Vector3d left(0.5, 0.35, 0.25), right(0.25, 0.4, 0.5);
  const cv::Mat both = seen_card([&](const cv::Point& place) { return place.x < 80 ? left : right; });
  write("new/1.png", both);
  write("new/2-small.png", both(cv::Rect(0, 0, 100, 100)).clone());
  folder_.write("new/3-torn.png", "no picture");
  folder_.write("regions.csv",
                "region,left_px,top_px,width_px,height_px\nleft,10,10,40,60\n\"right, below\",100,60,50,40\n"
                "bead,79,59,3,3\n");
  const auto run = run_program({"estimate", "colour", "--model", in("m.colour"), "--frames", in("new"), "--regions",
                                in("regions.csv"), "-o", in("colours.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 colours in 1 pictures"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("2-small.png"), HasSubstr("3-torn.png")));
  const auto rows = test::csv_table(folder_.path() / "colours.csv");
  ASSERT_EQ(rows.size(), 5U);
  const auto colour = [](const auto& row) {
    return Eigen::Vector3d(std::stod(row.at("L")), std::stod(row.at("a")), std::stod(row.at("b")));
  };
  EXPECT_LT(ciede2000(colour(rows[0]), lab_of(left)), 1.0);
  EXPECT_LT(ciede2000(colour(rows[1]), lab_of(right)), 1.0);
  EXPECT_EQ(rows[0].at("region") + rows[1].at("region"), "left\"right, below\"");
  EXPECT_EQ(rows[0].at("trusted_percent"), "100.0");
  EXPECT_EQ(rows[2].at("L"), "");
  EXPECT_THAT(rows[2].at("fault"), HasSubstr("no pixel of the mask"));
  EXPECT_THAT(rows[3].at("fault"), HasSubstr("2-small.png"));
  EXPECT_THAT(rows[4].at("fault"), HasSubstr("3-torn.png"));

  // The same by a mask, and with sRGB numbers in the table.
  cv::Mat mask(120, 160, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(10, 10, 40, 60)).setTo(7);
  write("mask.png", mask);
  ASSERT_EQ(run_program({"estimate", "colour", "--model", in("m.colour"), "--frames", in("new/1.png"), "--mask",
                         in("mask.png"), "-o", in("masked.csv")})
                .exit_code,
            0);
  const auto masked = test::csv_table(folder_.path() / "masked.csv");
  ASSERT_EQ(masked.size(), 1U);
  EXPECT_EQ(masked[0].at("region"), "7");
  EXPECT_EQ(masked[0].at("L"), rows[0].at("L"));
  std::string srgb = "file,left_px,top_px,width_px,height_px,red,green,blue\n";
  const Eigen::Vector3d colours[] = {{0.7, 0.2, 0.2}, {0.2, 0.6, 0.2}, {0.15, 0.2, 0.7}, {0.3, 0.3, 0.3}};
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d bytes = 255.0 * colours[k].unaryExpr([](double v) { return srgb_from_linear(v); });
    srgb += fmt::format("{}.png,20,20,30,30,{},{},{}\n", k, bytes.x(), bytes.y(), bytes.z());
  }
  folder_.write("srgb.csv", srgb);
  const auto same = run_program(calibration("same.colour", "srgb.csv"));
  EXPECT_EQ(made.out.substr(made.out.find(": 4")), same.out.substr(same.out.find(": 4")));
}

TEST_F(ColourCommands, WhatCantBeUsedIsRefusedByName) {
  const auto patches = [&](const std::string& lines, const std::string& part, const std::string& head = kPatchHead) {
    folder_.write("bad.csv", head + lines);
    expect_refused(calibration("bad", "bad.csv"), part);
  };
  patches("", "bad.csv:1: the first line is 'file'", "file\n");
  patches("", "bad.csv: has no patch");
  patches("no.png,1,1,5,5,50,0,0\n", "bad.csv:2: file: ");
  patches("0.png,1,1,0,5,50,0,0\n", "bad.csv:2: width_px: is 0, it must be at least 1");
  patches("0.png,1,1.5,5,5,50,0,0\n", "bad.csv:2: top_px: '1.5' isn't a whole number");
  patches("0.png,1,1,5,5,101,0,0\n", "bad.csv:2: L: is 101, it must be from 0 to 100");
  patches("0.png,158,1,5,5,50,0,0\n", "bad.csv:2: a rectangle of 5 x 5 px at (158, 1) isn't within");
  patches("0.png,1,1,5,5,50,0,0\n", "1 measured and 1 known patches");
  write("grey.png", cv::Mat(120, 160, CV_8UC1, cv::Scalar(90)));
  std::vector<std::string> words = calibration("bad");
  words[7] = in("grey.png");
  expect_refused(words, "grey.png: isn't a colour picture of 8 bit");
  words[7] = in("charts/none.png");
  expect_refused(words, "none.png");
  ASSERT_EQ(run_program(calibration("m.colour")).exit_code, 0);
  const auto estimation = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> all = {"estimate", "colour",     "--model", in("m.colour"),
                                    "--frames", in("charts"), "-o",      in("bad")};
    all.insert(all.end(), more.begin(), more.end());
    expect_refused(all, part);
  };
  estimation({}, "give either --regions CSV or --mask PICTURE");
  folder_.write("regions.csv", "region,left_px,top_px,width_px,height_px\na,0,0,5,5\na,0,0,5,5\n");
  estimation({"--regions", in("regions.csv")}, "regions.csv:3: region: 'a' stands there twice");
  folder_.write("regions.csv", "region,left_px,top_px,width_px,height_px\na,0,0,161,5\n");
  estimation({"--regions", in("regions.csv")}, "regions.csv:2: a rectangle of 161 x 5");
  estimation({"--mask", in("card.png")}, "card.png: isn't a grey picture");
  write("none.png", cv::Mat(120, 160, CV_8UC1, cv::Scalar(0)));
  estimation({"--mask", in("none.png")}, "none.png: all of it is 0");
  const std::string bytes = read_whole_file(folder_.path() / "m.colour");
  folder_.write("m.colour", bytes.substr(0, bytes.size() - 1));
  estimation({"--mask", in("none.png")}, "m.colour: has");
}

TEST_F(SkinCommands, WhatFadesIsErythemaAndWhatStaysIsPurpura) {
  write("skin/1-before.png", skin_frame(kRedMark, kPurpleMark, 1.0, 1));
  write("skin/2-pressed.png", skin_frame(kEvenSkin, kPurpleMark, 0.7, 2));
  write("skin/3-dark.png", cv::Mat(kSkinHeight, kSkinWidth, CV_8UC3, cv::Scalar::all(0)));
  const auto run = run_program({"estimate", "marks", "--frames", in("skin"), "-o", in("marks.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("marks of 1 pictures: 1 erythema, 1 purpura, 0 unknown"));
  EXPECT_THAT(run.err, HasSubstr("3-dark.png"));
  const auto rows = test::csv_table(folder_.path() / "marks.csv");
  ASSERT_EQ(rows.size(), 3U);
  for (int k = 0; k < 2; ++k) {
    const auto& row = rows[static_cast<std::size_t>(k)];
    const bool left = std::stod(row.at("u_px")) < 160;
    EXPECT_EQ(row.at("file") + row.at("mark"), fmt::format("2-pressed.png{}", k));
    EXPECT_EQ(row.at("kind"), left ? "erythema" : "purpura");
    EXPECT_NEAR(std::stod(row.at("blanched")), left ? 1.0 : 0.0, 0.1);
  }
  EXPECT_THAT(rows[2].at("fault"), HasSubstr("3-dark.png"));
  EXPECT_EQ(rows[2].at("kind"), "");

  // With the picture before named all others are judged; an even skin has no mark.
  write("even/1.png", skin_frame(kEvenSkin, kEvenSkin, 0.7, 3));
  write("even/before.png", skin_frame(kEvenSkin, kEvenSkin, 1.0, 4));
  ASSERT_EQ(run_program({"estimate", "marks", "--frames", in("even/1.png"), "--rest", in("even/before.png"), "-o",
                         in("none.csv")})
                .exit_code,
            0);
  const auto none = test::csv_table(folder_.path() / "none.csv");
  ASSERT_EQ(none.size(), 1U);
  EXPECT_EQ(none[0].at("file") + none[0].at("mark") + none[0].at("fault"), "1.png");
  expect_refused({"estimate", "marks", "--frames", in("even/1.png"), "-o", in("bad")}, "no picture under pressure");
  expect_refused(
      {"estimate", "marks", "--frames", in("skin/3-dark.png"), "--rest", in("even/before.png"), "-o", in("bad")},
      "none of 1 frames can be used");
  expect_refused({"estimate", "marks", "--frames", in("skin"), "--rest", in("no.png"), "-o", in("bad")}, "no.png");
}

/// Readings at a rate that isn't the model's.
std::string forces_csv(int level, int number, double rate_Hz) {
  std::string csv = "t_us,force_N\n";
  const std::vector<double> force_N = invented_press(level, number, rate_Hz);
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    csv += fmt::format("{},{:.5f}\n", 77000 + std::llround(1e6 * static_cast<double>(i) / rate_Hz), force_N[i]);
  }
  return csv;
}

TEST_F(SkinCommands, PressesOfKnownSoftnessNameOthers) {
  const char* levels[] = {"soft", "firm", "hard"};
  std::string table = "forces,softness\n";
  for (int number = 0; number < 8; ++number) {
    for (int level = 0; level < 3; ++level) {
      const std::string file = fmt::format("{}-{}.csv", levels[level], number);
      folder_.write(file, forces_csv(level, number, 250.0));
      table += fmt::format("{},{}\n", file, levels[level]);
    }
  }
  folder_.write("slow.csv", forces_csv(0, 1, 100.0));
  folder_.write("presses.csv", table + "slow.csv,soft\n");
  const auto made = run_program({"calibrate", "softness", "--presses", in("presses.csv"), "--networks", "2",
                                 "--highest-Hz", "60", "-o", in("softness.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("24 presses of 3 levels, 250 forces a second"), HasSubstr("left out in turn")));
  EXPECT_THAT(made.err, HasSubstr("slow.csv: has 100 readings a second, 250 are needed"));
  folder_.write("new-soft.csv", forces_csv(0, 100, 500.0));  // faster: brought to the model's rate
  folder_.write("new-hard.csv", forces_csv(2, 101, 250.0));
  folder_.write("still.csv", "t_us,force_N\n0,0\n4000,0\n8000,0\n");
  const auto run = run_program({"estimate", "softness", in("new-soft.csv"), in("new-hard.csv"), in("still.csv"),
                                "--model", in("softness.json"), "-o", in("softness.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("still.csv"), HasSubstr("nothing was touched")));
  const auto rows = test::csv_table(folder_.path() / "softness.csv");
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].at("file") + rows[0].at("softness"), "new-soft.csvsoft");
  EXPECT_EQ(rows[1].at("file") + rows[1].at("softness"), "new-hard.csvhard");
  EXPECT_GT(std::stod(rows[0].at("probability")), 0.5);
  EXPECT_THAT(rows[2].at("fault"), HasSubstr("nothing was touched"));

  const auto refused = [&](const std::string& lines, const std::string& part) {
    folder_.write("bad.csv", lines);
    expect_refused({"calibrate", "softness", "--presses", in("bad.csv"), "-o", in("bad")}, part);
  };
  refused("forces\n", "bad.csv:1: the first line is 'forces'");
  refused("forces,softness\n", "bad.csv: has no press");
  refused("forces,softness\nnone.csv,soft\n", "bad.csv:2: file: ");
  refused("forces,softness\nslow.csv,\n", "bad.csv:2: softness: is empty");
  refused("forces,softness\nstill.csv,soft\n", "nothing was touched");
  refused("forces,softness\nbad.csv,soft\n", "none of 1 presses can be used");
}

}  // namespace
}  // namespace touchstone
