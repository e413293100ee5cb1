#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/apps/run_program.h"
#include "tests/support/small_job.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::run_program;

class KilledRun : public ::testing::Test {
 protected:
  KilledRun() : job_(test::write_small_job(folder_).string()), cache_((folder_.path() / "cache").string()) {}

  test::ProgramRun generate(const std::string& out, const std::string& threads = "2",
                            std::chrono::milliseconds kill_after = std::chrono::milliseconds(0)) {
    return run_program({"--quiet", "--cache", cache_, "--threads", threads, "generate", job_, "-o",
                        (folder_.path() / out).string(), "--no-timings"},
                       kill_after);
  }

  test::TemporaryFolder folder_;
  std::string job_;
  std::string cache_;
};

TEST_F(KilledRun, GoesOnToTheBytesOfOneThatNeverWas) {
  const test::ProgramRun first = generate("warm");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto warm = std::chrono::steady_clock::now();
  ASSERT_EQ(generate("whole").exit_code, 0);
  const auto whole_time = std::chrono::steady_clock::now() - warm;
  const auto whole = test::contents_of(folder_.path() / "whole");
  EXPECT_EQ(test::contents_of(folder_.path() / "warm"), whole) << "a warm cache changes nothing";
  EXPECT_EQ(whole.size(), 26u);

  for (int moment = 1; moment <= 6; ++moment) {
    const auto after = std::chrono::duration_cast<std::chrono::milliseconds>(whole_time * moment / 7);
    generate("out", "2", std::max(after, std::chrono::milliseconds(1)));
    const test::ProgramRun last = generate("out", moment % 2 == 0 ? "1" : "4");
    EXPECT_EQ(last.exit_code, 0) << last.err;
    EXPECT_EQ(test::contents_of(folder_.path() / "out"), whole) << "killed after " << after.count() << " ms";
    fs::remove_all(folder_.path() / "out");
  }
}

TEST_F(KilledRun, ManyKillsInARowLoseNothing) {
  ASSERT_EQ(generate("whole").exit_code, 0);
  for (int k = 0; k < 8; ++k) generate("out", "2", std::chrono::milliseconds(30 + 40 * k));
  const test::ProgramRun last = generate("out");
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(test::contents_of(folder_.path() / "out"), test::contents_of(folder_.path() / "whole"));
}

TEST_F(KilledRun, AFullDiskIsSaidAndLosesNothing) {
  ASSERT_EQ(generate("whole").exit_code, 0);
  const auto whole = test::contents_of(folder_.path() / "whole");
  for (const char* file : {"frames/middle/000003.png", "radiance/middle/000003.exr", "truth.h5", "dataset.json"}) {
    const int kilobytes = std::max(1, static_cast<int>((fs::file_size(folder_.path() / "whole" / file) - 1) / 1024));
    const test::ProgramRun run = test::run_program_on_full_disk(
        {"--quiet", "--cache", cache_, "generate", job_, "-o", (folder_.path() / "out").string(), "--no-timings"},
        kilobytes);
    EXPECT_EQ(run.exit_code, 2) << file << ": " << run.err;
    EXPECT_THAT(run.err, ::testing::HasSubstr("can't be written"));
    EXPECT_EQ(generate("out").exit_code, 0);
    EXPECT_EQ(test::contents_of(folder_.path() / "out"), whole) << file;
    fs::remove_all(folder_.path() / "out");
  }
}

TEST_F(KilledRun, AFinishedSetIsSaidToBeFinished) {
  ASSERT_EQ(generate("out").exit_code, 0);
  const test::ProgramRun again = generate("out");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.out, ::testing::HasSubstr("is finished already"));
}

}  // namespace
}  // namespace touchstone
