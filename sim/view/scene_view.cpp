#include "sim/view/scene_view.h"

#include <utility>

#include "sim/plan/scene_bands.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {

SceneView::SceneView(const SceneSpec& scene_of, const Plan& plan_of, const fem::Compliance& gel_of)
    : scene(scene_of),
      plan(plan_of),
      gel(gel_of, gel_body(scene.device)),
      pins(scene.device, gel_of),
      membrane(plan.fine_relief || scene.outputs.height ? std::make_unique<Membrane>(scene, plan, gel_of) : nullptr),
      objects(visible_objects(scene)) {}

SceneView::SceneView(const SceneSpec& scene_of, const Plan& plan_of, const fem::Compliance& gel_of,
                     const SceneView& other)
    : scene(scene_of), plan(plan_of), gel(other.gel), pins(other.pins), objects(visible_objects(scene)) {
  if (!plan.fine_relief && !scene.outputs.height) return;
  membrane = other.membrane ? std::make_unique<Membrane>(scene, plan, other.membrane->surface())
                            : std::make_unique<Membrane>(scene, plan, gel_of);
}

render::Scene SceneView::seen_coating(const fem::PressState& press, const SeenGeometry& geometry) const {
  render::Scene out = scene_in_coating(scene, plan, press);
  out.surfaces.insert(out.surfaces.begin(), coated_surface(scene, plan, geometry.sheet));
  return with_pins(std::move(out), press);
}

/// Their white tips as one more surface, the last; the rest of them is black before a black skin.
render::Scene SceneView::with_pins(render::Scene seen, const fem::PressState& press) const {
  if (pins.empty()) return seen;
  seen.surfaces.push_back(
      {pins.tips(press), render::Lambertian{in_bands(scene.device.pins->colour, plan.bands, "pins.colour")}});
  return seen;
}

std::optional<fem::ReliefAnswer> SceneView::relief(const fem::PressState& press) const {
  return membrane ? membrane->relief(press) : std::nullopt;
}

render::Scene SceneView::seen(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const {
  const bool fine = relief && relief->grid.size() > 0;
  return with_pins(fine ? visible_scene(scene, plan, objects, *membrane, press, *relief)
                        : visible_scene(scene, plan, objects, gel, press),
                   press);
}

SeenGeometry SceneView::geometry(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const {
  const bool fine = relief && relief->grid.size() > 0;
  SeenGeometry seen = fine ? seen_geometry(scene, plan, objects, *membrane, press, *relief)
                           : seen_geometry(scene, plan, objects, gel, press);
  if (pins.empty()) return seen;
  seen.inside.surfaces.push_back({pins.tips(press), render::Black{}});
  seen.pins_rest = pins.tips_at_rest().vertices;
  return seen;
}

render::Camera planned_camera(const SceneSpec& scene, const Plan& plan) {
  return plan.diffraction ? diffracting_camera(scene.device, plan.bands.centres_nm) : camera_of(*scene.device.camera);
}

fem::PressState at_rest(fem::PressState press) {
  constexpr double kFarAway_mm = 1e4;
  press.surface_displacement.setZero();
  press.bead_displacement.setZero();
  std::fill(press.node_state.begin(), press.node_state.end(), fem::NodeState::open);
  press.gel_from_object.translation.z() += kFarAway_mm;
  for (fem::BodyState& body : press.bodies) body.gel_from_object.translation.z() += kFarAway_mm;
  return press;
}

}  // namespace touchstone::sim
