#include "sim/view/seen_geometry.h"

#include "core/error.h"

namespace touchstone::sim {
namespace {

SeenGeometry seen_as(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                     const std::vector<RigidTransform>& poses, GelSheet sheet, const fem::PressState& press) {
  SeenGeometry seen;
  render::Scene fixture = scene_without_surface(scene, plan, objects, poses, press);
  std::vector<render::Surface> all = std::move(fixture.surfaces);
  fixture.surfaces.clear();
  fixture.lamps.clear();
  seen.beyond = fixture;
  seen.beyond.balls.clear();
  seen.inside = std::move(fixture);
  seen.inside.surfaces = {gel_surface(sheet.mesh), std::move(all[0])};
  for (std::size_t k = 0; k < objects.size(); ++k) {
    seen.bodies.push_back({static_cast<int>(k), false});
    if (objects[k].screen) seen.bodies.push_back({static_cast<int>(k), true});
  }
  TS_ASSERT(all.size() >= 1 + seen.bodies.size() && objects.size() == moved_objects(scene).size());
  for (std::size_t i = 0; i < seen.bodies.size(); ++i) seen.beyond.surfaces.push_back(std::move(all[1 + i]));
  const auto& coating = scene.device.coating;
  if (coating && coating->print) {
    seen.markers = render::PrintIndex(printed_marks(*coating->print));
    seen.print = print_coordinates(*coating->print, scene.device.gel, sheet.rest);
  }
  seen.sheet = std::move(sheet);
  seen.bead_displacement = press.bead_displacement;
  return seen;
}

}  // namespace

SeenGeometry seen_geometry(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                           const VisibleGel& gel, const fem::PressState& press) {
  return seen_as(scene, plan, objects, poses_of(press), gel.sheet(press, placed_shapes(objects, press)), press);
}

SeenGeometry seen_geometry(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                           const Membrane& membrane, const fem::PressState& press, const fem::ReliefAnswer& relief) {
  GelSheet sheet = whole_sheet(membrane.sheet(press, relief));
  return seen_as(scene, plan, objects, poses_of(press, relief), std::move(sheet), press);
}

}  // namespace touchstone::sim
