#pragma once
// Leave-one-out: each grasp is tested once by models that haven't seen it. [Naeini2020, sec. V.C] (48 folds: 42 grasps
// to train on, 5 to validate on, 1 to test) and V.D (43, 4 and 1).

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/progress.h"

namespace touchstone::sensors {

/// Indices of grasps, each in one of the three.
struct Fold {
  int test = 0;
  std::vector<int> validation;  ///< ascending
  std::vector<int> training;    ///< ascending
};

/// One fold a grasp. "The five experiments in the validation set are selected randomly from a wide range of forces to
/// make sure that all possible values of the applied force are covered": the other grasps are sorted by level (peak
/// force, say), cut into as many parts as are wanted, and of each part one is drawn.
/// @throws Error for levels that aren't finite, or if fewer than 1 are left to train on
std::vector<Fold> folds_by_level(std::span<const double> levels, int validation, std::uint64_t seed);

/// One fold a grasp; of each class one of the other grasps is drawn to validate on (the paper's "four experiments" are
/// as many as its materials; how they were chosen it doesn't say). A class that would have none left to train on gives
/// none.
/// @throws Error for a label below 0, or if fewer than 1 are left to train on
std::vector<Fold> folds_by_class(std::span<const int> labels, std::uint64_t seed);

/// Runs work(0), ..., work(count - 1) on so many threads (0: as many as the machine has). What work(i) does may depend
/// on i alone and be kept in a place of its own: then the result is the same for any number of threads. If some throw,
/// all others are still done, and the error of the lowest i is thrown.
/// @throws Error for a negative count or number of threads
void run_folds(int count, int threads, const std::function<void(int fold)>& work, const Progress& progress = {});

}  // namespace touchstone::sensors
