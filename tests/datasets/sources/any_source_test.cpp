#include "datasets/sources/any_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/hdf5_file.h"
#include "datasets/sets/generate.h"
#include "datasets/sources/frame_times.h"
#include "sim/files/image_file.h"
#include "tests/support/message_of.h"
#include "tests/support/small_draw.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/written_video.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

cv::Mat level(int value) {
  return {6, 8, CV_8UC3, cv::Scalar::all(value)};
}

class AnySource : public ::testing::Test {
 protected:
  AnySource() {
    for (const int i : {0, 1, 2, 10}) sim::write_png(in(fmt::format("frames/{}.png", i), true), level(20 * i));
    test::write_video(in("clip.mkv"), {level(0), level(20), level(40), level(200)});
  }
  fs::path in(const std::string& name, bool make = false) const {
    const fs::path file = folder_.path() / name;
    if (make) fs::create_directories(file.parent_path());
    return file;
  }
  std::vector<SourceFrame> read(SourceChoice choice) const {
    std::vector<SourceFrame> frames;
    choice.place = in(choice.place);
    for_each_frame(streams_of(choice), [&](const SourceFrame& frame) { frames.push_back(frame); });
    return frames;
  }
  std::vector<std::int64_t> times(const SourceChoice& choice) const {
    std::vector<std::int64_t> all;
    for (const SourceFrame& frame : read(choice)) all.push_back(frame.label.timed ? frame.label.t_us : -1);
    return all;
  }
  std::string refused(const SourceChoice& choice) const {
    return message_of([&] { read(choice); });
  }

  test::TemporaryFolder folder_;
};

TEST_F(AnySource, AFolderAndAVideoOfItsPicturesAreTheSame) {
  const std::vector<SourceFrame> folder = read({.place = "frames"}), video = read({.place = "clip.mkv"});
  ASSERT_EQ(folder.size(), 4U);
  ASSERT_EQ(video.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(cv::norm(folder[i].image, video[i].image, cv::NORM_INF), 0.0);
    EXPECT_EQ(folder[i].label.frame, static_cast<int>(i));
    EXPECT_EQ(video[i].label.frame, static_cast<int>(i));
  }
  EXPECT_EQ(folder[3].stem, "10");
  EXPECT_EQ(video[3].stem, "clip-000003");
  EXPECT_EQ(streams_of({.place = in("frames/")})[0].name, "frames") << "a slash at the end is no name";
  EXPECT_EQ(read({.place = "frames/2.png"}).size(), 1U);
}

TEST_F(AnySource, TimesAreTheSourcesTheRatesOrTheTables) {
  EXPECT_THAT(times({.place = "frames"}), ElementsAre(-1, -1, -1, -1)) << "nobody knows them";
  EXPECT_THAT(times({.place = "clip.mkv"}), ElementsAre(0, 40000, 80000, 120000));
  for (const char* place : {"frames", "clip.mkv"}) {
    EXPECT_THAT(times({.place = place, .rate_Hz = 1000.0}), ElementsAre(0, 1000, 2000, 3000));
    const fs::path table = folder_.write("frame.csv", "frame,t_us\n0,5\n1,7\n2,1000\n3,2000\n");
    EXPECT_THAT(times({.place = place, .times = table}), ElementsAre(5, 7, 1000, 2000));
  }
  const fs::path table =
      folder_.write("file.csv", "file,t_s\r\n0.png,-1\r\n1.png,0.25\r\n2.png,1e3\r\n10.png,1001\r\n");
  EXPECT_THAT(times({.place = "frames", .times = table}), ElementsAre(-1000000, 250000, 1000000000, 1001000000));
}

TEST_F(AnySource, ATableOfTimesIsCheckedLineByLine) {
  const auto with = [&](const std::string& text, const char* place = "frames") {
    return refused({.place = place, .times = folder_.write("t.csv", text)});
  };
  EXPECT_THAT(with("name,t_us\n"), AllOf(HasSubstr("t.csv:1: "), HasSubstr("it must be one of 'file,t_us'")));
  EXPECT_THAT(with("frame,t_us\n0,0\n1,x\n"), HasSubstr("t.csv:3: t_us: 'x' isn't a whole number"));
  EXPECT_THAT(with("frame,t_s\n0,0\n1,nan\n"), HasSubstr("t.csv:3: t_s: 'nan' isn't a finite number"));
  EXPECT_THAT(with("frame,t_s\n0,0\n1,1e300\n"), HasSubstr("t.csv:3: t_s: 1e+300 is out of bounds"));
  EXPECT_THAT(with("frame,t_us\n0,5\n1,5\n"), HasSubstr("t.csv:3: t_us: 5 isn't later than the line before"));
  EXPECT_THAT(with("frame,t_us\n1,5\n0,6\n"), HasSubstr("t.csv:3: frame: 0 doesn't come after the line before"));
  EXPECT_THAT(with("frame,t_us\n-1,5\n"), HasSubstr("t.csv:2: frame: -1 must be 0 or more"));
  EXPECT_THAT(with("file,t_us\n0.png,1\n0.png,2\n"), HasSubstr("t.csv:3: file: '0.png' stands in line 2, too"));
  EXPECT_THAT(with("file,t_us\n0.png,1\n1.png,2\n2.png,3\n"), HasSubstr("10.png: has no line in "));
  EXPECT_THAT(with("file,t_us\n0.png,1\n1.png,2\n2.png,3\n10.png,4\nx.png,5\n"),
              HasSubstr("t.csv:6: file: there is no picture 'x.png' in frames"));
  EXPECT_THAT(with("file,t_us\n0.png,1\n10.png,2\n1.png,3\n2.png,4\n"), HasSubstr("10.png isn't later than the frame"));
  EXPECT_THAT(with("frame,t_us\n0,1\n1,2\n2,3\n3,4\n4,5\n"), HasSubstr("t.csv:6: frame: there is no frame 4"));
  EXPECT_THAT(with("file,t_us\n0.png,1\n", "clip.mkv"), HasSubstr("t.csv:1: the frames of clip have no files"));
}

TEST_F(AnySource, OfAVideoWhatATableLacksIsAFaultOfThatFrame) {
  const auto faults = [&](const std::string& text) {
    std::vector<std::string> all;
    for (const SourceFrame& frame : read({.place = "clip.mkv", .times = folder_.write("t.csv", text)})) {
      if (!frame.fault.empty()) all.push_back(frame.fault);
    }
    return all;
  };
  EXPECT_THAT(faults("frame,t_us\n0,1\n1,2\n3,4\n"), ElementsAre(HasSubstr("clip.mkv: frame 2 has no line in ")));
  EXPECT_THAT(faults("frame,t_us\n0,1\n1,2\n2,3\n3,4\n9,5\n"),
              ElementsAre(HasSubstr("t.csv:6: frame: there is no frame 9; the last one is 3")));
}

TEST_F(AnySource, AVideosForcesAreThoseOfItsNumberedFrames) {
  const fs::path table =
      folder_.write("f.csv", "frame,t_us,force_x_N,force_y_N,force_z_N\n0,10,0,0,0\n2,30,0.1,0.2,0.3\n");
  const std::vector<SourceFrame> frames = read({.place = "clip.mkv", .forces = table});
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].label.frame, 2);
  EXPECT_EQ(frames[1].label.t_us, 30);
  EXPECT_EQ(frames[1].label.force->z(), 0.3);
  EXPECT_EQ(cv::norm(frames[1].image, level(40), cv::NORM_INF), 0.0);
  const auto refusal = [&](const std::string& rows) {
    const std::string text = "frame,t_us,force_x_N,force_y_N,force_z_N\n" + rows;
    return refused({.place = "clip.mkv", .forces = folder_.write("g.csv", text)});
  };
  EXPECT_THAT(refusal("1,0,0,0,0\n1,1,0,0,0\n"), HasSubstr("g.csv:3: frame: 1 doesn't come after the line before"));
  EXPECT_THAT(refusal("0,0,0,0,inf\n"), HasSubstr("g.csv:2: force_z_N: 'inf' isn't a finite number"));
  EXPECT_THAT(refusal(""), HasSubstr("has no frame"));
}

TEST_F(AnySource, EndsWhereItIsAskedTo) {
  EXPECT_EQ(read({.place = "clip.mkv", .most_frames = 3}).size(), 3U);
  EXPECT_EQ(read({.place = "clip.mkv", .most_s = 0.08}).size(), 2U);
  EXPECT_EQ(read({.place = "frames", .most_frames = 9}).size(), 4U);
  EXPECT_EQ(streams_of({.place = in("frames"), .most_frames = 3})[0].frames, 3);
  EXPECT_THAT(refused({.place = "frames", .most_s = 1.0}), HasSubstr("the frames' times aren't known"));
}

TEST_F(AnySource, OptionsThatDontFitAreRefused) {
  const fs::path times = folder_.write("t.csv", "frame,t_us\n0,1\n1,2\n2,3\n3,4\n");
  EXPECT_THAT(refused({.place = "frames", .times = times, .rate_Hz = 1.0}),
              HasSubstr("--rate: the times are those of"));
  EXPECT_THAT(refused({.place = "frames", .split_given = true}), HasSubstr("--split: "));
  EXPECT_THAT(refused({.place = "frames", .rate_Hz = -1.0}), HasSubstr("rate: -1 isn't allowed"));
  EXPECT_THAT(refused({.place = "frames", .timeout_s = 0.0}), HasSubstr("timeout: 0 isn't allowed"));
  EXPECT_THAT(message_of([&] { streams_of({.place = "http://127.0.0.1/x", .times = times}); }),
              HasSubstr("is for what is recorded; http://127.0.0.1/x is live"));
  EXPECT_THAT(message_of([&] { streams_of({.place = "http://127.0.0.1/x", .rate_Hz = 1.0}); }), HasSubstr("--rate: "));
  fs::create_directory(in("nothing"));
  EXPECT_THAT(refused({.place = "nothing"}), HasSubstr("has no picture; read are .png"));
}

TEST_F(AnySource, ADrawnSetIsReadByUnitsWithForcesAndBackground) {
  const fs::path job = test::write_small_draw(folder_);
  GenerateOptions how;
  how.sensors = [](const PreparedDraw&, const DrawnUnit& unit) {
    UnitSensor sensor;
    sensor.light = "none";
    sensor.background = cv::Mat(30, 40, CV_8UC3, cv::Scalar(1, 2, 100 + unit.number));
    sensor.press = [](const DrawnTouch& touch, const sim::ObjectSpec&) {
      BlockRecord record;
      record.touch = touch;
      record.frame = cv::Mat(30, 40, CV_8UC3, cv::Scalar(10, 20, 30));
      record.height = cv::Mat(30, 40, CV_32F, cv::Scalar(0));
      record.contact = cv::Mat(30, 40, CV_8U, cv::Scalar(0));
      record.wrench << 0.1, 0.2, touch.force_N, 1, 2, 3;
      record.pose << rotation_of(touch), Eigen::Vector3d(touch.place_mm.x(), touch.place_mm.y(), 1.0);
      return record;
    };
    return sensor;
  };
  generate(job, in("set"), how);
  const std::vector<FrameStream> streams = streams_of({.place = in("set")});
  ASSERT_EQ(streams.size(), 2U);
  EXPECT_EQ(streams[1].name, "unit-1");
  EXPECT_EQ(frames_of(streams), 10);
  EXPECT_EQ(streams[1].rest().at<cv::Vec3b>(0, 0), cv::Vec3b(1, 2, 101)) << "BGR";
  std::vector<int> numbers;
  for_each_frame(streams, [&](const SourceFrame& frame) {
    EXPECT_EQ(frame.fault, "");
    EXPECT_EQ(frame.image.at<cv::Vec3b>(3, 3), cv::Vec3b(10, 20, 30));
    EXPECT_EQ(frame.label.force->x(), 0.1);
    EXPECT_FALSE(frame.label.timed);
    numbers.push_back(frame.label.frame);
  });
  EXPECT_THAT(numbers, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

}  // namespace
}  // namespace touchstone::datasets
