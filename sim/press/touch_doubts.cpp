#include "sim/press/touch_doubts.h"

#include "fem/contact/surface_check.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

std::vector<std::string> touch_doubts(const GelSpec& material, const fem::Compliance& gel,
                                      std::span<const fem::ContactShape* const> shapes, const fem::PressState& state) {
  return fem::surface_doubts(fem::check_surface(gel.vertices, gel.triangles, shapes, state), gel_materials(material));
}

std::vector<std::string> touch_doubts(const SceneSpec& scene, const fem::Compliance& gel,
                                      const fem::PressState& state) {
  std::vector<fem::ContactShape> shapes;
  std::vector<bool> rigid;
  for (const MovedObject& moved : moved_objects(scene)) {
    shapes.push_back(coarse_contact_shape(moved.object, scene.device.mesh.fine_mm));
    rigid.push_back(!moved.object.elastic);
  }
  std::vector<const fem::ContactShape*> of_rigid;
  for (std::size_t b = 0; b < shapes.size(); ++b) of_rigid.push_back(rigid[b] ? &shapes[b] : nullptr);
  return touch_doubts(scene.device.gel, gel, of_rigid, state);
}

}  // namespace touchstone::sim
