#include "datasets/jobs/spread.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::datasets {
namespace {

constexpr double kCutOff = 3.0;       // deviations
constexpr double kLeastShare = 0.01;  // of a normal's draws that may fall into its bounds

double normal_share(double low, double high) {
  const double root = std::sqrt(2.0);
  return 0.5 * (std::erf(high / root) - std::erf(low / root));
}

struct Bounds {
  double low = 0.0, high = 0.0;
};

void read_value(YamlReader& in, Bounds& bounds, Allowed allowed) {
  const std::vector<double> both = in.numbers(allowed);
  if (both.size() != 2) fail_at(in.where(), "{}has {} numbers, 2 are needed", in.context(), both.size());
  bounds = {both[0], both[1]};
  if (!(bounds.low <= bounds.high)) {
    fail_at(in.where(), "{}from {} to {}; the first must not be the larger", in.context(), bounds.low, bounds.high);
  }
}

struct Normal {
  double mean = 0.0, deviation = 0.0;
  Bounds within;
};

void fields(YamlReader& in, Normal& normal) {
  in.required("mean", normal.mean);
  in.required("deviation", normal.deviation, Allowed::above(0.0));
  normal.within = {normal.mean - kCutOff * normal.deviation, normal.mean + kCutOff * normal.deviation};
  in.optional("within", normal.within);
  const double share = normal_share((normal.within.low - normal.mean) / normal.deviation,
                                    (normal.within.high - normal.mean) / normal.deviation);
  if (share < kLeastShare) {
    fail_at(in.where(), "{}only {:.2g} of the draws would fall within {} and {}; at least {} is allowed", in.context(),
            share, normal.within.low, normal.within.high, kLeastShare);
  }
}

struct Choices {
  std::vector<double> values;
};

void read_value(YamlReader& in, Choices& choices, Allowed allowed) {
  choices.values = in.numbers(allowed);
  if (choices.values.empty()) fail_at(in.where(), "{}has no numbers; at least one is needed", in.context());
}

bool is_whole(double value) {
  constexpr double kLargest = 9007199254740992.0;  // 2^53
  return std::floor(value) == value && std::abs(value) <= kLargest;
}

}  // namespace

void fields(YamlReader& in, Spread& spread) {
  in.exactly_one_of({"uniform", "log_uniform", "whole", "normal", "one_of"});
  Bounds bounds;
  if (in.has("uniform")) {
    in.required("uniform", bounds);
    spread.kind = Spread::Kind::uniform;
  }
  if (in.has("log_uniform")) {
    in.required("log_uniform", bounds, Allowed::above(0.0));
    spread.kind = Spread::Kind::log_uniform;
  }
  if (in.has("whole")) {
    in.required("whole", bounds);
    if (!is_whole(bounds.low) || !is_whole(bounds.high)) {
      fail_at(in.where("whole"), "{}whole: from {} to {}; both must be whole numbers", in.context(), bounds.low,
              bounds.high);
    }
    spread.kind = Spread::Kind::whole;
  }
  if (in.has("normal")) {
    Normal normal;
    in.required("normal", normal);
    bounds = normal.within;
    spread.mean = normal.mean;
    spread.deviation = normal.deviation;
    spread.kind = Spread::Kind::normal;
  }
  if (in.has("one_of")) {
    Choices choices;
    in.required("one_of", choices);
    const auto [low, high] = std::minmax_element(choices.values.begin(), choices.values.end());
    bounds = {*low, *high};
    spread.choices = choices.values;
    spread.kind = Spread::Kind::one_of;
  }
  spread.low = bounds.low;
  spread.high = bounds.high;
}

void read_value(YamlReader& in, Spread& spread, Allowed allowed) {
  spread = {};
  if (!in.is_map()) {
    spread = Spread::of(in.number(allowed));
    return;
  }
  in.read_struct(spread);
  if (!allowed.holds(spread.low) || !allowed.holds(spread.high)) {
    fail_at(in.where(), "{}draws go from {} to {}; allowed is {}", in.context(), spread.low, spread.high,
            allowed.text());
  }
}

Spread Spread::of(double value) {
  Spread spread;
  spread.low = spread.high = value;
  return spread;
}

Spread Spread::uniform(double low, double high) {
  Spread spread = of(low);
  spread.kind = Kind::uniform;
  spread.high = high;
  return spread;
}

double Spread::draw(RandomStream& random) const {
  switch (kind) {
    case Kind::constant:
      return low;
    case Kind::uniform:
      return low + (high - low) * random.uniform();
    case Kind::log_uniform:
      return std::clamp(low * std::exp(std::log(high / low) * random.uniform()), low, high);
    case Kind::normal:
      for (;;) {
        const double value = mean + deviation * random.normal();
        if (value >= low && value <= high) return value;
      }
    case Kind::one_of: {
      const auto number = static_cast<std::size_t>(random.uniform() * static_cast<double>(choices.size()));
      return choices[std::min(number, choices.size() - 1)];
    }
    case Kind::whole:
      return std::min(high, low + std::floor(random.uniform() * (high - low + 1.0)));
  }
  TS_ASSERT(false);
  return 0.0;
}

std::string Spread::text() const {
  switch (kind) {
    case Kind::constant:
      return fmt::format("{}", low);
    case Kind::uniform:
      return fmt::format("uniform from {} to {}", low, high);
    case Kind::log_uniform:
      return fmt::format("log-uniform from {} to {}", low, high);
    case Kind::normal:
      return fmt::format("normal, mean {}, deviation {}, cut off at {} and {}", mean, deviation, low, high);
    case Kind::one_of:
      return fmt::format("one of {}", fmt::join(choices, ", "));
    case Kind::whole:
      return fmt::format("whole numbers from {} to {}", low, high);
  }
  TS_ASSERT(false);
  return {};
}

}  // namespace touchstone::datasets
