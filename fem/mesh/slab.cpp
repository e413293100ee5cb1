#include "fem/mesh/slab.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

double coarse_edge(const SlabMesh& slab) {
  return std::max(slab.fine, std::min(slab.coarse, slab.thickness));
}

/// Largest distance along an axis to the fine box: zero inside.
double distance_to_fine_box(const SlabMesh& slab, double x, double y, double z) {
  return std::max({0.0, std::abs(x) - slab.fine_half_x, std::abs(y) - slab.fine_half_y, -z - slab.fine_depth});
}

double wanted_edge(const SlabMesh& slab, double distance) {
  return std::min(slab.fine + kEdgeGrowth * distance, coarse_edge(slab));
}

/// Volume of the slab nearer to the fine box than `distance`.
double volume_within(const SlabMesh& slab, double distance) {
  const double x = std::min(slab.size_x, 2.0 * (slab.fine_half_x + distance));
  const double y = std::min(slab.size_y, 2.0 * (slab.fine_half_y + distance));
  return x * y * std::min(slab.thickness, slab.fine_depth + distance);
}

/// Planes across one axis for the background grid: the slab's ends with a margin beyond, those of its fine part, and
/// some between them.
std::vector<double> graded_planes(double low, double high, double fine_low, double fine_high) {
  const double margin = 0.05 * (high - low);  // TetGen must find each point of the solid inside the background
  std::vector<double> planes = {low - margin, high + margin};
  const auto add = [&](double from, double to) {
    for (int k = 0; k <= 4; ++k) {
      planes.push_back(from + (to - from) * k / 4.0);
    }
  };
  add(low, std::max(low, fine_low));
  add(std::min(high, fine_high), high);
  std::sort(planes.begin(), planes.end());
  std::vector<double> apart;
  for (const double plane : planes) {
    if (apart.empty() || plane - apart.back() > 1e-3 * (high - low)) {
      apart.push_back(plane);
    }
  }
  return apart;
}

/// Points in the fine part of the outer face: a lattice of equilateral triangles, mirrored in x and y.
std::vector<Eigen::Vector2d> fine_lattice(const SlabMesh& slab) {
  // The face's own edges are TetGen's to split.
  const double reach_x = std::min(slab.fine_half_x, slab.size_x / 2.0 - 0.6 * slab.fine);
  const double reach_y = std::min(slab.fine_half_y, slab.size_y / 2.0 - 0.6 * slab.fine);
  std::vector<Eigen::Vector2d> points;
  const double row_height = slab.fine * std::sqrt(0.75);
  const int rows = static_cast<int>(std::floor(reach_y / row_height + 1e-9));
  const int columns = static_cast<int>(std::floor(reach_x / slab.fine + 1e-9)) + 1;
  if (reach_x < 0.0 || reach_y < 0.0) {
    return points;
  }
  for (int row = -rows; row <= rows; ++row) {
    const double shift = row % 2 == 0 ? 0.0 : 0.5;
    for (int column = -columns; column <= columns; ++column) {
      const double x = (column + shift) * slab.fine;
      if (std::abs(x) <= reach_x * (1.0 + 1e-9)) {
        points.emplace_back(x, row * row_height);
      }
    }
  }
  return points;
}

FillInput fill_input(const SlabMesh& slab) {
  const double x = slab.size_x / 2.0;
  const double y = slab.size_y / 2.0;
  const double z = -slab.thickness;
  FillInput input;
  input.points = {{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z}, {-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}};
  for (const Eigen::Vector2d& point : fine_lattice(slab)) {
    input.points.emplace_back(point.x(), point.y(), 0.0);
  }
  const std::vector<std::vector<int>> corners = {{4, 5, 6, 7}, {0, 3, 2, 1}, {0, 1, 5, 4},
                                                 {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  for (std::size_t f = 0; f < corners.size(); ++f) {
    input.facets.push_back({corners[f]});
  }
  for (int point = 8; point < static_cast<int>(input.points.size()); ++point) {
    input.facets[0].push_back({point});  // a lone point in the face
  }
  input.grid = {graded_planes(-x, x, -slab.fine_half_x, slab.fine_half_x),
                graded_planes(-y, y, -slab.fine_half_y, slab.fine_half_y),
                graded_planes(z, 0.0, -slab.fine_depth, 0.0)};
  input.edge = [slab](const Eigen::Vector3d& at) {
    return wanted_edge(slab, distance_to_fine_box(slab, at.x(), at.y(), at.z()));
  };
  return input;
}

}  // namespace

void check(const SlabMesh& slab) {
  const auto positive = [](const char* name, double value) {
    if (!std::isfinite(value) || value <= 0.0) {
      fail("the slab's {} is {} mm; it must be finite and above zero", name, value);
    }
  };
  const auto not_negative = [](const char* name, double value) {
    if (!std::isfinite(value) || value < 0.0) {
      fail("the slab's {} is {} mm; it must be finite and not below zero", name, value);
    }
  };
  positive("size in x", slab.size_x);
  positive("size in y", slab.size_y);
  positive("thickness", slab.thickness);
  positive("fine edge length", slab.fine);
  positive("coarse edge length", slab.coarse);
  not_negative("fine half extent in x", slab.fine_half_x);
  not_negative("fine half extent in y", slab.fine_half_y);
  not_negative("fine depth", slab.fine_depth);
  if (slab.fine > slab.coarse) {
    fail("the slab's fine edge length is {} mm; it must not be above the coarse one, {} mm", slab.fine, slab.coarse);
  }
  const double narrowest = std::min({slab.size_x, slab.size_y, slab.thickness});
  const double widest = std::max({slab.size_x, slab.size_y, slab.thickness});
  if (widest > 200.0 * narrowest) {
    fail("the slab is {} x {} x {} mm; its longest side must be at most 200 times its shortest", slab.size_x,
         slab.size_y, slab.thickness);
  }
  if (slab.fine > narrowest) {
    fail("the slab's fine edge length is {} mm; it must not be above its shortest side, {} mm", slab.fine, narrowest);
  }
  check_tetrahedra(estimated_tetrahedra(slab), "the slab", slab.fine);
}

double estimated_tetrahedra(const SlabMesh& slab) {
  const double farthest = std::max({slab.size_x, slab.size_y, slab.thickness});
  double sum = volume_within(slab, 0.0) / std::pow(slab.fine, 3);
  constexpr int kShells = 400;
  for (int k = 0; k < kShells; ++k) {
    // Shells thicken outwards, as the field changes slower there.
    const auto distance = [&](double at) { return farthest * at * at; };
    const double inner = distance(static_cast<double>(k) / kShells);
    const double outer = distance((k + 1.0) / kShells);
    const double edge = wanted_edge(slab, 0.5 * (inner + outer));
    sum += (volume_within(slab, outer) - volume_within(slab, inner)) / std::pow(edge, 3);
  }
  return kTetrahedraPerCube * sum;
}

double estimated_surface_vertices(const SlabMesh& slab) {
  // Vertices per (mm^2 / edge^2): of equilateral triangles, and what TetGen adds to them.
  constexpr double kVerticesPerSquare = 1.155 * 1.09;
  const auto area_within = [&](double distance) {
    return std::min(slab.size_x, 2.0 * (slab.fine_half_x + distance)) *
           std::min(slab.size_y, 2.0 * (slab.fine_half_y + distance));
  };
  const double farthest = std::max(slab.size_x, slab.size_y) / 2.0;
  double sum = area_within(0.0) / std::pow(slab.fine, 2);
  constexpr int kShells = 400;
  for (int k = 0; k < kShells; ++k) {
    const double inner = farthest * k / kShells;
    const double outer = farthest * (k + 1) / kShells;
    sum += (area_within(outer) - area_within(inner)) / std::pow(wanted_edge(slab, 0.5 * (inner + outer)), 2);
  }
  return kVerticesPerSquare * sum;
}

TetMesh mesh_slab(const SlabMesh& slab) {
  check(slab);
  TetMesh mesh = fill_with_tetrahedra(
      fill_input(slab), fmt::format("the slab of {} x {} x {} mm with edges of {} to {} mm", slab.size_x, slab.size_y,
                                    slab.thickness, slab.fine, slab.coarse));
  for (const auto& face : boundary_faces(mesh)) {
    const auto all_at = [&](double z) {
      return std::all_of(face.begin(), face.end(), [&](int v) { return mesh.vertices[v].z() == z; });
    };
    if (all_at(0.0)) {
      mesh.outer.push_back(face);
    } else if (all_at(-slab.thickness)) {
      mesh.bonded.push_back(face);
    }
  }
  const std::string fault = fault_of(mesh);
  if (!fault.empty()) {
    fail("TetGen's mesh of the slab is unfit: {}", fault);
  }
  return mesh;
}

}  // namespace touchstone::fem
