#include "fem/finite_strain/force_growth.h"

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kLargestGrowth = 3.0;

}  // namespace

std::optional<double> ForceGrowth::next(double now) {
  if (!(now * kLargestGrowth < wanted_ * 0.999)) return std::nullopt;
  if (!(now > 0.0)) {
    fail(
        "the press doesn't converge: a normal force of {:.6g} N is wanted of an object that touches with {:.6g} N; "
        "forces grow by a factor at a time, so it must be above 0. Lead the object by its pose first",
        wanted_, now);
  }
  if (!(now > before_)) {
    fail(
        "the press doesn't converge: a normal force of {:.6g} N is wanted, but it doesn't grow beyond {:.6g} N (it was "
        "{:.6g} N a part before)",
        wanted_, now, before_);
  }
  before_ = now;
  return now * kLargestGrowth;
}

}  // namespace touchstone::fem
