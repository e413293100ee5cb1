#pragma once
// One part of a press's path, from a converged state to the next.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/transform.h"
#include "fem/contact_block.h"
#include "fem/contact_gap.h"
#include "fem/contact_shape.h"
#include "fem/contact_solver.h"
#include "fem/patch_motion.h"

namespace touchstone::fem {

struct PressTarget;

/// A converged point of the path.
struct PressSnapshot {
  RigidTransform pose;                              ///< gel from object
  Eigen::VectorXd traction;                         ///< 3 n, MPa, gel frame
  Eigen::VectorXd weighted;                         ///< 3 n, int phi u dA, mm^3
  std::vector<NodeState> state;                     ///< n
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the object, N
  bool touching = false;
  bool overlapping = false;   ///< the body reaches under the undeformed surface
  double penetration = 0.0;   ///< mm, the largest over all vertices
  double lookup_error = 0.0;  ///< mm
  double residual = 0.0;      ///< of the contact laws
};

/// The pose at `fraction` of the straight way from a to b (rotations by slerp).
RigidTransform between(const RigidTransform& a, const RigidTransform& b, double fraction);

/// @throws Error unless the target is finite, its rotation one, and its normal force not negative
void check_target(const PressTarget& target);

/// No contact at `pose`, for a surface of n vertices.
PressSnapshot untouched(const RigidTransform& pose, int n);

/// Where a part shall end: the pose, whose forced axes are only where to begin, and the forces on the object along the
/// forced axes (N).
struct PartTarget {
  RigidTransform pose;
  std::array<bool, 3> forced{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
};

/// What it took.
struct PartEffort {
  int candidates = 0;
  int geometry_updates = 0;
  int solves = 0;
  int factorisations = 0;
  int sweeps = 0;
};

/// Solves parts, and keeps the block of candidates and the last factorised system between them.
class PartSolver {
 public:
  /// `lookup_mm`: how well the place where the gap is looked up follows the contact patch. `traction`: relative
  /// residual of the contact laws.
  PartSolver(const Compliance& gel, ContactShape shape, double lookup_mm, double traction);

  const ContactSurface& surface() const { return surface_; }
  const ContactShape& shape() const { return shape_; }

  /// The friction to solve with from now on.
  void set_friction(double friction);

  /// The snapshot at the end of the part, or nothing if it doesn't converge; why_not() then says why.
  /// @throws Error if the body reaches deeper than the gel, or a force is wanted where the body isn't over the gel
  std::optional<PressSnapshot> solve(const PressSnapshot& from, const PartTarget& target, PartEffort& effort);
  const std::string& why_not() const { return why_not_; }

 private:
  struct Iterate;
  std::vector<int> candidates(const WeightedGap& gap, const Iterate& now, bool z_forced) const;
  ContactProblem problem(const WeightedGap& gap, const PressSnapshot& from, const PartTarget& target,
                         const Iterate& now) const;
  Eigen::VectorXd drag(const PressSnapshot& from, const RigidTransform& pose) const;
  void begin(const PressSnapshot& from, Iterate& now) const;
  bool take_shift(const ContactAnswer& answer, const WeightedGap& gap, const PartTarget& target, Iterate& now);
  void follow_patch(const ContactAnswer& answer, Iterate& now) const;
  std::optional<PressSnapshot> accept(const ContactAnswer& answer, Iterate& now, PartEffort& effort) const;
  PatchMotion motion_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& displacements,
                        const std::vector<double>& pressures) const;
  Eigen::Vector3d lumped(const Eigen::VectorXd& weighted, int vertex) const;
  void refuse_too_deep(double deepest) const;

  const Compliance& gel_;
  ContactShape shape_;
  double lookup_mm_;
  double traction_;
  double friction_ = 0.0;
  bool flat_ = true;  ///< one normal all over: a shift along it moves all gaps alike
  ContactSurface surface_;
  ContactBlock block_;
  ContactMemory memory_;
  std::array<bool, 3> remembered_axes_{};
  std::string why_not_;
};

}  // namespace touchstone::fem
