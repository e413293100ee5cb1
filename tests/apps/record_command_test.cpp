// A recording as a user makes it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(RecordCommand, WritesEventsAndForcesOfEachGrasp) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out";
  const ProgramRun run = run_program({"--quiet", "--cache", folder.path().string(), "record", "dvs", "-o", out.string(),
                                      "--grasps", "2", "--seed", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 grasps"));
  const std::string table = read_whole_file(out / "grasps.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  EXPECT_THAT(table, HasSubstr("grasp-00,foam,"));
  EXPECT_THAT(table, HasSubstr("grasp-01,silicone,"));
  EXPECT_EQ(read_whole_file(out / "files.csv"),
            "events,forces,material\ngrasp-00.h5,grasp-00-force.csv,foam\ngrasp-01.h5,grasp-01-force.csv,silicone\n");
  for (const char* name : {"grasp-00", "grasp-01"}) {
    EXPECT_THAT(read_whole_file(out / (std::string(name) + "-force.csv")), StartsWith("t_us,force_N\n"));
    const sensors::EventRecording events = sensors::read_events(out / (std::string(name) + ".h5"));
    EXPECT_EQ(events.source.size, cv::Size(240, 180));
    EXPECT_GT(events.events.size(), 3000u);
    EXPECT_TRUE(std::is_sorted(events.events.begin(), events.events.end(),
                               [](const Event& a, const Event& b) { return a.t_us < b.t_us; }));
    const std::string windows = read_whole_file(out / (std::string(name) + ".csv"));
    EXPECT_THAT(windows, StartsWith("end_ms,on,off,true_N,raw_N,measured_N\n7,"));
    const auto lines = std::count(windows.begin(), windows.end(), '\n');
    EXPECT_NEAR(static_cast<double>(lines), 1.0 + static_cast<double>(events.events.back().t_us) / 7000.0, 1.0);
  }
}

}  // namespace
}  // namespace touchstone::test
