#include "lab/mechanics/spectral_line.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"

namespace touchstone::lab {
namespace {

// A cosine of amplitude 3 and phase -0.5 on line 5 of an odd and an even number of samples, beside an offset.
TEST(SpectralLines, ACosineIsItsAmplitudeAndPhaseOnItsLine) {
  for (const int count : {31, 32}) {
    std::vector<double> signal;
    for (int i = 0; i < count; ++i) signal.push_back(7.0 + 3.0 * std::cos(2.0 * kPi * 5.0 * i / count - 0.5));
    const auto lines = spectral_lines(signal);
    ASSERT_EQ(lines.size(), static_cast<std::size_t>(count / 2 + 1));
    EXPECT_EQ(strongest_line(lines), 5u);
    EXPECT_NEAR(std::abs(lines[5]), 3.0, 1e-12);
    EXPECT_NEAR(std::arg(lines[5]), -0.5, 1e-12);
    EXPECT_NEAR(std::abs(lines[6]), 0.0, 1e-12);
    EXPECT_EQ(lines[0], 0.0);
  }
}

// +1 -1 +1 ...: all of it is the line in the middle.
TEST(SpectralLines, TheMiddleLineIsCountedOnce) {
  const auto lines = spectral_lines(std::vector<double>{1, -1, 1, -1, 1, -1, 1, -1});
  EXPECT_EQ(strongest_line(lines), 4u);
  EXPECT_NEAR(lines[4].real(), 1.0, 1e-15);
}

TEST(SpectralLines, NothingHasNone) {
  EXPECT_TRUE(spectral_lines({}).empty());
}

}  // namespace
}  // namespace touchstone::lab
