// Height maps to materials and to places on a map, by the built program. The maps are drawn by formulas.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "sim/files/image_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/touch_map/drawn_relief.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::PlanarPose;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPitch_mm = 0.05;

class SurfaceCommands : public ::testing::Test {
 protected:
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const cv::Mat& heights) const {
    fs::create_directories((folder_.path() / name).parent_path());
    sim::write_exr(folder_.path() / name, heights, {"height_mm"});
  }
  void expect_refused(const std::vector<std::string>& words, const std::string& part) const {
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad")));
  }

  test::TemporaryFolder folder_;
};

/// A weave of this many mm from thread to thread, turned and shifted, with noise.
cv::Mat weave(double period_mm, int number) {
  RandomStream random(static_cast<std::uint64_t>(number), 0, Purpose::kTest);
  const Eigen::Rotation2Dd turn(6.28 * random.uniform());
  const Eigen::Vector2d shift(random.uniform(), random.uniform());
  cv::Mat heights(180, 240, CV_32FC1);
  for (int v = 0; v < heights.rows; ++v) {
    for (int u = 0; u < heights.cols; ++u) {
      const Eigen::Vector2d place = turn * Eigen::Vector2d(kPitch_mm * u, kPitch_mm * v) + shift;
      const Eigen::Vector2d wave = (2.0 * kPi / period_mm * place).array().sin();
      heights.at<float>(v, u) = static_cast<float>(0.3 + 0.02 * wave.x() * wave.y() + 0.002 * random.normal());
    }
  }
  return heights;
}

class TextureCommands : public SurfaceCommands {
 protected:
  TextureCommands() {
    std::string labels = "file,material\n";
    for (const auto& [name, period_mm] : {std::pair{"linen", 0.6}, {"denim", 1.1}, {"silk", 0.35}}) {
      for (int i = 0; i < 4; ++i) {
        const std::string file = fmt::format("{}-{}.exr", name, i);
        write("known/" + file, weave(period_mm, 10 * i + static_cast<int>(100 * period_mm)));
        labels += fmt::format("{},{}\n", file, name);
      }
      for (int i = 0; i < 2; ++i) {
        write(fmt::format("new/{}-{}.exr", name, i), weave(period_mm, 1000 + i + static_cast<int>(100 * period_mm)));
      }
    }
    folder_.write("labels.csv", labels);
  }
  std::vector<std::string> calibration(const std::string& out) const {
    return {"calibrate",      "texture",     "--maps", in("known"),      "--mm-per-px", "0.05", "--labels",
            in("labels.csv"), "--square-px", "80",     "--grey-step-mm", "0.004",       "-o",   in(out)};
  }
};

TEST_F(TextureCommands, KnownMaterialsNameOthers) {
  const auto made = run_program(calibration("model.texture"));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("3 materials, 72 samples of 12 height maps"),
                              HasSubstr("of 12 maps that were left out in turn 12 are named right (100.0 %)")));
  write("new/flat.exr", cv::Mat(180, 240, CV_32FC1, cv::Scalar(0.3)));
  folder_.write("new/torn.exr", "no picture");
  const auto run = run_program({"estimate", "texture", "--model", in("model.texture"), "--maps", in("new"),
                                "--mm-per-px", "0.05", "--square-px", "80", "-o", in("materials.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("materials of 7 height maps"));
  EXPECT_THAT(run.err, HasSubstr("torn.exr"));
  const auto rows = test::csv_table(folder_.path() / "materials.csv");
  ASSERT_EQ(rows.size(), 8U);
  double farthest = 0.0;
  for (const auto& row : rows) {
    const std::string file = row.at("file"), name = file.substr(0, file.find('-'));
    if (file == "torn.exr") {
      EXPECT_EQ(row.at("material") + row.at("distance"), "");
      EXPECT_THAT(row.at("fault"), HasSubstr("torn.exr"));
    } else if (file == "flat.exr") {
      EXPECT_GT(std::stod(row.at("distance")), 2.0 * farthest) << "it's none of the three";
    } else {
      EXPECT_EQ(row.at("material"), name);
      EXPECT_EQ(row.at("squares"), "6");
      farthest = std::max(farthest, std::stod(row.at("distance")));
      EXPECT_GE(std::stoi(row.at("agreeing")), 4);
    }
  }
}

TEST_F(TextureCommands, WhatCantBeUsedIsRefusedByName) {
  std::vector<std::string> words = calibration("bad");
  const auto with = [&](std::size_t at, const std::string& value) {
    std::vector<std::string> changed = words;
    changed[at] = value;
    return changed;
  };
  expect_refused(with(3, in("none")), "none: isn't a folder");
  expect_refused(with(7, in("none.csv")), "none.csv");
  expect_refused(with(5, "0"), "--mm-per-px");
  expect_refused(with(9, "200"), "240 x 180 px doesn't hold a square of 200 px");
  expect_refused(with(9, "10"), "10");
  folder_.write("header.csv", "file,name\na.exr,b\n");
  expect_refused(with(7, in("header.csv")), "header.csv:1: the first line is 'file,name'");
  folder_.write("gone.csv", "file,material\nlinen-0.exr,linen\ngone.exr,linen\n");
  expect_refused(with(7, in("gone.csv")), "gone.csv:3: file: ");
  folder_.write("blank.csv", "file,material\nlinen-0.exr,\n");
  expect_refused(with(7, in("blank.csv")), "blank.csv:2: material: is empty");
  words.erase(words.begin() + 2, words.begin() + 4);
  expect_refused(words, "give either --frames SOURCE or --maps DIR");

  ASSERT_EQ(run_program(calibration("model.texture")).exit_code, 0);
  const auto estimation = [&](const std::string& model, const std::string& maps, const std::string& pitch,
                              const std::string& part) {
    expect_refused({"estimate", "texture", "--model", in(model), "--maps", in(maps), "--mm-per-px", pitch,
                    "--square-px", "80", "-o", in("bad")},
                   part);
  };
  estimation("model.texture", "new", "0.06", "0.06");
  estimation("labels.csv", "new", "0.05", "labels.csv");
  const std::string bytes = read_whole_file(folder_.path() / "model.texture");
  folder_.write("short.texture", bytes.substr(0, bytes.size() - 1));
  estimation("short.texture", "new", "0.05", "short.texture");
  sim::write_exr(folder_.path() / "other.exr", cv::Mat(80, 80, CV_32FC1, cv::Scalar(0.1)), {"depth_mm"});
  fs::create_directories(folder_.path() / "odd");
  fs::rename(folder_.path() / "other.exr", folder_.path() / "odd/other.exr");
  estimation("model.texture", "odd", "0.05", "other.exr: has no channel 'height_mm'");
  cv::Mat bad = weave(0.6, 1);
  bad.at<float>(3, 4) = std::numeric_limits<float>::quiet_NaN();
  write("nan/0.exr", bad);
  estimation("model.texture", "nan", "0.05", "nan/0.exr: has heights that aren't finite");
}

class PlaceCommands : public SurfaceCommands {
 protected:
  /// A touch of the surface, in its frame.
  void touch(const std::string& name, const PlanarPose& pose, std::uint64_t seed) const {
    write(name, sensors::fixtures::touch_of(relief_, pose, seed).height_mm);
  }
  sensors::fixtures::Surface relief_ = sensors::fixtures::strewn_relief(5);
};

TEST_F(PlaceCommands, TouchesMakeAMapOnWhichOthersAreFound) {
  const PlanarPose root{0.3, {-2.0, 1.0}};
  for (int i = 0; i < 5; ++i) {
    touch(fmt::format("touches/{}.exr", i),
          i == 0 ? root : root * PlanarPose{0.2 * i, {3.0 * std::cos(i), 3.0 * std::sin(i)}},
          static_cast<std::uint64_t>(i));
  }
  folder_.write("touches/9.exr", "no picture");
  const auto made = run_program({"calibrate", "place", "--maps", in("touches"), "--mm-per-px", "0.05", "--table",
                                 in("made.csv"), "--picture", in("map.exr"), "-o", in("coin.map")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("a map of 5 of 6 touches"));
  EXPECT_THAT(made.err, HasSubstr("9.exr"));
  EXPECT_GT(sim::read_exr(folder_.path() / "map.exr").image.cols, 400);
  EXPECT_EQ(test::csv_table(folder_.path() / "made.csv").size(), 6U);

  const std::vector<PlanarPose> truths = {{1.0, {1.0, -0.5}}, {-2.5, {-1.5, 2.0}}};
  for (std::size_t i = 0; i < truths.size(); ++i) touch(fmt::format("new/{}.exr", i), root * truths[i], 100 + i);
  write("new/flat.exr", cv::Mat(240, 320, CV_32FC1, cv::Scalar(0.1)));
  relief_ = sensors::fixtures::strewn_relief(77);
  touch("new/stranger.exr", root, 200);
  const auto run = run_program({"estimate", "place", "--model", in("coin.map"), "--maps", in("new"), "--mm-per-px",
                                "0.05", "-o", in("places.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("the places of 2 of 4 touches"));
  const auto rows = test::csv_table(folder_.path() / "places.csv");
  ASSERT_EQ(rows.size(), 4U);
  for (std::size_t i = 0; i < truths.size(); ++i) {
    EXPECT_EQ(rows[i].at("outcome"), "localised");
    EXPECT_NEAR(std::stod(rows[i].at("x_mm")), truths[i].translation.x(), 0.02);
    EXPECT_NEAR(std::stod(rows[i].at("y_mm")), truths[i].translation.y(), 0.02);
    EXPECT_NEAR(std::stod(rows[i].at("angle_deg")), truths[i].angle / kRadiansPerDegree, 0.1);
    EXPECT_GT(std::stod(rows[i].at("correlation")), 0.9);
  }
  for (const std::size_t i : {std::size_t{2}, std::size_t{3}}) {
    EXPECT_NE(rows[i].at("outcome"), "localised") << rows[i].at("file");
    EXPECT_EQ(rows[i].at("x_mm") + rows[i].at("angle_deg"), "");
  }
}

TEST_F(PlaceCommands, MarksTakeOutABentPicture) {
  // A lens that shows all a tenth larger: without marks the map would be a tenth too large.
  const PlanarPose there{0.2, {1.5, -1.0}};
  touch("touches/0.exr", {}, 1);
  touch("new/0.exr", there, 2);
  std::string marks = "u_px,v_px,x_mm,y_mm\n";
  for (int u = 10; u < 320; u += 30) {
    for (int v = 10; v < 240; v += 30)
      marks += fmt::format("{},{},{},{}\n", u, v, 0.045 * (u - 160), 0.045 * (v - 120));
  }
  folder_.write("marks.csv", marks);
  const std::vector<std::string> common = {"--mm-per-px", "0.05", "--marks", in("marks.csv")};
  std::vector<std::string> words = {"calibrate", "place", "--maps", in("touches"), "-o", in("bent.map")};
  words.insert(words.end(), common.begin(), common.end());
  const auto made = run_program(words);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  words = {"estimate", "place", "--model", in("bent.map"), "--maps", in("new"), "-o", in("places.csv")};
  words.insert(words.end(), common.begin(), common.end());
  const auto run = run_program(words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto rows = test::csv_table(folder_.path() / "places.csv");
  ASSERT_EQ(rows.front().at("outcome"), "localised");
  EXPECT_NEAR(std::stod(rows.front().at("x_mm")), 0.9 * there.translation.x(), 0.02);
  EXPECT_NEAR(std::stod(rows.front().at("y_mm")), 0.9 * there.translation.y(), 0.02);
}

TEST_F(PlaceCommands, WhatCantBeUsedIsRefusedByName) {
  touch("touches/0.exr", {}, 1);
  const auto calibration = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words = {"calibrate", "place", "-o", in("bad")};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(words, part);
  };
  calibration({"--maps", in("touches")}, "--maps needs --mm-per-px MM");
  calibration({"--frames", in("touches")}, "--frames needs --heights MODEL");
  calibration({"--maps", in("touches"), "--frames", in("touches")}, "give either");
  fs::create_directories(in("empty"));
  calibration({"--maps", in("empty"), "--mm-per-px", "0.05"}, "empty: has no height map (.exr)");
  folder_.write("few.csv", "u_px,v_px,x_mm,y_mm\n1,1,0,0\n");
  calibration({"--maps", in("touches"), "--mm-per-px", "0.05", "--marks", in("few.csv")}, "few.csv: ");
  folder_.write("word.csv", "u_px,v_px,x_mm,y_mm\n1,1,0,left\n");
  calibration({"--maps", in("touches"), "--mm-per-px", "0.05", "--marks", in("word.csv")}, "word.csv:2: y_mm: 'left'");
  folder_.write("torn/0.exr", "no picture");
  calibration({"--maps", in("torn"), "--mm-per-px", "0.05"}, "none of 1 frames can be used");

  ASSERT_EQ(run_program({"calibrate", "place", "--maps", in("touches"), "--mm-per-px", "0.05", "-o", in("one.map")})
                .exit_code,
            0);
  const auto estimation = [&](const std::string& model, const std::string& pitch, const std::string& part) {
    expect_refused(
        {"estimate", "place", "--model", in(model), "--maps", in("touches"), "--mm-per-px", pitch, "-o", in("bad")},
        part);
  };
  estimation("none.map", "0.05", "none.map");
  estimation("touches/0.exr", "0.05", "touches/0.exr");
  estimation("one.map", "0.07", "0.07");
  std::string bytes = read_whole_file(folder_.path() / "one.map");
  bytes[bytes.size() - 5] ^= 1;
  folder_.write("changed.map", bytes);
  estimation("changed.map", "0.05", "changed.map");
}

}  // namespace
}  // namespace touchstone
