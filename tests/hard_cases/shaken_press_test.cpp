// The hard case of an undamped resonance, 38, in a press: a ball that shakes a gel without relaxation, at each
// frequency up to far beyond the first resonances.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "core/error.h"
#include "core/units.h"
#include "fem/vibration/eigenmodes.h"
#include "sim/press/shaken_press.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::sim {
namespace {

using test::did;
using ::testing::HasSubstr;

constexpr double kDensity = 1.05e-9;

TEST(HardCase38Press, AShakenPressIsFiniteOrRefusedByName) {
  const fem::TetMesh mesh = fem::fixtures::box_mesh({8, 8, 3}, 6, 6, 3, 0.1);
  const fem::ElasticMaterial material{0.33, 0.45};
  const fem::Compliance gel = fem::compute_compliance(mesh, material, {}, 3.0);
  const fem::GelVibration vibration = fem::compute_vibration(mesh, material, {}, kDensity, 60);
  constexpr double kRadius = 6.0;
  fem::Press press(gel, fem::SphereShape{kRadius}, 2.0);
  const fem::PressState mean = press.step(test::target_at(0, 0, kRadius - 0.4));
  std::vector<int> touching;
  for (std::size_t v = 0; v < mean.node_state.size(); ++v) {
    if (mean.node_state[v] != fem::NodeState::open) touching.push_back(static_cast<int>(v));
  }
  ASSERT_GE(touching.size(), 4U);
  // Where the gel resonates under the ball, by an eigenproblem of its own; and many frequencies besides.
  const Eigen::VectorXd held =
      fem::lowest_eigenmodes(fem::make_space(mesh), material, kDensity, 4, touching).angular_frequency;
  std::vector<double> frequencies_Hz;
  const double first_Hz = held[0] / (2.0 * kPi);
  for (double part = 0.1; part < 6.0; part += 0.02) frequencies_Hz.push_back(part * first_Hz);
  for (const double omega : held) {
    for (const double off : {0.0, 1e-12, -1e-9, 1e-6, -1e-4, 1e-3}) {
      frequencies_Hz.push_back(omega / (2.0 * kPi) * (1.0 + off));
    }
  }
  ShakenPress shaken(gel, vibration, {}, 2.0);
  std::map<std::string, int> refusals;
  int answers = 0;
  double most = 0.0;
  for (const Axis axis : {Axis::x, Axis::z}) {
    for (const double frequency_Hz : frequencies_Hz) {
      const VibrationSpec shaking{axis, 1e-3, frequency_Hz};
      try {
        const fem::PressState state = shaken.at(mean, shaking, 0.25 / frequency_Hz);
        ASSERT_TRUE(state.wrench.allFinite() && state.traction.allFinite() && state.surface_displacement.allFinite());
        // It neither lifts off nor slides, so that its force changes by less than the mean force.
        EXPECT_LT(std::abs(state.wrench[2] - mean.wrench[2]), mean.wrench[2]);
        most = std::max(most, (state.wrench - mean.wrench).head<3>().norm() / mean.wrench[2]);
        ++answers;
      } catch (const Error& error) {
        const std::string said = error.what();
        const std::string kind = said.find("lift off") != std::string::npos        ? "it would lift off"
                                 : said.find("slide") != std::string::npos         ? "it would slide"
                                 : said.find("resonance") != std::string::npos     ? "too fast or too near a resonance"
                                 : said.find("nothing damps") != std::string::npos ? "a resonance that nothing damps"
                                                                                   : said;
        ++refusals[kind];
        if (kind == "too fast or too near a resonance") {
          EXPECT_THAT(said, HasSubstr("allowed is 0.05"));
        }
      }
    }
  }
  EXPECT_GT(answers, 20);
  std::string list;
  for (const auto& [kind, count] : refusals) {
    EXPECT_LT(kind.size(), 40U) << "a message without a name: " << kind;
    list += fmt::format(", {} times: {}", count, kind);
  }
  EXPECT_FALSE(refusals.empty());
  // Slow vibrations are answered.
  for (const Axis axis : {Axis::x, Axis::z}) EXPECT_NO_THROW(shaken.at(mean, {axis, 1e-3, 0.1 * first_Hz}, 0.0));
  did("a ball that shakes a gel without damping along x and z at {} frequencies from 0.1 to 6 of the first resonance "
      "({:.4g} "
      "Hz), and at four resonances to the last digit: {} answers, finite, the force by up to {:.2g} of the mean one; "
      "refused "
      "are{}",
      frequencies_Hz.size(), first_Hz, answers, most, list.substr(1));
}

}  // namespace
}  // namespace touchstone::sim
