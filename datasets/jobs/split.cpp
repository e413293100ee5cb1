#include "datasets/jobs/split.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/nearest_name.h"
#include "core/random.h"

namespace touchstone::datasets {

EnumNames<Split> enum_names(Split) {
  return {{"train", Split::train}, {"validate", Split::validate}, {"test", Split::test}};
}

std::string name_of(Split split) {
  for (const auto& [name, value] : enum_names(Split{})) {
    if (value == split) return name;
  }
  TS_ASSERT(false);
  return {};
}

Split split_named(const std::string& name) {
  std::vector<std::string> known;
  for (const auto& [known_name, value] : enum_names(Split{})) {
    if (known_name == name) return value;
    known.push_back(known_name);
  }
  fail("split '{}' is not known{}; allowed is one of: {}", name, did_you_mean(name, known), fmt::join(known, ", "));
}

EnumNames<SplitBy> enum_names(SplitBy) {
  return {{"sample", SplitBy::sample}, {"unit", SplitBy::unit}};
}

void fields(YamlReader& in, SplitSpec& spec) {
  constexpr double kRounding = 1e-9;
  spec.where = in.where();
  spec.share = {};
  for (int k = 0; k < kSplits; ++k) {
    in.optional(name_of(static_cast<Split>(k)), spec.share[static_cast<std::size_t>(k)], Allowed::within(0.0, 1.0));
  }
  in.optional("by", spec.by);
  const double sum = std::accumulate(spec.share.begin(), spec.share.end(), 0.0);
  if (std::abs(sum - 1.0) > kRounding) {
    fail_at(in.where(), "{}train, validate and test add up to {}; 1 is needed", in.context(), sum);
  }
}

std::vector<Split> splits_of_units(const SplitSpec& spec, std::uint64_t seed, int units) {
  const auto wanted =
      static_cast<int>(std::count_if(spec.share.begin(), spec.share.end(), [](double s) { return s > 0; }));
  if (units < wanted) {
    fail_at(spec.where, "splits: by unit, but there are {} splits for {} units; draw.units.count must be {} at least",
            wanted, units, wanted);
  }
  std::vector<int> order(static_cast<std::size_t>(units));
  std::iota(order.begin(), order.end(), 0);
  RandomStream random(seed, 0, Purpose::kSplit);
  for (std::size_t k = order.size(); k > 1; --k) {  // Fisher and Yates
    std::swap(order[k - 1],
              order[std::min(k - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(k)))]);
  }
  // How many units each gets: rounded down, at least one; what is left goes where most was cut off.
  std::array<int, kSplits> count{};
  for (std::size_t s = 0; s < kSplits; ++s) {
    if (spec.share[s] > 0) count[s] = std::max(1, static_cast<int>(spec.share[s] * units + 1e-9));
  }
  for (int left = units - std::accumulate(count.begin(), count.end(), 0); left != 0; left += left > 0 ? -1 : 1) {
    const double sign = left > 0 ? 1.0 : -1.0;
    std::size_t best = 0;
    double most = -INFINITY;
    for (std::size_t s = 0; s < kSplits; ++s) {
      if (!(spec.share[s] > 0) || (left < 0 && count[s] == 1)) continue;
      const double missing = sign * (spec.share[s] * units - count[s]);
      if (missing > most) {
        most = missing;
        best = s;
      }
    }
    count[best] += left > 0 ? 1 : -1;
  }
  std::vector<Split> splits(static_cast<std::size_t>(units));
  std::size_t next = 0;
  for (std::size_t s = 0; s < kSplits; ++s) {
    for (int k = 0; k < count[s]; ++k) splits[static_cast<std::size_t>(order[next++])] = static_cast<Split>(s);
  }
  TS_ASSERT(next == order.size());
  return splits;
}

Split split_of_sample(const SplitSpec& spec, std::uint64_t seed, std::int64_t sample) {
  const double drawn = RandomStream(seed, static_cast<std::uint64_t>(sample) + 1, Purpose::kSplit).uniform();
  double below = 0.0;
  std::size_t last = 0;
  for (std::size_t s = 0; s < kSplits; ++s) {
    if (!(spec.share[s] > 0)) continue;
    last = s;
    below += spec.share[s];
    if (drawn < below) return static_cast<Split>(s);
  }
  return static_cast<Split>(last);
}

}  // namespace touchstone::datasets
