#include "fem/elements/surface_coupling.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

/// The displacement is smooth inside an element and bends a little between them; degree 16 (153 points) leaves 1e-4 of
/// a bead's motion relative to its surroundings.
constexpr int kBeadRuleDegree = 16;

double area_of(const TetMesh& mesh, const std::array<int, 3>& face) {
  const Eigen::Vector3d& a = mesh.vertices[face[0]];
  return 0.5 * (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a).norm();
}

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const auto inside_of = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return normal.cross(to - from).dot(p - from) >= 0.0;
  };
  if (inside_of(a, b) && inside_of(b, c) && inside_of(c, a)) {
    return std::abs(normal.dot(p - a));
  }
  const auto to_edge = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const double t = std::clamp((p - from).dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
    return (p - from - t * (to - from)).norm();
  };
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// Barycentric coordinates in one element.
Eigen::Vector4d barycentric_of(const TetMesh& mesh, int element, const Eigen::Vector3d& x) {
  const auto& corner = mesh.tetrahedra[element];
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) {
    edges.col(k) = mesh.vertices[corner[k + 1]] - mesh.vertices[corner[0]];
  }
  Eigen::Vector4d at;
  at.tail<3>() = edges.inverse() * (x - mesh.vertices[corner[0]]);
  at[0] = 1.0 - at.tail<3>().sum();
  return at;
}

/// Elements whose box meets the bead's.
std::vector<int> elements_near(const TetMesh& mesh, const Bead& bead) {
  std::vector<int> near;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    Eigen::AlignedBox3d box;
    for (const int vertex : mesh.tetrahedra[e]) {
      box.extend(mesh.vertices[vertex]);
    }
    if (box.exteriorDistance(bead.centre) <= bead.radius) {
      near.push_back(static_cast<int>(e));
    }
  }
  return near;
}

struct Place {
  int element = -1;
  Eigen::Vector4d barycentric;
};

/// The element that a point is deepest in; none if it's outside all of them by more than rounding.
std::optional<Place> locate(const TetMesh& mesh, const std::vector<int>& among, const Eigen::Vector3d& x) {
  Place best;
  double deepest = -1e-9;
  for (const int element : among) {
    const Eigen::Vector4d at = barycentric_of(mesh, element, x);
    if (at.minCoeff() > deepest) {
      deepest = at.minCoeff();
      best = {element, at};
    }
  }
  if (best.element < 0) {
    return std::nullopt;
  }
  return best;
}

void check_bead(const TetMesh& mesh, const std::vector<std::array<int, 3>>& boundary, const Bead& bead,
                std::size_t index) {
  if (!bead.centre.allFinite() || !std::isfinite(bead.radius) || bead.radius <= 0.0) {
    fail("bead {} has its centre at ({}, {}, {}) mm and a radius of {} mm; they must be finite, the radius above zero",
         index, bead.centre.x(), bead.centre.y(), bead.centre.z(), bead.radius);
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& face : boundary) {
    nearest = std::min(nearest, distance_to_triangle(bead.centre, mesh.vertices[face[0]], mesh.vertices[face[1]],
                                                     mesh.vertices[face[2]]));
  }
  const bool centre_inside = locate(mesh, elements_near(mesh, {bead.centre, 0.0}), bead.centre).has_value();
  if (!centre_inside || nearest < bead.radius * (1.0 - 1e-9)) {
    fail("bead {} at ({}, {}, {}) mm with a radius of {} mm isn't wholly inside the gel", index, bead.centre.x(),
         bead.centre.y(), bead.centre.z(), bead.radius);
  }
}

}  // namespace

OuterSurface outer_surface(const TetMesh& mesh) {
  OuterSurface surface;
  for (const auto& face : mesh.outer) {
    surface.mesh_vertex.insert(surface.mesh_vertex.end(), face.begin(), face.end());
  }
  auto& list = surface.mesh_vertex;
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  for (const auto& face : mesh.outer) {
    std::array<int, 3> triangle{};
    for (int k = 0; k < 3; ++k) {
      triangle[k] = static_cast<int>(std::lower_bound(list.begin(), list.end(), face[k]) - list.begin());
    }
    surface.triangles.push_back(triangle);
  }
  return surface;
}

Eigen::SparseMatrix<double> surface_mass(const TetMesh& mesh, const OuterSurface& surface) {
  const auto n = static_cast<Eigen::Index>(surface.mesh_vertex.size());
  Triplets entries;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const double area = area_of(mesh, mesh.outer[t]);
    for (const int i : surface.triangles[t]) {
      for (const int j : surface.triangles[t]) {
        entries.emplace_back(i, j, area * (i == j ? 2.0 : 1.0) / 12.0);
      }
    }
  }
  Eigen::SparseMatrix<double> mass(n, n);
  mass.setFromTriplets(entries.begin(), entries.end());
  return mass;
}

Eigen::SparseMatrix<double> surface_coupling(const TaylorHoodSpace& space, const OuterSurface& surface) {
  const TetMesh& mesh = *space.mesh;
  Triplets entries;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const double area = area_of(mesh, mesh.outer[t]);
    for (int i = 0; i < 3; ++i) {
      // In barycentric coordinates l: int l_i l_j (2 l_j - 1) = A/30 for i = j, -A/60 else; int l_i 4 l_j l_k = 2A/15
      // for i = j or k, A/15 else.
      for (int j = 0; j < 3; ++j) {
        entries.emplace_back(surface.triangles[t][i], mesh.outer[t][j], i == j ? area / 30.0 : -area / 60.0);
        const int next = (j + 1) % 3;
        entries.emplace_back(surface.triangles[t][i], space.middle(mesh.outer[t][j], mesh.outer[t][next]),
                             i == j || i == next ? 2.0 * area / 15.0 : area / 15.0);
      }
    }
  }
  Eigen::SparseMatrix<double> coupling(static_cast<Eigen::Index>(surface.mesh_vertex.size()), space.nodes);
  coupling.setFromTriplets(entries.begin(), entries.end());
  return coupling;
}

Eigen::SparseMatrix<double> bead_means(const TaylorHoodSpace& space, std::span<const Bead> beads) {
  const TetMesh& mesh = *space.mesh;
  const auto boundary = boundary_faces(mesh);
  const auto rule = sphere_rule(kBeadRuleDegree);
  Triplets entries;
  for (std::size_t b = 0; b < beads.size(); ++b) {
    check_bead(mesh, boundary, beads[b], b);
    const std::vector<int> near = elements_near(mesh, beads[b]);
    for (const SpherePoint& point : rule) {
      const auto place = locate(mesh, near, beads[b].centre + beads[b].radius * point.direction);
      TS_ASSERT(place.has_value());
      const auto shape = quadratic_shape(place->barycentric);
      for (int k = 0; k < 10; ++k) {
        entries.emplace_back(static_cast<int>(b), space.elements[place->element][k], point.weight * shape[k]);
      }
    }
  }
  Eigen::SparseMatrix<double> means(static_cast<Eigen::Index>(beads.size()), space.nodes);
  means.setFromTriplets(entries.begin(), entries.end());
  return means;
}

}  // namespace touchstone::fem
