#include "fem/tetgen_fill.h"

#include <algorithm>
#include <mutex>

#include "core/error.h"

#define TETLIBRARY
#include <tetgen.h>

namespace touchstone::fem {
namespace {

/// TetGen keeps circumradii under the metric; a regular tetrahedron of edge h has 0.61 h.
constexpr double kMetricPerEdge = 1.0;

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
            std::swap(corners[2], corners[3]);  // odd orders turn the other way
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
  input.facetmarkerlist = new int[from.facets.size()];
  for (std::size_t f = 0; f < from.facets.size(); ++f) {
    const auto& polygons = from.facets[f].polygons;
    tetgenio::facet& facet = input.facetlist[f];
    tetgenio::init(&facet);
    facet.numberofpolygons = static_cast<int>(polygons.size());
    facet.polygonlist = new tetgenio::polygon[polygons.size()];
    for (std::size_t p = 0; p < polygons.size(); ++p) {
      facet.polygonlist[p].numberofvertices = static_cast<int>(polygons[p].size());
      facet.polygonlist[p].vertexlist = new int[polygons[p].size()];
      std::copy(polygons[p].begin(), polygons[p].end(), facet.polygonlist[p].vertexlist);
    }
    input.facetmarkerlist[f] = from.facets[f].marker;
  }
}

Filling filling_of(const tetgenio& output) {
  Filling filling;
  TetMesh& mesh = filling.mesh;
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
  for (int f = 0; f < output.numberoftrifaces; ++f) {
    const int* corner = output.trifacelist + 3 * f;
    filling.faces.push_back({corner[0], corner[1], corner[2]});
    filling.markers.push_back(output.trifacemarkerlist == nullptr ? 0 : output.trifacemarkerlist[f]);
  }
  return filling;
}

bool boundary_was_kept(const FillInput& input, const TetMesh& mesh) {
  const auto sorted = [](std::array<int, 3> face) {
    std::sort(face.begin(), face.end());
    return face;
  };
  std::vector<std::array<int, 3>> wanted;
  for (const auto& facet : input.facets) {
    const auto& corners = facet.polygons.front();
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

Filling fill_once(const FillInput& from, const std::string& quality, const std::string& what) {
  tetgenio input;
  tetgenio output;
  tetgenio background;
  fill_boundary(from, input);
  fill_background(from, background);
  tetgenbehavior behavior;
  std::string switches = fmt::format("p{}q{}mzQ", from.keep_boundary ? "YM" : "", quality);
  if (from.most_points >= 0) switches += fmt::format("S{}", from.most_points);
  TS_ASSERT(behavior.parse_commandline(switches.data()));
  // TetGen keeps its predicates' error bounds in globals.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  try {
    tetrahedralize(&behavior, &input, &output, nullptr, &background);
  } catch (int code) {
    fail("{}: TetGen gave up on it (code {})", what, code);
  }
  return filling_of(output);
}

}  // namespace

Filling fill_with_tetrahedra(const FillInput& input, const std::string& what) {
  for (const Eigen::Vector3d& point : input.points) TS_ASSERT(point.allFinite());
  Filling best;
  double best_angle = -1.0;
  for (const std::string quality : {"1.4/14", "1.3/14", "1.5/12", "1.4/16", "1.6/10", "1.25/18"}) {
    Filling filling = fill_once(input, quality, what);
    const double angle = smallest_dihedral_angle(filling.mesh);
    if (angle > best_angle) {
      best_angle = angle;
      best = std::move(filling);
    }
    if (best_angle > kGoodDihedral) break;
  }
  if (input.keep_boundary && !boundary_was_kept(input, best.mesh)) {
    fail("{}: TetGen couldn't fill it without changing its surface", what);
  }
  return best;
}

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

}  // namespace touchstone::fem
