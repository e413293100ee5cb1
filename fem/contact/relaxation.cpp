#include "fem/contact/relaxation.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// (1 - exp(-x)) / x, which is 1 at 0 and 0 at infinity.
double mean_decay(double x) {
  return x > 0.0 ? -std::expm1(-x) / x : 1.0;
}

}  // namespace

void check(const PronySeries& series) {
  double sum = 0.0;
  for (const PronyTerm& term : series) {
    if (!std::isfinite(term.share) || term.share < 0.0) {
      fail("a relaxing share is {}; it must be finite and at least 0", term.share);
    }
    if (!std::isfinite(term.time) || term.time <= 0.0) {
      fail("a relaxation time is {} s; it must be finite and above 0", term.time);
    }
    sum += term.share;
  }
  if (sum >= 1.0) fail("the relaxing shares sum to {}; they must leave something: their sum must be below 1", sum);
}

double lasting_share(const PronySeries& series) {
  double rest = 1.0;
  for (const PronyTerm& term : series) rest -= term.share;
  return rest;
}

double relaxation_at(const PronySeries& series, double seconds) {
  TS_ASSERT(seconds >= 0.0);
  double sum = lasting_share(series);
  for (const PronyTerm& term : series) sum += term.share * std::exp(-seconds / term.time);
  return sum;
}

std::complex<double> complex_modulus(const PronySeries& series, double angular_frequency) {
  std::complex<double> sum = lasting_share(series);
  for (const PronyTerm& term : series) {
    const std::complex<double> turn(0.0, angular_frequency * term.time);
    sum += term.share * turn / (1.0 + turn);
  }
  return sum;
}

RelaxationStep relaxation_step(const PronySeries& series, double seconds) {
  TS_ASSERT(seconds >= 0.0);
  RelaxationStep step;
  step.stiffness = lasting_share(series);
  for (const PronyTerm& term : series) {
    const double x = seconds / term.time;
    step.decay.push_back(std::exp(-x));
    step.uptake.push_back(term.share * mean_decay(x));
    step.stiffness += step.uptake.back();
  }
  return step;
}

Eigen::VectorXd carried_over(const RelaxationStep& step, const RelaxationHistory& before, Eigen::Index size) {
  Eigen::VectorXd rest = Eigen::VectorXd::Zero(size);
  if (before.empty()) return rest;
  TS_ASSERT(before.elastic.size() == size && before.terms.size() == step.decay.size());
  for (std::size_t i = 0; i < step.decay.size(); ++i) {
    rest += step.decay[i] * before.terms[i] - step.uptake[i] * before.elastic;
  }
  return rest;
}

RelaxationHistory after_step(const RelaxationStep& step, const RelaxationHistory& before, const Eigen::VectorXd& now) {
  RelaxationHistory after;
  after.elastic = (now - carried_over(step, before, now.size())) / step.stiffness;
  for (std::size_t i = 0; i < step.decay.size(); ++i) {
    if (before.empty()) {
      after.terms.emplace_back(step.uptake[i] * after.elastic);
    } else {
      after.terms.emplace_back(step.decay[i] * before.terms[i] + step.uptake[i] * (after.elastic - before.elastic));
    }
  }
  return after;
}

}  // namespace touchstone::fem
