// Grasps on disk to models of force and material, and other grasps to forces and materials, by the built program.
// Counts and forces are those of formulas (tests/sensors/events/synthetic_grasps.h).

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/apps/csv_table.h"
#include "tests/apps/run_program.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using sensors::SyntheticGrasp;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kStart_us = 123456;  // a camera's clock begins anywhere

class EventCommands : public ::testing::Test {
 protected:
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }
  void write_events(const std::string& name, const SyntheticGrasp& grasp) const {
    sensors::EventWriter writer(folder_.path() / name, {32, 24}, "test");
    writer.append(sensors::events_of(grasp, kStart_us));
    writer.close();
  }
  /// Readings each 5 ms: their times are none of the windows'.
  void write_forces(const std::string& name, const SyntheticGrasp& grasp) const {
    std::string csv = "t_us,force_N\n";
    const std::int64_t end_us = 7000 * static_cast<std::int64_t>(grasp.windows.size());
    for (std::int64_t t_us = 0; t_us < end_us; t_us += 5000) {
      // Means of windows, from middle to middle.
      const double window = std::max(0.0, static_cast<double>(t_us) / 7000.0 - 0.5);
      const auto before = std::min<Eigen::Index>(static_cast<Eigen::Index>(window), grasp.force_N.size() - 2);
      const double part = window - static_cast<double>(before);
      csv += fmt::format("{},{}\n", kStart_us + t_us,
                         (1.0 - part) * grasp.force_N[before] + part * grasp.force_N[before + 1]);
    }
    folder_.write(name, csv);
  }
  void expect_refused(const std::vector<std::string>& words, const std::string& part) const {
    test::expect_refused(run_program(words), part);
    EXPECT_FALSE(fs::exists(in("bad")));
  }

  test::TemporaryFolder folder_;
};

TEST_F(EventCommands, GraspsWithForcesGiveAModelThatReadsOthers) {
  const char* endings[] = {"h5", "txt", "raw", "aedat4"};
  std::string table = "events,forces,material\n";
  for (int i = 0; i < 24; ++i) {
    const SyntheticGrasp grasp = sensors::synthetic_grasp(i, 1);
    const std::string events = fmt::format("grasp-{}.{}", i, endings[i % 4]);
    write_events(events, grasp);
    write_forces(fmt::format("force-{}.csv", i), grasp);
    table += fmt::format("{},force-{}.csv,\n", events, i);
  }
  folder_.write("torn.h5", "no events");
  table += "torn.h5,force-0.csv,\n";
  folder_.write("grasps.csv", table);
  const auto made = run_program(
      {"calibrate", "event-force", "--grasps", in("grasps.csv"), "--size", "32x24", "-o", in("force.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("learnt from 1056 windows of 24 grasps"),
                              HasSubstr("forces of 12 grasps that were left out in turn are off by 0.")));
  EXPECT_THAT(made.err, HasSubstr("torn.h5"));

  // Damaged behind the first portion of 65536 events.
  write_events("whole.txt", sensors::synthetic_grasp(101, 1, 400.0));
  const std::string whole = read_whole_file(folder_.path() / "whole.txt");
  folder_.write("half.txt", whole.substr(0, whole.size() * 3 / 4) + "x\n");
  std::vector<std::string> words = {"estimate",       "event-force", in("half.txt"), in("torn.h5"), "--model",
                                    in("force.json"), "--size",      "32x24",        "-o",          in("out")};
  for (int i = 100; i < 120; ++i) {
    write_events(fmt::format("other-{}.h5", i), sensors::synthetic_grasp(i, 1));
    words.push_back(in(fmt::format("other-{}.h5", i)));
  }
  const auto run = run_program(words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("half.txt"), HasSubstr("windows before that are kept"), HasSubstr("torn.h5"),
                             HasSubstr("left out")));
  EXPECT_GT(test::csv_table(folder_.path() / "out/half.csv").size(), 5U);
  EXPECT_FALSE(fs::exists(in("out/torn.csv")));
  double squares = 0.0;
  int within = 0, counted = 0;
  for (int number = 100; number < 120; ++number) {
    const SyntheticGrasp other = sensors::synthetic_grasp(number, 1);
    const auto rows = test::csv_table(folder_.path() / fmt::format("out/other-{}.csv", number));
    ASSERT_NEAR(static_cast<double>(rows.size()), static_cast<double>(other.windows.size()), 1.0);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(rows[i].at("t_us"), std::to_string(kStart_us + 7000 * (static_cast<std::int64_t>(i) + 1)));
      EXPECT_EQ(rows[i].at("off"), std::to_string(other.windows[i].off));
      EXPECT_EQ(rows[i].at("touched"), static_cast<int>(i) >= other.first_touch ? "1" : "0") << i;
      if (rows[i].at("touched") == "0") {
        EXPECT_EQ(rows[i].at("force_N") + rows[i].at("sigma_force_N"), "0");
        continue;
      }
      if (static_cast<int>(i) >= other.first_touch + 22) continue;  // the hold isn't trained on
      const double off = std::stod(rows[i].at("force_N")) - other.force_N[static_cast<Eigen::Index>(i)];
      squares += off * off;
      within += std::abs(off) <= 2.0 * std::stod(rows[i].at("sigma_force_N")) ? 1 : 0;
      ++counted;
    }
  }
  ASSERT_EQ(counted, 440);
  EXPECT_LT(std::sqrt(squares / counted), 0.2) << "of forces up to some 3 N";
  // Windows of one grasp err alike: these are 20 independent errors, judged by those of 12.
  EXPECT_GE(within, 0.7 * counted);

  const auto network =
      run_program({"calibrate", "event-force", "--grasps", in("grasps.csv"), "--size", "32x24", "--method", "network",
                   "--hidden-layers", "1", "--units", "6", "--left-out", "2", "-o", in("network.json")});
  ASSERT_EQ(network.exit_code, 0) << network.err;
  ASSERT_EQ(run_program({"estimate", "event-force", in("other-100.h5"), "--model", in("network.json"), "-o", in("net")})
                .exit_code,
            0);
  EXPECT_GT(std::stod(test::csv_table(folder_.path() / "net/other-100.csv")[40].at("sigma_force_N")), 0.0);
}

TEST_F(EventCommands, GraspsOfKnownPiecesNameOthers) {
  // The softest and the hardest of the formula's: the four are near each other.
  const auto material = [](int i) { return 3 * (i % 2); };
  const char* names[] = {"foam", "steel"};
  std::string table = "events,forces,material\n";
  for (int i = 0; i < 24; ++i) {
    write_events(fmt::format("grasp-{}.h5", i), sensors::synthetic_grasp(i, material(i)));
    table += fmt::format("grasp-{}.h5,,{}\n", i, names[i % 2]);
  }
  folder_.write("grasps.csv", table);
  const auto made =
      run_program({"calibrate", "event-material", "--grasps", in("grasps.csv"), "-o", in("material.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("24 grasps of 2 materials"));
  std::vector<std::string> words = {"estimate", "event-material", "--model", in("material.json"), "-o", in("out.csv")};
  for (int i = 100; i < 108; ++i) {
    write_events(fmt::format("new-{}.h5", i), sensors::synthetic_grasp(i, material(i)));
    words.push_back(in(fmt::format("new-{}.h5", i)));
  }
  SyntheticGrasp still = sensors::synthetic_grasp(1, 1);
  still.windows.assign(180, {20, 20});
  write_events("still.h5", still);
  words.push_back(in("still.h5"));
  const auto run = run_program(words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("still.h5"), HasSubstr("there is no touch")));
  const auto rows = test::csv_table(folder_.path() / "out.csv");
  ASSERT_EQ(rows.size(), 9U);
  int right = 0;
  for (int i = 0; i < 8; ++i) {
    right += rows[static_cast<std::size_t>(i)].at("material") == names[(100 + i) % 2] ? 1 : 0;
    EXPECT_GT(std::stod(rows[static_cast<std::size_t>(i)].at("probability")), 0.5);
  }
  EXPECT_GE(right, 7) << "by chance that is once in 28";
  EXPECT_THAT(rows[8].at("fault"), HasSubstr("there is no touch"));
}

TEST_F(EventCommands, WhatCantBeUsedIsRefusedByName) {
  const SyntheticGrasp grasp = sensors::synthetic_grasp(1, 1);
  write_events("a.txt", grasp);
  write_forces("a.csv", grasp);
  const auto calibration = [&](const std::string& table, const std::string& part) {
    folder_.write("grasps.csv", table);
    expect_refused({"calibrate", "event-force", "--grasps", in("grasps.csv"), "--size", "32x24", "-o", in("bad")},
                   part);
  };
  calibration("events,force\n", "grasps.csv:1: the first line is 'events,force'");
  calibration("events,forces,material\n", "has no grasp");
  calibration("events,forces,material\nb.txt,a.csv,\n", "grasps.csv:2: file: ");
  calibration("events,forces,material\na.txt,b.csv,\n", "grasps.csv:2: forces: ");
  calibration("events,forces,material\na.txt,,\n", "grasps.csv:2: forces: is empty");
  calibration("events,forces,material\na.txt,a.csv,\n", "1 grasps can be used; at least 3 are needed");
  folder_.write("order.csv", "t_us,force_N\n5,1\n5,1\n");
  calibration("events,forces,material\na.txt,order.csv,\n", "order.csv:3: t_us: 5 isn't after the line before's, 5");
  folder_.write("word.csv", "t_us,force_N\n5,hard\n");
  calibration("events,forces,material\na.txt,word.csv,\n", "word.csv:2: force_N: 'hard'");
  folder_.write("short.csv", "t_us,force_N\n5,1\n6,1\n");
  calibration("events,forces,material\na.txt,short.csv,\n", "short.csv: ends at 6 us");
  folder_.write("grasps.csv", "events,forces,material\na.txt,a.csv,\n");
  for (const char* size : {"32", "32x", "x24", "0x24", "32x24x3", "-1x24", "9000x24", "a"}) {
    expect_refused({"calibrate", "event-force", "--grasps", in("grasps.csv"), "--size", size, "-o", in("bad")},
                   "--size");
  }
  expect_refused({"calibrate", "event-force", "--grasps", in("grasps.csv"), "--size", "8x8", "-o", in("bad")}, "a.txt");
  expect_refused({"calibrate", "event-material", "--grasps", in("grasps.csv"), "--size", "32x24", "-o", in("bad")},
                 "grasps.csv:2: material: is empty");
  folder_.write("model.json", "{}");
  expect_refused({"estimate", "event-force", in("a.txt"), "--model", in("model.json"), "-o", in("bad")}, "model.json");
  expect_refused({"estimate", "event-material", in("a.txt"), "--model", in("model.json"), "-o", in("bad")},
                 "model.json");
}

}  // namespace
}  // namespace touchstone
