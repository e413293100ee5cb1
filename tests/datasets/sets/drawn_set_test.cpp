#include "datasets/sets/generate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "datasets/sets/block_file.h"
#include "tests/support/message_of.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using ::testing::HasSubstr;

/// What a quick sensor was asked for, and when it ends the run.
struct Calls {
  std::atomic<int> units{0}, presses{0};
  int stop_at = -1;
  int refuse_every = 0;  // touches whose seed is a multiple of this can't be pressed
};

/// A sensor whose records are plain functions of unit and touch.
SensorSource quick_bench(Calls& calls) {
  return [&calls](const PreparedDraw&, const DrawnUnit& unit) {
    ++calls.units;
    UnitSensor sensor;
    sensor.light = "a plain function";
    sensor.background = cv::Mat(30, 40, CV_8UC3, cv::Scalar(unit.number, 20, 30));
    sensor.press = [&calls, unit](const DrawnTouch& touch, const sim::ObjectSpec& object) {
      if (calls.presses++ == calls.stop_at) throw std::runtime_error("the process ends here");
      if (calls.refuse_every > 0 && touch.seed % static_cast<std::uint64_t>(calls.refuse_every) == 0) {
        throw Unpressable("beside");
      }
      BlockRecord record;
      record.touch = touch;
      record.frame = cv::Mat(30, 40, CV_8UC3);
      record.height = cv::Mat(30, 40, CV_32F);
      record.contact = cv::Mat(30, 40, CV_8U, cv::Scalar(0));
      for (int row = 0; row < 30; ++row) {
        for (int column = 0; column < 40; ++column) {
          const double value = object.shape.radius_mm + unit.device.gel.youngs_modulus_MPa + 0.01 * row * column;
          record.frame.at<cv::Vec3b>(row, column) =
              cv::Vec3b(static_cast<unsigned char>(touch.seed), static_cast<unsigned char>(row),
                        static_cast<unsigned char>(10 * value));
          record.height.at<float>(row, column) = row == 0 ? NAN : static_cast<float>(0.001 * value);
          if (row > column) record.contact.at<unsigned char>(row, column) = 255;
        }
      }
      record.wrench << 0.1, 0.2, touch.force_N, 1, 2, 3;
      record.pose << rotation_of(touch), Eigen::Vector3d(touch.place_mm.x(), touch.place_mm.y(), 1.0);
      record.force_error_N << 0.001, 0.002, 0.01 * touch.force_N;
      record.contact_area_mm2 = 1.5;
      record.deepest_mm = 0.3;
      record.largest_strain = 0.1;
      return record;
    };
    return sensor;
  };
}

class DrawnDataset : public ::testing::Test {
 protected:
  DrawnDataset() : job_(test::write_small_draw(folder_)) {}

  GenerateReport generate(const std::string& out, Shard shard = {}, int threads = 2) {
    GenerateOptions options;
    options.sensors = quick_bench(calls_);
    options.threads = threads;
    options.shard = shard;
    return touchstone::datasets::generate(job_, folder_.path() / out, options);
  }
  auto contents(const std::string& out) { return test::contents_of(folder_.path() / out); }
  fs::path block(const std::string& out, int number) {
    return folder_.path() / out / fmt::format("blocks/{:06}.h5", number);
  }
  void write(const fs::path& file, const std::string& content) { std::ofstream(file, std::ios::binary) << content; }

  test::TemporaryFolder folder_;
  fs::path job_;
  Calls calls_;
};

TEST_F(DrawnDataset, ShardsAndThreadsGiveTheBytesOfOneRun) {
  const GenerateReport report = generate("one", {}, 1);
  EXPECT_EQ(report.made, 10);
  EXPECT_EQ(calls_.units, 2);
  const auto one = contents("one");
  EXPECT_EQ(one.size(), 4u + 2u);
  generate("many", {}, 4);
  EXPECT_EQ(contents("many"), one);
  for (const int count : {3, 7}) {
    const std::string out = fmt::format("shards-{}", count);
    std::int64_t made = 0;
    for (int number = count; number >= 1; --number) made += generate(out, {number, count}).made;
    EXPECT_EQ(made, 10);
    EXPECT_EQ(merge(job_, folder_.path() / out).samples, 10);
    EXPECT_EQ(contents(out), one) << count << " shards";
    EXPECT_TRUE(merge(job_, folder_.path() / out).was_finished);
  }
  EXPECT_TRUE(generate("one").was_finished);
}

TEST_F(DrawnDataset, ABlockHoldsItsSamplesWithUnitsAndShapes) {
  generate("out");
  const Hdf5Reader file(block("out", 1));
  EXPECT_EQ(file.read<std::int64_t>("/sample").values, (std::vector<std::int64_t>{3, 4}));
  EXPECT_EQ(file.text_attribute("/wrench", "unit"), "N, N mm");
  const PreparedDraw prepared = prepare_draw(job_);
  const DrawnTouch touch = drawn_touch(prepared, 4);
  EXPECT_EQ(file.read<std::uint64_t>("/seed").values[1], touch.seed);
  EXPECT_EQ(file.read<double>("/wrench").values[6 + 2], touch.force_N);
  const auto frame = file.read<std::uint8_t>("/frame");
  EXPECT_EQ(frame.shape, (std::vector<std::int64_t>{2, 30, 40, 3}));
  EXPECT_EQ(frame.values[(30 * 40 + 7 * 40) * 3 + 1], 7);
  EXPECT_EQ(frame.values[(30 * 40 + 7 * 40) * 3 + 2], static_cast<std::uint8_t>(touch.seed)) << "blue is last";
  const auto height = file.read<float>("/height");
  EXPECT_TRUE(std::isnan(height.values[5]));
  const double value = drawn_object(prepared, touch.object, touch.piece).shape.radius_mm +
                       drawn_unit(prepared, 0).device.gel.youngs_modulus_MPa + 0.01 * 7 * 9;
  EXPECT_NEAR(height.values[30 * 40 + 7 * 40 + 9], 0.001 * value, 1.0 / 16384);
  EXPECT_EQ(file.read<std::uint8_t>("/contact").values[30 * 40 + 7 * 40 + 2], 1);
  EXPECT_EQ(file.read_texts("/device_yaml").at(0), drawn_unit(prepared, 0).text);
}

TEST_F(DrawnDataset, TheManifestAndTheCardTellWhatIsThere) {
  generate("out");
  const auto json = nlohmann::json::parse(read_whole_file(folder_.path() / "out/dataset.json"));
  EXPECT_EQ(json.at("samples"), 10);
  EXPECT_EQ(json.at("splits").at("train").get<int>() + json.at("splits").at("test").get<int>(), 10);
  EXPECT_EQ(json.at("units").size(), 2u);
  EXPECT_EQ(json.at("units")[1].at("drawn").at("gel.youngs_modulus_MPa"),
            drawn_unit(prepare_draw(job_), 1).device.gel.youngs_modulus_MPa);
  int samples = 0;
  for (const auto& file : json.at("files")) {
    if (file.contains("samples")) samples += file.at("samples").get<int>();
    EXPECT_EQ(file.at("sha256"), sha256_of_file(folder_.path() / "out" / file.at("file").get<std::string>()));
  }
  EXPECT_EQ(samples, 10);
  const std::string card = read_whole_file(folder_.path() / "out/README.md");
  EXPECT_THAT(card, HasSubstr("10 presses on 2 units"));
  EXPECT_THAT(card, HasSubstr("licence: CC0-1.0"));
  EXPECT_THAT(card, HasSubstr("log-uniform from 0.05 to 0.3"));
}

TEST_F(DrawnDataset, ABrokenOffRunGoesOnToTheSameBytes) {
  generate("whole");
  const auto whole = contents("whole");
  for (const int stop : {0, 2, 4, 7, 9}) {
    calls_.presses = 0;
    calls_.stop_at = stop;
    EXPECT_THROW(generate("out", {}, 1), std::runtime_error);
    calls_.stop_at = -1;
    const GenerateReport report = generate("out");
    EXPECT_EQ(report.made + report.kept, 10);
    EXPECT_EQ(contents("out"), whole) << "stopped at " << stop;
    fs::remove_all(folder_.path() / "out");
  }
}

TEST_F(DrawnDataset, DamagedBlocksAreMadeAgainAndForeignOnesRefused) {
  generate("whole");
  const auto whole = contents("whole");
  generate("out", {1, 1});
  fs::remove(folder_.path() / "out/dataset.json");
  fs::create_directories(folder_.path() / "out/.unfinished");
  generate("begun", {1, 4});
  fs::copy(folder_.path() / "begun/.unfinished/run.json", folder_.path() / "out/.unfinished/run.json");
  const std::string good = read_whole_file(block("out", 2));
  std::string turned = good;
  turned[good.size() / 2] ^= 1;
  for (const std::string& bad : {good.substr(0, good.size() - 100), good.substr(0, 100), std::string(), turned}) {
    write(block("out", 2), bad);
    EXPECT_THAT(message_of([&] { merge(job_, folder_.path() / "out"); }), HasSubstr("000002.h5 (damaged)"));
    const GenerateReport report = generate("out", {3, 4});
    EXPECT_EQ(report.damaged_blocks, 1);
    EXPECT_EQ(read_whole_file(block("out", 2)), good);
  }
  fs::remove(block("out", 1));
  EXPECT_THAT(message_of([&] { merge(job_, folder_.path() / "out"); }),
              HasSubstr("1 of 4 files are missing (blocks/000001.h5)"));
  write(block("out", 1), good);  // whole, but in the wrong place
  EXPECT_THAT(message_of([&] { generate("out"); }), HasSubstr("000001.h5: is of another job or another run"));
  EXPECT_THAT(message_of([&] { merge(job_, folder_.path() / "out"); }), HasSubstr("another run"));
  fs::remove(block("out", 1));
  EXPECT_EQ(generate("out").made, 2);
  EXPECT_EQ(contents("out"), whole);
}

TEST_F(DrawnDataset, MissingShardsAreNamed) {
  const fs::path out = folder_.path() / "out";
  EXPECT_EQ(missing_shards(job_, out, 4), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_FALSE(fs::exists(out));
  generate("out", {2, 4});
  EXPECT_EQ(missing_shards(job_, out, 4), (std::vector<int>{1, 3, 4}));
  EXPECT_EQ(missing_shards(job_, out, 2), (std::vector<int>{1, 2}));
  for (const int number : {1, 3, 4}) generate("out", {number, 4});
  EXPECT_TRUE(missing_shards(job_, out, 4).empty());
  write(block("out", 2), "short");
  EXPECT_EQ(missing_shards(job_, out, 4), (std::vector<int>{3}));
  EXPECT_EQ(missing_shards(job_, out, 2), (std::vector<int>{2}));
  EXPECT_THAT(message_of([&] { missing_shards(job_, out, 0); }), HasSubstr("--missing: 0 is not allowed"));
}

TEST_F(DrawnDataset, AChangedJobAForeignFolderAndAChangedSetAreRefused) {
  generate("out", {1, 2});
  const auto before = contents("out");
  std::string other = test::kSmallDraw;
  other.replace(other.find("seed: 3"), 7, "seed: 4");
  folder_.write("job.yaml", other);
  EXPECT_THAT(message_of([&] { generate("out"); }), HasSubstr("since it was begun the job file has changed"));
  EXPECT_THAT(message_of([&] { merge(job_, folder_.path() / "out"); }), HasSubstr("the job file has changed"));
  EXPECT_EQ(contents("out"), before);
  test::write_small_draw(folder_);
  folder_.write("ball.yaml", "name: ball\nshape: {type: sphere, radius_mm: 1.6}\nfriction: 0.5\n");
  EXPECT_THAT(message_of([&] { generate("out"); }), HasSubstr("a file that the job names has changed"));
  test::write_small_draw(folder_);
  generate("out");
  folder_.write("other/file.txt", "mine");
  EXPECT_THAT(message_of([&] { generate("other"); }), HasSubstr("isn't empty ('file.txt' is in it)"));
  EXPECT_THAT(message_of([&] { merge(job_, folder_.path() / "none"); }), HasSubstr("holds nothing of this job"));
  write(block("out", 0), "short");
  EXPECT_THAT(message_of([&] { generate("out"); }), HasSubstr("000000.h5: was changed"));
}

TEST_F(DrawnDataset, WhatCannotBePressedIsDrawnAgain) {
  calls_.refuse_every = 3;
  EXPECT_GT(generate("out").drawn_again, 0);
  calls_.refuse_every = 1;
  EXPECT_THAT(message_of([&] { generate("never", {}, 1); }), HasSubstr("20 draws in a row couldn't be pressed"));
}

TEST_F(DrawnDataset, ARunKilledBeforeItsFirstBlockGoesOn) {
  generate("whole");
  fs::create_directories(folder_.path() / "out/.unfinished");
  EXPECT_EQ(generate("out").made, 10);
  EXPECT_EQ(contents("out"), contents("whole"));
}

TEST(Shards, AreRead) {
  EXPECT_EQ(shard_of("2/8").number, 2);
  EXPECT_EQ(shard_of("2/8").count, 8);
  for (const char* bad : {"", "3", "0/4", "5/4", "1/0", "a/b", "1/2/3", "-1/2", "1 /2"}) {
    EXPECT_THAT(message_of([&] { shard_of(bad); }), HasSubstr("isn't a shard")) << bad;
  }
}

}  // namespace
}  // namespace touchstone::datasets
