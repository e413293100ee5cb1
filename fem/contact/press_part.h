#pragma once
// One part of a press's path, from a converged state to the next.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/transform.h"
#include "fem/contact/contact_block.h"
#include "fem/contact/contact_gap.h"
#include "fem/contact/contact_solver.h"
#include "fem/contact/elastic_body.h"
#include "fem/contact/part_relaxation.h"
#include "fem/contact/patch_motion.h"
#include "fem/contact/press_body.h"

namespace touchstone::fem {

struct PressTarget;

/// One body at a converged point of the path.
struct BodySnapshot {
  RigidTransform pose;                               ///< gel from object
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();    ///< what torque control has turned it by beyond its target
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< on the object, N
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< on the object about the gel frame's origin, N mm
  bool touching = false;
  bool overlapping = false;  ///< it reaches under the undeformed surface
};

/// A converged point of the path.
struct PressSnapshot {
  std::vector<BodySnapshot> bodies;
  Eigen::VectorXd traction;  ///< 3 n, MPa, gel frame
  /// 3 n, mm^3, where `known`: int phi u dA of the gel, and of the gel relative to the elastic body that touches it.
  Eigen::VectorXd weighted;
  Eigen::VectorXd relative;
  std::vector<char> known;              ///< n
  std::vector<NodeState> state;         ///< n
  std::vector<int> owner;               ///< n, the body that touches; -1 where open
  double penetration = 0.0;             ///< mm, the largest over all vertices
  double lookup_error = 0.0;            ///< mm
  double residual = 0.0;                ///< of the contact laws
  Eigen::VectorXd share;                ///< n, of each hat: the part that bears (see cut_hats.h)
  std::shared_ptr<const CutHats> cuts;  ///< by all bodies; null: all hats are whole
  RelaxationHistory history;  ///< of (traction; weighted displacement by the unrelaxed gel), 6 n; may be empty

  /// Is any body in contact?
  bool touching() const;
  /// As if this body had never touched.
  void forget(int body);
};

inline constexpr double kMostTurn = 0.8;  ///< radians, by which torque control may turn a body in all

/// The rotation about the vector by its length, radians.
Eigen::Matrix3d turned_by(const Eigen::Vector3d& turn);

/// The pose at `fraction` of the straight path from a to b (rotations by slerp).
RigidTransform between(const RigidTransform& a, const RigidTransform& b, double fraction);

/// No contact, for a surface of n vertices.
PressSnapshot untouched(std::vector<BodySnapshot> bodies, int n);

/// Where a part shall end for one body: the pose, whose forced axes are only where to begin, and the forces and torques
/// on the object along the forced axes of the gel frame (N; N mm about the object frame's origin).
struct PartTarget {
  RigidTransform pose;
  std::array<bool, 3> forced{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  std::array<bool, 3> turned{};
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
};

/// What it took.
struct PartEffort {
  int candidates = 0;
  int geometry_updates = 0;
  int solves = 0;
  int factorisations = 0;
  int sweeps = 0;
};

/// Solves parts, and keeps the block of candidates, the last gaps and the last factorised system between them.
class PartSolver {
 public:
  /// `lookup_mm`: how well the place where the gap is looked up follows the contact patch. `traction`: relative
  /// residual of the contact laws. `outlines`: as in PressTolerance. `relaxation`: the compliance is that of the
  /// instantaneous modulus.
  PartSolver(const Compliance& gel, std::vector<PressBody> bodies, double lookup_mm, double traction, bool outlines,
             PronySeries relaxation);
  ~PartSolver();

  const ContactSurface& surface() const { return surface_; }
  const std::vector<PressBody>& bodies() const { return bodies_; }
  bool outlines() const { return outlines_; }  ///< see PressTolerance

  /// The friction to solve with from now on, for each body.
  void set_friction(const std::vector<double>& friction);

  /// The snapshot at the end of the part, which takes so many seconds, or nothing if it doesn't converge; why_not()
  /// then says why.
  /// @throws Error if a body reaches deeper than the gel, or a force is wanted where the body isn't over the gel
  std::optional<PressSnapshot> solve(const PressSnapshot& from, const std::vector<PartTarget>& targets, double seconds,
                                     PartEffort& effort);

  /// The gel left alone for so long after `from`, nothing touching it.
  PressSnapshot apart(const PressSnapshot& from, std::vector<BodySnapshot> bodies, double seconds);
  bool relaxes() const { return relaxation_.on(); }
  const std::string& why_not() const { return why_not_; }

  /// int phi u dA of the gel at one vertex, mm^3, computed if it isn't known.
  Eigen::Vector3d weighted_at(const PressSnapshot& snapshot, int vertex) const;

 private:
  struct Iterate;
  struct Body;
  struct CachedGap;
  bool cuts_hold(const CachedGap& cached, const Body& body, double part) const;
  WeightedGap gap_of(std::size_t body, const Iterate& now, PartEffort& effort);
  void look_up(Iterate& now, const std::vector<PartTarget>& targets, PartEffort& effort);
  std::vector<int> candidates(const Iterate& now, bool z_forced) const;
  ContactProblem problem(const PressSnapshot& from, const std::vector<PartTarget>& targets, const Iterate& now);
  Eigen::VectorXd drag(const PressSnapshot& from, const Iterate& now) const;
  void begin(const PressSnapshot& from, const std::vector<PartTarget>& targets, Iterate& now) const;
  bool take_shift(const ContactAnswer& answer, const std::vector<PartTarget>& targets, Iterate& now);
  void follow_patches(const ContactAnswer& answer, Iterate& now) const;
  std::optional<PressSnapshot> accept(const ContactAnswer& answer, const PressSnapshot& from, Iterate& now,
                                      PartEffort& effort);
  void remember(const PressSnapshot& from, PressSnapshot& next) const;
  bool bulges_into(const Iterate& now) const;
  PatchMotion motion_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& displacements,
                        const std::vector<double>& pressures) const;
  Eigen::Vector3d relative_at(const PressSnapshot& snapshot, int vertex) const;
  Eigen::Ref<const Eigen::MatrixXd> compliance() const {
    return use_combined_ ? Eigen::Ref<const Eigen::MatrixXd>(combined_) : block_.compliance();
  }
  /// Of the gel alone, with what cut hats change.
  Eigen::Ref<const Eigen::MatrixXd> gel_compliance() const {
    return any_cuts_ && elastic_ ? Eigen::Ref<const Eigen::MatrixXd>(cut_)
           : elastic_            ? block_.compliance()
                                 : compliance();
  }
  Eigen::Vector3d arm_of(const Iterate& now, int vertex) const;
  void refuse_too_deep(double deepest) const;

  const Compliance& gel_;
  std::vector<PressBody> bodies_;
  std::vector<std::unique_ptr<ElasticBody>> soft_;
  bool elastic_ = false;   ///< any body is
  bool friction_ = false;  ///< any body has some
  double lookup_mm_;
  double traction_;
  bool outlines_;
  double size_ = 1.0;  ///< mm, of a mean triangle
  PartRelaxation relaxation_;
  std::vector<double> mu_;
  ContactSurface surface_;
  ContactBlock block_;
  Eigen::MatrixXd combined_;         ///< the block's compliance with the elastic bodies' and what cut hats change
  Eigen::MatrixXd combined_normal_;  ///< its normal rows and columns
  bool use_combined_ = false;
  Eigen::MatrixXd cut_;    ///< beside elastic bodies: the block's compliance with what cut hats change
  bool any_cuts_ = false;  ///< in `combined_`
  std::vector<std::shared_ptr<const CutHats>> combined_cuts_;  ///< per body: those in `combined_`
  std::shared_ptr<const CutHats> joint_cuts_;                  ///< of all bodies, by the vertices that each is over
  std::vector<int> combined_vertices_;                         ///< and the block's vertices
  std::vector<int> combined_owner_;                            ///< and theirs
  ContactMemory memory_;
  std::vector<std::array<bool, 6>> remembered_axes_;
  std::vector<CachedGap> cached_gaps_;  ///< per body: the last gap and where it was looked up
  std::string why_not_;
};

}  // namespace touchstone::fem
