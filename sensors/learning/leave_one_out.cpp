#include "sensors/learning/leave_one_out.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <thread>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sensors {
namespace {

std::size_t draw_below(std::size_t count, RandomStream& random) {
  return std::min(count - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}

/// A fold whose validation is known: the others are trained on.
Fold complete(int test, std::vector<int> validation, int count) {
  std::sort(validation.begin(), validation.end());
  Fold fold{test, std::move(validation), {}};
  for (int i = 0; i < count; ++i) {
    if (i != test && !std::binary_search(fold.validation.begin(), fold.validation.end(), i)) fold.training.push_back(i);
  }
  if (fold.training.empty()) fail("leave-one-out: of {} grasps none is left to train on", count);
  return fold;
}

}  // namespace

std::vector<Fold> folds_by_level(std::span<const double> levels, int validation, std::uint64_t seed) {
  const auto count = static_cast<int>(levels.size());
  if (validation < 0 || validation > count - 2) {
    fail("leave-one-out: {} of {} grasps to validate on; it must be from 0 to {}", validation, count, count - 2);
  }
  for (int i = 0; i < count; ++i) {
    if (!std::isfinite(levels[static_cast<std::size_t>(i)])) {
      fail("leave-one-out: the level of grasp {} isn't finite", i);
    }
  }
  std::vector<Fold> folds;
  for (int test = 0; test < count; ++test) {
    RandomStream random(seed, static_cast<std::uint64_t>(test), Purpose::kFolds);
    std::vector<int> others;
    for (int i = 0; i < count; ++i) {
      if (i != test) others.push_back(i);
    }
    std::stable_sort(others.begin(), others.end(), [&](int a, int b) {
      return levels[static_cast<std::size_t>(a)] < levels[static_cast<std::size_t>(b)];
    });
    std::vector<int> chosen;
    const std::size_t parts = static_cast<std::size_t>(validation);
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t begin = part * others.size() / parts;
      const std::size_t end = (part + 1) * others.size() / parts;
      chosen.push_back(others[begin + draw_below(end - begin, random)]);
    }
    folds.push_back(complete(test, std::move(chosen), count));
  }
  return folds;
}

std::vector<Fold> folds_by_class(std::span<const int> labels, std::uint64_t seed) {
  const auto count = static_cast<int>(labels.size());
  for (int i = 0; i < count; ++i) {
    const int label = labels[static_cast<std::size_t>(i)];
    if (label < 0) fail("leave-one-out: grasp {} is of class {}; it must be at least 0", i, label);
  }
  if (count < 2) fail("leave-one-out: {} grasps; at least 2 are needed", count);
  std::vector<Fold> folds;
  for (int test = 0; test < count; ++test) {
    RandomStream random(seed, static_cast<std::uint64_t>(test), Purpose::kFolds);
    std::map<int, std::vector<int>> classes;
    for (int i = 0; i < count; ++i) {
      if (i != test) classes[labels[static_cast<std::size_t>(i)]].push_back(i);
    }
    std::vector<int> chosen;
    for (const auto& [label, members] : classes) {
      if (members.size() > 1) chosen.push_back(members[draw_below(members.size(), random)]);
    }
    folds.push_back(complete(test, std::move(chosen), count));
  }
  return folds;
}

void run_folds(int count, int threads, const std::function<void(int fold)>& work, const Progress& progress) {
  if (count < 0 || threads < 0) fail("leave-one-out: {} folds on {} threads; neither may be below 0", count, threads);
  if (threads == 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::exception_ptr> errors(static_cast<std::size_t>(count));
  std::atomic<int> next{0};
  std::atomic<int> done{0};
  const auto run = [&] {
    for (int fold = next++; fold < count; fold = next++) {
      try {
        work(fold);
      } catch (...) {
        errors[static_cast<std::size_t>(fold)] = std::current_exception();
      }
      const int finished = ++done;
      if (progress) progress("folds", finished, count);
    }
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < std::min(threads, count); ++i) helpers.emplace_back(run);
  run();
  helpers.clear();  // joins
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

}  // namespace touchstone::sensors
