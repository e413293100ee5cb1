#pragma once
// Bodies pressed on a neo-Hookean gel at finite strain, step by step along a motion: what fem/contact/press.h does in
// linear elasticity, slower (a factorisation of the whole gel every part or every few) and without its limits.
//
// The tangent is factorised bordered by the rows of the vertices that may touch (fem/finite_strain/finite_tangent.h).
// The Schur complement is the surface compliance at that state, so contact with Coulomb friction is solved on it as in
// the linear case, and the volume follows by two solutions with the same factor. It serves for further iterates and
// parts, with residual and gaps as they are there, as long as the error falls fast enough. Gaps and the direction of
// contact forces belong to the deformed surface (fem/finite_strain/finite_contact.h). Tractions are nominal: force per
// undeformed area. Friction acts in the plane across the vertex's mean contact direction, against the motion relative
// to the object since the last step.
//
// Several bodies touch the gel, not each other; each vertex may touch the one that has the least gap there. A body may
// be led by torques: its turn is an unknown like a shift, and contact forces turn with it.
//
// A body may be elastic (fem/contact/elastic_body.h). It stays linear: its compliance is added to the gel's, coupled
// where the gel's deformed surface meets it, and gaps and slips are from where its surface has gone.
//
// A gel may relax (fem/contact/relaxation.h): all of its nominal stress, the pressure in it, is then the hereditary
// integral of what the elastic gel has at the same displacements (quasi-linear [Fung1972], with the same function for
// all of it). Equilibrium is linear in nominal stress, so a gel that is led by poses moves as the elastic one, and its
// tractions and forces are the integrals of the elastic ones: exactly while contact doesn't change and the gel doesn't
// turn, since the integral adds up stresses of different directions. Where contact grows that's first order in what
// relaxes within the growth. Two things it leaves out: a gel that is let go faster than it recovers stays back, where
// this one follows the object (with no force, never a pull in all), and friction keeps to its law in the elastic
// tractions.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fem/contact/press.h"
#include "fem/contact/press_body.h"
#include "fem/contact/relaxation.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// As fem::Press, at finite strain. It can be moved, not copied.
class FinitePress {
 public:
  /// Several bodies at once. @pre at least one
  /// @throws Error as the one for a rigid body; for an elastic body where the gel relaxes
  FinitePress(const FiniteGel& gel, std::vector<PressBody> bodies, PressTolerance tolerance = {},
              PronySeries relaxation = {});
  /// The same for one body.
  FinitePress(const FiniteGel& gel, PressBody body, PressTolerance tolerance = {}, PronySeries relaxation = {});
  /// `friction` as for Press. The gel must outlive this. Of the tolerance, `force`, `lookup_mm` (here: what the gaps
  /// are closed to) and `traction` (of the laws of friction; a hundred times that) count.
  /// `relaxation`: the gel's moduli relax by this series from those of the gel, which are the instantaneous ones; over
  /// a step the elastic forces are taken to go linearly, from the touch on where it has z position-controlled.
  /// @throws Error for a shape, a friction or a relaxation that isn't allowed
  FinitePress(const FiniteGel& gel, ContactShape shape, double friction, PressTolerance tolerance = {},
              PronySeries relaxation = {});
  FinitePress(FinitePress&&) noexcept;
  FinitePress& operator=(FinitePress&&) noexcept;
  ~FinitePress();

  /// Moves the bodies to their targets, all at once, in parts of no more than a tenth of the gel's thickness, halved
  /// where Newton's method doesn't converge. In the state, `solves` counts contact problems, `factorisations` those of
  /// the gel, `parts` the parts; `lookup_error` is zero.
  /// @throws Error, the state being as before the step, as Press::step; for a target with torques if the gel relaxes;
  /// and if a tetrahedron would turn inside out, Newton's method stalls in the smallest part allowed, or a wanted
  /// normal force isn't come nearer to (fem/finite_strain/force_growth.h)
  const PressState& step(std::span<const PressTarget> targets);
  /// The same for one body.
  const PressState& step(const PressTarget& target) { return step(std::span(&target, 1)); }

  /// After the last step; before the first one the gel at rest.
  const PressState& state() const;

  /// The pose straight above or below `pose` in which the first body just touches the undeformed gel; nothing if
  /// it isn't over it.
  std::optional<RigidTransform> touching(const RigidTransform& pose) const;

  /// The gel's displacement and pressure at the last step; of a gel that relaxes what the elastic one's would be.
  const ElasticSolution& solution() const;
  /// N mm, elastic energy of gel and bodies at the last step; likewise.
  double stored_energy() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::fem
