#pragma once
// One part of a finite-strain press's path, from a converged state to the next.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
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

/// An axis along which a body is led by a force or about which it's led by a torque.
struct LedAxis {
  int body = 0;
  int axis = 0;      ///< 0 to 2: a shift along x, y, z of the gel frame; 3 to 5: a turn about them through its origin
  double arm = 1.0;  ///< mm: how far the body reaches from its origin. A turn is counted in mm of so long an arm

  bool turns() const { return axis >= 3; }
  friend bool operator==(const LedAxis&, const LedAxis&) = default;
};

/// A converged state of gel and bodies.
struct FiniteSnapshot {
  std::vector<BodySnapshot> bodies;
  ElasticSolution elastic;
  Eigen::VectorXd pressure;  ///< n, MPa: the gap's multiplier
  Eigen::MatrixX3d shear;    ///< n x 3, MPa, on the gel
  std::vector<NodeState> state;
  std::vector<int> owner;  ///< n, the body that has the least gap there; -1: none is near
  bool touching = false;   ///< is any body?
  DeformedGap gap;         ///< of a touching state; from an elastic object's surface as it is then
  /// n x 3, mm^3, gel frame: int phi_i g dA, by how much an elastic object's surface gives way, against the gel; known
  /// where the gel touches and beside it, else zero; empty if all are rigid.
  Eigen::MatrixX3d given;
  double penetration = 0.0;  ///< mm, the largest weighted gap below zero over its weight
  double residual = 0.0;     ///< of the contact laws
};

/// The gel at rest under bodies at these poses.
FiniteSnapshot untouched(const FiniteGel& gel, std::vector<BodySnapshot> bodies);

/// What a body's pressures do to the gel's nodes (nodes x 3, N).
Eigen::MatrixX3d pressure_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body);
/// The same of all its tractions.
Eigen::MatrixX3d traction_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body);
/// What it does beside them against edges that bulge (nodes x 3, N).
Eigen::MatrixX3d bulge_forces(const FiniteGel& gel, const FiniteSnapshot& at, int body);

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
  FinitePartSolver(const FiniteGel& gel, std::vector<PressBody> bodies, PressTolerance tolerance);

  const std::vector<PressBody>& bodies() const { return bodies_; }
  /// How deep a body reaches under the undeformed surface, mm; minus infinity if it isn't over it.
  double overlap(int body, const RigidTransform& pose) const;
  /// The same of its lowest corner (fem/contact/tip_gap.h).
  double tip_overlap(int body, const RigidTransform& pose) const;

  /// The state at the end of the part, or nothing if Newton's method doesn't get there; why_not() then says why.
  std::optional<FiniteSnapshot> solve(const FiniteSnapshot& from, std::span<const PartTarget> targets,
                                      PartEffort& effort);
  const std::string& why_not() const { return why_not_; }

  /// The tangent that the next part begins with; nothing: it makes its own. A step that is taken back gives it back.
  const std::shared_ptr<const FiniteTangent>& tangent() const { return tangent_; }
  void take_back(std::shared_ptr<const FiniteTangent> tangent) { tangent_ = std::move(tangent); }

 private:
  struct Soft;
  struct Iterate;
  struct Step;
  struct Now;
  double friction_at(const FiniteSnapshot& at, int vertex) const { return bodies_[at.owner[vertex]].friction; }
  void find_gaps(bool anew, Iterate& iterate, PartEffort& effort) const;
  void evaluate(bool anew, Iterate& iterate, PartEffort& effort) const;
  void give_way(bool anew, Iterate& iterate) const;
  void give_way(int body, bool anew, const std::vector<int>& near, Iterate& iterate) const;
  void add_given(const Iterate& iterate, const std::vector<int>& block, int components,
                 Eigen::MatrixXd& compliance) const;
  std::vector<int> with_those_beside(const FiniteSnapshot& at, std::vector<int> vertices) const;
  std::vector<int> candidates(const FiniteSnapshot& at) const;
  Eigen::Vector2d slid(const FiniteSnapshot& from, const FiniteSnapshot& at, int vertex,
                       const Eigen::Matrix3d& axes) const;
  double error_of(const FiniteSnapshot& from, std::span<const PartTarget> targets, const Iterate& iterate) const;
  bool cover(const Iterate& iterate, const std::vector<int>& block);
  bool factorise(const Iterate& iterate, PartEffort& effort);
  Now now_at(const FiniteSnapshot& from, const Iterate& iterate, const std::vector<int>& block) const;
  bool find_step(const FiniteSnapshot& from, std::span<const PartTarget> targets, Iterate& iterate, Step& step,
                 PartEffort& effort);
  bool move_bodies(const Step& step, double factor, std::vector<BodySnapshot>& bodies);
  std::optional<FiniteSnapshot> finished(Iterate iterate);
  bool take_step(const Step& step, double& factor, Iterate& iterate);

  const FiniteGel& gel_;
  std::vector<PressBody> bodies_;
  std::vector<std::unique_ptr<const ElasticBody>> soft_;  ///< per body; none: it is rigid
  bool any_soft_ = false;
  int components_ = 1;  ///< rows a vertex, as in LawRows
  PressTolerance tolerance_;
  int n_;
  std::shared_ptr<const FiniteTangent> tangent_;
  std::string why_not_;
};

}  // namespace touchstone::fem
