#include "sim/visible_scene.h"

#include <cmath>

#include "core/units.h"

namespace touchstone::sim {
namespace {

enum MediumIndex { kAir = 0, kPlate = 1, kGel = 2 };

render::Spectrum bands(const Eigen::Vector3d& values) {
  return values.array();
}

/// The frame that holds the gel: walls round the pad's sides, from the plate to its outer surface.
TriangleMesh pad_walls(const GelSpec& gel) {
  const double x = gel.size_x_mm / 2;
  const double y = gel.size_y_mm / 2;
  const Eigen::Vector2d corners[4] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  TriangleMesh mesh;
  for (const Eigen::Vector2d& corner : corners) {
    mesh.vertices.emplace_back(corner.x(), corner.y(), -gel.thickness_mm);
    mesh.vertices.emplace_back(corner.x(), corner.y(), 0.0);
  }
  for (int side = 0; side < 4; ++side) {
    const int a = 2 * side;
    const int b = 2 * ((side + 1) % 4);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
  }
  return mesh;
}

TriangleMesh placed(TriangleMesh mesh, const RigidTransform& gel_from_object) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = gel_from_object * vertex;
  return mesh;
}

render::Material material_of(const ObjectSpec& object) {
  if (object.radiance) return render::Emitter{bands(*object.radiance)};
  return render::Lambertian{bands(object.albedo)};
}

render::BayerPattern bayer_pattern(BayerLayout layout) {
  switch (layout) {
    case BayerLayout::none:
      return render::BayerPattern::none;
    case BayerLayout::rggb:
      return render::BayerPattern::rggb;
    case BayerLayout::bggr:
      return render::BayerPattern::bggr;
    case BayerLayout::grbg:
      return render::BayerPattern::grbg;
    case BayerLayout::gbrg:
      return render::BayerPattern::gbrg;
  }
  TS_ASSERT(false);
  return {};
}

}  // namespace

VisibleObject visible_object(const ObjectSpec& object, double edge_mm) {
  VisibleObject visible{coarse_contact_shape(object, edge_mm), visible_mesh(object.shape), {}};
  if (object.screen) visible.screen = visible_mesh(*object.screen);
  return visible;
}

std::vector<VisibleObject> visible_objects(const SceneSpec& scene) {
  std::vector<VisibleObject> all;
  for (const MovedObject& moved : moved_objects(scene)) {
    all.push_back(visible_object(moved.object, scene.device.mesh.fine_mm));
  }
  return all;
}

std::vector<RigidTransform> poses_of(const fem::PressState& press) {
  std::vector<RigidTransform> poses = {press.gel_from_object};
  for (std::size_t k = 1; k < press.bodies.size(); ++k) poses.push_back(press.bodies[k].gel_from_object);
  return poses;
}

std::vector<RigidTransform> poses_of(const fem::PressState& press, const fem::ReliefAnswer& relief) {
  RigidTransform shifted = press.gel_from_object;
  shifted.translation.z() += relief.solved.shift;
  return {shifted};
}

std::vector<PlacedShape> placed_shapes(const std::vector<VisibleObject>& objects, const fem::PressState& press) {
  const std::vector<RigidTransform> poses = poses_of(press);
  TS_ASSERT(poses.size() == objects.size());
  std::vector<PlacedShape> placed;
  for (std::size_t k = 0; k < objects.size(); ++k) placed.push_back({objects[k].felt, poses[k]});
  return placed;
}

render::Surface gel_surface(TriangleMesh mesh) {
  return {std::move(mesh), render::Refractive{kGel, kAir}};
}

render::Scene scene_without_surface(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                                    const std::vector<RigidTransform>& poses, const fem::PressState& press) {
  const DeviceSpec& device = scene.device;
  render::Scene out;
  out.media.resize(3);
  out.media[kPlate].index = device.plate.refractive_index;
  out.media[kGel].index = device.gel.refractive_index;
  out.media[kGel].absorption = render::flat_spectrum(3, device.gel.absorption_per_mm);
  out.faces = {{-device.gel.thickness_mm - device.plate.thickness_mm, kAir, kPlate},
               {-device.gel.thickness_mm, kPlate, kGel}};
  out.surfaces.push_back(
      {pad_walls(device.gel), render::Lambertian{render::flat_spectrum(3, device.gel.frame_albedo)}});
  const std::vector<MovedObject> all = moved_objects(scene);
  for (std::size_t k = 0; k < objects.size(); ++k) {
    out.surfaces.push_back({placed(objects[k].body, poses[k]), material_of(all[k].object)});
    if (!objects[k].screen) continue;
    out.surfaces.push_back({placed(*objects[k].screen, {Eigen::Matrix3d::Identity(), all[k].motion.start_mm}),
                            render::Emitter{bands(all[k].object.screen->radiance)}});
  }
  if (device.beads) {
    const std::vector<Eigen::Vector3d> centres = bead_centres(*device.beads);
    const render::RoughConductor metal{bands(device.beads->reflectance), device.beads->roughness};
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Eigen::Vector3d moved = press.bead_displacement.row(static_cast<Eigen::Index>(i));
      out.balls.push_back({centres[i] + moved, device.beads->diameter_mm / 2, metal});
    }
  }
  for (const LampSpec& lamp : device.lamps) {
    out.lamps.push_back(render::SpotLamp{lamp.position_mm, (lamp.target_mm - lamp.position_mm).normalized(),
                                         lamp.lens_radius_mm, lamp.half_angle_deg * kRadiansPerDegree,
                                         lamp.soft_angle_deg * kRadiansPerDegree,
                                         scene.lamp_level * bands(lamp.power_W)});
  }
  out.environment = render::flat_spectrum(3, device.room_radiance);
  out.interreflection = plan.interreflection;
  return out;
}

render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const VisibleGel& gel, const fem::PressState& press) {
  render::Scene out = scene_without_surface(scene, plan, objects, poses_of(press), press);
  out.surfaces.insert(out.surfaces.begin(), gel_surface(gel.dry_surface(press, placed_shapes(objects, press))));
  return out;
}

render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const Membrane& membrane, const fem::PressState& press, const fem::ReliefAnswer& relief) {
  TS_ASSERT(objects.size() == 1);
  render::Scene out = scene_without_surface(scene, plan, objects, poses_of(press, relief), press);
  Membrane::Sheet sheet = membrane.sheet(press, relief);
  out.surfaces.insert(out.surfaces.begin(), gel_surface(std::move(sheet.dry)));
  out.surfaces.push_back({std::move(sheet.wet), material_of(scene.object)});
  return out;
}

RigidTransform pose_of(const CameraSpec& camera) {
  // The camera looks out of the gel, along +z: with +y of the gel frame down the picture, +x runs to its right and
  // nothing is mirrored. A camera that looks straight along y has +z down instead.
  const Eigen::Vector3d view = (camera.look_at_mm - camera.hole_position_mm).normalized();
  const Eigen::Vector3d down = std::abs(view.y()) > 0.999 ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(0, 1, 0);
  return look_at(camera.hole_position_mm, camera.look_at_mm, down);
}

render::PinholeCamera pinhole_camera(const CameraSpec& camera) {
  render::PinholeCamera out;
  out.width = camera.width;
  out.height = camera.height;
  out.pixel_pitch_um = camera.pixel_pitch_um;
  out.hole_diameter_um = camera.hole_diameter_um;
  out.foil_thickness_um = camera.foil_thickness_um;
  out.distance_mm = camera.hole_to_sensor_mm;
  out.gel_from_camera = pose_of(camera);
  return out;
}

render::Imager imager(const DeviceSpec& device, bool with_noise) {
  const CameraSpec& camera = *device.camera;
  render::Imager out;
  out.bits = camera.bits;
  out.active_area_um2 = camera.active_area_um2;
  out.exposure_s = camera.exposure_us / kMicrosecondsPerSecond;
  out.wavelengths_nm = bands(device.band_wavelengths_nm);
  if (camera.bayer == BayerLayout::none) {
    out.quantum_efficiency = camera.quantum_efficiency_green.transpose();
  } else {
    Eigen::Matrix3d efficiency;
    efficiency << camera.quantum_efficiency_red.transpose(), camera.quantum_efficiency_green.transpose(),
        camera.quantum_efficiency_blue.transpose();
    out.quantum_efficiency = efficiency;
  }
  out.full_well_e = camera.full_well_e;
  out.read_noise_e = camera.read_noise_e;
  out.dark_current_e_per_s = camera.dark_current_e_per_s;
  out.prnu = camera.prnu;
  out.dsnu_e = camera.dsnu_e;
  out.bayer = bayer_pattern(camera.bayer);
  out.black_level_DN = camera.black_level_DN;
  constexpr double kDecibelsPerDecade = 20.0;
  out.gain_DN_per_e = ((1 << camera.bits) - 1 - camera.black_level_DN) / camera.full_well_e *
                      std::pow(10.0, camera.gain_dB / kDecibelsPerDecade);
  out.ideal = !with_noise;
  if (camera.white_balance) {
    out.white_balance = *camera.white_balance;
  } else if (camera.bayer != BayerLayout::none) {
    Eigen::Vector3d light = Eigen::Vector3d::Zero();
    for (const LampSpec& lamp : device.lamps) light += lamp.power_W;
    if (light.sum() > 0.0) out.white_balance = render::grey_gains(out, bands(light));
  }
  return out;
}

}  // namespace touchstone::sim
