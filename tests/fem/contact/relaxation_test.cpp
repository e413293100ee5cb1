#include "fem/contact/relaxation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

const PronySeries kOne = {{0.4, 0.5}};
const PronySeries kTwo = {{0.2, 0.1}, {0.3, 2.0}};

/// One node, held at displacement or at traction. `elastic` is the displacement over H0.
struct Node {
  PronySeries series;
  RelaxationHistory history;

  double elastic() const { return history.empty() ? 0.0 : history.elastic[0]; }
  /// Goes to the displacement; returns the traction.
  double strain_to(double elastic_wanted, double seconds) {
    const RelaxationStep step = relaxation_step(series, seconds);
    const Eigen::VectorXd now =
        Eigen::VectorXd::Constant(1, step.stiffness * elastic_wanted) + carried_over(step, history, 1);
    history = after_step(step, history, now);
    return now[0];
  }
  /// Goes to the traction; returns the displacement.
  double load_to(double traction, double seconds) {
    history = after_step(relaxation_step(series, seconds), history, Eigen::VectorXd::Constant(1, traction));
    return elastic();
  }
};

std::string error_of(const PronySeries& series) {
  try {
    check(series);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Relaxation, OnlyWhatIsPhysicalIsAllowed) {
  EXPECT_EQ(error_of({}), "");
  EXPECT_EQ(error_of(kTwo), "");
  EXPECT_EQ(error_of({{0.0, 1.0}}), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of({{-0.1, 1.0}}), HasSubstr("-0.1"));
  EXPECT_THAT(error_of({{nan, 1.0}}), HasSubstr("share"));
  EXPECT_THAT(error_of({{0.1, 0.0}}), HasSubstr("above 0"));
  EXPECT_THAT(error_of({{0.1, nan}}), HasSubstr("time"));
  EXPECT_THAT(error_of({{0.1, std::numeric_limits<double>::infinity()}}), HasSubstr("time"));
  EXPECT_THAT(error_of({{0.5, 1.0}, {0.5, 2.0}}), HasSubstr("below 1"));
}

TEST(Relaxation, HeldDisplacementRelaxesAsTheSeriesSays) {
  for (const double step : {0.001, 0.07, 1.0}) {
    Node node{kTwo, {}};
    EXPECT_DOUBLE_EQ(node.strain_to(2.0, 0.0), 2.0);
    for (int k = 1; k <= 20; ++k) {
      EXPECT_NEAR(node.strain_to(2.0, step), 2.0 * relaxation_at(kTwo, k * step), 1e-13) << step << " " << k;
    }
  }
}

// E0 J(t) = 1/g_inf - (1/g_inf - 1) exp(-t g_inf / tau) for one term. Held traction isn't piecewise linear
// displacement: the step is second order.
TEST(Relaxation, HeldTractionCreepsAsItsComplianceWithSecondOrder) {
  const double lasting = 0.6;
  const double wanted = 1.0 / lasting - (1.0 / lasting - 1.0) * std::exp(-1.0 * lasting / 0.5);
  std::vector<double> errors;
  for (const int steps : {10, 20, 40}) {
    Node node{kOne, {}};
    EXPECT_DOUBLE_EQ(node.load_to(1.0, 0.0), 1.0);
    for (int k = 0; k < steps; ++k) node.load_to(1.0, 1.0 / steps);
    errors.push_back(std::abs(node.elastic() - wanted));
  }
  EXPECT_LT(errors[0], 1e-3);
  EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.2);
  EXPECT_NEAR(errors[1] / errors[2], 4.0, 0.1);
}

// A ramp e = t: tau = g_inf t + sum g_i tau_i (1 - exp(-t/tau_i)).
TEST(Relaxation, ARampIsExact) {
  for (const int steps : {1, 3, 100}) {
    Node node{kTwo, {}};
    double traction = 0.0;
    for (int k = 1; k <= steps; ++k) traction = node.strain_to(1.5 * k / steps, 1.5 / steps);
    const double wanted = 0.5 * 1.5 - 0.2 * 0.1 * std::expm1(-1.5 / 0.1) - 0.3 * 2.0 * std::expm1(-1.5 / 2.0);
    EXPECT_NEAR(traction, wanted, 1e-13) << steps;
  }
}

TEST(Relaxation, CuttingAStepInPartsChangesNothing) {
  Node whole{kTwo, {}};
  Node parts{kTwo, {}};
  const double times[] = {0.3, 0.0, 2.0, 0.01};
  const double places[] = {1.0, 1.4, -0.5, 0.2};
  double at = 0.0;
  for (int k = 0; k < 4; ++k) {
    const double traction = whole.strain_to(places[k], times[k]);
    double last = 0.0;
    for (int part = 1; part <= 7; ++part) last = parts.strain_to(at + (places[k] - at) * part / 7.0, times[k] / 7.0);
    EXPECT_NEAR(last, traction, 1e-13);
    at = places[k];
  }
}

TEST(Relaxation, ASuddenChangeIsElasticAndAnEndlessWaitLeavesWhatLasts) {
  Node node{kTwo, {}};
  node.strain_to(1.0, 0.5);
  const double before = node.strain_to(1.0, 0.0);
  EXPECT_NEAR(node.strain_to(1.7, 0.0) - before, 0.7, 1e-15);
  EXPECT_NEAR(node.strain_to(1.7, std::numeric_limits<double>::infinity()), 0.5 * 1.7, 1e-15);
  Node tiny{kTwo, {}};
  EXPECT_NEAR(tiny.strain_to(1.0, 1e-300), 1.0, 1e-15);
  EXPECT_NEAR(tiny.strain_to(1.0, 1e-20), 1.0, 1e-15);
  EXPECT_NEAR(tiny.strain_to(1.0, 1e20), 0.5, 1e-15);
}

TEST(Relaxation, WithoutSharesItIsBitwiseElastic) {
  for (const PronySeries& series : {PronySeries{}, PronySeries{{0.0, 0.3}, {0.0, 2.0}}}) {
    Node node{series, {}};
    for (const double traction : {0.1, 1.0 / 3.0, -0.7}) EXPECT_EQ(node.load_to(traction, 0.123), traction);
  }
}

TEST(Relaxation, WhatIsUnloadedRecovers) {
  Node node{kOne, {}};
  node.load_to(1.0, 0.0);
  for (int k = 0; k < 100; ++k) node.load_to(1.0, 0.01);
  double dent = node.load_to(0.0, 0.0);
  EXPECT_GT(dent, 0.1);
  EXPECT_LT(dent, 2.0 / 3.0);
  for (int k = 0; k < 10; ++k) {
    const double after = node.load_to(0.0, 0.5);
    EXPECT_LT(after, dent);
    EXPECT_GT(after, 0.0);
    dent = after;
  }
  EXPECT_LT(dent, 2e-3);
}

TEST(Relaxation, TheComplexModulusIsTheAnswerToASteadyVibration) {
  const double omega = 7.0;
  Node node{kTwo, {}};
  const int steps = 4000;
  const double period = 2.0 * std::acos(-1.0) / omega;
  std::complex<double> found = 0.0;
  for (int k = 1; k <= 20 * steps; ++k) {  // 20 periods are 18 s, nine of the longest time constant
    const double t = k * period / steps;
    const double traction = node.strain_to(std::cos(omega * t), period / steps);
    if (k > 19 * steps) found += traction * std::polar(2.0 / steps, -omega * t);
  }
  const std::complex<double> wanted = complex_modulus(kTwo, omega);
  EXPECT_NEAR(found.real(), wanted.real(), 1e-4);
  EXPECT_NEAR(found.imag(), wanted.imag(), 1e-4);
  EXPECT_GT(wanted.imag(), 0.05);
  EXPECT_NEAR(std::abs(complex_modulus(kTwo, 1e9) - 1.0), 0.0, 1e-6);
  EXPECT_EQ(complex_modulus(kTwo, 0.0), std::complex<double>(lasting_share(kTwo)));
}

}  // namespace
}  // namespace touchstone::fem
