#pragma once
// One part of a finite-strain press's path, from a converged state to the next.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/transform.h"
#include "fem/contact/contact_solver.h"
#include "fem/contact/elastic_body.h"
#include "fem/contact/press.h"
#include "fem/contact/press_body.h"
#include "fem/contact/press_part.h"
#include "fem/finite_strain/finite_contact.h"
#include "fem/finite_strain/finite_gel.h"

namespace touchstone::fem {

/// A converged state of gel and object.
struct FiniteSnapshot {
  RigidTransform pose;  ///< gel from object
  ElasticSolution elastic;
  Eigen::VectorXd pressure;  ///< n, MPa: the gap's multiplier
  Eigen::MatrixX3d shear;    ///< n x 3, MPa, on the gel
  std::vector<NodeState> state;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the object, N
  bool touching = false;
  DeformedGap gap;  ///< of a touching state; from an elastic object's surface as it is then
  /// n x 3, mm^3, gel frame: int phi_i g dA, by how much an elastic object's surface gives way, against the gel; known
  /// where the gel touches and beside it, else zero; empty for a rigid one.
  Eigen::MatrixX3d given;
  double penetration = 0.0;  ///< mm, the largest weighted gap below zero over its weight
  double residual = 0.0;     ///< of the contact laws
};

/// The gel at rest under an object at `pose`.
FiniteSnapshot untouched(const FiniteGel& gel, const RigidTransform& pose);

/// What contact does to the gel's nodes (nodes x 3, N): by its tractions, and by its edges against bulging.
Eigen::MatrixX3d traction_forces(const FiniteGel& gel, const FiniteSnapshot& at);
/// The part of these forces that acts against bulging (nodes x 3, N).
Eigen::MatrixX3d bulge_forces(const FiniteGel& gel, const FiniteSnapshot& at);

/// What contact does to the vertex's hat, MPa: force per undeformed area.
Eigen::Vector3d traction_at(const FiniteGel& gel, const FiniteSnapshot& at, int vertex);

/// The gel's tangent at some state, factorised, with the compliance of the vertices that may touch there.
struct FiniteTangent;

/// Newton's method for parts, its tangent held as long as the error falls fast with it: to factorise the gel takes as
/// long as some ten steps with the factor there is. Residual and gaps are always those of the iterate, so what is
/// converged to doesn't depend on the tangent's age.
class FinitePartSolver {
 public:
  /// Of the tolerance, `force`, `lookup_mm` and `traction` count (see FinitePress).
  FinitePartSolver(const FiniteGel& gel, PressBody body, PressTolerance tolerance);

  /// How deep the object reaches under the undeformed surface, mm; minus infinity if it isn't over it.
  double overlap(const RigidTransform& pose) const;
  /// The same of the object's lowest corner (fem/contact/tip_gap.h).
  double tip_overlap(const RigidTransform& pose) const;

  /// The state at the end of the part, or nothing if Newton's method doesn't get there; why_not() then says why.
  std::optional<FiniteSnapshot> solve(const FiniteSnapshot& from, const PartTarget& target, PartEffort& effort);
  const std::string& why_not() const { return why_not_; }

  /// The tangent that the next part begins with; nothing: it makes its own. A step that is taken back gives it back.
  const std::shared_ptr<const FiniteTangent>& tangent() const { return tangent_; }
  void take_back(std::shared_ptr<const FiniteTangent> tangent) { tangent_ = std::move(tangent); }

 private:
  struct Soft;
  struct Iterate;
  struct Step;
  struct Now;
  void evaluate(const GapLines* held, Iterate& iterate, PartEffort& effort) const;
  void give_way(bool anew, Iterate& iterate) const;
  void add_given(const Iterate& iterate, const std::vector<int>& block, int components,
                 Eigen::MatrixXd& compliance) const;
  std::vector<int> with_those_beside(const FiniteSnapshot& at, std::vector<int> vertices) const;
  std::vector<int> candidates(const FiniteSnapshot& at) const;
  Eigen::Vector2d slid(const FiniteSnapshot& from, const FiniteSnapshot& at, int vertex,
                       const Eigen::Matrix3d& axes) const;
  double error_of(const FiniteSnapshot& from, const PartTarget& target, const Iterate& iterate) const;
  bool cover(const PartTarget& target, const Iterate& iterate, const std::vector<int>& block);
  bool factorise(const PartTarget& target, const Iterate& iterate, PartEffort& effort);
  Now now_at(const FiniteSnapshot& from, const Iterate& iterate, const std::vector<int>& block) const;
  bool find_step(const FiniteSnapshot& from, const PartTarget& target, Iterate& iterate, Step& step,
                 PartEffort& effort);
  std::optional<FiniteSnapshot> finished(Iterate iterate);
  bool take_step(const PartTarget& target, const Step& step, double& factor, Iterate& iterate);

  const FiniteGel& gel_;
  PressBody body_;
  std::unique_ptr<const ElasticBody> soft_;  ///< none: the object is rigid
  PressTolerance tolerance_;
  int n_;
  std::shared_ptr<const FiniteTangent> tangent_;
  std::string why_not_;
};

}  // namespace touchstone::fem
