#pragma once
// An object's detail far below the mesh size, imprinted on the gel: contact solved anew on a grid of pixels.
//
// The coarse press (fem/contact/press.h) knows the pad's sides, its layers, friction and the force; its elements are
// too wide for detail. Here the same object, as it really is, presses on the pixels of a grid over the contact patch.
// Pressure p moves the surface by the coarse displacement plus what an endless layer does under p less the coarse
// pressure. That difference has no mean (the force stays the coarse one), so what the endless layer doesn't know of,
// the pad's sides above all, is left out only in a far field that decays within a thickness. Where the gel would need
// more pressure than it has to fill a groove, it bridges it.

#include <Eigen/Core>
#include <vector>

#include "fem/contact/press.h"
#include "fem/fine_relief/pixel_contact.h"
#include "fem/fine_relief/smooth_surface.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// What is kept of the coarse press: its force along ReliefAnswer::direction (the object gives way along that by
/// ReliefAnswer::solved.shift), or its pose (the force becomes another: for an object that the coarse mesh can't see,
/// such as a lone hair).
enum class ReliefControl { force, pose };

/// How finely the relief is resolved, where it is looked up, and to what tolerance contact is solved.
struct ReliefSettings {
  double pitch = 0.02;  ///< mm, of pixels: a third of the finest detail. On a dome's flank they are smaller, by
                        ///< SurfacePlace::scale
  /// mm of surface round the coarse contact that the grid begins with; below 0: two edges of the mesh or a quarter of
  /// the thickness, the larger. It is widened where the fine contact reaches its border.
  double margin = -1.0;
  ReliefControl control = ReliefControl::force;
  /// The object is looked up where the surface has gone along itself, point by point: what a picture needs. Without
  /// this, where the contact patch has gone as a whole, as the coarse press does: linear theory, for comparisons (a
  /// frictionless flat punch of 3 mm pressed by a tenth of a gel of 5 mm meets 5 % less of it when followed).
  bool follow_surface = true;
  PixelTolerance tolerance;
  /// Of an elastic object. Under the difference of the fine and the coarse pressure its surface gives way as an endless
  /// half space; else as the coarse press has it (PressState::object_gives).
  std::optional<ElasticMaterial> object = {};
};

/// The surface under the fine contact, of the gel. Pixels stand where SmoothSurface::place has them; that at x has
/// moved to x + tangential + height * normal.
struct ReliefAnswer {
  PixelGrid grid;                ///< as the surface is laid out; empty (0 x 0) out of contact
  std::vector<double> pressure;  ///< MPa, of the object on the gel
  std::vector<double> height;    ///< mm, normal displacement: below 0 under the object
  std::vector<char> contact;     ///< 1: in contact
  SplineField along;             ///< the tangential displacement, mm, gel frame
  SplineField rest;              ///< as SmoothDisplacement::rest
  std::vector<double> layer;     ///< as SmoothDisplacement::layer
  PixelContactAnswer solved;     ///< shift, residuals, work; its pressure and displacement are moved into the above
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< as SmoothDisplacement::direction
  double coarse_force = 0.0;                             ///< N
  double misfit = 0.0;                                   ///< mm, see SmoothDisplacement::largest_misfit
  bool at_the_edge = false;  ///< contact reaches the surface's own edge, where the layer isn't endless

  Eigen::Vector3d tangential(const Eigen::Vector2d& laid_out) const { return along.at(laid_out); }
  /// Where the object stands that `press` has at a pose: moved out of the gel by what the force wants.
  RigidTransform moved(RigidTransform gel_from_object) const {
    gel_from_object.translation += solved.shift * direction;
    return gel_from_object;
  }
};

/// Solves the fine contact of `shape`, in all its detail, as `press` has it placed. A pure function of its arguments;
/// `previous`, an answer with the same pitch, only makes it quicker. Out of contact everything is zero.
/// @throws Error if the grid would have more than kMostPixelsASide pixels a side (then the pitch is too fine), or no
/// pixel of the contact has the object over it
ReliefAnswer solve_fine_relief(const SmoothSurface& surface, const PressState& press, const ContactShape& shape,
                               const ReliefSettings& settings = {}, const ReliefAnswer* previous = nullptr);

/// The displaced surface's height (mm) over the undeformed one, along z, at points of the gel frame's x, y plane, as a
/// camera or a profilometer above it would find it: where the displacement has carried the gel. Where it hangs over
/// itself, as on a steep flank beside a deep contact, one of its heights. Outside of the answer's grid: the coarse one.
class HeightField {
 public:
  /// `fine` may be null: coarse heights everywhere. The surface must outlive this.
  HeightField(const SmoothSurface& surface, const PressState& press, const ReliefAnswer* fine);

  /// The height over a place that a camera sees; beside a dome that of its rim.
  double at(const Eigen::Vector2d& seen) const;
  /// How far the material point whose place is laid out at `material` has moved along the undeformed surface's normal.
  double at_material(const Eigen::Vector2d& material) const;

 private:
  const SmoothSurface& surface_;
  SplineField along_;
  PixelGrid coarse_grid_, fine_grid_;
  std::vector<double> coarse_, fine_;
};

}  // namespace touchstone::fem
