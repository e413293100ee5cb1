#pragma once
// What a hard case's test measured, for the page that script/hard_cases writes. A test belongs to the case whose number
// its suite bears, HardCase27 or HardCase27Media, and says by did() what the program under test did.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

namespace touchstone::test {

/// The largest value that a test has met, beside the bar that it must stay below.
struct Worst {
  double bar;
  double seen = 0.0;

  /// Hands `value` on; NaN stays.
  double operator()(double value) {
    if (std::isnan(value) || value > seen) seen = value;
    return value;
  }
  /// "3e-09 mm (allowed 1e-06)"
  std::string text(const std::string& unit = "") const {
    return fmt::format("{:.2g}{}{} (allowed {:.3g})", seen, unit.empty() ? "" : " ", unit, bar);
  }
};

/// Adds a line to what the page says of the running test: a whole sentence without its full stop, with this run's
/// numbers.
template <typename... Values>
void did(fmt::format_string<Values...> text, Values&&... values) {
  std::string all = fmt::format(text, std::forward<Values>(values)...);
  const testing::TestResult& sofar = *testing::UnitTest::GetInstance()->current_test_info()->result();
  for (int i = 0; i < sofar.test_property_count(); ++i) {
    const testing::TestProperty& property = sofar.GetTestProperty(i);
    if (std::string(property.key()) == "did") all = property.value() + ("\n" + all);
  }
  testing::Test::RecordProperty("did", all);
}

/// An error's whole text, as it is on the page; what an empty one means is plain there, too.
inline std::string refused(const std::string& message) {
  return message.empty() ? "not refused" : "refused: \"" + message + '"';
}

}  // namespace touchstone::test
