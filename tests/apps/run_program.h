#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "tests/support/run_words.h"

namespace touchstone::test {

/// Runs the built program with these arguments.
inline ProgramRun run_program(const std::vector<std::string>& arguments,
                              std::chrono::milliseconds kill_after = std::chrono::milliseconds(0)) {
  std::vector<std::string> words = {TOUCHSTONE_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_words(std::move(words), kill_after);
}

/// The same where no file can grow beyond `kilobytes`: writes fail as on a full disk.
inline ProgramRun run_program_on_full_disk(const std::vector<std::string>& arguments, int kilobytes) {
  std::vector<std::string> words = {"/bin/bash", "-c",
                                    "trap '' XFSZ; ulimit -f " + std::to_string(kilobytes) + "; exec \"$@\"", "bash",
                                    TOUCHSTONE_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_words(std::move(words));
}

/// A mistake is one line on stderr that has `part` in it, exit code 2, and nothing on stdout.
inline void expect_refused(const ProgramRun& run, const std::string& part) {
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_THAT(run.err, ::testing::AllOf(::testing::StartsWith("touchstone: "), ::testing::HasSubstr(part)));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_EQ(run.out, "");
}

}  // namespace touchstone::test
