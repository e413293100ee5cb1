#include "sensors/learning/leave_one_out.h"
#include "tests/support/message_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
#include <set>
#include <stdexcept>

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

void expect_partition(const Fold& fold, int count) {
  std::set<int> all(fold.training.begin(), fold.training.end());
  all.insert(fold.validation.begin(), fold.validation.end());
  all.insert(fold.test);
  EXPECT_EQ(static_cast<int>(all.size()), count);
  EXPECT_EQ(static_cast<int>(fold.training.size() + fold.validation.size()) + 1, count);
}

TEST(LeaveOneOut, EachGraspIsTestedOnceAndValidationCoversAllLevels) {
  std::vector<double> levels;
  for (int i = 0; i < 48; ++i) levels.push_back((i * 31) % 48);
  const std::vector<Fold> folds = folds_by_level(levels, 5, 1);
  ASSERT_EQ(folds.size(), 48U);
  for (int test = 0; test < 48; ++test) {
    const Fold& fold = folds[static_cast<std::size_t>(test)];
    EXPECT_EQ(fold.test, test);
    EXPECT_EQ(fold.training.size(), 42U);  // the paper's
    expect_partition(fold, 48);
    std::vector<double> chosen;
    for (const int i : fold.validation) chosen.push_back(levels[static_cast<std::size_t>(i)]);
    std::sort(chosen.begin(), chosen.end());
    // Levels are 0 to 47: one of each fifth, give or take the one that is left out.
    for (int part = 0; part < 5; ++part) {
      EXPECT_GE(chosen[static_cast<std::size_t>(part)], std::floor(9.4 * part));
      EXPECT_LE(chosen[static_cast<std::size_t>(part)], std::ceil(9.4 * (part + 1)));
    }
  }
  EXPECT_EQ(folds_by_level(levels, 5, 1)[7].validation, folds[7].validation);
  int differ = 0;
  const std::vector<Fold> others = folds_by_level(levels, 5, 2);
  for (std::size_t i = 0; i < 48; ++i) differ += others[i].validation != folds[i].validation;
  EXPECT_GT(differ, 40);
  EXPECT_TRUE(folds_by_level(levels, 0, 1)[0].validation.empty());
}

TEST(LeaveOneOut, OfEachClassOneValidates) {
  std::vector<int> labels;  // of the 48 grasps of [Naeini2020]
  for (int i = 0; i < 48; ++i) labels.push_back(i < 11 ? 0 : i < 20 ? 1 : i < 34 ? 2 : 3);
  for (const Fold& fold : folds_by_class(labels, 1)) {
    EXPECT_EQ(fold.training.size(), 43U);
    expect_partition(fold, 48);
    std::set<int> classes;
    for (const int i : fold.validation) classes.insert(labels[static_cast<std::size_t>(i)]);
    EXPECT_EQ(classes.size(), 4U);
  }
  // A class of two can't spare one when its other member is tested.
  const std::vector<Fold> folds = folds_by_class(std::vector<int>{0, 0, 0, 1, 1}, 1);
  EXPECT_EQ(folds[0].validation.size(), 2U);
  EXPECT_EQ(folds[3].validation.size(), 1U);
}

TEST(LeaveOneOut, FaultyInputIsNamed) {
  const std::vector<double> three{1.0, 2.0, 3.0};
  EXPECT_THAT(message_of([&] { folds_by_level(three, 2, 1); }), HasSubstr("from 0 to 1"));
  EXPECT_THAT(message_of([&] { folds_by_level(three, -1, 1); }), HasSubstr("-1 of 3"));
  EXPECT_THAT(message_of([] {
                folds_by_level(std::vector<double>{1.0, std::nan(""), 2.0}, 1, 1);
              }),
              HasSubstr("grasp 1 isn't finite"));
  EXPECT_THAT(message_of([] { folds_by_class(std::vector<int>{0, -1}, 1); }), HasSubstr("grasp 1 is of class -1"));
  EXPECT_THAT(message_of([] { folds_by_class(std::vector<int>{0}, 1); }), HasSubstr("at least 2"));
  EXPECT_THAT(message_of([] { run_folds(-1, 1, [](int) {}); }), HasSubstr("-1 folds"));
  EXPECT_THAT(message_of([] { run_folds(1, -1, [](int) {}); }), HasSubstr("-1 threads"));
}

TEST(LeaveOneOut, EveryFoldRunsOnceOnAnyNumberOfThreads) {
  for (const int threads : {0, 1, 3, 100}) {
    std::vector<int> runs(48, 0);
    std::atomic<int> reported{0};
    run_folds(
        48, threads, [&](int fold) { ++runs[static_cast<std::size_t>(fold)]; },
        [&](const std::string&, std::int64_t, std::int64_t total) { reported += total == 48; });
    EXPECT_THAT(runs, testing::Each(1));
    EXPECT_EQ(reported, 48);
  }
  run_folds(0, 4, [](int) { FAIL(); });
}

TEST(LeaveOneOut, TheFirstErrorIsThrownAndTheOthersAreDone) {
  for (const int threads : {1, 4}) {
    std::atomic<int> done{0};
    const std::string message = message_of([&] {
      run_folds(20, threads, [&](int fold) {
        ++done;
        if (fold == 5 || fold == 11) fail("fold {}", fold);
      });
    });
    EXPECT_EQ(message, "fold 5");
    EXPECT_EQ(done, 20);
  }
}

}  // namespace
}  // namespace touchstone::sensors
