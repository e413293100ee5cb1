#include "datasets/sets/generate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "datasets/sets/folder_lock.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/run_folder.h"
#include "datasets/sets/truth_file.h"
#include "sensors/events/event_file.h"
#include "tests/datasets/sets/fake_source.h"
#include "tests/support/message_of.h"
#include "tests/support/small_job.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::contents_of;
using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

class DataSet : public ::testing::Test {
 protected:
  DataSet() : job_(test::write_small_job(folder_)), out_(folder_.path() / "out") {}

  GenerateReport run(const fs::path& out, int threads = 2, bool timings = false) {
    calls_.pictures = 0;
    calls_.cameras = 0;
    return generate(job_, out, {.scenes = test::fake_source(calls_), .threads = threads, .timings = timings});
  }
  GenerateReport run() { return run(out_); }

  /// Starts a run that ends in the middle of its pictures.
  void run_broken_off(int at_picture) {
    calls_.fail_at_picture = at_picture;
    EXPECT_THROW(run(), std::runtime_error);
    calls_.fail_at_picture = -1;
  }

  /// What a run gives that was never broken off.
  std::map<std::string, std::string> whole_set() {
    run(folder_.path() / "whole");
    return contents_of(folder_.path() / "whole");
  }

  test::TemporaryFolder folder_;
  test::FakeCalls calls_;
  fs::path job_;
  fs::path out_;
};

TEST_F(DataSet, HoldsFramesTruthAndManifest) {
  const GenerateReport report = run();
  EXPECT_EQ(report.samples, 12);
  EXPECT_EQ(report.made, 12);
  const auto contents = contents_of(out_);
  EXPECT_EQ(contents.size(), 12u + 12u + 2u);
  EXPECT_TRUE(contents.contains("frames/middle/000000.png"));
  EXPECT_TRUE(contents.contains("radiance/beside/000005.exr"));
  EXPECT_TRUE(contents.contains("truth.h5"));
  EXPECT_TRUE(contents.contains("dataset.json"));
}

TEST_F(DataSet, TruthHasAllObjects) {
  fem::Compliance gel;
  gel.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  gel.triangles = {{0, 1, 2}};
  sim::Truth truth;
  truth.press.bodies.resize(2);
  truth.press.bodies[0].wrench << 1, 2, 3, 4, 5, 6;
  truth.press.bodies[1].wrench << 7, 8, 9, 10, 11, 12;
  truth.press.bodies[1].gel_from_object.translation = {0.5, -0.5, 2};
  truth.press.wrench = truth.press.bodies[0].wrench;
  truth.press.traction = truth.press.surface_displacement = Eigen::MatrixX3d::Zero(3, 3);
  truth.press.node_state.assign(3, fem::NodeState::open);
  TruthHeader header;
  header.samples = 1;
  header.objects = 2;
  header.scenes = {"pair"};
  const fs::path path = folder_.path() / "pair.h5";
  TruthFileWriter writer(path, header, gel);
  writer.append(0, Split::test, truth);
  writer.close();
  const Hdf5Reader file(path);
  const auto wrench = file.read<double>("/objects/wrench");
  EXPECT_EQ(wrench.shape, (std::vector<std::int64_t>{1, 2, 6}));
  EXPECT_EQ(wrench.values, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  const auto pose = file.read<double>("/objects/pose");
  EXPECT_EQ(pose.shape, (std::vector<std::int64_t>{1, 2, 3, 4}));
  EXPECT_EQ(std::vector<double>(pose.values.end() - 12, pose.values.end()),
            (std::vector<double>{1, 0, 0, 0.5, 0, 1, 0, -0.5, 0, 0, 1, 2}));
}

TEST_F(DataSet, TruthIsInItsRows) {
  run();
  const TruthTable table = read_truth_table(out_ / "truth.h5");
  ASSERT_EQ(table.samples(), 12);
  EXPECT_EQ(table.scene_names, (std::vector<std::string>{"middle", "beside"}));
  EXPECT_EQ(table.scene[7], 1);
  EXPECT_EQ(table.frame[7], 1);
  EXPECT_EQ(table.split[7], Split::validate);
  EXPECT_EQ(table.t_us[7], 33333);
  EXPECT_DOUBLE_EQ(table.wrench[11][2], 2.5);
  const Hdf5Reader file(out_ / "truth.h5");
  EXPECT_EQ(file.read<float>("/traction_MPa").shape, (std::vector<std::int64_t>{12, 4, 3}));
  EXPECT_EQ(file.read<float>("/bead_displacement_mm").values[11 * 12], 0.125F * 5);
  EXPECT_EQ(file.read<double>("/bead_rest_mm").shape, (std::vector<std::int64_t>{4, 3}));
  EXPECT_EQ(file.read<std::uint8_t>("/contact").values[1], 1);
  const auto force_error = file.read<double>("/error/force_N");
  EXPECT_EQ(force_error.shape, (std::vector<std::int64_t>{12, 3}));
  EXPECT_EQ(force_error.values[3 * 11 + 2], 0.003 * 5);
  const auto objects = file.read<double>("/objects/wrench");
  EXPECT_EQ(objects.shape, (std::vector<std::int64_t>{12, 1, 6}));
  EXPECT_EQ(objects.values, file.read<double>("/wrench").values);
  EXPECT_EQ(file.read<double>("/objects/pose").values, file.read<double>("/pose").values);
  EXPECT_EQ(file.read<double>("/error/displacement_mm").values[11], 0.004 * 5);
  EXPECT_EQ(file.read<double>("/error/bead_mm").values[11], 0.005 * 5);
  EXPECT_EQ(file.read<double>("/error/traction_MPa").values[11], 0.006 * 5);
  EXPECT_EQ(file.read<double>("/lookup_error_mm").values[11], 1e-7 * 5);
  EXPECT_EQ(file.read<std::uint8_t>("/node_state").values[2], 2);
  const auto pose = file.read<double>("/pose");
  EXPECT_EQ(pose.shape, (std::vector<std::int64_t>{12, 3, 4}));
  EXPECT_EQ(pose.values[12 * 6 + 3], 0.5) << "x of the object in the second scene";
}

TEST_F(DataSet, EveryArrayTellsUnitAndShape) {
  run();
  const auto manifest = nlohmann::json::parse(read_whole_file(out_ / "dataset.json"));
  const Hdf5Reader file(out_ / "truth.h5");
  EXPECT_GT(manifest.at("arrays").size(), 15u);
  for (const auto& array : manifest.at("arrays")) {
    const std::string path = array.at("path");
    EXPECT_EQ(file.text_attribute(path, "unit"), array.at("unit"));
    EXPECT_EQ(file.text_attribute(path, "shape"), array.at("axes"));
    EXPECT_FALSE(file.text_attribute(path, "meaning").empty());
  }
}

TEST_F(DataSet, ManifestTellsJobPlanSeedsWorkAndChecksums) {
  run();
  const auto manifest = nlohmann::json::parse(read_whole_file(out_ / "dataset.json"));
  EXPECT_EQ(manifest.at("job").at("text"), test::kSmallJob);
  EXPECT_EQ(manifest.at("run").at("job_sha256"), sha256_of(test::kSmallJob));
  EXPECT_EQ(manifest.at("scenes").at(1).at("first_sample"), 6);
  EXPECT_EQ(manifest.at("scenes").at(1).at("seed"), 11);
  EXPECT_FALSE(manifest.at("scenes").at(0).at("plan").at(0).at("why").get<std::string>().empty());
  EXPECT_EQ(manifest.at("work").at("paths_traced"), 1200);
  EXPECT_EQ(manifest.at("work").at("pixels_traced"), 12 * 10 + 66) << "the camera sees the sample's number";
  EXPECT_EQ(manifest.at("files").size(), 25u);
  EXPECT_FALSE(manifest.contains("timings"));
  for (const auto& file : manifest.at("files")) {
    EXPECT_EQ(sha256_of_file(out_ / file.at("file").get<std::string>()), file.at("sha256"));
  }
}

TEST_F(DataSet, TimingsAreAllThatDiffersBetweenRuns) {
  run(out_, 2, true);
  run(folder_.path() / "again", 1, true);
  auto one = nlohmann::ordered_json::parse(read_whole_file(out_ / "dataset.json"));
  auto two = nlohmann::ordered_json::parse(read_whole_file(folder_.path() / "again/dataset.json"));
  EXPECT_TRUE(one.at("timings").at("wall_s").contains("frames"));
  EXPECT_NE(one.at("timings"), two.at("timings"));
  one.erase("timings");
  two.erase("timings");
  EXPECT_EQ(one.dump(), two.dump());
  const std::string stated = one.at("content_sha256");
  one.erase("content_sha256");
  one.erase("run");
  EXPECT_EQ(sha256_of(one.dump()), stated);
}

TEST_F(DataSet, AnyNumberOfThreadsGivesTheSameBytes) {
  const auto whole = whole_set();
  for (const int threads : {1, 3, 8}) {
    const fs::path out = folder_.path() / std::to_string(threads);
    run(out, threads);
    EXPECT_EQ(contents_of(out), whole) << threads << " threads";
  }
}

TEST_F(DataSet, ABrokenOffRunGoesOnToTheSameBytes) {
  const auto whole = whole_set();
  for (const int at : {0, 1, 5, 11}) {
    run_broken_off(at);
    EXPECT_TRUE(fs::exists(out_ / kUnfinished));
    EXPECT_FALSE(fs::exists(out_ / "dataset.json"));
    const GenerateReport report = run();
    EXPECT_EQ(report.kept + report.made, 12);
    EXPECT_EQ(calls_.pictures, report.made) << "what is kept isn't rendered again";
    EXPECT_EQ(contents_of(out_), whole) << "broken off at picture " << at;
    fs::remove_all(out_);
  }
}

TEST_F(DataSet, KeptFramesAreKept) {
  run_broken_off(9);
  const GenerateReport report = run();
  EXPECT_GE(report.kept, 7) << "two threads may have been at work on two more";
}

TEST_F(DataSet, StreamsOfEventsAreWrittenCheckedAndKept) {
  folder_.write("device.yaml", std::string(test::kSmallDevice) + test::kSmallCamera + "  events: {dark_e_per_s: 10}\n");
  folder_.write("scene.yaml",
                std::string(test::kSmallScene).replace(std::string(test::kSmallScene).find("radiance"), 8, "events"));
  const auto whole = whole_set();
  EXPECT_EQ(calls_.streams, 2);
  const sensors::EventRecording middle = sensors::read_events(folder_.path() / "whole/events/middle.h5");
  const sensors::EventRecording beside = sensors::read_events(folder_.path() / "whole/events/beside.h5");
  EXPECT_EQ(middle.source.size, cv::Size(48, 36));
  ASSERT_EQ(middle.events.size(), 500u);
  EXPECT_EQ(middle.events[203].t_us, 2003);
  EXPECT_EQ(middle.events[203].y, 2);
  EXPECT_FALSE(middle.events[204].on);
  EXPECT_TRUE(middle.events[3].on);
  EXPECT_NE(middle.events[0].x, beside.events[0].x) << "two scenes have the same noise";
  const auto manifest = nlohmann::json::parse(read_whole_file(folder_.path() / "whole/dataset.json"));
  EXPECT_TRUE(manifest["scenes"][0]["outputs"]["events"]);
  EXPECT_EQ(manifest["work"]["pictures"], 12);

  calls_.streams = 0;
  calls_.fail_at_stream = 1;
  EXPECT_THROW(run(), std::runtime_error);
  EXPECT_FALSE(fs::exists(out_ / "events/beside.h5")) << "half a stream";
  calls_.fail_at_stream = -1;
  calls_.streams = 0;
  EXPECT_EQ(run().made, 0);
  EXPECT_EQ(calls_.streams, 1) << "the finished stream is kept";
  EXPECT_EQ(contents_of(out_), whole);
}

TEST_F(DataSet, LostChangedAndCutFramesAreMadeAgain) {
  const auto whole = whole_set();
  run_broken_off(10);
  const std::vector<FrameRecord> records = read_journal(out_ / kUnfinished / "frames.log");
  ASSERT_GE(records.size(), 4u);
  fs::remove(out_ / records[0].files[0].name);
  fs::resize_file(out_ / records[1].files[1].name, 20);
  std::ofstream(out_ / records[2].files[0].name, std::ios::app) << "x";
  const GenerateReport report = run();
  EXPECT_EQ(report.kept, static_cast<std::int64_t>(records.size()) - 3);
  EXPECT_EQ(contents_of(out_), whole);
}

TEST_F(DataSet, ABrokenOffJournalLineAndTemporaryFilesDoNoHarm) {
  const auto whole = whole_set();
  run_broken_off(8);
  const fs::path journal = out_ / kUnfinished / "frames.log";
  const std::size_t lines = read_journal(journal).size();
  fs::resize_file(journal, fs::file_size(journal) - 30);
  std::ofstream(out_ / "frames/middle/.000003.0123456789abcdef.part.png") << "half";
  std::ofstream(out_ / ".truth.00000000000000ff.part.h5") << "half";
  const GenerateReport report = run();
  EXPECT_EQ(report.kept, static_cast<std::int64_t>(lines) - 1);
  EXPECT_EQ(contents_of(out_), whole);
}

TEST_F(DataSet, CamerasOfFinishedScenesArentSetUpAgain) {
  run_broken_off(11);
  for (const FrameRecord& record : read_journal(out_ / kUnfinished / "frames.log")) {
    if (record.sample >= 6) fs::remove(out_ / record.files[0].name);
  }
  const std::vector<FrameRecord> records = read_journal(out_ / kUnfinished / "frames.log");
  const auto of_first = std::count_if(records.begin(), records.end(), [](const auto& r) { return r.sample < 6; });
  run();
  EXPECT_EQ(calls_.cameras, of_first == 6 ? 1 : 2);
}

TEST_F(DataSet, KilledBeforeClearingUpIsFinishedByTheNextRun) {
  const auto whole = whole_set();
  run();
  fs::create_directories(out_ / kUnfinished);
  std::ofstream(out_ / ".dataset.0123456789abcdef.part.json") << "half";
  EXPECT_TRUE(run().was_finished);
  EXPECT_EQ(contents_of(out_), whole);
}

TEST_F(DataSet, AFinishedSetIsVerifiedAndLeftAlone) {
  run();
  const auto before = contents_of(out_);
  const GenerateReport report = run();
  EXPECT_TRUE(report.was_finished);
  EXPECT_EQ(calls_.pictures, 0);
  EXPECT_EQ(contents_of(out_), before);
}

TEST_F(DataSet, ADamagedFinishedSetIsNamed) {
  run();
  std::ofstream(out_ / "frames/beside/000002.png", std::ios::app) << "x";
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("000002.png"), HasSubstr("checksum")));
  fs::remove(out_ / "frames/beside/000002.png");
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("000002.png"), HasSubstr("missing")));
}

TEST_F(DataSet, AChangedJobIsRefusedAndNothingTouched) {
  run_broken_off(4);
  const auto before = contents_of(out_);
  folder_.write("job.yaml", std::string(test::kSmallJob) + "# another word\n");
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("unfinished"), HasSubstr("the job file has changed")));
  EXPECT_EQ(contents_of(out_), before);
}

TEST_F(DataSet, AChangedFileThatTheJobNamesIsRefused) {
  run_broken_off(4);
  const auto before = contents_of(out_);
  folder_.write("motion.yaml", std::string(test::kSmallMotion) + "# another word\n");
  EXPECT_THAT(message_of([&] { run(); }), HasSubstr("a file that the job names has changed"));
  EXPECT_EQ(contents_of(out_), before);
}

TEST_F(DataSet, AnotherVersionIsRefused) {
  run_broken_off(4);
  const fs::path record = out_ / kUnfinished / "run.json";
  auto json = nlohmann::ordered_json::parse(read_whole_file(record));
  json["version"] = "0.0.1";
  write_whole_file(record, json.dump());
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("version"), HasSubstr("0.0.1")));
}

TEST_F(DataSet, AnotherJobsFinishedSetIsRefused) {
  run();
  const auto before = contents_of(out_);
  folder_.write("job.yaml", std::string(test::kSmallJob) + "# another word\n");
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("finished data set"), HasSubstr("another folder")));
  EXPECT_EQ(contents_of(out_), before);
}

TEST_F(DataSet, AForeignFolderIsRefusedAndNothingTouched) {
  folder_.write("out/holiday.jpg", "picture");
  EXPECT_THAT(message_of([&] { run(); }), AllOf(HasSubstr("isn't empty"), HasSubstr("holiday.jpg")));
  EXPECT_EQ(contents_of(out_).size(), 1u);
  EXPECT_FALSE(fs::exists(out_ / kUnfinished));
  EXPECT_THAT(message_of([&] { run(folder_.path() / "job.yaml"); }), HasSubstr("isn't a folder"));
}

TEST_F(DataSet, AnEmptyFolderIsTaken) {
  fs::create_directories(out_);
  EXPECT_EQ(run().made, 12);
}

TEST_F(DataSet, AFailureBeforeTheFirstPictureLeavesNothing) {
  SampleSource source = test::fake_source(calls_);
  source.play_motion = [](const sim::SceneSpec&, const sim::Plan&, const fem::Compliance&,
                          const Progress&) -> std::vector<sim::Truth> { fail("frame 3: gross slip"); };
  const fs::path deep = folder_.path() / "new/deep/out";
  EXPECT_THAT(message_of([&] { generate(job_, deep, {.scenes = source}); }), HasSubstr("gross slip"));
  EXPECT_FALSE(fs::exists(folder_.path() / "new"));
  fs::create_directories(out_);
  EXPECT_THAT(message_of([&] { generate(job_, out_, {.scenes = source}); }), HasSubstr("gross slip"));
  EXPECT_TRUE(fs::is_empty(out_)) << "a folder that was there stays";
}

TEST_F(DataSet, ASecondRunOnTheSameFolderIsRefusedAndSaysWho) {
  run_broken_off(4);
  const FolderLock lock(out_ / kUnfinished / "lock");
  EXPECT_THAT(message_of([&] { run(); }),
              AllOf(HasSubstr("another run"), HasSubstr("process " + std::to_string(getpid()))));
}

TEST_F(DataSet, TheLockGoesWithItsHolder) {
  { const FolderLock lock(folder_.path() / "lock"); }
  EXPECT_NO_THROW(FolderLock(folder_.path() / "lock"));
}

TEST_F(DataSet, AManifestThatWasChangedIsRefused) {
  run();
  std::string text = read_whole_file(out_ / "dataset.json");
  text.replace(text.find("\"seed\": 11"), 10, "\"seed\": 12");
  write_whole_file(out_ / "dataset.json", text);
  EXPECT_THAT(message_of([&] { read_manifest(out_); }), HasSubstr("content_sha256"));
  write_whole_file(out_ / "dataset.json", text.substr(0, 100));
  EXPECT_THAT(message_of([&] { read_manifest(out_); }), HasSubstr("isn't a whole manifest"));
  write_whole_file(out_ / "dataset.json", "{}");
  EXPECT_THROW(read_manifest(out_), Error);
}

TEST_F(DataSet, WithoutImagesThereIsOnlyTruth) {
  job_ = folder_.write("job.yaml", std::string(test::kSmallJob) + "outputs: {frames: false}\n");
  run();
  EXPECT_EQ(contents_of(out_).size(), 2u);
  EXPECT_EQ(calls_.cameras, 0);
}

}  // namespace
}  // namespace touchstone::datasets
