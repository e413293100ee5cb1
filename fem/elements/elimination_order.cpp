#include "fem/elements/elimination_order.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>

#include "core/error.h"

namespace touchstone::fem {
namespace {

/// Parts of no more nodes than this aren't cut any further.
constexpr std::size_t kLeafNodes = 40;
/// Where planes are tried, as parts of the nodes below them.
constexpr std::array<double, 5> kCuts = {0.42, 0.46, 0.5, 0.54, 0.58};

/// Neighbours of each node, in one list.
struct Graph {
  std::vector<int> first;
  std::vector<int> list;

  std::span<const int> around(int node) const {
    return {list.data() + first[node], static_cast<std::size_t>(first[node + 1] - first[node])};
  }
};

Graph graph_of(const TaylorHoodSpace& space) {
  std::vector<std::vector<int>> around(space.nodes);
  for (const auto& nodes : space.elements) {
    for (const int a : nodes) {
      for (const int b : nodes) {
        if (a != b) {
          around[a].push_back(b);
        }
      }
    }
  }
  Graph graph;
  graph.first.push_back(0);
  for (auto& list : around) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    graph.list.insert(graph.list.end(), list.begin(), list.end());
    graph.first.push_back(static_cast<int>(graph.list.size()));
  }
  return graph;
}

/// Nodes in the order of their elimination.
struct NodeGroups {
  std::vector<int> nodes;
  std::vector<std::size_t> end;  ///< of each group
  std::vector<int> parent;       ///< a later group, or -1

  int add(const std::vector<int>& group, std::initializer_list<int> children) {
    const int number = static_cast<int>(parent.size());
    nodes.insert(nodes.end(), group.begin(), group.end());
    end.push_back(nodes.size());
    parent.push_back(-1);
    for (const int child : children) {
      if (child >= 0) {
        parent[child] = number;
      }
    }
    return number;
  }
};

enum class Side : char { none, low, high };

class Dissection {
 public:
  explicit Dissection(const TaylorHoodSpace& space)
      : graph_(graph_of(space)), side_(space.nodes, Side::none), match_(space.nodes, -1), seen_(space.nodes, 0) {
    for (int node = 0; node < space.nodes; ++node) {
      positions_.push_back(space.position(node));
    }
  }

  /// Appends the nodes in the order of their elimination, as groups. Returns the last group, -1 if there are no nodes.
  int order(std::vector<int> nodes, NodeGroups& result) {
    if (nodes.size() <= kLeafNodes) {
      return nodes.empty() ? -1 : result.add(nodes, {});
    }
    std::vector<int> best_nodes;
    std::vector<int> best_separator;
    std::size_t best_cut = 0;
    double best_cost = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      std::sort(nodes.begin(), nodes.end(), [&](int a, int b) {
        const double xa = positions_[a][axis];
        const double xb = positions_[b][axis];
        return xa != xb ? xa < xb : a < b;
      });
      for (const double part : kCuts) {
        const auto cut = static_cast<std::size_t>(part * static_cast<double>(nodes.size()));
        // Eliminating a separator costs its cube; a lopsided cut leaves more to be cut.
        const double lopsided = std::abs(part - 0.5);
        const auto cost = [&](std::size_t size) { return static_cast<double>(size) * (1.0 + lopsided); };
        std::optional<std::vector<int>> separator =
            cover(nodes, cut, [&](std::size_t size) { return cost(size) < best_cost; });
        if (separator) {
          best_cost = cost(separator->size());
          best_nodes = nodes;
          best_cut = cut;
          best_separator = std::move(*separator);
        }
      }
    }
    for (const int node : best_separator) {
      seen_[node] = 1;
    }
    std::vector<int> low;
    std::vector<int> high;
    for (std::size_t i = 0; i < best_nodes.size(); ++i) {
      if (!seen_[best_nodes[i]]) {
        (i < best_cut ? low : high).push_back(best_nodes[i]);
      }
    }
    for (const int node : best_separator) {
      seen_[node] = 0;
    }
    nodes.clear();
    best_nodes.clear();
    const int below = order(std::move(low), result);
    const int above = order(std::move(high), result);
    return result.add(best_separator, {below, above});
  }

 private:
  /// Fewest nodes that cover every edge between nodes[0..cut) and the rest; nothing where they are too many, as
  /// worth(size) says.
  template <typename Worth>
  std::optional<std::vector<int>> cover(const std::vector<int>& nodes, std::size_t cut, const Worth& worth) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      side_[nodes[i]] = i < cut ? Side::low : Side::high;
    }
    std::vector<int> left;  // nodes of the low side with an edge across
    for (std::size_t i = 0; i < cut; ++i) {
      const auto around = graph_.around(nodes[i]);
      if (std::any_of(around.begin(), around.end(), [&](int other) { return side_[other] == Side::high; })) {
        left.push_back(nodes[i]);
      }
    }
    // A largest matching ([Pothen1990]): most nodes are matched greedily; then each phase
    // lengthens it by paths that share no node, until none is left.
    std::size_t matched = 0;
    for (const int node : left) {
      matched += match_free(node) ? 1 : 0;
    }
    bool grown = true;
    while (grown && worth(matched)) {
      forget_visits();
      grown = false;
      for (const int node : left) {
        if (match_[node] < 0 && augment(node)) {
          ++matched;
          grown = true;
        }
      }
    }
    std::optional<std::vector<int>> result;
    if (worth(matched)) {
      // Koenig: what the last phase visited are the right nodes on alternating paths from unmatched left ones. They are
      // the cover, with the matched left nodes off these paths. It's the same for each largest matching.
      result = visited_;
      for (const int node : left) {
        if (match_[node] >= 0 && !seen_[match_[node]]) {
          result->push_back(node);
        }
      }
      std::sort(result->begin(), result->end());
    }
    forget_visits();
    for (const int node : left) {
      if (match_[node] >= 0) {
        match_[match_[node]] = -1;
        match_[node] = -1;
      }
    }
    for (const int node : nodes) {
      side_[node] = Side::none;
    }
    return result;
  }

  /// Matches a node of the low side with one across that has no match yet, if there is one.
  bool match_free(int node) {
    for (const int other : graph_.around(node)) {
      if (side_[other] == Side::high && match_[other] < 0) {
        match_[other] = node;
        match_[node] = other;
        return true;
      }
    }
    return false;
  }

  /// Matches a node of the low side, and others anew, along a path of nodes not visited yet, if there is one.
  bool augment(int node) {
    for (const int other : graph_.around(node)) {
      if (side_[other] != Side::high || seen_[other]) {
        continue;
      }
      visit(other);
      if (match_[other] < 0 || augment(match_[other])) {
        match_[other] = node;
        match_[node] = other;
        return true;
      }
    }
    return false;
  }

  void visit(int node) {
    seen_[node] = 1;
    visited_.push_back(node);
  }
  void forget_visits() {
    for (const int node : visited_) {
      seen_[node] = 0;
    }
    visited_.clear();
  }

  Graph graph_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<Side> side_;  // of the part that is being cut
  std::vector<int> match_;
  std::vector<char> seen_;
  std::vector<int> visited_;
};

}  // namespace

std::vector<int> elimination_order(const TaylorHoodSpace& space) {
  return elimination_tree(space).order;
}

EliminationTree elimination_tree(const TaylorHoodSpace& space) {
  std::vector<int> nodes;
  for (int node = 0; node < space.nodes; ++node) {
    if (!space.clamped[node] || node < space.vertices) {
      nodes.push_back(node);
    }
  }
  NodeGroups groups;
  Dissection(space).order(std::move(nodes), groups);
  EliminationTree tree;
  tree.parent = std::move(groups.parent);
  // A vertex' further pressures meet no node that the vertex itself doesn't: they follow it.
  std::vector<std::vector<int>> further(space.vertices);
  for (std::size_t k = space.vertices; k < space.pressure.size(); ++k) {
    further[space.pressure_vertex[k]].push_back(space.pressure[k]);
  }
  std::vector<int>& unknowns = tree.order;
  unknowns.reserve(space.unknowns);
  std::size_t next = 0;
  for (const std::size_t end : groups.end) {
    for (; next < end; ++next) {
      const int node = groups.nodes[next];
      if (!space.clamped[node]) {
        for (int a = 0; a < 3; ++a) {
          unknowns.push_back(space.displacement[node] + a);
        }
      }
      if (node < space.vertices) {
        unknowns.push_back(space.pressure[node]);
        unknowns.insert(unknowns.end(), further[node].begin(), further[node].end());
      }
    }
    tree.end.push_back(static_cast<int>(unknowns.size()));
  }
  TS_ASSERT(static_cast<int>(unknowns.size()) == space.unknowns);
  return tree;
}

}  // namespace touchstone::fem
