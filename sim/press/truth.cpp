#include "sim/press/truth.h"

#include <algorithm>

namespace touchstone::sim {

const Truth& deepest(std::span<const Truth> truths) {
  const auto depth = [](const Truth& truth) {
    const auto& moved = truth.press.surface_displacement;
    return moved.rows() == 0 ? 0.0 : moved.col(2).minCoeff();
  };
  return *std::min_element(truths.begin(), truths.end(),
                           [&](const Truth& a, const Truth& b) { return depth(a) < depth(b); });
}

}  // namespace touchstone::sim
