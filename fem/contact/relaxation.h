#pragma once
// Stress relaxation of the gel: a Prony series with a Poisson's ratio that doesn't change with time.
//
// E(t) = E0 [g_inf + sum g_i exp(-t / tau_i)], g_inf = 1 - sum g_i. With nu constant the whole surface compliance
// scales, so relaxation acts on the surface tractions alone: with H0, the compliance of the instantaneous modulus E0,
// the displacement is u(t) = H0 e(t), where e is the pseudo-elastic traction, and the true traction is the hereditary
// integral of e ([Christensen1982, sec. 2.1]; the correspondence principle):
//   tau = g_inf e + sum h_i,     dh_i/dt = g_i de/dt - h_i / tau_i.
// Over a step dt in which e goes linearly, with x = dt / tau_i, that is integrated exactly ([Taylor1970]; [Simo1998,
// sec. 10.3]):
//   h_i' = exp(-x) h_i + g_i phi(x) (e' - e),  phi(x) = (1 - exp(-x)) / x,
// so that tau' = G e' + r with G = g_inf + sum g_i phi(x_i) and r = sum [exp(-x_i) h_i - g_i phi(x_i) e] known
// beforehand: in a step the gel is an elastic one of compliance H0 / G, displaced beforehand by -H0 r / G.

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace touchstone::fem {

/// One term of the series: the part of the instantaneous modulus that relaxes with time constant `time`.
struct PronyTerm {
  double share = 0.0;  ///< g_i, of E0
  double time = 1.0;   ///< tau_i, s
};
/// Its terms; empty: the gel doesn't relax. The shares' sum is below 1.
using PronySeries = std::vector<PronyTerm>;

/// @throws Error unless each share is finite and at least 0, each time finite and above 0, and the shares' sum below 1
void check(const PronySeries& series);

/// What doesn't relax, g_inf = 1 - sum g_i.
double lasting_share(const PronySeries& series);

/// E(t) / E0 at t >= 0 seconds after a step of strain.
double relaxation_at(const PronySeries& series, double seconds);

/// E*(omega) / E0 = g_inf + sum g_i i omega tau_i / (1 + i omega tau_i): storage and loss, for motion exp(i omega t).
std::complex<double> complex_modulus(const PronySeries& series, double angular_frequency);

/// The numbers of one step.
struct RelaxationStep {
  double stiffness = 1.0;      ///< G
  std::vector<double> decay;   ///< exp(-x_i)
  std::vector<double> uptake;  ///< g_i phi(x_i)
};
/// @pre seconds >= 0; 0 is a sudden change: G = 1. Infinity is allowed: all is relaxed
RelaxationStep relaxation_step(const PronySeries& series, double seconds);

/// What the gel remembers, of any vector that is linear in the traction (a traction, its displacement).
struct RelaxationHistory {
  Eigen::VectorXd elastic;                            ///< e
  std::vector<Eigen::VectorXd> terms;                 ///< h_i
  bool empty() const { return elastic.size() == 0; }  ///< never loaded: as if all were zero
};

/// r of the step that begins at this history. An empty history gives zeros of length `size`.
Eigen::VectorXd carried_over(const RelaxationStep& step, const RelaxationHistory& before, Eigen::Index size);

/// The history at the end of the step, which ends at the true vector `now`: e' = (now - r) / G.
RelaxationHistory after_step(const RelaxationStep& step, const RelaxationHistory& before, const Eigen::VectorXd& now);

}  // namespace touchstone::fem
