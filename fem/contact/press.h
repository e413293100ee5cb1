#pragma once
// Bodies pressed on the gel, step by step along a motion.
//
// Linear elasticity and unilateral contact with Coulomb friction. What is kept of large motion: the gap is looked up
// where the contact patch's mean motion along the surface (translation and spin, weighted by pressure) has carried the
// gel, so a sheared gel stays under the object that holds it; and the object's own rotation is finite. Contact acts
// along the undeformed surface's normal.
//
// Friction remembers: each step adds the relative motion of object and gel since the last one, and what sticks is
// carried along. A step that starts out of contact takes its history from the touch on: with all axes
// position-controlled, from where the straight path from the last pose first touches; with z force-controlled (or at
// the very first step) from straight above the target.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/transform.h"
#include "fem/contact/contact_solver.h"
#include "fem/contact/press_body.h"
#include "fem/contact/relaxation.h"
#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

struct CutHats;

/// What one translation axis of the object is commanded: its position (mm, the object frame's origin in the gel frame)
/// or the force on the object (N, gel frame; pressing gives Fz > 0).
struct AxisControl {
  /// What is prescribed along the axis; the other one follows.
  enum class Kind { position, force };
  Kind kind = Kind::position;
  double value = 0.0;

  static AxisControl at(double position) { return {Kind::position, position}; }
  static AxisControl with_force(double force) { return {Kind::force, force}; }
};

/// Where the object is to be at the end of a step, or what is to act on it.
struct PressTarget {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< gel from object
  std::array<AxisControl, 3> axis;                         ///< x, y, z
  /// Torque on the object about its origin, N mm, along the gel frame's x, y, z. Where one is given, the object turns
  /// about that axis, beyond `rotation`, until it is reached (by at most 0.8 rad); without contact it stays.
  std::array<std::optional<double>, 3> torque = {};
  double seconds = 0.0;  ///< since the last step; matters to a gel that relaxes only
};

/// When a step is good enough.
struct PressTolerance {
  double force = 1e-6;      ///< of a wanted force, relative or N, whichever is larger
  double lookup_mm = 1e-6;  ///< between where the gap is looked up and where the contact patch has gone; a hundred
                            ///< times that where the iteration doesn't settle (see PressState::lookup_error)
  double traction = 1e-10;  ///< of the contact laws, relative to the largest pressure
  double largest_motion =
      std::numeric_limits<double>::infinity();  ///< mm: steps with friction are cut into equal parts
                                                ///< whose translations are no longer than this
  /// Of a step with friction in which a body that is led by force first touches, with fewer parts than this: so many,
  /// each of which ends twice as far as the one before. What sticks keeps the place along the body that it had when it
  /// was touched, so the displacement along the surface needs parts, the force hardly does: in one part of a sphere's
  /// press it was off by 0.37 to 0.60 (root of the mean square, of its own), the depth by 0.1 %; in four by 0.16 to
  /// 0.27 and 0.04 %.
  int touch_parts = 1;
  int most_halvings = 7;          ///< of a step that doesn't converge
  bool outlines = true;           ///< hats are cut by what bodies cover (see cut_hats.h); false: they are
                                  ///< whole, as at finite strain, for comparisons with that
  int most_factorisations = 300;  ///< of the whole gel in a step at finite strain, which then gives up
};

/// What a step computes.
enum class PressOutput : std::uint8_t {
  forces,  ///< poses, wrenches, tractions, states, beads
  fields,  ///< the surface's displacement, too, and what is derived from it: a pass over the whole compliance
};

/// One body after a step.
struct BodyState {
  RigidTransform gel_from_object;
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();  ///< on the object: force (N), torque (N
                                                                             ///< mm) about the gel frame's origin
  double contact_area = 0.0;                                                 ///< mm^2
  int contact_vertices = 0;
};

/// What a step left behind. n surface vertices, m beads. All zero out of contact.
struct PressState {
  RigidTransform gel_from_object;                                            ///< of the first body
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();  ///< likewise
  std::vector<BodyState> bodies;                                             ///< all of them
  Eigen::MatrixX3d traction;                                                 ///< n x 3, MPa, on the gel, P1
  Eigen::MatrixX3d surface_displacement;  ///< n x 3, mm: the L2 projection on P1, mass^-1 * surface * traction; fields
  Eigen::MatrixX3d bead_displacement;     ///< m x 3, mm
  Eigen::VectorXd bearing_share;        ///< n: the part of a vertex's hat that the body covers and that bears, 1 where
                                        ///< no outline cuts it (see cut_hats.h); empty: hats are whole
  std::shared_ptr<const CutHats> cuts;  ///< how they are cut; null: all are whole
  std::vector<NodeState> node_state;    ///< n
  std::vector<int> node_owner;          ///< n, the body that a vertex touches, -1 where open
  Eigen::VectorXd object_gives;  ///< n, mm, means over hats: how far an elastic body's surface has given way along
                                 ///< the gel's normal; NaN where none touches; empty: all are rigid, or the gel relaxes

  double largest_penetration = 0.0;  ///< mm, weighted gap over weight
  double largest_tension = 0.0;      ///< MPa
  double cone_violation = 0.0;       ///< excess of |t| over mu p, relative to mu times the largest pressure
  double lookup_error = 0.0;         ///< mm, see PressTolerance::lookup_mm
  double force_residual = 0.0;       ///< N, over the force-controlled axes
  double torque_residual = 0.0;      ///< N mm, over the torque-controlled axes
  double contact_residual = 0.0;     ///< see ContactAnswer::residual
  double largest_gradient = 0.0;     ///< of the surface displacement (see largest_surface_gradient): strain and tilt;
                                     ///< fields
  double largest_strain = 0.0;       ///< the larger of largest_gradient and |normal displacement| / thickness. Linear
                                     ///< elasticity is first-order in it: above some 0.2, don't trust percents; fields
  double contact_area = 0.0;         ///< mm^2: weights of the vertices in contact, times what bears of them
  int contact_vertices = 0;
  bool under_resolved = false;  ///< overlapping, but in contact with fewer than 13 vertices (a contact radius under
                                ///< two edges) or with none that only others in contact surround (as a knife's edge):
                                ///< forces may be several percent off
  int candidates = 0;           ///< vertices in the dense block
  int geometry_updates = 0;     ///< gap evaluations, over all parts of the step
  int solves = 0;               ///< linear systems solved
  int factorisations = 0;
  int sweeps = 0;  ///< Gauss-Seidel
  int parts = 0;   ///< in how many parts the step was made
};

/// The gel and what presses on it, with the history of friction and relaxation: step() leads from one state to the
/// next. It can be moved, not copied.
class Press {
 public:
  /// One rigid body. `friction` is Coulomb's mu >= 0; infinity: what touches sticks (a step in which that has no
  /// answer, because a vertex can shed its shear only by opening, is made with mu = 100). The compliance must outlive
  /// this.
  ///
  /// `relaxation`: the gel's moduli relax by this series from those of the compliance, which are the instantaneous
  /// ones. Over each step (each part of it where it's cut, see PressState::parts) the displacement is taken to go
  /// linearly. While nothing touches, the gel recovers; a step that starts out of contact and has its z
  /// position-controlled begins to load at the share of its time at which its straight path touches the undeformed
  /// face, else with its whole time.
  /// @throws Error for a shape, a friction or a relaxation that isn't allowed
  Press(const Compliance& gel, ContactShape shape, double friction, PressTolerance tolerance = {},
        PronySeries relaxation = {}, PressOutput output = PressOutput::fields);
  /// Several bodies at once, which may be elastic. They touch the gel, not each other; where two are over one vertex,
  /// the nearer one touches. @pre at least one
  Press(const Compliance& gel, std::vector<PressBody> bodies, PressTolerance tolerance = {},
        PronySeries relaxation = {}, PressOutput output = PressOutput::fields);
  Press(Press&&) noexcept;
  Press& operator=(Press&&) noexcept;
  ~Press();

  /// Moves the bodies to their targets, all at once and in the same time. Force-controlled axes start where they were
  /// (0 at the first step).
  /// @throws Error, the state being as before the step, if: a target has NaN or infinity or isn't a rotation; a normal
  /// force or a time is negative; a body reaches deeper than the gel; a shear is wanted that friction can't hold
  /// ("gross slip:
  /// ..."); a force is wanted but the body isn't over the gel; the iteration doesn't converge (with its residual)
  const PressState& step(std::span<const PressTarget> targets);
  /// The same for one body.
  const PressState& step(const PressTarget& target) { return step(std::span(&target, 1)); }

  /// After the last step; before the first one the gel at rest.
  const PressState& state() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::fem
