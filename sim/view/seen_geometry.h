#pragma once
// A frame's geometry with what each piece of it means: what first hits are distinguished by, and what is written as
// glTF.

#include <vector>

#include "core/triangle_mesh.h"
#include "render/scene/scene.h"
#include "sim/scene/scene.h"
#include "sim/view/membrane.h"
#include "sim/view/visible_gel.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {

/// An object, or an object's screen.
struct SeenBody {
  int object = 0;  ///< its number in moved_objects()
  bool screen = false;
};

/// Unlike in visible_scene, the gel's outer surface is whole: where it lies on an object it is still the gel's.
struct SeenGeometry {
  /// What can be seen before the outer surface: surfaces[0] is that surface, surfaces[1] the gel's frame, surfaces[2]
  /// the pins' tips (sim/view/skin_pins.h), if SceneView added any; the balls are the beads.
  render::Scene inside;
  render::Scene beyond;                    ///< the objects and their screens; no gel
  std::vector<SeenBody> bodies;            ///< what each of `beyond.surfaces` is
  GelSheet sheet;                          ///< surfaces[0] of `inside` with its meaning
  Eigen::MatrixX3d bead_displacement;      ///< m x 3, mm
  render::PrintIndex markers;              ///< printed on the outer surface; none without a coating
  std::vector<Eigen::Vector2d> print;      ///< material coordinates of the sheet's vertices, where there's a print
  std::vector<Eigen::Vector3d> pins_rest;  ///< the vertices of the pins' tips on the undeformed gel; none without pins
};

/// As the elements' surface has it. @pre the gel is a slab
SeenGeometry seen_geometry(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                           const VisibleGel& gel, const fem::PressState& press);
/// As the fine relief has it. @pre the relief has contact
SeenGeometry seen_geometry(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                           const Membrane& membrane, const fem::PressState& press, const fem::ReliefAnswer& relief);

}  // namespace touchstone::sim
