#include "sim/scene/object.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/units.h"
#include "sim/files/mesh_file.h"

namespace touchstone::sim {
namespace {

constexpr int kAround = 96;  // segments of a turned body

/// The body that a profile of (radius, z) pairs sweeps about the z axis, from its lower pole or disc to its upper one.
/// The profile starts and ends on the axis.
TriangleMesh turned_body(const std::vector<Eigen::Vector2d>& profile) {
  TriangleMesh mesh;
  std::vector<int> first_of_ring;
  for (const Eigen::Vector2d& p : profile) {
    first_of_ring.push_back(static_cast<int>(mesh.vertices.size()));
    const int points = p.x() == 0.0 ? 1 : kAround;
    for (int i = 0; i < points; ++i) {
      const double angle = 2.0 * kPi * i / kAround;
      mesh.vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
    }
  }
  for (std::size_t ring = 0; ring + 1 < profile.size(); ++ring) {
    const int low = first_of_ring[ring];
    const int high = first_of_ring[ring + 1];
    const bool low_pole = profile[ring].x() == 0.0;
    const bool high_pole = profile[ring + 1].x() == 0.0;
    for (int i = 0; i < kAround; ++i) {
      const int j = (i + 1) % kAround;
      const int low_i = low_pole ? low : low + i;
      const int low_j = low_pole ? low : low + j;
      const int high_i = high_pole ? high : high + i;
      const int high_j = high_pole ? high : high + j;
      if (!low_pole) mesh.triangles.push_back({low_i, low_j, high_i});
      if (!high_pole) mesh.triangles.push_back({low_j, high_j, high_i});
    }
  }
  return mesh;
}

TriangleMesh sphere_mesh(double radius) {
  constexpr int kRings = 48;
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i <= kRings; ++i) {
    const double angle = kPi * i / kRings;
    const bool pole = i == 0 || i == kRings;
    profile.emplace_back(pole ? 0.0 : radius * std::sin(angle), -radius * std::cos(angle));
  }
  return turned_body(profile);
}

TriangleMesh rounded_cylinder_mesh(const ShapeSpec& shape) {
  constexpr int kArc = 12;
  const double edge = shape.edge_radius_mm;
  std::vector<Eigen::Vector2d> profile = {{0.0, 0.0}};
  if (edge < shape.radius_mm) profile.emplace_back(shape.radius_mm - edge, 0.0);
  for (int i = 1; i <= kArc && edge > 0.0; ++i) {
    const double angle = kPi / 2 * i / kArc;
    profile.emplace_back(shape.radius_mm - edge + edge * std::sin(angle), edge - edge * std::cos(angle));
  }
  if (edge < shape.height_mm) profile.emplace_back(shape.radius_mm, shape.height_mm);
  profile.emplace_back(0.0, shape.height_mm);
  return turned_body(profile);
}

TriangleMesh box_mesh(const Eigen::Vector3d& size) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1) ? 0.5 : -0.5, (corner & 2) ? 0.5 : -0.5, (corner & 4) ? 0.5 : -0.5);
    mesh.vertices.push_back(sign.cwiseProduct(size));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TriangleMesh egg_mesh(const ShapeSpec& shape) {
  constexpr int kRings = 48;
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i <= kRings; ++i) {
    const double angle = kPi * i / kRings;
    const bool pole = i == 0 || i == kRings;
    const double half = 2 * i < kRings ? shape.blunt_mm : shape.sharp_mm;
    profile.emplace_back(pole ? 0.0 : shape.radius_mm * std::sin(angle), -half * std::cos(angle));
  }
  TriangleMesh mesh = turned_body(profile);
  for (Eigen::Vector3d& v : mesh.vertices) v = Eigen::Vector3d(v.x(), v.z(), -v.y());  // its axis from z to y
  return mesh;
}

fem::ShellShape shell_shape(const ShapeSpec& shape) {
  return {shape.axes_mm, shape.thickness_mm, shape.curvature_per_mm};
}

/// A convex prism along x, half of it on either side of x = 0, over an outline (y, z) that runs counter-clockwise.
TriangleMesh prism_mesh(const std::vector<Eigen::Vector2d>& outline, double length) {
  const auto corners = static_cast<int>(outline.size());
  TriangleMesh mesh;
  for (const double x : {-0.5 * length, 0.5 * length}) {
    for (const Eigen::Vector2d& p : outline) mesh.vertices.emplace_back(x, p.x(), p.y());
  }
  for (int k = 0; k < corners; ++k) {
    const int next = (k + 1) % corners;
    mesh.triangles.push_back({k, next, corners + next});
    mesh.triangles.push_back({k, corners + next, corners + k});
    if (k == 0 || next == 0) continue;
    mesh.triangles.push_back({0, k + 1, k});
    mesh.triangles.push_back({corners, corners + k, corners + k + 1});
  }
  return mesh;
}

/// A regular hexagon's prism along x about the origin; one flat faces -z.
TriangleMesh hexagon_mesh(const ShapeSpec& shape) {
  const double corner = shape.across_flats_mm / std::sqrt(3.0);  // from the axis
  const double flat = 0.5 * shape.across_flats_mm;
  return prism_mesh({{-0.5 * corner, -flat},
                     {0.5 * corner, -flat},
                     {corner, 0.0},
                     {0.5 * corner, flat},
                     {-0.5 * corner, flat},
                     {-corner, 0.0}},
                    shape.length_mm);
}

TriangleMesh wedge_mesh(const ShapeSpec& shape) {
  const double half = shape.height_mm * std::tan(shape.half_angle_deg * kRadiansPerDegree);
  return prism_mesh({{0.0, 0.0}, {half, shape.height_mm}, {-half, shape.height_mm}}, shape.length_mm);
}

fem::ConeShape cone_shape(const ShapeSpec& shape) {
  return {shape.half_angle_deg * kRadiansPerDegree, shape.height_mm, shape.tip_radius_mm};
}

fem::BarShape bar_shape(const ShapeSpec& shape) {
  return {shape.radius_mm, shape.length_mm, shape.type == ShapeKind::capsule};
}

TriangleMesh cone_mesh(const fem::ConeShape& cone) {
  constexpr int kArc = 24;
  std::vector<Eigen::Vector2d> profile = {{0.0, 0.0}};
  const double arc = 0.5 * kPi - cone.half_angle;  // of the tip, from the axis to where the side begins
  for (int i = 1; i <= kArc && cone.tip_radius > 0.0; ++i) {
    const double angle = arc * i / kArc;
    profile.emplace_back(cone.tip_radius * std::sin(angle), cone.tip_radius * (1.0 - std::cos(angle)));
  }
  profile.emplace_back(cone.base_radius(), cone.height);
  profile.emplace_back(0.0, cone.height);
  return turned_body(profile);
}

TriangleMesh bar_mesh(const fem::BarShape& bar) {
  constexpr int kRings = 24;  // of an end
  const double half = bar.half_cylinder();
  std::vector<Eigen::Vector2d> profile = {{0.0, -0.5 * bar.length}};
  for (int i = 1; i < kRings && bar.round_ends; ++i) {
    const double angle = 0.5 * kPi * i / kRings;
    profile.emplace_back(bar.radius * std::sin(angle), -half - bar.radius * std::cos(angle));
  }
  profile.emplace_back(bar.radius, -half);
  for (auto k = static_cast<int>(profile.size()) - 1; k > 0; --k) {  // the other end is its mirror image
    if (half > 0.0 || profile[k].y() < 0.0) profile.emplace_back(profile[k].x(), -profile[k].y());
  }
  profile.emplace_back(0.0, 0.5 * bar.length);
  TriangleMesh mesh = turned_body(profile);
  for (Eigen::Vector3d& v : mesh.vertices) v = Eigen::Vector3d(v.z(), v.x(), v.y());  // its axis from z to x
  return mesh;
}

TriangleMesh torus_mesh(const fem::TorusShape& torus) {
  constexpr int kAcross = 48;  // segments of the tube
  TriangleMesh mesh;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2.0 * kPi * i / kAround;
    for (int j = 0; j < kAcross; ++j) {
      const double turn = 2.0 * kPi * j / kAcross;
      const double rho = torus.radius + torus.tube * std::cos(turn);
      mesh.vertices.emplace_back(rho * std::cos(angle), rho * std::sin(angle), torus.tube * std::sin(turn));
    }
  }
  const auto at = [](int i, int j) { return i % kAround * kAcross + j % kAcross; };
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

/// Rings of an ellipse, the lower face first, then the upper one.
TriangleMesh shell_mesh(const fem::ShellShape& shell) {
  constexpr int kRings = 48;
  constexpr int kPoints = 1 + kRings * kAround;  // of one face
  TriangleMesh mesh;
  for (const double above : {0.0, shell.thickness}) {
    for (int ring = 0; ring <= kRings; ++ring) {
      for (int i = 0; i < (ring == 0 ? 1 : kAround); ++i) {
        const double angle = 2.0 * kPi * i / kAround;
        const double part = 0.5 * ring / kRings;
        const double x = part * shell.size.x() * std::cos(angle);
        const double y = part * shell.size.y() * std::sin(angle);
        mesh.vertices.emplace_back(x, y, shell.lower_face(x, y) + above);
      }
    }
  }
  const auto at = [](int ring, int i) { return ring == 0 ? 0 : 1 + (ring - 1) * kAround + i % kAround; };
  const auto both_faces = [&](int a, int b, int c) {  // given as seen from above
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({kPoints + a, kPoints + b, kPoints + c});
  };
  for (int i = 0; i < kAround; ++i) {
    both_faces(0, at(1, i), at(1, i + 1));
    for (int ring = 1; ring < kRings; ++ring) {
      both_faces(at(ring, i), at(ring + 1, i), at(ring + 1, i + 1));
      both_faces(at(ring, i), at(ring + 1, i + 1), at(ring, i + 1));
    }
    const int low = at(kRings, i);
    const int next = at(kRings, i + 1);
    mesh.triangles.push_back({low, next, kPoints + next});
    mesh.triangles.push_back({low, kPoints + next, kPoints + low});
  }
  return mesh;
}

/// @pre its file was read, as `fields` does
const TriangleMesh& mesh_of(const ShapeSpec& shape) {
  TS_ASSERT(shape.mesh != nullptr);
  return *shape.mesh;
}

}  // namespace

double flat_width_mm(const ShapeSpec& hexagon) {
  TS_ASSERT(hexagon.type == ShapeKind::hexagon);
  return hexagon.across_flats_mm / std::sqrt(3.0);
}

EnumNames<ShapeKind> enum_names(ShapeKind) {
  return {{"sphere", ShapeKind::sphere},
          {"rounded_cylinder", ShapeKind::rounded_cylinder},
          {"box", ShapeKind::box},
          {"mesh", ShapeKind::mesh},
          {"egg", ShapeKind::egg},
          {"shell", ShapeKind::shell},
          {"hexagon", ShapeKind::hexagon},
          {"cone", ShapeKind::cone},
          {"torus", ShapeKind::torus},
          {"capsule", ShapeKind::capsule},
          {"lying_cylinder", ShapeKind::lying_cylinder},
          {"wedge", ShapeKind::wedge}};
}

void fields(YamlReader& in, ShapeSpec& shape) {
  shape.where = in.where();
  in.required("type", shape.type);
  switch (shape.type) {
    case ShapeKind::sphere:
      in.required("radius_mm", shape.radius_mm, Allowed::above_up_to(0.0, 1e4));
      break;
    case ShapeKind::rounded_cylinder:
      in.required("radius_mm", shape.radius_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("height_mm", shape.height_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("edge_radius_mm", shape.edge_radius_mm,
                  Allowed::within(0.0, std::min(shape.radius_mm, shape.height_mm)));
      break;
    case ShapeKind::box:
      in.required("size_mm", shape.size_mm, Allowed::above_up_to(0.0, 1e4));
      break;
    case ShapeKind::mesh: {
      std::string file;
      in.required("file", file);
      shape.file = in.folder() / file;
      shape.where = in.where("file");
      in.optional("mm_per_unit", shape.mm_per_unit, Allowed::above(0.0));
      if (in.describing()) break;
      try {
        if (!shape.mm_per_unit) shape.mm_per_unit = usual_mm_per_unit(shape.file);
        shape.mesh = std::make_shared<const TriangleMesh>(read_mesh_file(shape.file, *shape.mm_per_unit));
      } catch (const Error& error) {
        fail_at(shape.where, "shape.file: {}", error.what());
      }
      break;
    }
    case ShapeKind::egg:
      in.required("radius_mm", shape.radius_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("blunt_mm", shape.blunt_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("sharp_mm", shape.sharp_mm, Allowed::above_up_to(0.0, 1e4));
      break;
    case ShapeKind::shell:
      in.required("axes_mm", shape.axes_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("thickness_mm", shape.thickness_mm, Allowed::above_up_to(0.0, 1e3));
      in.optional("curvature_per_mm", shape.curvature_per_mm, Allowed::within(-10.0, 10.0));
      break;
    case ShapeKind::hexagon:
      in.required("across_flats_mm", shape.across_flats_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("length_mm", shape.length_mm, Allowed::above_up_to(0.0, 1e4));
      break;
    case ShapeKind::cone: {
      in.required("half_angle_deg", shape.half_angle_deg, Allowed::within(1.0, 89.0));
      in.required("height_mm", shape.height_mm, Allowed::above_up_to(0.0, 1e4));
      // The tip's ball ends below the base.
      const double lowered = 1.0 - std::sin(shape.half_angle_deg * kRadiansPerDegree);
      in.optional("tip_radius_mm", shape.tip_radius_mm,
                  Allowed{.low = 0.0, .high = shape.height_mm / lowered, .high_included = false});
      break;
    }
    case ShapeKind::torus:
      in.required("radius_mm", shape.radius_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("tube_radius_mm", shape.tube_radius_mm,
                  Allowed{.low = 0.0, .high = shape.radius_mm, .low_included = false, .high_included = false});
      break;
    case ShapeKind::capsule:
    case ShapeKind::lying_cylinder:
      in.required("radius_mm", shape.radius_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("length_mm", shape.length_mm,
                  shape.type == ShapeKind::capsule ? Allowed::within(2.0 * shape.radius_mm, 2e4)
                                                   : Allowed::above_up_to(0.0, 1e4));
      break;
    case ShapeKind::wedge:
      in.required("half_angle_deg", shape.half_angle_deg, Allowed::within(1.0, 89.0));
      in.required("height_mm", shape.height_mm, Allowed::above_up_to(0.0, 1e4));
      in.required("length_mm", shape.length_mm, Allowed::above_up_to(0.0, 1e4));
      break;
  }
}

void fields(YamlReader& in, ScreenSpec& screen) {
  in.required("radius_mm", screen.radius_mm, Allowed::above(0.0));
  in.required("behind_mm", screen.behind_mm, Allowed::above(0.0));
  in.required("radiance", screen.radiance, Allowed::at_least(0.0));
}

void fields(YamlReader& in, ElasticSpec& elastic) {
  elastic.where = in.where();
  in.required("youngs_modulus_MPa", elastic.youngs_modulus_MPa, Allowed::above_up_to(0.0, 1e7));
  in.required("poisson_ratio", elastic.poisson_ratio, Allowed::within(0.0, 0.5));
  in.required("mesh_mm", elastic.mesh_mm, Allowed::above_up_to(0.0, 1e3));
  in.optional("fine_radius_mm", elastic.fine_radius_mm, Allowed::at_least(0.0));
  in.optional("held_above_mm", elastic.held_above_mm);
}

void fields(YamlReader& in, ObjectSpec& object) {
  in.required("name", object.name);
  in.required("shape", object.shape);
  in.optional("relief", object.relief);
  in.optional("radiance", object.radiance, Allowed::at_least(0.0));
  if (!object.radiance) {
    in.optional("albedo", object.albedo, Allowed::within(0.0, 1.0));
    in.optional("print", object.print);
    check_layers(object.print);
  }
  in.optional("elastic", object.elastic);
  in.optional("friction", object.friction, Allowed::at_least(0.0));
  in.optional("screen", object.screen);
  in.optional("mass_g", object.mass_g, Allowed::above_up_to(0.0, 1e5));
  in.optional("crush_force_N", object.crush_force_N, Allowed::above_up_to(0.0, 1e6));
}

ObjectSpec read_object(const std::filesystem::path& file) {
  return read_yaml<ObjectSpec>(file);
}

fem::ContactShape contact_shape(const ShapeSpec& shape) {
  switch (shape.type) {
    case ShapeKind::sphere:
      return fem::SphereShape{shape.radius_mm};
    case ShapeKind::rounded_cylinder:
      return fem::RoundedCylinder{shape.radius_mm, shape.edge_radius_mm, shape.height_mm};
    case ShapeKind::box:
      return fem::BoxShape{shape.size_mm};
    case ShapeKind::mesh:
      return fem::MeshShape(mesh_of(shape));
    case ShapeKind::egg:
      return fem::EggShape{shape.radius_mm, shape.blunt_mm, shape.sharp_mm};
    case ShapeKind::shell:
      return shell_shape(shape);
    case ShapeKind::hexagon:
      return fem::MeshShape(hexagon_mesh(shape));
    case ShapeKind::cone:
      return cone_shape(shape);
    case ShapeKind::torus:
      return fem::TorusShape{shape.radius_mm, shape.tube_radius_mm};
    case ShapeKind::capsule:
    case ShapeKind::lying_cylinder:
      return bar_shape(shape);
    case ShapeKind::wedge:
      return fem::MeshShape(wedge_mesh(shape));
  }
  TS_ASSERT(false);
  return {};
}

namespace {

fem::ContactShape with_relief(const fem::ContactShape& shape, fem::ReliefMap relief) {
  fem::ReliefShape body;
  std::visit(
      [&]<typename Shape>(const Shape& plain) {
        if constexpr (!std::is_same_v<Shape, fem::ReliefShape>) body.base = plain;
      },
      shape);
  body.relief = std::make_shared<const fem::ReliefMap>(std::move(relief));
  return body;
}

}  // namespace

fem::ContactShape contact_shape(const ObjectSpec& object) {
  const fem::ContactShape plain = contact_shape(object.shape);
  return object.relief ? with_relief(plain, relief_map(*object.relief)) : plain;
}

fem::ContactShape coarse_contact_shape(const ObjectSpec& object, double edge_mm) {
  const fem::ContactShape plain = contact_shape(object.shape);
  return object.relief ? with_relief(plain, relief_map(*object.relief).blurred(edge_mm)) : plain;
}

TriangleMesh visible_mesh(const ShapeSpec& shape) {
  switch (shape.type) {
    case ShapeKind::sphere:
      return sphere_mesh(shape.radius_mm);
    case ShapeKind::rounded_cylinder:
      return rounded_cylinder_mesh(shape);
    case ShapeKind::box:
      return box_mesh(shape.size_mm);
    case ShapeKind::mesh:
      return mesh_of(shape);
    case ShapeKind::egg:
      return egg_mesh(shape);
    case ShapeKind::shell:
      return shell_mesh(shell_shape(shape));
    case ShapeKind::hexagon:
      return hexagon_mesh(shape);
    case ShapeKind::cone:
      return cone_mesh(cone_shape(shape));
    case ShapeKind::torus:
      return torus_mesh({shape.radius_mm, shape.tube_radius_mm});
    case ShapeKind::capsule:
    case ShapeKind::lying_cylinder:
      return bar_mesh(bar_shape(shape));
    case ShapeKind::wedge:
      return wedge_mesh(shape);
  }
  TS_ASSERT(false);
  return {};
}

TriangleMesh visible_mesh(const ScreenSpec& screen) {
  constexpr double kThickness = 1.0;
  ShapeSpec disc;
  disc.type = ShapeKind::rounded_cylinder;
  disc.radius_mm = screen.radius_mm;
  disc.height_mm = kThickness;
  TriangleMesh mesh = rounded_cylinder_mesh(disc);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.z() += screen.behind_mm;
  return mesh;
}

}  // namespace touchstone::sim
