#include "fem/mesh/tetgen_fill.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "core/error.h"
#include "core/isolated_call.h"

#define TETLIBRARY
#include <tetgen.h>

namespace touchstone::fem {
namespace {

/// TetGen keeps circumradii under the metric; a regular tetrahedron of edge h has 0.61 h.
constexpr double kMetricPerEdge = 1.0;
constexpr int kMostSeconds = 120;  // of computing; twenty times of waiting, as other work may hold the cores

/// The size field as TetGen reads it: a grid of boxes, each cut into six tetrahedra, with a metric at each vertex.
void fill_background(const FillInput& from, tetgenio& background) {
  const auto& [xs, ys, zs] = from.grid;
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
        background.pointmtrlist[point] = kMetricPerEdge * from.edge({xs[i], ys[j], zs[k]});
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
            std::swap(corners[2], corners[3]);  // odd orders have the opposite orientation
          }
          next = std::copy(std::begin(corners), std::end(corners), next);
        }
      }
    }
  }
}

void fill_boundary(const FillInput& from, tetgenio& input) {
  input.numberofpoints = static_cast<int>(from.points.size());
  input.pointlist = new REAL[3 * from.points.size()];
  for (std::size_t i = 0; i < from.points.size(); ++i) {
    std::copy_n(from.points[i].data(), 3, input.pointlist + 3 * i);
  }
  input.numberoffacets = static_cast<int>(from.facets.size());
  input.facetlist = new tetgenio::facet[from.facets.size()];
  for (std::size_t f = 0; f < from.facets.size(); ++f) {
    const auto& polygons = from.facets[f];
    tetgenio::facet& facet = input.facetlist[f];
    tetgenio::init(&facet);
    facet.numberofpolygons = static_cast<int>(polygons.size());
    facet.polygonlist = new tetgenio::polygon[polygons.size()];
    for (std::size_t p = 0; p < polygons.size(); ++p) {
      facet.polygonlist[p].numberofvertices = static_cast<int>(polygons[p].size());
      facet.polygonlist[p].vertexlist = new int[polygons[p].size()];
      std::copy(polygons[p].begin(), polygons[p].end(), facet.polygonlist[p].vertexlist);
    }
  }
}

/// The mesh as bytes: two counts, the vertices, the tetrahedra.
std::string bytes_of(const tetgenio& output) {
  std::string bytes;
  const auto add = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
  add(&output.numberofpoints, sizeof(int));
  add(&output.numberoftetrahedra, sizeof(int));
  add(output.pointlist, sizeof(REAL) * 3 * static_cast<std::size_t>(output.numberofpoints));
  add(output.tetrahedronlist, sizeof(int) * 4 * static_cast<std::size_t>(output.numberoftetrahedra));
  return bytes;
}

TetMesh mesh_of(const std::string& bytes) {
  const char* at = bytes.data();
  const auto take = [&](void* data, std::size_t size) {
    TS_ASSERT(size <= static_cast<std::size_t>(bytes.data() + bytes.size() - at));
    std::memcpy(data, at, size);
    at += size;
  };
  int points = 0;
  int tetrahedra = 0;
  take(&points, sizeof(int));
  take(&tetrahedra, sizeof(int));
  TetMesh mesh;
  mesh.vertices.resize(static_cast<std::size_t>(points));
  mesh.tetrahedra.resize(static_cast<std::size_t>(tetrahedra));
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(REAL));
  for (auto& vertex : mesh.vertices) take(vertex.data(), sizeof(REAL) * 3);
  for (auto& tetrahedron : mesh.tetrahedra) {
    take(tetrahedron.data(), sizeof(int) * 4);
    if (volume(mesh, tetrahedron) < 0.0) {
      std::swap(tetrahedron[2], tetrahedron[3]);
    }
  }
  return mesh;
}

bool boundary_was_kept(const FillInput& input, const TetMesh& mesh) {
  const auto sorted = [](std::array<int, 3> face) {
    std::sort(face.begin(), face.end());
    return face;
  };
  std::vector<std::array<int, 3>> wanted;
  for (const auto& facet : input.facets) {
    const auto& corners = facet.front();
    wanted.push_back(sorted({corners[0], corners[1], corners[2]}));
  }
  std::vector<std::array<int, 3>> made;
  for (const auto& face : boundary_faces(mesh)) made.push_back(sorted(face));
  std::sort(wanted.begin(), wanted.end());
  std::sort(made.begin(), made.end());
  const bool same_points = mesh.vertices.size() >= input.points.size() &&
                           std::equal(input.points.begin(), input.points.end(), mesh.vertices.begin());
  return wanted == made && same_points;
}

/// The wanted edges, for TetGen's call-back, which takes no context. Set in a process of its own.
const FillInput* in_work = nullptr;

/// Whether a tetrahedron's circumradius is above the wanted edge at its middle.
bool too_large(REAL* a, REAL* b, REAL* c, REAL* d, REAL*, REAL) {
  const Eigen::Map<const Eigen::Vector3d> pa(a), pb(b), pc(c), pd(d);
  const Eigen::Vector3d u = pb - pa;
  const Eigen::Vector3d v = pc - pa;
  const Eigen::Vector3d w = pd - pa;
  const double six_volumes = u.dot(v.cross(w));
  const Eigen::Vector3d to_centre =
      u.squaredNorm() * v.cross(w) + v.squaredNorm() * w.cross(u) + w.squaredNorm() * u.cross(v);
  const double wanted = kMetricPerEdge * in_work->edge(0.25 * (pa + pb + pc + pd));
  return to_centre.norm() > 2.0 * std::abs(six_volumes) * wanted;
}

std::string call_tetgen(const FillInput& from, const std::string& quality) {
  tetgenio input;
  tetgenio output;
  tetgenio background;
  fill_boundary(from, input);
  // A background mesh makes TetGen end the process where it tries a vertex outside of it, as it does beside a boundary
  // that it may not split; a call-back doesn't.
  if (from.keep_boundary) {
    input.tetunsuitable = too_large;
  } else {
    fill_background(from, background);
  }
  tetgenbehavior behavior;
  std::string switches =
      fmt::format("p{}q{}{}zQ", from.keep_boundary ? "YM" : "", quality, from.keep_boundary ? "" : "m");
  if (from.most_points >= 0) switches += fmt::format("S{}", from.most_points);
  TS_ASSERT(behavior.parse_commandline(switches.data()));
  in_work = &from;
  try {
    tetrahedralize(&behavior, &input, &output, nullptr, from.keep_boundary ? nullptr : &background);
  } catch (int code) {
    fail("code {}", code);
  }
  return bytes_of(output);
}

/// The mesh, or none if TetGen gave up, with the reason.
std::optional<TetMesh> fill_once(const FillInput& from, const std::string& quality, std::string& why_not) {
  try {
    return mesh_of(isolated_call([&] { return call_tetgen(from, quality); }, kMostSeconds, 20 * kMostSeconds));
  } catch (const Error& error) {
    why_not = error.what();
    return std::nullopt;
  }
}

}  // namespace

void check_tetrahedra(double estimate, std::string_view what, double fine, std::string_view fine_part) {
  if (estimate <= kMostTetrahedra) return;
  fail(
      "{} would take some {:.3g} tetrahedra; at most {} are allowed: make its fine edge length ({:.4g} mm) larger or "
      "its {} smaller",
      what, estimate, kMostTetrahedra, fine, fine_part);
}

TetMesh fill_with_tetrahedra(const FillInput& input, const std::string& what) {
  for (const Eigen::Vector3d& point : input.points) TS_ASSERT(point.allFinite());
  TetMesh best;
  double best_angle = -1.0;
  std::string why_not;
  for (const std::string quality : {"1.4/14", "1.3/14", "1.5/12", "1.4/16", "1.6/10", "1.25/18"}) {
    std::optional<TetMesh> mesh = fill_once(input, quality, why_not);
    if (!mesh) continue;
    const double angle = smallest_dihedral_angle(*mesh);
    if (angle > best_angle) {
      best_angle = angle;
      best = std::move(*mesh);
    }
    if (best_angle > kGoodDihedral) break;
  }
  if (best_angle < 0.0) fail("{}: TetGen gave up on it ({})", what, why_not);
  if (input.keep_boundary && !boundary_was_kept(input, best)) {
    fail("{}: TetGen couldn't fill it without changing its surface", what);
  }
  return best;
}

}  // namespace touchstone::fem
