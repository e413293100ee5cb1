// The hard case of relaxation times 10^6 apart, 39, with steps a thousand times as long as the shortest and a
// thousandth of the longest, or of any length.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "fem/contact/relaxation.h"
#include "fem/finite_strain/finite_press.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::Worst;

constexpr double kShort = 1e-3, kLong = 1e3;  // s
const PronySeries kSeries = {{0.35, kShort}, {0.4, kLong}};

/// Traction over E0 of a strain that grows evenly to one within `rise` s and then stays.
double held_ramp(double rise, double seconds) {
  double sum = lasting_share(kSeries);
  for (const PronyTerm& term : kSeries) {
    sum -= term.share * term.time / rise * std::expm1(-rise / term.time) * std::exp(-(seconds - rise) / term.time);
  }
  return sum;
}

/// E0 J(t) of a load that is put on at once: J~ = (1 + s a)(1 + s b) / (s P(s)), P = a b s^2 + q s + g, by its poles.
double creep(double seconds) {
  const double a = kShort, b = kLong;
  const double g = lasting_share(kSeries);
  const double q = g * (a + b) + kSeries[0].share * a + kSeries[1].share * b;
  const double fast = -(q + std::sqrt(q * q - 4.0 * a * b * g)) / (2.0 * a * b);
  const double slow = g / (a * b * fast);
  double sum = 1.0 / g;
  for (const auto& [pole, other] : {std::pair{fast, slow}, {slow, fast}}) {
    sum += (1.0 + pole * a) * (1.0 + pole * b) / (pole * a * b * (pole - other)) * std::exp(pole * seconds);
  }
  return sum;
}

PressTarget at(double x, double z, double seconds) {
  PressTarget target = test::target_at(x, 0.0, z);
  target.seconds = seconds;
  return target;
}

/// Steps from 0 to 10^4 s: even ones of a second; from 10^-7 s on ever longer ones; one; and short ones in the middle.
std::vector<std::vector<double>> ways(double rise) {
  const double rest = 1e4 - rise;
  std::vector<std::vector<double>> all;
  std::vector<double> even;
  for (int k = 0; k < 10000 - static_cast<int>(rise); ++k) even.push_back(1.0);
  all.push_back(even);
  std::vector<double> growing;
  double sum = 0.0;
  for (double step = 1e-7; sum + step < rest; step *= 1.3) {
    growing.push_back(step);
    sum += step;
  }
  growing.push_back(rest - sum);
  all.push_back(growing);
  all.push_back({rest});
  std::vector<double> uneven = {0.37 * rest};
  for (int k = 0; k < 3000; ++k) uneven.push_back(k % 2 == 0 ? 1e-6 : 0.02);
  double uneven_sum = 0.0;
  for (const double step : uneven) uneven_sum += step;
  uneven.push_back(rest - uneven_sum);
  all.push_back(uneven);
  return all;
}

TEST(HardCase39, AHeldStrainRelaxesAsTheSeriesSaysInAnySteps) {
  constexpr double kRise = 2.0;
  Worst away{1e-12};
  std::size_t steps = 0;
  for (const std::vector<double>& way : ways(kRise)) {
    for (const int parts : {1, 7}) {
      RelaxationHistory history;
      double seconds = 0.0;
      const auto strain_to = [&](double strain, double step_s) {
        const RelaxationStep step = relaxation_step(kSeries, step_s);
        const Eigen::VectorXd now =
            Eigen::VectorXd::Constant(1, step.stiffness * strain) + carried_over(step, history, 1);
        history = after_step(step, history, now);
        seconds += step_s;
        return now[0];
      };
      for (int k = 1; k <= parts; ++k) strain_to(static_cast<double>(k) / parts, kRise / parts);
      for (const double step : way) {
        const double traction = strain_to(1.0, step);
        EXPECT_LT(away(std::abs(traction - held_ramp(kRise, seconds))), away.bar) << seconds;
        ++steps;
      }
      ASSERT_NEAR(seconds, 1e4, 1e-6);
    }
  }
  did("one strain, terms of 0.001 s and 1000 s, held for 10^4 s in steps from 1e-7 s to 10^4 s: at each of {} steps "
      "its "
      "traction is the closed form's to {}",
      steps, away.text());
}

TEST(HardCase39, AHeldLoadCreepsAsTheClosedFormInLongSteps) {
  // In a step that begins with the load the strain is taken to go evenly, where it jumps within the shortest time: by
  // as much as that is of the step, and what relaxes slowly in half the step.
  std::string errors;
  for (const double step_s : {1.0, 0.1}) {
    Worst away{2.0 * (kShort / step_s + 0.5 * step_s / kLong)};
    RelaxationHistory history;
    const Eigen::VectorXd load = Eigen::VectorXd::Ones(1);
    history = after_step(relaxation_step(kSeries, 0.0), history, load);
    EXPECT_DOUBLE_EQ(history.elastic[0], 1.0);
    const RelaxationStep step = relaxation_step(kSeries, step_s);
    for (int k = 1; k * step_s <= 5000.0; ++k) {
      history = after_step(step, history, load);
      EXPECT_LT(away(std::abs(history.elastic[0] / creep(k * step_s) - 1.0)), away.bar) << k * step_s;
    }
    errors += fmt::format("{}{} in steps of {} s", errors.empty() ? "" : ", ", away.text(), step_s);
  }
  did("one load held for 5000 s: its strain grows from 1 to {:.3g} as the closed form's, relative, to {}",
      creep(5000.0), errors);
}

TEST(HardCase39, APressRelaxesAsTheSeriesSays) {
  const Compliance gel = test::half_space_gel(1.5, 0.25, {1.0, 0.45}, 5.0);
  constexpr double kBallRadius = 6.0;
  PressTolerance tight;
  tight.lookup_mm = 1e-12;
  tight.traction = 1e-13;
  Worst away{1e-8};
  int steps = 0;
  for (const double friction : {0.0, 0.4}) {
    Press press(gel, SphereShape{kBallRadius}, friction, tight, kSeries);
    press.step(at(0.0, kBallRadius - 0.1, 0.0));
    const PressState start = press.step(at(0.02, kBallRadius - 0.1, 0.0));
    double seconds = 0.0;
    for (const double step : {1.0, 1.0, 1e-6, 1e-3, 30.0, 1e3, 1e-9, 1.0, 9e3, 1e6}) {
      const PressState& state = press.step(at(0.02, kBallRadius - 0.1, step));
      const double share = relaxation_at(kSeries, seconds += step);
      EXPECT_LT(away((state.traction - share * start.traction).norm() / start.traction.norm()), away.bar) << seconds;
      EXPECT_LT(away((state.wrench - share * start.wrench).norm() / start.wrench.norm()), away.bar) << seconds;
      EXPECT_LT(
          away((state.surface_displacement - start.surface_displacement).norm() / start.surface_displacement.norm()),
          away.bar)
          << seconds;
      ++steps;
    }
  }
  // A flat punch, whose contact doesn't grow, pressed evenly within 4 s in steps of a second.
  Press elastic(gel, RoundedCylinder{0.8, 0.0, 3.0}, 0.0, tight);
  const double whole = elastic.step(at(0.0, -0.1, 0.0)).wrench[2];
  Press punch(gel, RoundedCylinder{0.8, 0.0, 3.0}, 0.0, tight, kSeries);
  punch.step(at(0.0, 0.0, 0.0));
  for (int k = 1; k <= 4; ++k) punch.step(at(0.0, -0.025 * k, 1.0));
  EXPECT_LT(away(std::abs(punch.state().wrench[2] / (held_ramp(4.0, 4.0) * whole) - 1.0)), away.bar);
  punch.step(at(0.0, -0.1, 500.0));
  EXPECT_LT(away(std::abs(punch.state().wrench[2] / (held_ramp(4.0, 504.0) * whole) - 1.0)), away.bar);
  did("a ball pressed and sheared, held in {} steps from 1e-9 s to 10^6 s, and a flat punch pressed within 4 s: "
      "forces, "
      "tractions and displacements are the closed form's, relative, to {}",
      steps, away.text());
}

TEST(HardCase39, APressAtFiniteStrainRelaxesAsTheSeriesSays) {
  const FiniteGel gel(fixtures::box_mesh({8, 8, 3}, 4, 4, 2), std::vector<ElasticMaterial>{{0.33, 0.49}}, {}, 3.0);
  constexpr double kBallRadius = 5.0;
  FinitePress press(gel, SphereShape{kBallRadius}, 0.3, {}, kSeries);
  const double start = press.step(at(0.0, kBallRadius - 0.6, 0.0)).wrench[2];
  ASSERT_GT(start, 0.0);
  Worst away{1e-6};
  double seconds = 0.0;
  for (const double step : {1.0, 1e-6, 30.0, 1e3, 1e5}) {
    const double force = press.step(at(0.0, kBallRadius - 0.6, step)).wrench[2];
    EXPECT_LT(away(std::abs(force / start - relaxation_at(kSeries, seconds += step))), away.bar) << seconds;
  }
  did("a ball pressed by 0.6 mm at finite strain and held in steps from 1e-6 s to 10^5 s: its force is the closed "
      "form's, "
      "to {} of what it was",
      away.text());
}

}  // namespace
}  // namespace touchstone::fem
