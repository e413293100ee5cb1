#include "core/isolated_call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>

#include "core/error.h"

namespace touchstone {
namespace {

using ::testing::HasSubstr;

std::string error_of(const std::function<std::string()>& work, int cpu_seconds = 60, int wall_seconds = 600) {
  try {
    isolated_call(work, cpu_seconds, wall_seconds);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(IsolatedCall, BringsBackWhatItsWorkReturns) {
  EXPECT_EQ(isolated_call([] { return std::string("abc\0def", 7); }, 60, 600), std::string("abc\0def", 7));
  EXPECT_EQ(isolated_call([] { return std::string(); }, 60, 600), "");
  const std::string large(3'000'000, 'x');  // far more than a pipe holds
  EXPECT_EQ(isolated_call([&] { return large; }, 60, 600), large);
}

TEST(IsolatedCall, ChangesNothingHere) {
  int value = 1;
  isolated_call(
      [&] {
        value = 2;
        return std::string();
      },
      60, 600);
  EXPECT_EQ(value, 1);
}

TEST(IsolatedCall, ErrorsComeBackAsErrors) {
  EXPECT_EQ(error_of([]() -> std::string { fail("the number is {}", 7); }), "the number is 7");
  EXPECT_EQ(error_of([]() -> std::string { throw 3; }), "an unknown exception");
}

TEST(IsolatedCall, AnAbortEndsOnlyTheChild) {
  EXPECT_EQ(error_of([]() -> std::string { std::abort(); }), "it was ended by signal 6");
  EXPECT_EQ(error_of([]() -> std::string {
              std::raise(SIGTERM);
              return "";
            }),
            "it was ended by signal 15");
  EXPECT_EQ(error_of([]() -> std::string { std::_Exit(3); }), "it ended without an answer");
}

TEST(IsolatedCall, WhatNeverComesBackIsEnded) {
  EXPECT_THAT(error_of(
                  []() -> std::string {
                    std::atomic<int> count = 0;
                    for (;;) ++count;
                  },
                  1),
              HasSubstr("more than 1 s"));
  EXPECT_EQ(error_of(
                []() -> std::string {
                  for (;;) pause();
                },
                60, 1),
            "it gave no answer within 1 s");
}

}  // namespace
}  // namespace touchstone
