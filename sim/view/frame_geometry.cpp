#include "sim/view/frame_geometry.h"

#include <cmath>

#include "sim/scene/device_camera.h"
#include "sim/scene/device_gel.h"
#include "sim/view/skin_pins.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

TriangleMesh moved(TriangleMesh mesh, const RigidTransform& gel_from_object) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = gel_from_object * vertex;
  return mesh;
}

void add_gel(const GelSheet& sheet, std::vector<GltfPart>& parts) {
  GltfPart free{"gel surface", {sheet.mesh.vertices, {}}, {0.75, 0.8, 0.85}, 0.5, false, {Eigen::Vector3d::Zero()}};
  GltfPart touched{"gel in contact", {sheet.mesh.vertices, {}}, {0.9, 0.35, 0.2}, 0.7, false, free.places};
  for (std::size_t i = 0; i < sheet.touched.size(); ++i) {
    (sheet.touched[i] < 0 ? free : touched).mesh.triangles.push_back(sheet.mesh.triangles[i]);
  }
  parts.push_back(std::move(free));
  parts.push_back(std::move(touched));
}

void add_beads(const BeadSpec& beads, const fem::PressState& press, std::vector<GltfPart>& parts) {
  ShapeSpec ball;
  ball.type = ShapeKind::sphere;
  ball.radius_mm = beads.diameter_mm / 2;
  GltfPart part{"bead", visible_mesh(ball), display_colour(beads.reflectance), 1.0, true, {}};
  const std::vector<Eigen::Vector3d> rest = bead_centres(beads);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    part.places.emplace_back(rest[i] + press.bead_displacement.row(static_cast<Eigen::Index>(i)).transpose());
  }
  parts.push_back(std::move(part));
}

}  // namespace

FrameGeometry frame_geometry(const SceneSpec& scene, const fem::Compliance& gel, const fem::PressState& press) {
  FrameGeometry out;
  const std::vector<VisibleObject> objects = visible_objects(scene);
  const std::vector<MovedObject> all = moved_objects(scene);
  const std::vector<PlacedShape> shapes = placed_shapes(objects, press);
  add_gel(VisibleGel(gel, gel_body(scene.device)).sheet(press, shapes), out.parts);
  if (scene.device.beads) add_beads(*scene.device.beads, press, out.parts);
  if (scene.device.pins) {
    out.parts.push_back(
        {"pin tips", SkinPins(scene.device, gel).tips(press), display_colour(scene.device.pins->colour)});
  }
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const ObjectSpec& object = all[k].object;
    out.parts.push_back(
        {object.name, moved(objects[k].body, shapes[k].gel_from_object), display_colour(object.albedo)});
    if (!objects[k].screen) continue;
    const RigidTransform start{Eigen::Matrix3d::Identity(), all[k].motion.start_mm};
    out.parts.push_back({object.name + " screen", moved(*objects[k].screen, start), {1.0, 1.0, 1.0}});
  }
  if (scene.device.camera) {
    const render::Camera camera = camera_of(*scene.device.camera);
    const Eigen::Vector2i size = render::size_of(camera);
    // Half the picture's height over its distance; a lens's distortion and shifted centre have no place in glTF.
    double half_height = 0.0;
    RigidTransform pose;
    if (const auto* lens = std::get_if<render::LensCamera>(&camera)) {
      half_height = 0.5 * lens->height / lens->matrix.fy;
      pose = lens->gel_from_camera;
    } else {
      const auto& hole = std::get<render::PinholeCamera>(camera);
      half_height = 0.5e-3 * hole.pixel_pitch_um * hole.height / hole.distance_mm;
      pose = hole.gel_from_camera;
    }
    out.cameras.push_back({pose, 2.0 * std::atan(half_height), static_cast<double>(size.x()) / size.y()});
  }
  return out;
}

}  // namespace touchstone::sim
