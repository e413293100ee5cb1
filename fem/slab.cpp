#include "fem/slab.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <vector>

#include "core/error.h"

#define TETLIBRARY
#include <tetgen.h>

namespace touchstone::fem {
namespace {

/// Growth of the wanted edge length per mm away from the fine box.
constexpr double kGrowth = 0.4;
/// TetGen keeps circumradii under the metric; a regular tetrahedron of edge h has 0.61 h.
constexpr double kMetricPerEdge = 1.0;
/// Tetrahedra per (mm^3 / edge^3), measured on what TetGen makes of this metric.
constexpr double kTetrahedraPerCube = 8.0;

enum FaceMarker { side = 1, outer_face = 2, bonded_face = 3 };

double coarse_edge(const SlabMesh& slab) {
  return std::max(slab.fine, std::min(slab.coarse, slab.thickness));
}

/// Largest distance along an axis to the fine box: zero inside.
double distance_to_fine_box(const SlabMesh& slab, double x, double y, double z) {
  return std::max({0.0, std::abs(x) - slab.fine_half_x, std::abs(y) - slab.fine_half_y, -z - slab.fine_depth});
}

double wanted_edge(const SlabMesh& slab, double distance) {
  return std::min(slab.fine + kGrowth * distance, coarse_edge(slab));
}

/// Volume of the slab nearer to the fine box than `distance`.
double volume_within(const SlabMesh& slab, double distance) {
  const double x = std::min(slab.size_x, 2.0 * (slab.fine_half_x + distance));
  const double y = std::min(slab.size_y, 2.0 * (slab.fine_half_y + distance));
  return x * y * std::min(slab.thickness, slab.fine_depth + distance);
}

/// Planes across one axis for the background grid: the box's own, and some between them and the slab's ends.
std::vector<double> grid_planes(double low, double high, double fine_low, double fine_high) {
  const double margin = 0.05 * (high - low);  // TetGen must find each point of the slab inside the background
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

/// The size field as TetGen reads it: a grid of boxes, each cut into six tetrahedra, with a metric at each vertex.
void fill_background(const SlabMesh& slab, tetgenio& background) {
  const double half_x = slab.size_x / 2.0;
  const double half_y = slab.size_y / 2.0;
  const std::vector<double> xs = grid_planes(-half_x, half_x, -slab.fine_half_x, slab.fine_half_x);
  const std::vector<double> ys = grid_planes(-half_y, half_y, -slab.fine_half_y, slab.fine_half_y);
  const std::vector<double> zs = grid_planes(-slab.thickness, 0.0, -slab.fine_depth, 0.0);
  const int nx = static_cast<int>(xs.size());
  const int ny = static_cast<int>(ys.size());
  const int nz = static_cast<int>(zs.size());
  background.numberofpoints = nx * ny * nz;
  background.numberofpointmtrs = 1;
  background.pointlist = new REAL[3 * background.numberofpoints];
  background.pointmtrlist = new REAL[background.numberofpoints];
  const auto index = [&](int i, int j, int k) { return (k * ny + j) * nx + i; };
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const int point = index(i, j, k);
        background.pointlist[3 * point] = xs[i];
        background.pointlist[3 * point + 1] = ys[j];
        background.pointlist[3 * point + 2] = zs[k];
        background.pointmtrlist[point] =
            kMetricPerEdge * wanted_edge(slab, distance_to_fine_box(slab, xs[i], ys[j], zs[k]));
      }
    }
  }
  // Kuhn's six tetrahedra along the diagonal of a box: one for each order of the three axes.
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  background.numberofcorners = 4;
  background.numberoftetrahedra = 6 * (nx - 1) * (ny - 1) * (nz - 1);
  background.tetrahedronlist = new int[4 * background.numberoftetrahedra];
  int* next = background.tetrahedronlist;
  for (int k = 0; k + 1 < nz; ++k) {
    for (int j = 0; j + 1 < ny; ++j) {
      for (int i = 0; i + 1 < nx; ++i) {
        for (int order = 0; order < 6; ++order) {
          int at[3] = {i, j, k};
          int corners[4];
          corners[0] = index(at[0], at[1], at[2]);
          for (int step = 0; step < 3; ++step) {
            ++at[kOrders[order][step]];
            corners[step + 1] = index(at[0], at[1], at[2]);
          }
          if (order >= 3) {
            std::swap(corners[2], corners[3]);  // odd orders turn the other way
          }
          next = std::copy(std::begin(corners), std::end(corners), next);
        }
      }
    }
  }
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

void set_polygon(tetgenio::polygon& polygon, const std::vector<int>& vertices) {
  polygon.numberofvertices = static_cast<int>(vertices.size());
  polygon.vertexlist = new int[vertices.size()];
  std::copy(vertices.begin(), vertices.end(), polygon.vertexlist);
}

void fill_input(const SlabMesh& slab, tetgenio& input) {
  const double x = slab.size_x / 2.0;
  const double y = slab.size_y / 2.0;
  const double z = -slab.thickness;
  std::vector<Eigen::Vector3d> points = {{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z},
                                         {-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}};
  for (const Eigen::Vector2d& point : fine_lattice(slab)) {
    points.emplace_back(point.x(), point.y(), 0.0);
  }
  input.numberofpoints = static_cast<int>(points.size());
  input.pointlist = new REAL[3 * points.size()];
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::copy_n(points[i].data(), 3, input.pointlist + 3 * i);
  }
  const std::vector<std::vector<int>> corners = {{4, 5, 6, 7}, {0, 3, 2, 1}, {0, 1, 5, 4},
                                                 {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  const std::vector<int> markers = {outer_face, bonded_face, side, side, side, side};
  input.numberoffacets = static_cast<int>(corners.size());
  input.facetlist = new tetgenio::facet[corners.size()];
  input.facetmarkerlist = new int[corners.size()];
  for (std::size_t f = 0; f < corners.size(); ++f) {
    tetgenio::facet& facet = input.facetlist[f];
    tetgenio::init(&facet);
    facet.numberofpolygons = f == 0 ? static_cast<int>(points.size()) - 7 : 1;
    facet.polygonlist = new tetgenio::polygon[facet.numberofpolygons];
    set_polygon(facet.polygonlist[0], corners[f]);
    for (int p = 1; p < facet.numberofpolygons; ++p) {
      set_polygon(facet.polygonlist[p], {p + 7});  // a lone point in the face
    }
    input.facetmarkerlist[f] = markers[f];
  }
}

TetMesh mesh_of(const tetgenio& output) {
  TetMesh mesh;
  for (int i = 0; i < output.numberofpoints; ++i) {
    mesh.vertices.emplace_back(output.pointlist[3 * i], output.pointlist[3 * i + 1], output.pointlist[3 * i + 2]);
  }
  for (int e = 0; e < output.numberoftetrahedra; ++e) {
    const int* corner = output.tetrahedronlist + 4 * e;
    std::array<int, 4> tetrahedron = {corner[0], corner[1], corner[2], corner[3]};
    if (volume(mesh, tetrahedron) < 0.0) {
      std::swap(tetrahedron[2], tetrahedron[3]);
    }
    mesh.tetrahedra.push_back(tetrahedron);
  }
  return mesh;
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
  const double tetrahedra = estimated_tetrahedra(slab);
  if (!(tetrahedra <= kMostSlabTetrahedra)) {
    fail(
        "the slab would take some {:.3g} tetrahedra; at most {} are allowed: make its fine edge length ({} mm) larger "
        "or "
        "its fine box smaller",
        tetrahedra, kMostSlabTetrahedra, slab.fine);
  }
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
  tetgenio input;
  tetgenio output;
  tetgenio background;
  fill_input(slab, input);
  fill_background(slab, background);
  tetgenbehavior behavior;
  char switches[] = "pq1.4/14mzQ";
  TS_ASSERT(behavior.parse_commandline(switches));
  {
    // TetGen keeps its predicates' error bounds in globals.
    static std::mutex one_at_a_time;
    const std::lock_guard lock(one_at_a_time);
    try {
      tetrahedralize(&behavior, &input, &output, nullptr, &background);
    } catch (int code) {
      fail("TetGen gave up on the slab of {} x {} x {} mm with edges of {} to {} mm (code {})", slab.size_x,
           slab.size_y, slab.thickness, slab.fine, slab.coarse, code);
    }
  }
  TetMesh mesh = mesh_of(output);
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
