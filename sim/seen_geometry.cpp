#include "sim/seen_geometry.h"

#include "core/error.h"

namespace touchstone::sim {
namespace {

SeenGeometry sorted(const SceneSpec& scene, const std::vector<VisibleObject>& objects, render::Scene visible,
                    GelSheet sheet, const fem::PressState& press) {
  SeenGeometry seen;
  std::vector<render::Surface> all = std::move(visible.surfaces);
  visible.surfaces.clear();
  visible.lamps.clear();
  seen.beyond = visible;
  seen.beyond.balls.clear();
  seen.inside = std::move(visible);
  all[0].mesh = sheet.mesh;
  seen.inside.surfaces = {std::move(all[0]), std::move(all[1])};
  for (std::size_t k = 0; k < objects.size(); ++k) {
    seen.bodies.push_back({static_cast<int>(k), false});
    if (objects[k].screen) seen.bodies.push_back({static_cast<int>(k), true});
  }
  TS_ASSERT(all.size() >= 2 + seen.bodies.size() && objects.size() == moved_objects(scene).size());
  for (std::size_t i = 0; i < seen.bodies.size(); ++i) seen.beyond.surfaces.push_back(std::move(all[2 + i]));
  seen.sheet = std::move(sheet);
  seen.bead_displacement = press.bead_displacement;
  return seen;
}

}  // namespace

SeenGeometry seen_geometry(const SceneSpec& scene, const std::vector<VisibleObject>& objects, const VisibleGel& gel,
                           const fem::PressState& press) {
  std::vector<PlacedShape> felt;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    felt.push_back({objects[k].felt, k == 0 ? press.gel_from_object : press.bodies[k].gel_from_object});
  }
  return sorted(scene, objects, visible_scene(scene, Plan{}, objects, gel, press), gel.sheet(press, felt), press);
}

SeenGeometry seen_geometry(const SceneSpec& scene, const std::vector<VisibleObject>& objects, const Membrane& membrane,
                           const fem::PressState& press, const fem::ReliefAnswer& relief) {
  Membrane::Sheet fine = membrane.sheet(press, relief);
  GelSheet sheet;
  sheet.mesh = std::move(fine.dry);
  sheet.touched.assign(sheet.mesh.triangles.size(), -1);
  sheet.mesh.triangles.insert(sheet.mesh.triangles.end(), fine.wet.triangles.begin(), fine.wet.triangles.end());
  sheet.touched.resize(sheet.mesh.triangles.size(), 0);
  sheet.rest = std::move(fine.rest);
  return sorted(scene, objects, visible_scene(scene, Plan{}, objects, membrane, press, relief), std::move(sheet),
                press);
}

}  // namespace touchstone::sim
