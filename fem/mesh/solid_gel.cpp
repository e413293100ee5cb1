#include "fem/mesh/solid_gel.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "fem/mesh/surface_refinement.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
/// What TetGen fills in seconds.
constexpr std::size_t kMostRefinedTriangles = 40000;

Eigen::AlignedBox3d box_of(const SolidGel& solid) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : solid.surface.vertices) box.extend(vertex);
  return box;
}

double wanted_edge(const SolidGel& solid, double longest, const Vector3d& x) {
  const double distance = std::max(
      {0.0, std::abs(x.x()) - solid.fine_half_x, std::abs(x.y()) - solid.fine_half_y, -x.z() - solid.fine_depth});
  return std::min(solid.fine + kEdgeGrowth * distance, std::max(solid.fine, std::min(solid.coarse, longest)));
}

/// Edges longer than the solid's thinnest side make no sense.
double longest_edge(const SolidGel& solid) {
  return box_of(solid).sizes().minCoeff();
}

double distance_to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a).normalized();
  const auto inside_of = [&](const Vector3d& from, const Vector3d& to) {
    return normal.cross(to - from).dot(p - from) >= 0.0;
  };
  if (inside_of(a, b) && inside_of(b, c) && inside_of(c, a)) return std::abs(normal.dot(p - a));
  const auto to_edge = [&](const Vector3d& from, const Vector3d& to) {
    const double t = std::clamp((p - from).dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
    return (p - from - t * (to - from)).norm();
  };
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// TetGen runs away on features far below the wanted edges.
void refuse_nearly_coincident(const SolidGel& solid) {
  const std::vector<Vector3d>& vertices = solid.surface.vertices;
  const auto& triangles = solid.surface.triangles;
  const double allowed = kNearestVertices * solid.fine;
  // Along x, so that only neighbours are compared.
  std::vector<int> order(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return vertices[a].x() != vertices[b].x() ? vertices[a].x() < vertices[b].x() : a < b;
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size() && vertices[order[j]].x() - vertices[order[i]].x() < allowed; ++j) {
      const double apart = (vertices[order[j]] - vertices[order[i]]).norm();
      if (apart < allowed) {
        fail(
            "the gel's surface has vertices {} and {} at ({}, {}, {}) mm, {:.3g} mm apart; they must be at least "
            "{:.3g} "
            "mm apart, a hundredth of the fine edge length",
            std::min(order[i], order[j]), std::max(order[i], order[j]), vertices[order[i]].x(), vertices[order[i]].y(),
            vertices[order[i]].z(), apart, allowed);
      }
    }
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& corner = triangles[t];
    Eigen::AlignedBox3d box;
    for (const int v : corner) box.extend(vertices[v]);
    const Vector3d low = box.min().array() - allowed;
    const Vector3d high = box.max().array() + allowed;
    const auto begin =
        std::lower_bound(order.begin(), order.end(), low.x(), [&](int v, double x) { return vertices[v].x() < x; });
    for (auto at = begin; at != order.end() && vertices[*at].x() <= high.x(); ++at) {
      const Vector3d& p = vertices[*at];
      if (p.y() < low.y() || p.y() > high.y() || p.z() < low.z() || p.z() > high.z()) continue;
      if (std::find(corner.begin(), corner.end(), *at) != corner.end()) continue;
      const double apart = distance_to_triangle(p, vertices[corner[0]], vertices[corner[1]], vertices[corner[2]]);
      if (apart < allowed) {
        fail(
            "the gel's surface has vertex {} at ({}, {}, {}) mm {:.3g} mm beside triangle {}; it must be at least "
            "{:.3g} "
            "mm from it, a hundredth of the fine edge length",
            *at, p.x(), p.y(), p.z(), apart, t, allowed);
      }
    }
  }
}

}  // namespace

void check(const SolidGel& solid) {
  const auto require = [](const char* what, double value, bool zero) {
    if (!std::isfinite(value) || value < 0.0 || (value == 0.0 && !zero)) {
      fail("the gel's {} is {} mm; it must be finite and {} zero", what, value, zero ? "not below" : "above");
    }
  };
  require("fine edge length", solid.fine, false);
  require("coarse edge length", solid.coarse, false);
  require("fine half extent in x", solid.fine_half_x, true);
  require("fine half extent in y", solid.fine_half_y, true);
  require("fine depth", solid.fine_depth, true);
  if (solid.fine > solid.coarse) {
    fail("the gel's fine edge length is {} mm; it must not be above the coarse one, {} mm", solid.fine, solid.coarse);
  }
  if (solid.surface.triangles.size() > kMostSolidTriangles) {
    fail("the gel's surface has {} triangles; at most {} are allowed", solid.surface.triangles.size(),
         kMostSolidTriangles);
  }
  if (const std::string fault = fault_of_closed_mesh(solid.surface); !fault.empty()) {
    fail("the gel's surface isn't a closed solid: {}", fault);
  }
  if (solid.faces.size() != solid.surface.triangles.size()) {
    fail("the gel's surface has {} triangles, but {} of them are named", solid.surface.triangles.size(),
         solid.faces.size());
  }
  for (const auto& [kind, name] : {std::pair(FaceKind::bonded, "bonded"), std::pair(FaceKind::outer, "outer")}) {
    if (std::find(solid.faces.begin(), solid.faces.end(), kind) == solid.faces.end()) {
      fail("the gel's surface has no {} face", name);
    }
  }
  const Vector3d size = box_of(solid).sizes();
  if (size.maxCoeff() > 200.0 * size.minCoeff()) {
    fail("the gel is {} x {} x {} mm; its longest side must be at most 200 times its shortest", size.x(), size.y(),
         size.z());
  }
  refuse_nearly_coincident(solid);
  check_tetrahedra(estimated_tetrahedra(solid), "the gel", solid.fine);
}

double thickness_of(const SolidGel& solid) {
  return box_of(solid).sizes().z();
}

double estimated_tetrahedra(const SolidGel& solid) {
  const Eigen::AlignedBox3d box = box_of(solid);
  const double longest = longest_edge(solid);
  constexpr int kSteps = 40;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      for (int k = 0; k < kSteps; ++k) {
        const Vector3d part((i + 0.5) / kSteps, (j + 0.5) / kSteps, (k + 0.5) / kSteps);
        sum += std::pow(wanted_edge(solid, longest, box.min() + part.cwiseProduct(box.sizes())), -3);
      }
    }
  }
  return kTetrahedraPerCube * enclosed_volume(solid.surface) * sum / (kSteps * kSteps * kSteps);
}

TetMesh mesh_solid(const SolidGel& solid) {
  check(solid);
  const double longest = longest_edge(solid);
  FillInput input;
  input.keep_boundary = true;
  // A run-away ends here, and is then refused: a mesh has about five tetrahedra a vertex.
  input.most_points = static_cast<int>(kMostTetrahedra / 4.0);
  TetMesh best;
  double best_angle = -1.0;
  // Where TetGen leaves slivers, edges a little longer or shorter are tried.
  for (const double factor : {1.0, 0.93, 1.07, 0.87}) {
    input.edge = [&](const Vector3d& x) { return factor * wanted_edge(solid, longest, x); };
    TriangleMesh surface = solid.surface;
    std::vector<FaceKind> kinds = solid.faces;
    refine_surface(input.edge, surface, kinds);
    if (surface.triangles.size() > kMostRefinedTriangles) {
      fail("the gel's surface takes {} triangles at the wanted edge lengths; at most {} are allowed",
           surface.triangles.size(), kMostRefinedTriangles);
    }
    input.points = surface.vertices;
    input.facets.clear();
    for (const auto& t : surface.triangles) input.facets.push_back({{t[0], t[1], t[2]}});
    TetMesh mesh = fill_with_tetrahedra(input, "the gel's mesh");
    const double angle = smallest_dihedral_angle(mesh);
    if (angle > best_angle) {
      best_angle = angle;
      best = std::move(mesh);
      for (std::size_t t = 0; t < kinds.size(); ++t) {
        if (kinds[t] == FaceKind::outer) best.outer.push_back(surface.triangles[t]);
        if (kinds[t] == FaceKind::bonded) best.bonded.push_back(surface.triangles[t]);
      }
    }
    if (best_angle > kGoodDihedral) break;
  }
  if (static_cast<double>(best.tetrahedra.size()) > 1.5 * kMostTetrahedra) {
    fail(
        "the gel took {} tetrahedra; at most {} are allowed: its surface has features far below its fine edge length, "
        "{} mm",
        best.tetrahedra.size(), 1.5 * kMostTetrahedra, solid.fine);
  }
  return best;
}

}  // namespace touchstone::fem
