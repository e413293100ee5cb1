#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <thread>

#include "tests/apps/run_program.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::run_program;

/// Data sets that are drawn, through the program with its real sensor.
class KilledDraw : public ::testing::Test {
 protected:
  KilledDraw() : job_(test::write_small_draw(folder_).string()), cache_((folder_.path() / "cache").string()) {}

  std::vector<std::string> words(const std::string& out, const std::string& threads = "2") const {
    return {
        "--quiet", "--cache", cache_, "--threads", threads, "generate", job_, "-o", (folder_.path() / out).string()};
  }
  std::vector<std::string> shard(const std::string& out, const std::string& which) const {
    std::vector<std::string> all = words(out);
    all.insert(all.end(), {"--shard", which});
    return all;
  }
  auto contents(const std::string& out) const { return test::contents_of(folder_.path() / out); }

  test::TemporaryFolder folder_;
  std::string job_;
  std::string cache_;
};

TEST_F(KilledDraw, KillsShardsThreadsAndFullDisksLeaveNoTrace) {
  const test::ProgramRun first = run_program(words("whole", "1"));
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto whole = contents("whole");
  const auto begun = std::chrono::steady_clock::now();
  ASSERT_EQ(run_program(words("again", "4")).exit_code, 0);
  const auto takes = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begun);
  EXPECT_EQ(contents("again"), whole) << "4 threads";

  for (int kill = 1; kill <= 5; ++kill)
    run_program(words("killed"), std::max(takes * kill / 6, std::chrono::milliseconds(1)));
  const test::ProgramRun last = run_program(words("killed"));
  EXPECT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(contents("killed"), whole);

  // A cluster's orphan beside its retry: two processes at once, then the other shard, which is killed once.
  test::ProgramRun orphan;
  std::thread beside([&] { orphan = run_program(shard("shards", "1/2")); });
  const test::ProgramRun retry = run_program(shard("shards", "1/2"));
  beside.join();
  EXPECT_EQ(orphan.exit_code, 0) << orphan.err;
  EXPECT_EQ(retry.exit_code, 0) << retry.err;
  run_program(shard("shards", "2/2"), takes / 3);
  EXPECT_EQ(run_program(shard("shards", "2/2")).exit_code, 0);
  const test::ProgramRun merged = run_program({"--quiet", "merge", job_, "-o", (folder_.path() / "shards").string()});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(contents("shards"), whole);

  const auto bytes = fs::file_size(folder_.path() / "whole/blocks/000001.h5");
  const test::ProgramRun full =
      test::run_program_on_full_disk(words("full"), std::max(1, static_cast<int>((bytes - 1) / 1024)));
  test::expect_refused(full, "can't be written");
  EXPECT_EQ(run_program(words("full")).exit_code, 0);
  EXPECT_EQ(contents("full"), whole);
  EXPECT_THAT(run_program(words("full")).out, ::testing::HasSubstr("is finished already"));
}

TEST_F(KilledDraw, ReadOnlyFolderIsOneLineAndNothingIsLost) {
  ASSERT_EQ(run_program(shard("out", "1/2")).exit_code, 0);
  const auto begun = contents("out");
  const std::string out = (folder_.path() / "out").string();
  test::ProgramRun run;
  if (geteuid() == 0) {  // whom no permission stops: a mount of this process's own
    const auto mounted = [&](const std::vector<std::string>& then) {
      std::vector<std::string> all = {"/usr/bin/unshare",
                                      "--mount",
                                      "/bin/bash",
                                      "-ec",
                                      "mount --bind \"$1\" \"$1\"; mount -o remount,ro,bind \"$1\"; shift; exec \"$@\"",
                                      "bash",
                                      out};
      all.insert(all.end(), then.begin(), then.end());
      return test::run_words(all);
    };
    const test::ProgramRun tried = mounted({"/bin/true"});
    if (tried.exit_code != 0) GTEST_SKIP() << "no mounts here: " << tried.err;
    std::vector<std::string> program = words("out");
    program.insert(program.begin(), TOUCHSTONE_PROGRAM);
    run = mounted(program);
  } else {
    const auto writable = fs::perms::owner_write;
    for (const fs::path& one : {folder_.path() / "out", folder_.path() / "out/blocks"}) {
      fs::permissions(one, writable, fs::perm_options::remove);
    }
    run = run_program(words("out"));
    for (const fs::path& one : {folder_.path() / "out", folder_.path() / "out/blocks"}) {
      fs::permissions(one, writable, fs::perm_options::add);
    }
  }
  test::expect_refused(run, out);
  EXPECT_EQ(contents("out"), begun);
  EXPECT_EQ(run_program(words("out")).exit_code, 0);
}

TEST_F(KilledDraw, MistakesAreOneLine) {
  test::expect_refused(run_program(shard("out", "3/2")), "'3/2' isn't a shard");
  test::expect_refused(run_program({"merge", job_, "-o", (folder_.path() / "out").string()}),
                       "holds nothing of this job");
  EXPECT_FALSE(fs::exists(folder_.path() / "out"));
  test::expect_refused(run_program({"generate", job_, "-o", "/proc/none"}), "/proc/none");
}

}  // namespace
}  // namespace touchstone
