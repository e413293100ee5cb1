#include "sim/view/visible_scene.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/units.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_faces.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_lamps.h"
#include "sim/scene/scattered_print.h"
#include "sim/scene/translucent_coat.h"

namespace touchstone::sim {
namespace {

constexpr double kFilmInGelMm = 1e-3;  // so that film and face don't coincide

/// A wall on a circle about z from `low` to `high`; nothing where that's no height.
TriangleMesh round_wall(double radius, double low, double high) {
  constexpr int kSides = 180;
  constexpr double kLowest = 1e-6;
  TriangleMesh mesh;
  if (high - low < kLowest) return mesh;
  for (int side = 0; side < kSides; ++side) {
    const double angle = 2.0 * kPi * side / kSides;
    for (const double z : {low, high})
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    const int a = 2 * side;
    const int b = 2 * ((side + 1) % kSides);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
  }
  return mesh;
}

/// The frame that holds the gel: walls round its sides, from the plate to its outer surface. @pre it isn't a mesh
TriangleMesh gel_walls(const GelSpec& gel) {
  if (const DomeSpec* dome = gel.dome()) {
    const double sphere = dome->sphere_radius_mm;
    const double base = dome->base_radius_mm;
    return round_wall(base, -gel.thickness_mm, std::sqrt(sphere * sphere - base * base) - sphere);
  }
  if (const FingertipSpec* tip = gel.fingertip()) {
    return round_wall(tip->radius_mm, -gel.thickness_mm, -gel.thickness_mm + tip->sleeve_mm);
  }
  const auto& slab = std::get<SlabSpec>(gel.shape);
  const double x = slab.size_x_mm / 2;
  const double y = slab.size_y_mm / 2;
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

render::Material material_of(const ObjectSpec& object, const SceneBands& bands) {
  if (object.radiance) return render::Emitter{in_bands(*object.radiance, bands, "radiance")};
  return render::Lambertian{in_bands(object.albedo, bands, "albedo")};
}

/// Material coordinates of an object's print for its mesh: x and y on the lower side, far from any print elsewhere. The
/// mesh gets vertices of their own for the triangles that look up or sideways.
std::vector<Eigen::Vector2d> lay_out_print(TriangleMesh& body) {
  constexpr double kNowhere_mm = 1e5;
  std::vector<Eigen::Vector2d> places;
  for (const Eigen::Vector3d& vertex : body.vertices) places.emplace_back(vertex.head<2>());
  for (std::array<int, 3>& t : body.triangles) {
    const Eigen::Vector3d a = body.vertices[t[0]];
    if ((body.vertices[t[1]] - a).cross(body.vertices[t[2]] - a).z() < 0.0) continue;
    for (int& corner : t) {
      body.vertices.push_back(Eigen::Vector3d(body.vertices[corner]));
      places.push_back(Eigen::Vector2d::Constant(kNowhere_mm));
      corner = static_cast<int>(body.vertices.size()) - 1;
    }
  }
  return places;
}

/// The print of an object's own body.
render::Print print_on(const VisibleObject& visible, const ObjectSpec& object, const SceneBands& bands,
                       const ContactPressure* pressure) {
  render::Print print = object_print(visible.print, bands, object.albedo, pressure);
  print.material_mm = visible.printed_mm;
  return print;
}

/// Centres of a grid about the origin, row by row.
std::vector<Eigen::Vector2d> grid_centres(const Eigen::Vector2i& grid, const Eigen::Vector2d& spacing) {
  std::vector<Eigen::Vector2d> centres;
  for (int row = 0; row < grid.y(); ++row) {
    for (int column = 0; column < grid.x(); ++column) {
      centres.emplace_back((column - 0.5 * (grid.x() - 1)) * spacing.x(), (row - 0.5 * (grid.y() - 1)) * spacing.y());
    }
  }
  return centres;
}

render::Print print_of(const PrintSpec& spec, const GelSpec& gel, const SceneBands& bands,
                       const std::vector<Eigen::Vector3d>& rest) {
  render::Print print;
  print.material_mm = print_coordinates(spec, gel, rest);
  print.inks = {in_bands(spec.colour, bands, "coating.print.colour")};
  print.marks = printed_marks(spec);
  return print;
}

/// Colours the triangles of a translucent coat that lie on objects, under its print. `colours`: of the objects.
void show_touched(const std::vector<render::Spectrum>& colours, const GelSheet& sheet,
                  std::optional<render::Print>& print) {
  if (!print) {
    print.emplace();
    print->material_mm.assign(sheet.rest.size(), Eigen::Vector2d::Zero());
  }
  const auto first = static_cast<int>(print->inks.size());
  print->inks.insert(print->inks.end(), colours.begin(), colours.end());
  print->ground.reserve(sheet.touched.size());
  for (const int body : sheet.touched) print->ground.push_back(body < 0 ? -1 : first + body);
}

/// All of a device's film squares as one sheet, just inside the gel.
render::Surface film_sheet(const FilmSpec& films, const SceneBands& bands, double thickness_mm) {
  TriangleMesh mesh;
  const double half = films.side_mm / 2;
  const double z = -thickness_mm + kFilmInGelMm;
  for (const Eigen::Vector2d& centre : grid_centres(films.grid, films.spacing_mm)) {
    const int first = static_cast<int>(mesh.vertices.size());
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(-half, -half), {half, -half}, {half, half}, {-half, half}}) {
      mesh.vertices.emplace_back(centre.x() + corner.x(), centre.y() + corner.y(), z);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  return {std::move(mesh),
          render::ThinFilm{in_bands(films.transmittance, bands, "films.transmittance"), films.refractive_index, false}};
}

/// A level panel behind all that touches the gel, so wide that the gel sees nothing beside it.
TriangleMesh panel_behind() {
  constexpr double kHeightMm = 1000.0;
  constexpr double kHalfMm = 40.0 * kHeightMm;
  TriangleMesh mesh;
  mesh.vertices = {{-kHalfMm, -kHalfMm, kHeightMm},
                   {kHalfMm, -kHalfMm, kHeightMm},
                   {kHalfMm, kHalfMm, kHeightMm},
                   {-kHalfMm, kHalfMm, kHeightMm}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace

VisibleObject visible_object(const ObjectSpec& object, double edge_mm) {
  VisibleObject visible{coarse_contact_shape(object, edge_mm), visible_mesh(object.shape), {}, {}, {}};
  if (object.screen) visible.screen = visible_mesh(*object.screen);
  if (!object.print.empty()) {
    visible.print = ready_print(object.print);
    visible.printed_mm = lay_out_print(visible.body);
  }
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
  return {relief.moved(press.gel_from_object)};
}

std::vector<PlacedShape> placed_shapes(const std::vector<VisibleObject>& objects, const fem::PressState& press) {
  const std::vector<RigidTransform> poses = poses_of(press);
  TS_ASSERT(poses.size() == objects.size());
  std::vector<PlacedShape> placed;
  for (std::size_t k = 0; k < objects.size(); ++k) placed.push_back({objects[k].shape, poses[k]});
  return placed;
}

render::Surface gel_surface(TriangleMesh mesh) {
  return {std::move(mesh), render::Refractive{kGel, kAir}};
}

render::Surface coated_surface(const SceneSpec& scene, const Plan& plan, GelSheet sheet) {
  const DeviceSpec& device = scene.device;
  const SceneBands& bands = plan.bands;
  const CoatingSpec& coating = *device.coating;
  render::Surface out;
  if (coating.print) out.print = print_of(*coating.print, device.gel, bands, sheet.rest);
  if (coating.type == CoatingType::metal) {
    out.material = render::RoughConductor{in_bands(coating.albedo, bands, "coating.reflectance"), coating.roughness};
  } else if (coating.transmittance.largest() > 0.0) {
    const TranslucentCoat coat = translucent_coat(scene, bands);
    out.material = render::Lambertian{coat.free};
    if (plan.translucent_coating) show_touched(coat.touched, sheet, out.print);
  } else {
    out.material = render::Lambertian{in_bands(coating.albedo, bands, "coating.albedo")};
  }
  out.normals = vertex_normals(sheet.mesh);
  out.mesh = std::move(sheet.mesh);
  // What is bonded there moves by some hundredths of a micrometre, as displacements are means over the mesh's hats; but
  // the gel doesn't reach below the plate's face.
  if (ends_on_plate(device.gel)) {
    for (Eigen::Vector3d& vertex : out.mesh.vertices) vertex.z() = std::max(vertex.z(), -device.gel.thickness_mm);
  }
  return out;
}

render::Scene scene_without_surface(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                                    const std::vector<RigidTransform>& poses, const fem::PressState& press) {
  const DeviceSpec& device = scene.device;
  const SceneBands& bands = plan.bands;
  render::Scene out = clear_layers(device);
  out.media[kGel].absorption = in_bands(device.gel.absorption_per_mm, bands, "gel.absorption_per_mm");
  if (plan.scattering) {
    out.media[kGel].scattering = in_bands(device.gel.scattering_per_mm, bands, "gel.scattering_per_mm");
    out.media[kGel].anisotropy = device.gel.scattering_anisotropy;
  }
  out.surfaces.push_back(
      {gel_walls(device.gel), render::Lambertian{in_bands(device.gel.frame_albedo, bands, "gel.frame_albedo")}});
  const std::vector<MovedObject> all = moved_objects(scene);
  for (std::size_t k = 0; k < objects.size(); ++k) {
    // Under a coating an object has a shape and no colour (seen_geometry).
    out.surfaces.push_back({placed(objects[k].body, poses[k]),
                            device.coating ? render::Material(render::Black{}) : material_of(all[k].object, bands)});
    if (!objects[k].screen) continue;
    out.surfaces.push_back({placed(*objects[k].screen, {Eigen::Matrix3d::Identity(), all[k].motion.start_mm}),
                            render::Emitter{in_bands(all[k].object.screen->radiance, bands, "screen.radiance")}});
  }
  if (device.films) out.surfaces.push_back(film_sheet(*device.films, bands, device.gel.thickness_mm));
  if (device.beads) {
    const std::vector<Eigen::Vector3d> centres = bead_centres(*device.beads);
    const render::RoughConductor metal{in_bands(device.beads->reflectance, bands, "beads.reflectance"),
                                       device.beads->roughness};
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Eigen::Vector3d moved = press.bead_displacement.row(static_cast<Eigen::Index>(i));
      out.balls.push_back({centres[i] + moved, device.beads->diameter_mm / 2, metal});
    }
  }
  for (const LampSpec& lamp : device.lamps) {
    for (render::Lamp& one : lamps_of(lamp, bands, scene.lamp_level)) out.lamps.push_back(std::move(one));
  }
  out.environment = in_bands(device.room_radiance, bands, "room_radiance");
  if (device.room_radiance_behind) {
    out.surfaces.push_back(
        {panel_behind(), render::Emitter{in_bands(*device.room_radiance_behind, bands, "room_radiance_behind")}});
  }
  out.interreflection = plan.interreflection;
  return out;
}

render::Scene scene_in_coating(const SceneSpec& scene, const Plan& plan, const fem::PressState& press) {
  render::Scene out = scene_without_surface(scene, plan, {}, {}, press);
  if (scene.device.gel.frame == GelFrame::clear) out.surfaces.erase(out.surfaces.begin());
  return out;
}

render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const VisibleGel& gel, const fem::PressState& press) {
  const std::vector<PlacedShape> shapes = placed_shapes(objects, press);
  if (scene.device.coating) {
    render::Scene out = scene_in_coating(scene, plan, press);
    out.surfaces.insert(out.surfaces.begin(), coated_surface(scene, plan, gel.sheet(press, shapes)));
    return out;
  }
  render::Scene out = scene_without_surface(scene, plan, objects, poses_of(press), press);
  if (plan.object_print) {
    const std::vector<MovedObject> all = moved_objects(scene);
    std::size_t surface = 1;  // after the frame
    for (std::size_t k = 0; k < objects.size(); ++k) {
      if (!objects[k].print.layers.empty()) {
        std::optional<ContactPressure> pressure;
        if (plan.skin_blanching) pressure = gel.pressure_on(press, static_cast<int>(k));
        out.surfaces[surface].print = print_on(objects[k], all[k].object, plan.bands, pressure ? &*pressure : nullptr);
      }
      surface += objects[k].screen ? 2 : 1;
    }
  }
  out.surfaces.insert(out.surfaces.begin(), gel_surface(gel.dry_surface(press, shapes)));
  return out;
}

render::Scene visible_scene(const SceneSpec& scene, const Plan& plan, const std::vector<VisibleObject>& objects,
                            const Membrane& membrane, const fem::PressState& press, const fem::ReliefAnswer& relief) {
  TS_ASSERT(objects.size() == 1);
  if (scene.device.coating) {
    render::Scene out = scene_in_coating(scene, plan, press);
    out.surfaces.insert(out.surfaces.begin(), coated_surface(scene, plan, whole_sheet(membrane.sheet(press, relief))));
    return out;
  }
  render::Scene out = scene_without_surface(scene, plan, objects, poses_of(press, relief), press);
  Membrane::Sheet sheet = membrane.sheet(press, relief);
  render::Surface wet{std::move(sheet.wet), material_of(scene.object, plan.bands)};
  if (plan.object_print && !objects.front().print.layers.empty()) {
    render::Print print = print_on(objects.front(), scene.object, plan.bands, nullptr);
    wet.print = print;
    wet.print->material_mm.clear();
    const RigidTransform object_from_gel = poses_of(press, relief).front().inverse();
    for (const Eigen::Vector3d& vertex : wet.mesh.vertices) {
      wet.print->material_mm.emplace_back((object_from_gel * vertex).head<2>());
    }
    out.surfaces[1].print = std::move(print);
  }
  out.surfaces.insert(out.surfaces.begin(), gel_surface(std::move(sheet.dry)));
  out.surfaces.push_back(std::move(wet));
  return out;
}

GelSheet whole_sheet(Membrane::Sheet fine) {
  GelSheet sheet;
  sheet.mesh = std::move(fine.dry);
  sheet.touched.assign(sheet.mesh.triangles.size(), -1);
  sheet.mesh.triangles.insert(sheet.mesh.triangles.end(), fine.wet.triangles.begin(), fine.wet.triangles.end());
  sheet.touched.resize(sheet.mesh.triangles.size(), 0);
  sheet.rest = std::move(fine.rest);
  return sheet;
}

std::vector<render::PrintedMark> printed_marks(const PrintSpec& print) {
  if (print.pattern == PrintPattern::scattered) return scattered_marks(print);
  std::vector<render::PrintedMark> marks;
  std::uint64_t index = 0;
  for (const Eigen::Vector2d& centre : grid_centres(print.grid, print.spacing_mm)) {
    RandomStream random(print.seed, index++, Purpose::kPlacement);
    const double dx = print.jitter_mm * (2.0 * random.uniform() - 1.0);
    const double dy = print.jitter_mm * (2.0 * random.uniform() - 1.0);
    marks.push_back({centre + Eigen::Vector2d(dx, dy), print.width_mm / 2, 0, print.shape});
  }
  return marks;
}

std::vector<Eigen::Vector2d> print_coordinates(const PrintSpec& print, const GelSpec& gel,
                                               const std::vector<Eigen::Vector3d>& rest) {
  std::vector<Eigen::Vector2d> places;
  places.reserve(rest.size());
  const bool along = print.pattern == PrintPattern::scattered;
  for (const Eigen::Vector3d& point : rest) {
    places.push_back(along ? along_surface(gel, point) : Eigen::Vector2d(point.head<2>()));
  }
  return places;
}

}  // namespace touchstone::sim
