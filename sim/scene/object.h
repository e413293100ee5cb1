#pragma once
// An object file: the shape of a body, its stiffness and its appearance. See docs/file-formats.md.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/triangle_mesh.h"
#include "core/yaml_reader.h"
#include "fem/shapes/contact_shape.h"
#include "sim/files/colour.h"
#include "sim/relief/relief.h"
#include "sim/scene/object_print.h"

namespace touchstone::sim {

/// `shape.type` of the file; which fields of ShapeSpec count depends on it.
enum class ShapeKind {
  sphere,
  rounded_cylinder,
  box,
  mesh,
  egg,
  shell,
  hexagon,
  cone,
  torus,
  capsule,
  lying_cylinder,
  wedge
};
EnumNames<ShapeKind> enum_names(ShapeKind);

/// Only the fields that belong to `type` may stand in the file.
struct ShapeSpec {
  ShapeKind type = ShapeKind::sphere;
  /// sphere, rounded_cylinder, capsule, lying_cylinder; egg: of its equator; torus: of the tube's middle
  double radius_mm = 0.0;
  double edge_radius_mm = 0.0;                                 ///< rounded_cylinder
  double height_mm = 0.0;                                      ///< rounded_cylinder, cone, wedge: along z
  Eigen::Vector3d size_mm = Eigen::Vector3d::Zero();           ///< box
  std::filesystem::path file;                                  ///< mesh: see sim/files/mesh_file.h
  std::optional<double> mm_per_unit;                           ///< mesh: where not given, usual_mm_per_unit(file)
  std::shared_ptr<const TriangleMesh> mesh;                    ///< mesh: what its file holds
  double blunt_mm = 0.0;                                       ///< egg: from the equator to its end at -y
  double sharp_mm = 0.0;                                       ///< egg: to its end at +y
  Eigen::Vector2d axes_mm = Eigen::Vector2d::Zero();           ///< shell: whole axes of its outline, an ellipse
  double thickness_mm = 0.0;                                   ///< shell: along z
  Eigen::Vector2d curvature_per_mm = Eigen::Vector2d::Zero();  ///< shell: along x and y, see fem::ShellShape
  double across_flats_mm = 0.0;                                ///< hexagon: a regular prism along x, a flat below
  double length_mm = 0.0;                                      ///< hexagon, capsule, lying_cylinder, wedge: along x
  double half_angle_deg = 0.0;                                 ///< cone, wedge: of their tip or edge, which is below
  double tip_radius_mm = 0.0;                                  ///< cone
  double tube_radius_mm = 0.0;                                 ///< torus
  SourceLocation where;
};

/// Width of one of the hexagon's flats, mm. @pre the shape is one
double flat_width_mm(const ShapeSpec& hexagon);

/// A luminous disc round or behind the object that the camera sees and that is never touched: a light panel. It stays
/// where the motion starts, level.
struct ScreenSpec {
  double radius_mm = 0.0;
  double behind_mm = 0.0;  ///< its front face above the object's origin at the start
  Colour radiance = 1.0;   ///< W/m^2/sr in each band
};

/// A body that isn't rigid: linear elastic, held on its upper side.
struct ElasticSpec {
  double youngs_modulus_MPa = 0.0;
  double poisson_ratio = 0.0;
  double mesh_mm = 0.0;                  ///< its edges on the underside; they grow to three times that
  std::optional<double> fine_radius_mm;  ///< how far from its z axis they are so fine; without it, all of the underside
  /// Faces wholly at or above this z of the object frame are held. Without it: of a sphere, the cap above half its
  /// radius; of others, the faces within a hundredth of the height from the top.
  std::optional<double> held_above_mm;
  SourceLocation where;
};

/// All of an object file, checked.
struct ObjectSpec {
  std::string name;
  ShapeSpec shape;
  std::optional<ReliefSpec> relief;  ///< on the shape's lower side
  Colour albedo = 0.5;
  std::vector<PrintLayer> print;       ///< on the shape's lower side; none with a radiance
  std::optional<Colour> radiance;      ///< W/m^2/sr in air: a diffuser lit from behind, which has no albedo
  std::optional<ElasticSpec> elastic;  ///< without it the object is rigid
  double friction = 0.0;               ///< Coulomb coefficient against the gel
  std::optional<ScreenSpec> screen;
  std::optional<double> mass_g;         ///< what a gripper lifts
  std::optional<double> crush_force_N;  ///< normal force that breaks it
};

void fields(YamlReader& in, ShapeSpec& shape);
void fields(YamlReader& in, ScreenSpec& screen);
void fields(YamlReader& in, ElasticSpec& elastic);
void fields(YamlReader& in, ObjectSpec& object);

/// @throws Error with file and line for what can't be read or isn't allowed
ObjectSpec read_object(const std::filesystem::path& file);

/// The body as the contact solver sees it.
fem::ContactShape contact_shape(const ShapeSpec& shape);
/// The same with the object's relief on it, in all its detail. @throws Error also for a relief that can't be read
fem::ContactShape contact_shape(const ObjectSpec& object);
/// What a gel meshed with edges of `edge_mm` can resolve of the object: its relief is blurred by that.
fem::ContactShape coarse_contact_shape(const ObjectSpec& object, double edge_mm);

/// The body as the renderer sees it: a closed surface in the object frame.
TriangleMesh visible_mesh(const ShapeSpec& shape);
TriangleMesh visible_mesh(const ScreenSpec& screen);

}  // namespace touchstone::sim
