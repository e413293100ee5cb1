#pragma once
// What the camera of a device sees of a pressed gel, in the renderer's terms.

#include <vector>

#include "fem/contact/press.h"
#include "fem/shapes/contact_shape.h"
#include "render/scene/scene.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"
#include "sim/view/membrane.h"
#include "sim/view/visible_gel.h"

namespace touchstone::sim {

/// The shape of an object file, read and turned once for all frames; object frame.
struct VisibleObject {
  fem::ContactShape shape;
  TriangleMesh body;
  std::optional<TriangleMesh> screen;
  ReadyPrint print;                         ///< no layers: none
  std::vector<Eigen::Vector2d> printed_mm;  ///< the body's vertices in the print's coordinates; none without a print
};

/// `edge_mm` of the gel's mesh: what the gel's coarse surface can be laid onto has no finer detail.
VisibleObject visible_object(const ObjectSpec& object, double edge_mm);

/// All of a scene's.
std::vector<VisibleObject> visible_objects(const SceneSpec& scene);

/// Where the objects stand. The first one's pose has its own vibration in it.
std::vector<RigidTransform> poses_of(const fem::PressState& press);
/// With a fine relief: its single object stands where the fine contact shifted it to.
std::vector<RigidTransform> poses_of(const fem::PressState& press, const fem::ReliefAnswer& relief);

/// What the gel feels of each object, where it stands.
std::vector<PlacedShape> placed_shapes(const std::vector<VisibleObject>& objects, const fem::PressState& press);

/// A clear gel's outer surface with what is on its two sides.
render::Surface gel_surface(TriangleMesh mesh);

/// The sheet of a fine relief in one piece.
GelSheet whole_sheet(Membrane::Sheet fine);

/// The markers in material coordinates: of a grid those are the gel's x and y, row by row, y growing from row to row;
/// of scattered ones see sim/scene/scattered_print.h.
std::vector<render::PrintedMark> printed_marks(const PrintSpec& print);

/// Where points of the undeformed outer surface lie in the print's material coordinates.
std::vector<Eigen::Vector2d> print_coordinates(const PrintSpec& print, const GelSpec& gel,
                                               const std::vector<Eigen::Vector3d>& rest);

/// A coated gel's outer surface. @pre the device has a coating
render::Surface coated_surface(const SceneSpec& scene, const Plan& plan, GelSheet sheet);

/// All of visible_scene but the gel's outer surface: its frame first, then each object followed by its screen if it has
/// one, then the films.
render::Scene scene_without_surface(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                                    const std::vector<RigidTransform>& poses, const fem::PressState& press);

/// What the camera of a coated device sees beside the coating: the gel's frame, unless that is clear, first.
render::Scene scene_in_coating(const SceneSpec& scene, const Plan& plan, const fem::PressState& press);

/// Plate, gel, beads, objects and lamps as they stand at `press`. Where the gel is wetted by the object there is no
/// face between them: the light goes on into the object. A coated gel shows its coating and nothing of what is beyond.
/// Surfaces: the gel's outer surface (of a clear gel where it's dry), its frame unless that is clear, then each object
/// followed by its screen if it has one (not with a coating), then the films. Balls: the beads in their order.
render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const VisibleGel& gel, const fem::PressState& press);

/// The same with the surface of a fine relief: what lies on the object has the object's own appearance, and the object,
/// a single one, stands where the fine contact shifted it to.
render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const Membrane& membrane, const fem::PressState& press, const fem::ReliefAnswer& relief);

}  // namespace touchstone::sim
