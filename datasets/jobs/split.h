#pragma once
// Which samples of a data set are for training, which to validate, which to test.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/yaml_reader.h"

namespace touchstone::datasets {

/// Numbers as in the files' `split`.
enum class Split : std::uint8_t { train = 0, validate = 1, test = 2 };
/// How many kinds there are; they are numbered from 0.
inline constexpr int kSplits = 3;
/// "train", "validate" or "test".
EnumNames<Split> enum_names(Split);
/// "train", "validate" or "test".
std::string name_of(Split split);
/// @throws Error that lists the known names
Split split_named(const std::string& name);

/// What is dealt out as a whole.
enum class SplitBy : std::uint8_t {
  sample,  ///< each sample by itself
  unit     ///< all samples of a unit: the test is then on sensors that training never saw
};
EnumNames<SplitBy> enum_names(SplitBy);

/// Shares of the samples, which add up to 1.
struct SplitSpec {
  std::array<double, kSplits> share = {1.0, 0.0, 0.0};
  SplitBy by = SplitBy::sample;
  SourceLocation where;
};
void fields(YamlReader& in, SplitSpec& spec);

/// The split of each unit, for SplitBy::unit: units in an order drawn at random, the first ones for training. A share
/// above 0 gets a unit at least. @throws Error if there are fewer units than shares above 0
std::vector<Split> splits_of_units(const SplitSpec& spec, std::uint64_t seed, int units);

/// The split of a sample, for SplitBy::sample: drawn at random, so that shares are met as closely as chance has it.
Split split_of_sample(const SplitSpec& spec, std::uint64_t seed, std::int64_t sample);

}  // namespace touchstone::datasets
