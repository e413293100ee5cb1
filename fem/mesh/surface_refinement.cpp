#include "fem/mesh/surface_refinement.h"

#include <algorithm>
#include <map>
#include <queue>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kLongest = 1.4;  // so that halves are no shorter than 0.7

using Edge = std::array<int, 2>;

Edge edge_between(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

class Refinement {
 public:
  Refinement(const std::function<double(const Eigen::Vector3d&)>& edge, TriangleMesh& surface,
             std::vector<FaceKind>& kinds)
      : edge_(edge), surface_(surface), kinds_(kinds) {
    for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
      for (int k = 0; k < 3; ++k) {
        const Edge e = edge_between(surface.triangles[t][k], surface.triangles[t][(k + 1) % 3]);
        auto& owners = owners_[e];
        owners.push_back(t);
        if (owners.size() == 1) consider(e);
      }
    }
  }

  void run() {
    while (!queue_.empty()) {
      const Edge e = queue_.top().second;
      queue_.pop();
      split(e);
    }
  }

 private:
  void consider(const Edge& e) {
    const Eigen::Vector3d& a = surface_.vertices[e[0]];
    const Eigen::Vector3d& b = surface_.vertices[e[1]];
    const double ratio = (b - a).norm() / edge_(0.5 * (a + b));
    if (ratio > kLongest) queue_.push({ratio, e});
  }

  void replace_owner(const Edge& e, int from, int to) {
    auto& owners = owners_[e];
    *std::find(owners.begin(), owners.end(), from) = to;
  }

  void split(const Edge& e) {
    const int middle = static_cast<int>(surface_.vertices.size());
    surface_.vertices.push_back(0.5 * (surface_.vertices[e[0]] + surface_.vertices[e[1]]));
    const std::vector<int> owners = owners_.at(e);
    TS_ASSERT(owners.size() == 2);
    owners_.erase(e);
    for (const int t : owners) {
      auto& triangle = surface_.triangles[t];
      int k = 0;
      while (edge_between(triangle[k], triangle[(k + 1) % 3]) != e) ++k;
      const int from = triangle[k];
      const int to = triangle[(k + 1) % 3];
      const int apex = triangle[(k + 2) % 3];
      const int other = static_cast<int>(surface_.triangles.size());
      triangle = {from, middle, apex};
      surface_.triangles.push_back({middle, to, apex});
      kinds_.push_back(kinds_[t]);
      replace_owner(edge_between(to, apex), t, other);
      owners_[edge_between(from, middle)].push_back(t);
      owners_[edge_between(middle, to)].push_back(other);
      owners_[edge_between(middle, apex)] = {t, other};
      consider(edge_between(middle, apex));
    }
    consider(edge_between(e[0], middle));
    consider(edge_between(middle, e[1]));
  }

  const std::function<double(const Eigen::Vector3d&)>& edge_;
  TriangleMesh& surface_;
  std::vector<FaceKind>& kinds_;
  std::map<Edge, std::vector<int>> owners_;  // the two triangles at each edge
  std::priority_queue<std::pair<double, Edge>> queue_;
};

}  // namespace

void refine_surface(const std::function<double(const Eigen::Vector3d&)>& edge, TriangleMesh& surface,
                    std::vector<FaceKind>& kinds) {
  TS_ASSERT(kinds.size() == surface.triangles.size());
  Refinement(edge, surface, kinds).run();
}

}  // namespace touchstone::fem
