// The hard case of an undamped resonance, 38. The gel under a body that sticks to it is an oscillator that the body's
// shaking drives: without damping its amplitude is R / (1 - omega / omega_h) near a resonance omega_h, and there is no
// steady answer at it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/units.h"
#include "fem/vibration/vibration.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/hard_cases/hard_case.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::refused;
using test::Worst;
using ::testing::HasSubstr;
using Complex = std::complex<double>;

constexpr double kDensity = 1.05e-9;  // tonne/mm^3
constexpr double kModulus = 0.33;     // MPa
constexpr double kHeight = 5.0;
constexpr double kShake = 0.01;                         // mm, along the column
constexpr double kBeadHeight = 3.0, kBeadRadius = 0.5;  // over the plate

/// A column that Poisson's ratio doesn't narrow, all of its face shaken along it: a wave's equation in one dimension.
struct Column {
  TetMesh mesh = fixtures::box_mesh({2, 2, kHeight}, 2, 2, 8, 0.1);
  ElasticMaterial material{kModulus, 0.0};
  std::vector<Bead> beads = {{{0.0, 0.0, kBeadHeight - kHeight}, kBeadRadius}};
  Compliance compliance = compute_compliance(mesh, material, beads, 2.0);
  GelVibration vibration = compute_vibration(mesh, material, beads, kDensity, 80);
  StuckPatch patch = [this] {
    std::vector<int> all(compliance.vertices.size());
    for (std::size_t v = 0; v < all.size(); ++v) all[v] = static_cast<int>(v);
    return StuckPatch(compliance, vibration, all);
  }();

  SteadyVibration answer(double omega, const PronySeries& series = {}) const {
    return patch.answer({0.0, 0.0, kShake}, omega, series);
  }
  double bead(double omega) const { return answer(omega).bead_displacement(0, 2).real(); }
};

const Column& column() {
  static const Column made;
  return made;
}

/// Of a bead of the column, u / shake = sin(k z) / sin(k h) sin(k r) / (k r), k = omega sqrt(rho / E).
Complex bead_of_the_wave(Complex k) {
  return std::sin(k * kBeadHeight) / std::sin(k * kHeight) * std::sin(k * kBeadRadius) / (k * kBeadRadius);
}

/// Where 1 / u goes through zero: by secants, the last one from 1e-6 to either side, as nearer is refused.
double resonance() {
  static const double found = [] {
    const double theory = kPi / kHeight * std::sqrt(kModulus / kDensity);
    double a = 0.995 * theory, b = 0.997 * theory;
    const auto root = [&] {
      const double ua = 1.0 / column().bead(a), ub = 1.0 / column().bead(b);
      return b - ub * (b - a) / (ub - ua);
    };
    for (const double beside : {1e-3, 1e-4, 1e-6}) {
      const double next = root();
      a = next * (1.0 - beside);
      b = next * (1.0 + beside);
    }
    return root();
  }();
  return found;
}

TEST(HardCase38, BesideAnUndampedResonanceTheAmplitudeIsAnOscillators) {
  const double omega = resonance();
  const double theory = kPi / kHeight * std::sqrt(kModulus / kDensity);
  Worst frequency{0.01};
  EXPECT_LT(frequency(std::abs(omega / theory - 1.0)), frequency.bar);
  // sin(k h) = -(k h - pi) there, so that u (1 - omega / omega_h) goes to this.
  const double k = kPi / kHeight;
  const double residue = kShake * std::sin(k * kBeadHeight) / kPi * std::sin(k * kBeadRadius) / (k * kBeadRadius);
  Worst away{0.02};
  double most = 0.0;
  for (double detuning = 1e-2; detuning > 5e-8; detuning *= 0.1) {
    for (const double side : {-1.0, 1.0}) {
      const double u = column().bead(omega * (1.0 + side * detuning));
      most = std::max(most, std::abs(u));
      EXPECT_LT(away(std::abs(-u * side * detuning / residue - 1.0)), away.bar + 4.0 * detuning) << side * detuning;
    }
  }
  did("a column shaken at its face without damping: it resonates at {:.5g} Hz, closed form to {}; from 1e-2 to 1e-7 "
      "beside it a bead's amplitude is the residue over the detuning, to {}, up to {:.2g} times the shaking",
      omega / (2.0 * kPi), frequency.text("relative"), away.text("relative"), most / kShake);
}

TEST(HardCase38, AtAnUndampedResonanceThereIsNoSteadyAnswer) {
  const double omega = resonance();
  const double residue = std::abs(column().bead(omega * (1.0 + 1e-5)) * 1e-5);
  std::string said;
  int refusals = 0, answers = 0;
  double most = 0.0;
  // Down to the last digits, both sides, and along the way in every decade.
  std::vector<double> places;
  for (int steps = -20; steps <= 20; ++steps) places.push_back(omega * (1.0 + 1.1e-16 * steps));
  for (double detuning = 1e-15; detuning < 1e-5; detuning *= 2.0) {
    places.push_back(omega * (1.0 - detuning));
    places.push_back(omega * (1.0 + detuning));
  }
  for (const double place : places) {
    try {
      const SteadyVibration answer = column().answer(place);
      EXPECT_TRUE(answer.bead_displacement.allFinite() && answer.force.allFinite() && answer.traction.allFinite());
      // What is answered is no rounding: nearer the amplitude would be larger.
      most = std::max(most, std::abs(answer.bead_displacement(0, 2)));
      EXPECT_GT(answer.truncation, 0.0);
      ++answers;
    } catch (const Error& error) {
      said = error.what();
      EXPECT_THAT(said, HasSubstr("resonates and nothing damps it"));
      ++refusals;
    }
  }
  EXPECT_GT(refusals, 41) << "all within the last digits, and more";
  EXPECT_GT(answers, 10);
  // The nearest that is answered is known to some five digits of its detuning.
  const double nearest = residue / most;
  EXPECT_GT(nearest, 1e-11);
  EXPECT_LT(nearest, 1e-7);
  did("nearer than {:.1g} to that resonance, relative, an undamped excitation is {}", nearest, refused(said));
}

// With loss s = s' + i s'' the wave's number is complex: a finite amplitude at resonance, of the residue over the loss.
TEST(HardCase38, DampingMakesItFiniteAndOfTheRightSize) {
  const double omega = resonance();
  Worst away{0.03};
  std::string amplitudes;
  for (const double share : {0.2, 0.02, 2e-3, 2e-4}) {
    const PronySeries series = {{share, 1.0 / omega}};
    const Complex s = complex_modulus(series, omega);
    const Complex k = kPi / kHeight / std::sqrt(s);  // pi / h where the mesh resonates, whatever its stiffness
    const SteadyVibration answer = column().answer(omega, series);
    const Complex wanted = kShake * bead_of_the_wave(k);
    EXPECT_LT(away(std::abs(answer.bead_displacement(0, 2) / wanted - 1.0)), away.bar) << share;
    EXPECT_GT(-answer.force.z().imag(), 0.0) << "the gel takes energy";
    amplitudes +=
        fmt::format("{}{:.3g}", amplitudes.empty() ? "" : ", ", std::abs(answer.bead_displacement(0, 2)) / kShake);
  }
  did("at that resonance with a loss of 10 % to 0.01 %: a bead moves by {} times the shaking, the wave equation's "
      "amplitude and phase to {}",
      amplitudes, away.text("relative"));
}

// The free gel's own frequency is no resonance under the body: there the force on it is least.
TEST(HardCase38, TheFreeGelsFrequencyIsNone) {
  const double free = 0.5 * kPi / kHeight * std::sqrt(kModulus / kDensity);
  const double scale = 4.0 * kModulus / kHeight * kShake;
  Worst force{0.01};
  for (const double frequency : column().vibration.angular_frequency.head(3)) {
    const SteadyVibration answer = column().answer(frequency);
    EXPECT_TRUE(answer.force.allFinite() && answer.bead_displacement.allFinite());
  }
  EXPECT_LT(force(std::abs(column().answer(free).force.z()) / scale), force.bar);
  did("at the free column's own frequencies the answer is finite; at the quarter wave's the force on the body is {} of "
      "the "
      "static one",
      force.text());
}

}  // namespace
}  // namespace touchstone::fem
