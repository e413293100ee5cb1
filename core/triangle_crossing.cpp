#include "core/triangle_crossing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "core/exact_sign.h"

namespace touchstone {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;
using Box = Eigen::AlignedBox3d;

// The two coordinates in which a plane with this triangle is seen broadest.
std::array<int, 2> broad_axes(const Corners& t) {
  Eigen::Index thin = 0;
  (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff(&thin);
  return {static_cast<int>((thin + 1) % 3), static_cast<int>((thin + 2) % 3)};
}

bool segments_meet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                   const Eigen::Vector2d& d) {
  const int sides_of_cd = side_of_line(c, d, a) * side_of_line(c, d, b);
  const int sides_of_ab = side_of_line(a, b, c) * side_of_line(a, b, d);
  if (sides_of_cd > 0 || sides_of_ab > 0) return false;
  if (sides_of_cd < 0 || sides_of_ab < 0) return true;
  // An end lies on the other's line, or all on one line: then boxes that overlap decide.
  return (a.cwiseMin(b).array() <= c.cwiseMax(d).array()).all() &&
         (c.cwiseMin(d).array() <= a.cwiseMax(b).array()).all();
}

// All in one plane; ends and borders count.
bool segment_meets_in_plane(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Corners& t) {
  const auto axes = broad_axes(t);
  const auto flat = [&](const Eigen::Vector3d& v) { return Eigen::Vector2d(v[axes[0]], v[axes[1]]); };
  const std::array<Eigen::Vector2d, 3> corner = {flat(t[0]), flat(t[1]), flat(t[2])};
  for (int k = 0; k < 3; ++k) {
    if (segments_meet(flat(p), flat(q), corner[k], corner[(k + 1) % 3])) return true;
  }
  std::array<int, 3> side{};
  for (int k = 0; k < 3; ++k) side[k] = side_of_line(corner[k], corner[(k + 1) % 3], flat(p));
  return side[0] == side[1] && side[1] == side[2];
}

bool segment_meets(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Corners& t) {
  const int side_p = side_of_plane(t[0], t[1], t[2], p);
  const int side_q = side_of_plane(t[0], t[1], t[2], q);
  if (side_p == 0 && side_q == 0) return segment_meets_in_plane(p, q, t);
  if (side_p * side_q > 0) return false;
  std::array<int, 3> side{};
  for (int k = 0; k < 3; ++k) side[k] = side_of_plane(p, q, t[k], t[(k + 1) % 3]);
  const auto [low, high] = std::minmax({side[0], side[1], side[2]});
  return low >= 0 || high <= 0;
}

bool triangles_meet(const Corners& a, const Corners& b) {
  for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    std::array<int, 3> side{};
    for (int k = 0; k < 3; ++k) side[k] = side_of_plane((*one)[0], (*one)[1], (*one)[2], (*other)[k]);
    if (side[0] != 0 && side[0] == side[1] && side[1] == side[2]) return false;
  }
  for (int k = 0; k < 3; ++k) {
    if (segment_meets(a[k], a[(k + 1) % 3], b) || segment_meets(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

class Crossings {
 public:
  explicit Crossings(const TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    boxes_.reserve(order_.size());
    for (const auto& t : mesh.triangles) {
      Box box(mesh.vertices[t[0]]);
      box.extend(mesh.vertices[t[1]]).extend(mesh.vertices[t[2]]);
      boxes_.push_back(box);
    }
    nodes_.reserve(2 * order_.size());
    build(0, static_cast<int>(order_.size()));
  }

  std::optional<std::pair<int, int>> find() {
    within(0);
    return found_;
  }

 private:
  // A leaf has no children and holds order_[begin, end); the left child of an inner node follows it at once.
  struct Node {
    Box box;
    int begin = 0, end = 0, right = -1;
  };

  int build(int begin, int end) {
    const auto index = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    Box box;
    Box centres;
    for (int i = begin; i < end; ++i) {
      box.extend(boxes_[order_[i]]);
      centres.extend(boxes_[order_[i]].center());
    }
    int right = -1;
    if (end - begin > 4) {
      Eigen::Index axis = 0;
      centres.sizes().maxCoeff(&axis);
      const int middle = (begin + end) / 2;
      std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
        const double x = boxes_[a].center()[axis];
        const double y = boxes_[b].center()[axis];
        return x != y ? x < y : a < b;  // so that the order is the same everywhere
      });
      build(begin, middle);
      right = build(middle, end);
    }
    nodes_[index] = {box, begin, end, right};
    return index;
  }

  // Pairs inside one node.
  void within(int index) {
    const Node& node = nodes_[index];
    if (found_) return;
    if (node.right < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        for (int j = i + 1; j < node.end; ++j) test(order_[i], order_[j]);
      }
      return;
    }
    within(index + 1);
    within(node.right);
    between(index + 1, node.right);
  }

  // Pairs of one triangle in each node.
  void between(int one, int other) {
    const Node& a = nodes_[one];
    const Node& b = nodes_[other];
    if (found_ || !a.box.intersects(b.box)) return;
    if (a.right < 0 && b.right < 0) {
      for (int i = a.begin; i < a.end; ++i) {
        for (int j = b.begin; j < b.end; ++j) test(order_[i], order_[j]);
      }
    } else if (b.right < 0 || (a.right >= 0 && a.end - a.begin >= b.end - b.begin)) {
      between(one + 1, other);
      between(a.right, other);
    } else {
      between(one, other + 1);
      between(one, b.right);
    }
  }

  void test(int one, int other) {
    if (found_ || !boxes_[one].intersects(boxes_[other])) return;
    if (cross(mesh_.triangles[one], mesh_.triangles[other])) found_ = std::minmax(one, other);
  }

  Corners corners(const std::array<int, 3>& t) const {
    return {mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]};
  }

  bool cross(const std::array<int, 3>& s, const std::array<int, 3>& t) const {
    std::array<int, 3> own_s{};  // vertices of s that t doesn't have, first
    std::array<int, 3> own_t{};
    const auto split = [](const std::array<int, 3>& all, const std::array<int, 3>& other, std::array<int, 3>& own) {
      own = all;
      const auto end = std::stable_partition(own.begin(), own.end(), [&](int vertex) {
        return std::find(other.begin(), other.end(), vertex) == other.end();
      });
      return static_cast<int>(end - own.begin());
    };
    const int alone = split(s, t, own_s);
    split(t, s, own_t);
    const auto& v = mesh_.vertices;
    switch (alone) {
      case 0:
        return true;  // the same three vertices
      case 1: {       // a shared edge: they meet elsewhere only if they are folded onto each other
        const Eigen::Vector3d& p = v[own_s[1]];
        const Eigen::Vector3d& q = v[own_s[2]];
        const Eigen::Vector3d& a = v[own_s[0]];
        const Eigen::Vector3d& b = v[own_t[0]];
        if (side_of_plane(p, q, a, b) != 0) return false;
        const auto axes = broad_axes(corners(s));
        const auto flat = [&](const Eigen::Vector3d& x) { return Eigen::Vector2d(x[axes[0]], x[axes[1]]); };
        return side_of_line(flat(p), flat(q), flat(a)) == side_of_line(flat(p), flat(q), flat(b));
      }
      case 2:  // a shared vertex: what they share besides reaches the side opposite to it in one of them
        return segment_meets(v[own_s[0]], v[own_s[1]], corners(t)) ||
               segment_meets(v[own_t[0]], v[own_t[1]], corners(s));
      default:
        return triangles_meet(corners(s), corners(t));
    }
  }

  const TriangleMesh& mesh_;
  std::vector<int> order_;
  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
  std::optional<std::pair<int, int>> found_;
};

}  // namespace

std::optional<std::pair<int, int>> first_crossing(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return std::nullopt;
  return Crossings(mesh).find();
}

}  // namespace touchstone
