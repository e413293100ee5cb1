#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "tests/apps/run_program.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"

namespace touchstone {
namespace {

using test::run_program;

/// As small as the others', but of more files, so that there is something to kill.
std::string larger_draw() {
  std::string job = test::kSmallDraw;
  const std::string few = "samples: 10\n";
  return job.replace(job.find(few), few.size(), "samples: 60\n");
}

/// A hundred SIGKILLs at random moments, to whole runs, shards and merges: each set that is finished in spite of them
/// has the bytes of a run that nobody disturbed.
TEST(HundredKills, LeaveNoTrace) {
  constexpr int kKills = 100;
  const test::TemporaryFolder folder;
  const std::string job = test::write_small_draw(folder, larger_draw()).string();
  const std::string cache = (folder.path() / "cache").string();
  const auto generate = [&](const std::string& out) {
    return std::vector<std::string>{"--quiet", "--cache", cache, "--threads", "2", "generate", job, "-o", out};
  };
  const std::string whole_folder = (folder.path() / "whole").string();
  ASSERT_EQ(run_program(generate(whole_folder)).exit_code, 0);  // fills the cache
  const auto whole = test::contents_of(whole_folder);
  const auto begun = std::chrono::steady_clock::now();
  ASSERT_EQ(run_program(generate((folder.path() / "again").string())).exit_code, 0);
  const std::chrono::duration<double, std::milli> takes = std::chrono::steady_clock::now() - begun;

  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> moment(1.0, takes.count());
  int kills = 0;
  int sets = 0;
  for (; kills < kKills; ++sets) {
    const std::string out = (folder.path() / ("killed" + std::to_string(sets))).string();
    std::vector<std::vector<std::string>> steps;
    if (sets % 2 == 0) {
      steps.push_back(generate(out));
    } else {
      for (const char* shard : {"1/3", "2/3", "3/3"}) {
        steps.push_back(generate(out));
        steps.back().insert(steps.back().end(), {"--shard", shard});
      }
      steps.push_back({"--quiet", "merge", job, "-o", out});
    }
    for (const std::vector<std::string>& step : steps) {
      // Shards and merges take a part of the whole's time.
      const double share = 1.0 / static_cast<double>(steps.size());
      for (;;) {
        const std::chrono::milliseconds after(1 + static_cast<int>(share * moment(random)));
        const test::ProgramRun run = kills < kKills ? run_program(step, after) : run_program(step);
        if (run.exit_code == 0) break;
        ASSERT_EQ(run.exit_code, -1) << "not killed, but refused: " << run.err;
        ++kills;
      }
    }
    ASSERT_EQ(test::contents_of(out), whole) << "set " << sets << " after " << kills << " kills";
    std::filesystem::remove_all(out);
  }
  std::cout << kills << " kills, " << sets << " sets\n";
  EXPECT_GE(sets, 4);
}

}  // namespace
}  // namespace touchstone
