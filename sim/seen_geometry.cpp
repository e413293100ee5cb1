#include "sim/seen_geometry.h"

#include "core/error.h"

namespace touchstone::sim {
namespace {

SeenGeometry seen_as(const SceneSpec& scene, const std::vector<VisibleObject>& objects,
                     const std::vector<RigidTransform>& poses, GelSheet sheet, const fem::PressState& press) {
  SeenGeometry seen;
  render::Scene fixture = scene_without_surface(scene, Plan{}, objects, poses, press);
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
  TS_ASSERT(all.size() == 1 + seen.bodies.size() && objects.size() == moved_objects(scene).size());
  for (std::size_t i = 0; i < seen.bodies.size(); ++i) seen.beyond.surfaces.push_back(std::move(all[1 + i]));
  seen.sheet = std::move(sheet);
  seen.bead_displacement = press.bead_displacement;
  return seen;
}

}  // namespace

SeenGeometry seen_geometry(const SceneSpec& scene, const std::vector<VisibleObject>& objects, const VisibleGel& gel,
                           const fem::PressState& press) {
  return seen_as(scene, objects, poses_of(press), gel.sheet(press, placed_shapes(objects, press)), press);
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
  return seen_as(scene, objects, poses_of(press, relief), std::move(sheet), press);
}

}  // namespace touchstone::sim
