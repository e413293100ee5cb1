#pragma once
// How a press that is led by a force comes to it: the force grows by a factor at a time, not by equal amounts, because
// a contact that widens follows its tangent only so far.

#include <optional>

namespace touchstone::fem {

/// The normal forces (N) of a press's parts on the way to a wanted one.
class ForceGrowth {
 public:
  explicit ForceGrowth(double wanted) : wanted_(wanted) {}

  /// The next part's force after one that ended at `now`; nothing if the wanted one is near enough for a single part.
  /// @throws Error if no factor leads on from `now`: it isn't above 0, or hasn't grown since the last call
  std::optional<double> next(double now);

 private:
  double wanted_;
  double before_ = 0.0;
};

}  // namespace touchstone::fem
