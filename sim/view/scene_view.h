#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/paths/path_tracer.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"
#include "sim/view/membrane.h"
#include "sim/view/seen_geometry.h"
#include "sim/view/skin_pins.h"
#include "sim/view/visible_gel.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {

/// All of a scene that can be seen, ready to be traced at any of its states. Safe to use from many threads.
struct SceneView {
  /// Makes what all states share. @throws Error as Membrane, or for an object's file that can't be read
  SceneView(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel);
  /// Another scene with the same gel: takes from `other` what depends on the gel alone, most of the work.
  SceneView(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, const SceneView& other);

  /// The fine contact, where it's called for.
  std::optional<fem::ReliefAnswer> relief(const fem::PressState& press) const;
  /// What first hits and viewers get; `relief` as relief() gave it.
  SeenGeometry geometry(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const;
  /// What a coated gel's camera sees, from what geometry() gave: the same as seen(). @pre the device has a coating
  render::Scene seen_coating(const fem::PressState& press, const SeenGeometry& geometry) const;
  /// `relief` as relief() gave it.
  render::Scene seen(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const;
  /// The same, ready to be traced.
  render::Tracer tracer(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const {
    return render::Tracer(seen(press, relief));
  }
  render::Tracer tracer(const fem::PressState& press) const { return tracer(press, relief(press)); }

  SceneSpec scene;
  Plan plan;
  VisibleGel gel;
  SkinPins pins;                             ///< none of a device without
  std::unique_ptr<const Membrane> membrane;  ///< for the fine contact and height maps; null where neither is wanted
  std::vector<VisibleObject> objects;

 private:
  render::Scene with_pins(render::Scene seen, const fem::PressState& press) const;
};

/// The device's camera as the plan has it: with diffraction or without. @pre it has one
render::Camera planned_camera(const SceneSpec& scene, const Plan& plan);

/// The gel of `press` as nothing presses it.
fem::PressState at_rest(fem::PressState press);

}  // namespace touchstone::sim
