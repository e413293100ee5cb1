#pragma once
// A drawn data set as its reader meets it: a card in Markdown, and the figures that it's made of.

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "datasets/sets/block_file.h"

namespace touchstone::datasets {

/// A number over all samples, kept in bins of equal width between bounds that are known before.
struct Histogram {
  std::string name, unit;
  double low = 0.0, high = 1.0;
  std::array<std::int64_t, 24> count{};
  double least = 0.0, most = 0.0, sum = 0.0;
  std::int64_t samples = 0;

  /// Counts a value; one outside of the bounds counts in the outermost bin.
  void add(double value);
  double mean() const { return samples > 0 ? sum / static_cast<double>(samples) : 0.0; }
};

/// What a data set's blocks hold in all; memory doesn't grow with them.
struct DrawnFigures {
  /// Without samples; the histograms' bounds are what the job's draws can give.
  explicit DrawnFigures(const PreparedDraw& prepared);
  /// Counts a block's samples.
  void add(const BlockColumns& block);

  std::vector<Histogram> histograms;
  std::array<std::int64_t, kSplits> splits{};
  std::vector<std::int64_t> objects;  ///< samples of each
  std::int64_t drawn_again = 0, under_resolved = 0, strained = 0, untouched = 0;
  double worst_force_error = 0.0;             ///< relative, of forces above kSmallForce_N
  std::map<std::string, std::int64_t> light;  ///< how pictures are lit: units
};

inline constexpr double kSmallForce_N = 0.05;  ///< forces below it have no relative error on the card
inline constexpr double kLargeStrain = 0.2;  ///< presses beyond it are counted: the gel is computed as linearly elastic

/// README.md
std::string data_card(const PreparedDraw& prepared, const DrawnFigures& figures);

}  // namespace touchstone::datasets
