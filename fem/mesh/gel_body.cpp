#include "fem/mesh/gel_body.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string_view>

#include "core/error.h"
#include "core/overloaded.h"
#include "fem/mesh/layer_columns.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

/// What is left of a slab under its layers, in a frame of its own with z = 0 on top.
SlabMesh core_of(const SlabGel& gel) {
  SlabMesh core = gel.mesh;
  const double layers = total_thickness(gel.layers);
  core.thickness -= layers;
  core.fine_depth = std::max(0.0, core.fine_depth - layers);
  return core;
}

double estimated(const SlabGel& gel) {
  if (gel.layers.empty()) return estimated_tetrahedra(gel.mesh);
  const SlabMesh core = core_of(gel);
  const LayerSheets sheets = layer_sheets(gel.layers, gel.mesh.fine, gel.mesh.fine_depth);
  // A thin sheet of the slab shows how many triangles its face has: about 2.3 to the edge squared.
  const double fine_area =
      4.0 * std::min(core.fine_half_x, core.size_x / 2.0) * std::min(core.fine_half_y, core.size_y / 2.0);
  const double grade = 2.0 * std::log(core.coarse / core.fine + 1.0);
  const double fine_part = fine_area / (core.fine * core.fine);
  const double rest = (core.size_x * core.size_y - fine_area) / (core.coarse * core.coarse);
  return estimated_tetrahedra(core) + 3.0 * 2.3 * (fine_part + grade * std::sqrt(fine_part + 1.0) + rest) *
                                          static_cast<double>(sheets.region.size());
}

void check_slab(const SlabGel& gel) {
  check(gel.mesh);
  const double layers = total_thickness(gel.layers);
  if (layers == 0.0) return;
  if (layers > gel.mesh.thickness - 0.5 * gel.mesh.fine) {
    fail("the slab's layers are {} mm thick together; there is space for {:.3g} mm", layers,
         gel.mesh.thickness - 0.5 * gel.mesh.fine);
  }
  SlabMesh core = core_of(gel);
  core.fine = std::min(core.fine, core.thickness);
  check(core);
  check_tetrahedra(estimated(gel), "the slab with its layers", gel.mesh.fine);
}

TetMesh mesh_layered_slab(const SlabGel& gel) {
  check_slab(gel);
  if (gel.layers.empty()) return mesh_slab(gel.mesh);
  SlabMesh core = core_of(gel);
  core.fine = std::min(core.fine, core.thickness);
  TetMesh mesh = mesh_slab(core);
  const double layers = total_thickness(gel.layers);
  for (Eigen::Vector3d& vertex : mesh.vertices) {
    vertex.z() = vertex.z() == 0.0               ? -layers
                 : vertex.z() == -core.thickness ? -gel.mesh.thickness
                                                 : vertex.z() - layers;
  }
  LayerColumns columns;
  columns.faces = mesh.outer;
  columns.kinds.assign(mesh.outer.size(), FaceKind::outer);
  const std::vector<Eigen::Vector3d> body = mesh.vertices;
  columns.at = [&](int vertex, double depth) -> Eigen::Vector3d {
    return {body[vertex].x(), body[vertex].y(), 0.0 - depth};
  };
  add_layers(layer_sheets(gel.layers, gel.mesh.fine, gel.mesh.fine_depth), columns, mesh);
  return mesh;
}

/// The smallest angle among the tetrahedra that aren't layers' prisms, radians.
double smallest_dihedral_of_body(const TetMesh& mesh) {
  if (mesh.region.empty()) return smallest_dihedral_angle(mesh);
  TetMesh body;
  body.vertices = mesh.vertices;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    if (mesh.region[e] == 0) body.tetrahedra.push_back(mesh.tetrahedra[e]);
  }
  return smallest_dihedral_angle(body);
}

}  // namespace

int material_count(const GelBody& body) {
  return std::visit(Overloaded{[](const SolidGel&) { return 1; },
                               [](const auto& gel) { return 1 + static_cast<int>(gel.layers.size()); }},
                    body);
}

void check(const GelBody& body) {
  std::visit(Overloaded{[](const SlabGel& gel) { check_slab(gel); }, [](const auto& gel) { check(gel); }}, body);
}

double thickness_of(const GelBody& body) {
  return std::visit(Overloaded{[](const SlabGel& gel) { return gel.mesh.thickness; },
                               [](const auto& gel) { return thickness_of(gel); }},
                    body);
}

double fine_edge(const GelBody& body) {
  if (const auto* slab = std::get_if<SlabGel>(&body)) return slab->mesh.fine;
  if (const auto* dome = std::get_if<DomeGel>(&body)) return dome->fine;
  if (const auto* tip = std::get_if<FingertipGel>(&body)) return tip->fine;
  return std::get<SolidGel>(body).fine;
}

double fine_reach(const GelBody& body) {
  if (const auto* slab = std::get_if<SlabGel>(&body)) return std::min(slab->mesh.fine_half_x, slab->mesh.fine_half_y);
  if (const auto* dome = std::get_if<DomeGel>(&body)) return dome->fine_radius;
  if (const auto* tip = std::get_if<FingertipGel>(&body)) return tip->fine_radius;
  const SolidGel& solid = std::get<SolidGel>(body);
  return std::min(solid.fine_half_x, solid.fine_half_y);
}

double least_extent(const GelBody& body) {
  if (const auto* slab = std::get_if<SlabGel>(&body)) {
    return std::min({slab->mesh.size_x, slab->mesh.size_y, slab->mesh.thickness});
  }
  return thickness_of(body);
}

namespace {

/// Calls act(fine, coarse) on the body's two edge lengths.
template <typename Act>
void on_edges(GelBody& body, const Act& act) {
  if (auto* slab = std::get_if<SlabGel>(&body)) act(slab->mesh.fine, slab->mesh.coarse);
  if (auto* dome = std::get_if<DomeGel>(&body)) act(dome->fine, dome->coarse);
  if (auto* tip = std::get_if<FingertipGel>(&body)) act(tip->fine, tip->coarse);
  if (auto* solid = std::get_if<SolidGel>(&body)) act(solid->fine, solid->coarse);
}

}  // namespace

GelBody with_edges(GelBody body, double factor) {
  on_edges(body, [factor](double& fine, double& coarse) {
    fine *= factor;
    coarse *= factor;
  });
  return body;
}

GelBody with_edges(GelBody body, double fine, double coarse) {
  on_edges(body, [=](double& own_fine, double& own_coarse) {
    own_fine = fine;
    own_coarse = coarse;
  });
  return body;
}

double estimated_tetrahedra(const GelBody& body) {
  return std::visit(Overloaded{[](const SlabGel& gel) { return estimated(gel); },
                               [](const auto& gel) { return estimated_tetrahedra(gel); }},
                    body);
}

TetMesh mesh_gel(const GelBody& body) {
  TetMesh mesh = std::visit(Overloaded{[](const SlabGel& gel) { return mesh_layered_slab(gel); },
                                       [](const DomeGel& gel) { return mesh_revolved(gel); },
                                       [](const FingertipGel& gel) { return mesh_revolved(gel); },
                                       [](const SolidGel& gel) { return mesh_solid(gel); }},
                            body);
  if (const std::string fault = fault_of(mesh); !fault.empty()) {
    fail("the mesh made of the gel is unfit: {}", fault);
  }
  const double angle = smallest_dihedral_of_body(mesh) * 180.0 / std::numbers::pi;
  if (!(angle >= kSmallestDihedralDeg)) {
    fail(
        "the gel's mesh has faces that meet at {:.3g} degrees; at least {} are wanted: change its edge lengths, or its "
        "shape if it has edges as sharp",
        angle, kSmallestDihedralDeg);
  }
  return mesh;
}

void add_to(Sha256& sum, const GelBody& body) {
  const auto number = [&](double value) {
    value += 0.0;  // -0 and 0 are one gel
    sum.add(&value, sizeof(value));
  };
  const auto numbers = [&](std::span<const double> values) {
    number(static_cast<double>(values.size()));
    for (const double value : values) number(value);
  };
  const auto add = [&](std::string_view kind, std::initializer_list<double> values) {
    sum.add(kind);
    numbers({values.begin(), values.size()});
  };
  std::visit(Overloaded{[&](const SlabGel& gel) {
                          const SlabMesh& m = gel.mesh;
                          add("slab", {m.size_x, m.size_y, m.thickness, m.fine, m.coarse, m.fine_half_x, m.fine_half_y,
                                       m.fine_depth});
                          numbers(gel.layers);
                        },
                        [&](const DomeGel& gel) {
                          add("dome", {gel.sphere_radius, gel.base_radius, gel.thickness, gel.fine, gel.coarse,
                                       gel.fine_radius, gel.fine_depth});
                          numbers(gel.layers);
                        },
                        [&](const FingertipGel& gel) {
                          add("fingertip", {gel.radius, gel.length, gel.sleeve, gel.fine, gel.coarse, gel.fine_radius,
                                            gel.fine_depth});
                          numbers(gel.layers);
                        },
                        [&](const SolidGel& gel) {
                          add("solid", {gel.fine, gel.coarse, gel.fine_half_x, gel.fine_half_y, gel.fine_depth,
                                        static_cast<double>(gel.surface.vertices.size()),
                                        static_cast<double>(gel.surface.triangles.size())});
                          for (const Eigen::Vector3d& vertex : gel.surface.vertices) {
                            for (int a = 0; a < 3; ++a) number(vertex[a]);
                          }
                          for (const auto& triangle : gel.surface.triangles) {
                            for (const int v : triangle) number(v);
                          }
                          for (const FaceKind kind : gel.faces) number(static_cast<double>(kind));
                        }},
             body);
}

}  // namespace touchstone::fem
