#pragma once

#include <algorithm>
#include <utility>
#include <vector>

namespace touchstone::render {

/// Takes one of many lamps in proportion to its power, whatever their number, in steps that grow with its logarithm.
class ChoiceByPower {
 public:
  /// `power`: of the next lamp, 0 or more.
  void add(double power) { sums_.push_back((sums_.empty() ? 0.0 : sums_.back()) + power); }

  /// The number of a lamp from `number` in [0, 1), and the probability that it had; lamp 0 for sure if none shines.
  /// @pre there is a lamp
  std::pair<int, double> choose(double number) const {
    const double all = sums_.back();
    if (!(all > 0.0)) return {0, 1.0};
    // Rounding may run past the last lamp that shines: that is the first whose sum is all.
    const auto last = std::lower_bound(sums_.begin(), sums_.end(), all);
    const auto lamp = static_cast<int>(std::upper_bound(sums_.begin(), last, number * all) - sums_.begin());
    return {lamp, probability(lamp)};
  }

  /// That with which `choose` takes that lamp.
  double probability(int lamp) const {
    if (!(sums_.back() > 0.0)) return lamp == 0 ? 1.0 : 0.0;
    return (sums_[lamp] - (lamp > 0 ? sums_[lamp - 1] : 0.0)) / sums_.back();
  }

 private:
  std::vector<double> sums_;  // of the powers of the lamps up to and with each
};

}  // namespace touchstone::render
