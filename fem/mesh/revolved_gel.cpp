#include "fem/mesh/revolved_gel.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/error.h"
#include "fem/mesh/gel_outline.h"
#include "fem/mesh/layer_columns.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
/// Rings lie nearer to each other than points in a ring: rows of equilateral triangles would be at 0.87. Where TetGen
/// leaves slivers, the next one is tried.
constexpr std::array<double, 5> kRingSpacings = {0.93, 0.89, 0.97, 0.85, 1.01};

/// Places from 0 to `length`, both included, as far apart as `spacing` says, all scaled alike to end at the end.
std::vector<double> stations(double length, const std::function<double(double)>& spacing, int fewest) {
  constexpr int kSteps = 4000;
  std::vector<double> count(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    count[i + 1] = count[i] + length / kSteps / spacing(length * (i + 0.5) / kSteps);
  }
  const int parts = std::max(fewest, static_cast<int>(std::lround(count.back())));
  std::vector<double> result = {0.0};
  int i = 0;
  for (int k = 1; k < parts; ++k) {
    const double wanted = count.back() * k / parts;
    while (count[i + 1] < wanted) ++i;
    result.push_back(length * (i + (wanted - count[i]) / (count[i + 1] - count[i])) / kSteps);
  }
  result.push_back(length);
  return result;
}

/// A ring of vertices: where it is at each depth under the outside, and how many points it has.
struct Ring {
  std::function<Eigen::Vector2d(double depth)> at;  ///< radius, z
  int points = 1;                                   ///< 1: a pole
  double turn = 0.0;                                ///< angle of the first point
  FaceKind kind = FaceKind::side;                   ///< of the band between the ring before and this one
  bool layered = false;                             ///< likewise: layers lie on the band
};

class Rings {
 public:
  Rings(const Outline& outline, double spacing)
      : o_(outline), spacing_(spacing), depth_(total_thickness(outline.layers)) {
    add_cap();
    if (o_.cylinder() > 0.0) add_side();
    add_base();
  }

  const std::vector<Ring>& list() const { return list_; }
  double depth() const { return depth_; }

  /// Vertex number `index` of ring `ring` at a depth.
  Vector3d point(std::size_t ring, int index, double depth) const {
    const Ring& r = list_[ring];
    const Eigen::Vector2d at = r.at(depth);
    if (r.points == 1) return {0.0, 0.0, at.y()};
    const double angle = 2.0 * kPi * index / r.points + r.turn;
    return {at.x() * std::cos(angle), at.x() * std::sin(angle), at.y()};
  }

 private:
  void add(Ring ring) {
    const Eigen::Vector2d at = ring.at(0.0);
    const double edge = o_.edge_at({at.x(), 0.0, at.y()});
    if (at.x() > 0.0) {
      // Multiples of six: round the apex they make a lattice of nearly equilateral triangles.
      ring.points = 6 * std::max(1, static_cast<int>(std::lround(2.0 * kPi * at.x() / (6.0 * edge))));
      const bool alike = !list_.empty() && list_.back().points == ring.points && list_.back().turn == 0.0;
      ring.turn = alike ? kPi / ring.points : 0.0;
    }
    list_.push_back(std::move(ring));
  }

  void add_cap() {
    const double rim = o_.rim_angle();
    const auto spacing = [&](double s) {
      const double angle = s / o_.sphere;
      return spacing_ *
             o_.edge_at({o_.sphere * std::sin(angle), 0.0, -2.0 * o_.sphere * std::pow(std::sin(angle / 2.0), 2)});
    };
    const Outline o = o_;
    for (const double s : stations(o_.sphere * rim, spacing, 3)) {
      const double part = s / (o_.sphere * rim);
      const auto at = [o, part](double depth) -> Eigen::Vector2d {
        const double radius = o.sphere - depth;
        if (part == 1.0 && o.smooth()) return {radius, -o.sphere};
        if (part == 1.0 && o.cylinder() == 0.0) {
          return {depth == 0.0 ? o.base : radius * std::sin(o.rim_angle(depth)), -o.thickness};
        }
        const double angle = part * o.rim_angle(depth);
        const double sine = std::sin(angle / 2.0);
        return {part == 1.0 ? o.base : radius * std::sin(angle), -depth - 2.0 * radius * sine * sine};
      };
      add({at, 1, 0.0, FaceKind::outer, true});
    }
  }

  void add_side() {
    const Outline o = o_;
    const bool layered = o.layers_on_side();
    const double rim = list_.back().at(layered ? 0.0 : depth_).y();
    const double sleeve_top = -o.thickness + o.sleeve;
    const auto add_part = [&](double from, double to, FaceKind kind) {
      if (from - to <= 1e-9 * o.thickness) return;
      const auto spacing = [&](double s) { return spacing_ * o.edge_at({o.base, 0.0, from - s}); };
      const std::vector<double> down = stations(from - to, spacing, 1);
      for (std::size_t k = 1; k < down.size(); ++k) {
        const double z = k + 1 == down.size() ? to : from - down[k];
        const auto at = [o, z, layered](double depth) -> Eigen::Vector2d {
          return {layered ? o.base - depth : o.base, z};
        };
        add({at, 1, 0.0, kind, layered});
      }
    };
    const FaceKind free = o.side_outer ? FaceKind::outer : FaceKind::side;
    const bool has_sleeve = o.sleeve > 1e-9 * o.thickness;
    add_part(rim, has_sleeve ? std::min(rim, sleeve_top) : -o.thickness, free);
    if (has_sleeve) add_part(std::min(rim, sleeve_top), -o.thickness, FaceKind::bonded);
  }

  void add_base() {
    const double z = -o_.thickness;
    const double radius = list_.back().at(depth_).x();
    const auto spacing = [&](double s) { return spacing_ * o_.edge_at({radius - s, 0.0, z}); };
    const std::vector<double> inwards = stations(radius, spacing, 2);
    for (std::size_t k = 1; k < inwards.size(); ++k) {
      const double r = k + 1 == inwards.size() ? 0.0 : radius - inwards[k];
      add({[r, z](double) -> Eigen::Vector2d { return {r, z}; }, 1, 0.0, FaceKind::bonded, false});
    }
  }

  Outline o_;
  double spacing_;  ///< of rings, over the wanted edge
  double depth_;
  std::vector<Ring> list_;
};

/// The core's surface: all that is under the layers.
struct CoreSurface {
  std::vector<Vector3d> points;
  std::vector<std::array<int, 2>> place;  ///< per point: its ring, and which of the ring's it is
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> band;  ///< per triangle: the ring that its band ends with
};

CoreSurface core_surface(const Rings& rings) {
  CoreSurface surface;
  std::vector<int> first;
  for (std::size_t k = 0; k < rings.list().size(); ++k) {
    first.push_back(static_cast<int>(surface.points.size()));
    for (int i = 0; i < rings.list()[k].points; ++i) {
      surface.points.push_back(rings.point(k, i, rings.depth()));
      surface.place.push_back({static_cast<int>(k), i});
    }
  }
  for (std::size_t k = 1; k < rings.list().size(); ++k) {
    const Ring& upper = rings.list()[k - 1];
    const Ring& lower = rings.list()[k];
    const auto angle = [](const Ring& ring, int i) { return 2.0 * kPi * i / ring.points + ring.turn; };
    const auto vertex = [&](std::size_t ring, int i) { return first[ring] + i % rings.list()[ring].points; };
    const auto add = [&](int a, int b, int c) {
      surface.triangles.push_back({a, b, c});
      surface.band.push_back(static_cast<int>(k));
    };
    // Both rings are walked round; the one that is behind takes the next step.
    const int steps_up = upper.points == 1 ? 0 : upper.points;
    const int steps_down = lower.points == 1 ? 0 : lower.points;
    int i = 0;
    int j = 0;
    while (i < steps_up || j < steps_down) {
      const bool down = i == steps_up || (j < steps_down && angle(lower, j + 1) <= angle(upper, i + 1) + 1e-9);
      if (down) {
        add(vertex(k - 1, i), vertex(k, j), vertex(k, j + 1));
        ++j;
      } else {
        add(vertex(k - 1, i), vertex(k, j), vertex(k - 1, i + 1));
        ++i;
      }
    }
  }
  return surface;
}

/// What lies under the layers, without faces.
TetMesh core_mesh(const Outline& outline, const CoreSurface& surface) {
  FillInput input;
  input.points = surface.points;
  for (const auto& t : surface.triangles) input.facets.push_back({{t[0], t[1], t[2]}});
  input.keep_boundary = true;
  input.most_points = static_cast<int>(kMostTetrahedra / 4.0);
  input.edge = [&](const Vector3d& x) { return outline.edge_at(x); };
  return fill_with_tetrahedra(
      input, fmt::format("{} of radius {} mm, {} mm thick, with edges of {} to {} mm", outline.name, outline.sphere,
                         outline.thickness, outline.fine, outline.coarse));
}

TetMesh mesh_with(const Outline& outline, const Rings& rings, const CoreSurface& surface, TetMesh mesh) {
  LayerColumns columns;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Ring& band = rings.list()[surface.band[t]];
    if (band.layered && !outline.layers.empty()) {
      columns.faces.push_back(surface.triangles[t]);
      columns.kinds.push_back(band.kind);
    } else if (band.kind == FaceKind::outer) {
      mesh.outer.push_back(surface.triangles[t]);
    } else if (band.kind == FaceKind::bonded) {
      mesh.bonded.push_back(surface.triangles[t]);
    }
  }
  const bool on_base = outline.cylinder() == 0.0 || outline.layers_on_side();
  columns.rim = on_base ? FaceKind::bonded : FaceKind::side;
  columns.at = [&](int vertex, double depth) {
    const auto [ring, index] = surface.place[vertex];
    return rings.point(ring, index, depth);
  };
  if (!outline.layers.empty()) {
    add_layers(layer_sheets(outline.layers, outline.fine, outline.fine_depth), columns, mesh);
  }
  return mesh;
}

TetMesh mesh(const Outline& outline) {
  check(outline);
  TetMesh best;
  double best_angle = -1.0;
  for (const double spacing : kRingSpacings) {
    const Rings rings(outline, spacing);
    const CoreSurface surface = core_surface(rings);
    TetMesh core = core_mesh(outline, surface);
    const double angle = smallest_dihedral_angle(core);
    if (angle > best_angle) {
      best_angle = angle;
      best = mesh_with(outline, rings, surface, std::move(core));
    }
    if (angle > kGoodDihedral) break;
  }
  return best;
}

}  // namespace

void check(const DomeGel& dome) {
  if (!std::isfinite(dome.thickness) || dome.thickness < 0.0) {
    fail("the dome's thickness is {} mm; it must be finite and not below zero", dome.thickness);
  }
  check(outline_of(dome));
}

void check(const FingertipGel& fingertip) {
  if (!std::isfinite(fingertip.length) || fingertip.length < 0.0) {
    fail("the fingertip's length is {} mm; it must be finite and not below zero", fingertip.length);
  }
  check(outline_of(fingertip));
}

double thickness_of(const DomeGel& dome) {
  return outline_of(dome).thickness;
}

double thickness_of(const FingertipGel& fingertip) {
  return outline_of(fingertip).thickness;
}

double estimated_tetrahedra(const DomeGel& dome) {
  return estimated_tetrahedra(outline_of(dome));
}

double estimated_tetrahedra(const FingertipGel& fingertip) {
  return estimated_tetrahedra(outline_of(fingertip));
}

TetMesh mesh_revolved(const DomeGel& dome) {
  check(dome);
  return mesh(outline_of(dome));
}

TetMesh mesh_revolved(const FingertipGel& fingertip) {
  check(fingertip);
  return mesh(outline_of(fingertip));
}

}  // namespace touchstone::fem
