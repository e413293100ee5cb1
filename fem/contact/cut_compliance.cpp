#include "fem/contact/cut_compliance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fem/contact/density_pairs.h"
#include "fem/contact/keep_definite.h"
#include "fem/contact/smooth_rest.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;

constexpr double kSliver = 0.02;  // share of a hat at which what bears is held off by as much as it gives way
constexpr double kStiffest = 1e8;
constexpr double kCutInFull = 0.1;  // of a hat: it counts as cut in full from where so much of it has another density
constexpr double kCovered = 1e-6;   // of a triangle: what may be missing, from where it is covered
constexpr double kReplaced = 1.3;   // edges: among cut hats that are nearer, the elements' response is replaced

/// How much each vertex of `cuts` is cut, 0 to 1: nearly 0 where a hat only begins to be, so that nothing changes at
/// once.
Eigen::VectorXd how_cut(const CutHats& cuts, const ContactSurface& surface) {
  Eigen::VectorXd same = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(cuts.vertices.size()));
  for (const CutTriangle& triangle : cuts.triangles) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Index k = place_in(cuts, surface.triangles[triangle.triangle][a]);
      for (const DensityCell& cell : triangle.cells) {
        if (k >= 0) same[k] += std::min(cell.density[a], cell.area * cell.corners[a]);
      }
    }
  }
  for (Eigen::Index k = 0; k < same.size(); ++k) {
    same[k] =
        std::clamp((1.0 - same[k] / surface.weight[cuts.vertices[static_cast<std::size_t>(k)]]) / kCutInFull, 0.0, 1.0);
  }
  return same;
}

/// A triangle's cells where no hat is cut: the same, if they cover it, so that what isn't cut makes no difference.
std::vector<DensityCell> uncut(const ContactSurface& surface, const CutTriangle& triangle) {
  std::vector<DensityCell> cells = triangle.cells;
  const Matrix3d corners = corners_of(surface, triangle.triangle);
  double area = 0.0;
  for (DensityCell& cell : cells) {
    cell.density = cell.area * cell.corners;
    cell.at = corners * cell.corners;
    area += cell.area;
  }
  const double missing = std::abs(surface.triangle_area[triangle.triangle] - area);
  return missing < kCovered * surface.triangle_area[triangle.triangle] ? cells
                                                                       : whole_cells(surface, triangle.triangle);
}

double share_of(const CutHats& cuts, int vertex) {
  return cuts.share[place_in(cuts, vertex)];
}

}  // namespace

void add_cut_compliance(Eigen::MatrixXd& compliance, const CutHats& cuts, const ContactSurface& surface,
                        const Compliance& gel, const std::vector<int>& vertices,
                        const std::vector<Matrix3d>& axes_of_all, bool normal_only) {
  std::vector<int> place(surface.vertices.size(), -1);
  for (std::size_t k = 0; k < vertices.size(); ++k) place[vertices[k]] = static_cast<int>(k);
  std::vector<DensityTriangle> parts;
  double mean_area = 0.0;
  auto next_cut = cuts.triangles.begin();
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    while (next_cut != cuts.triangles.end() && next_cut->triangle < t) ++next_cut;
    const auto& index = surface.triangles[t];
    std::array<int, 3> places{};
    int own = -1;
    for (int k = 0; k < 3; ++k) {
      places[k] = place[index[k]];
      if (places[k] >= 0) own = index[k];
    }
    if (own < 0) continue;
    const bool is_cut = next_cut != cuts.triangles.end() && next_cut->triangle == t;
    const std::vector<DensityCell> whole = is_cut ? uncut(surface, *next_cut) : whole_cells(surface, t);
    DensityTriangle& part = parts.emplace_back(is_cut ? next_cut->cells : whole, whole);
    part.middle = (surface.vertices[index[0]] + surface.vertices[index[1]] + surface.vertices[index[2]]) / 3.0;
    part.first = axes_of_all[own].col(1);
    part.second = axes_of_all[own].col(2);
    part.place = places;
    mean_area += surface.triangle_area[t];
  }
  if (parts.empty()) return;
  mean_area /= static_cast<double>(parts.size());
  const double edge = std::sqrt(mean_area * 4.0 / std::sqrt(3.0));
  const HalfSpaceResponse half_space(gel.material, gel.thickness, edge);
  const Eigen::Index each = normal_only ? 1 : 3;  // rows of a vertex in the responses
  const Eigen::Index rows = each * static_cast<Eigen::Index>(vertices.size());
  std::vector<DensityVertex> places;
  for (const int v : vertices) {
    places.push_back({surface.vertices[v], axes_of_all[v].col(1), axes_of_all[v].col(2), place_in(cuts, v) >= 0});
  }
  DensityResponses response = density_responses(half_space, places, parts, edge, normal_only);
  Eigen::MatrixXd& cut_response = response.cut;
  const Eigen::MatrixXd& whole_response = response.whole;
  // Among cut hats near each other: the half-space's response to their densities, and a smooth rest.
  std::vector<int> cut;
  for (const int v : cuts.vertices) {
    if (place[v] >= 0) cut.push_back(v);
  }
  const Eigen::VectorXd how = how_cut(cuts, surface);
  const auto how_of = [&](int v) { return how[place_in(cuts, v)]; };
  SmoothRest rest(gel, surface, half_space, axes_of_all);
  for (const int i : cut) {
    if (how_of(i) <= 0.0 || !rest.fit(i)) continue;
    std::vector<int> near_ones;
    Matrix3d level = Matrix3d::Zero();
    double weights = 0.0;
    const Eigen::Index column = each * place[i];
    const auto elements = [&](int j) -> Matrix3d {
      Matrix3d block = compliance.block<3, 3>(3 * place[j], 3 * place[i]);
      block.topLeftCorner(each, each) -= whole_response.block(each * place[j], column, each, each);
      return block / (surface.weight[i] * surface.weight[j]);
    };
    for (const int j : cut) {
      if ((surface.vertices[i] - surface.vertices[j]).norm() > kReplaced * rest.edge()) continue;
      near_ones.push_back(j);
      level += how_of(j) * surface.weight[j] * (elements(j) - rest.at(j));
      weights += how_of(j) * surface.weight[j];
    }
    level /= weights;
    for (const int j : near_ones) {
      // Half from either end, so that it's symmetric.
      const Eigen::Index row = each * place[j];
      const Matrix3d change =
          0.5 * how_of(i) * how_of(j) * surface.weight[i] * surface.weight[j] * (rest.at(j) + level - elements(j));
      const auto part = change.topLeftCorner(each, each);
      cut_response.block(row, column, each, each) += part;
      cut_response.block(column, row, each, each) += part.transpose();
    }
  }
  // A sliver's traction goes to nothing as the body leaves its hat, so that no vertex switches on or off by its share.
  for (std::size_t k = 0; k < cuts.vertices.size(); ++k) {
    const int row = place[cuts.vertices[k]];
    const double share = cuts.share[static_cast<Eigen::Index>(k)];
    if (row < 0) continue;
    if (share <= 0.0) {  // what bears nothing stays as it is
      cut_response.middleRows(each * row, each) = whole_response.middleRows(each * row, each);
      cut_response.middleCols(each * row, each) = whole_response.middleCols(each * row, each);
      continue;
    }
    const double more = std::min(kStiffest, std::pow(kSliver / share, 2));
    for (Eigen::Index a = 0; a < each; ++a) {
      cut_response(each * row + a, each * row + a) += more * compliance(3 * row + a, 3 * row + a);
    }
  }
  const auto changed = Eigen::seqN(Eigen::fix<0>, rows, 3 / each);
  compliance(changed, changed) += cut_response - whole_response;
  // What bears nothing asks for nothing.
  std::erase_if(cut, [&](int v) { return share_of(cuts, v) <= 0.0; });
  std::stable_sort(cut.begin(), cut.end(), [&](int a, int b) { return share_of(cuts, a) > share_of(cuts, b); });
  std::vector<int> beside;
  for (const CutTriangle& triangle : cuts.triangles) {
    for (const int v : surface.triangles[triangle.triangle]) {
      if (place[v] >= 0 && place_in(cuts, v) < 0) beside.push_back(v);
    }
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  const auto rows_of = [&](const std::vector<int>& list) {
    std::vector<Eigen::Index> of_list;
    for (const int v : list) {
      for (Eigen::Index a = 0; a < each; ++a) of_list.push_back(3 * place[v] + a);
    }
    return of_list;
  };
  keep_definite(compliance, rows_of(beside), rows_of(cut));
}

}  // namespace touchstone::fem
