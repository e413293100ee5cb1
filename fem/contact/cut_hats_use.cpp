// What hats are once they are cut: after a motion of the body, and under several bodies.

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "fem/contact/contact_gap.h"
#include "fem/contact/cut_hats.h"

namespace touchstone::fem {

Eigen::Index place_in(const CutHats& cuts, int vertex) {
  const auto found = std::lower_bound(cuts.vertices.begin(), cuts.vertices.end(), vertex);
  return found != cuts.vertices.end() && *found == vertex ? found - cuts.vertices.begin() : -1;
}

Eigen::VectorXd moved_gaps(const ContactSurface& surface, const CutHats& cuts,
                           const std::function<double(int, const Eigen::Vector3d&)>& gap_at) {
  // What each cell's gap changed by, for each vertex with the density that it has there.
  std::map<int, std::vector<std::pair<double, double>>> changes;
  for (const int v : cuts.vertices) changes[v];
  for (const CutTriangle& triangle : cuts.triangles) {
    const auto& index = surface.triangles[triangle.triangle];
    for (const DensityCell& cell : triangle.cells) {
      const double change = gap_at(triangle.triangle, cell.corners) - cell.gap;
      if (!std::isfinite(change)) continue;
      for (int a = 0; a < 3; ++a) {
        if (!(cell.density[a] > 0.0)) continue;
        const auto found = changes.find(index[a]);
        if (found != changes.end()) found->second.emplace_back(change, cell.density[a]);
      }
    }
  }
  Eigen::VectorXd result = cuts.gap;
  for (Eigen::Index k = 0; k < result.size(); ++k) {
    std::vector<std::pair<double, double>>& own = changes[cuts.vertices[static_cast<std::size_t>(k)]];
    if (own.empty()) continue;  // the body has left it
    std::sort(own.begin(), own.end());
    double half = 0.0;
    for (const auto& [change, density] : own) half += 0.5 * density;
    double sum = 0.0;
    for (const auto& [change, density] : own) {
      sum += density;
      if (sum < half) continue;
      result[k] += change;
      break;
    }
  }
  return result;
}

std::shared_ptr<const CutHats> joint_cuts(const ContactSurface& surface,
                                          const std::vector<std::shared_ptr<const CutHats>>& of_bodies,
                                          const std::vector<int>& owner) {
  std::vector<std::shared_ptr<const CutHats>> cutting;
  for (const auto& cuts : of_bodies) {
    if (cuts) cutting.push_back(cuts);
  }
  if (cutting.empty()) return nullptr;
  if (of_bodies.size() == 1) return cutting.front();
  auto joint = std::make_shared<CutHats>();
  std::map<int, int> body_of;  // the body that cuts a vertex's hat
  std::map<int, double> share_of;
  for (std::size_t b = 0; b < of_bodies.size(); ++b) {
    if (!of_bodies[b]) continue;
    for (std::size_t k = 0; k < of_bodies[b]->vertices.size(); ++k) {
      const int v = of_bodies[b]->vertices[k];
      if (owner[v] != static_cast<int>(b)) continue;
      body_of[v] = static_cast<int>(b);
      share_of[v] = of_bodies[b]->share[static_cast<Eigen::Index>(k)];
    }
  }
  joint->share.resize(static_cast<Eigen::Index>(body_of.size()));
  std::vector<int> triangles;
  for (const auto& [v, unused] : body_of) {
    joint->share[static_cast<Eigen::Index>(joint->vertices.size())] = share_of[v];
    joint->vertices.push_back(v);
    triangles.insert(triangles.end(), surface.triangles_of[v].begin(), surface.triangles_of[v].end());
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  for (const int t : triangles) {
    CutTriangle triangle{t, {}};
    // Cells of one body, or whole ones, of which the corners' densities are taken that are its own.
    const auto take = [&](const std::vector<DensityCell>& cells, int body) {
      std::array<bool, 3> own{};
      for (int a = 0; a < 3; ++a) {
        const auto found = body_of.find(surface.triangles[t][a]);
        own[a] = (found == body_of.end() ? -1 : found->second) == body;
      }
      if (std::none_of(own.begin(), own.end(), [](bool x) { return x; })) return;
      for (DensityCell cell : cells) {
        for (int a = 0; a < 3; ++a) cell.density[a] = own[a] ? cell.density[a] : 0.0;
        triangle.cells.push_back(cell);
      }
    };
    for (std::size_t b = 0; b < of_bodies.size(); ++b) {
      if (!of_bodies[b]) continue;
      const auto& list = of_bodies[b]->triangles;
      const auto found = std::lower_bound(list.begin(), list.end(), t,
                                          [](const CutTriangle& one, int index) { return one.triangle < index; });
      if (found != list.end() && found->triangle == t) take(found->cells, static_cast<int>(b));
    }
    take(whole_cells(surface, t), -1);
    joint->triangles.push_back(std::move(triangle));
  }
  return joint;
}

}  // namespace touchstone::fem
