#pragma once
// How stress relaxation enters the contact problem of one part of a press's path (see fem/contact/relaxation.h).

#include <Eigen/Core>
#include <utility>

#include "fem/contact/contact_block.h"
#include "fem/contact/contact_solver.h"
#include "fem/contact/relaxation.h"

namespace touchstone::fem {

/// Over the part, the gel's weighted displacement is (H0 t - H0 r) / G of its traction t, H0 being the unrelaxed
/// compliance. Multiplied by G, the contact laws are those of H0 with other gaps and drags, so factors stay what they
/// are; an elastic body's own compliance is multiplied by G, too.
class PartRelaxation {
 public:
  PartRelaxation() = default;
  /// A series whose shares are all zero is none.
  explicit PartRelaxation(PronySeries series) {
    if (lasting_share(series) < 1.0) series_ = std::move(series);
  }

  /// Does the gel relax at all?
  bool on() const { return !series_.empty(); }
  /// Sets what the part begins with; n surface vertices.
  void begin(const RelaxationHistory& history, double seconds, int n);
  /// G; 1 without relaxation.
  double stiffness() const { return on() ? step_.stiffness : 1.0; }
  /// H0 r at a vertex, mm^3; zero without relaxation.
  Eigen::Vector3d carried(int vertex) const;

  /// Gaps and drags of the block's vertices, before the contact problem is solved.
  void prepare(ContactProblem& problem, const ContactBlock& block) const;
  /// Shifts and responses, after it.
  void finish(ContactAnswer& answer, const ContactBlock& block) const;

  /// What the gel remembers after the part, given its traction and H0 times it (3 n each).
  RelaxationHistory after(const RelaxationHistory& before, const Eigen::VectorXd& traction,
                          const Eigen::VectorXd& elastic_weighted) const;

 private:
  PronySeries series_;
  RelaxationStep step_;
  Eigen::VectorXd carried_;  ///< r of (traction; weighted displacement), 6 n
};

}  // namespace touchstone::fem
