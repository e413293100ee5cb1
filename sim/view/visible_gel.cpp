#include "sim/view/visible_gel.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr int kSubdivisions = 2;
constexpr std::size_t kParts = 16;  // 4^kSubdivisions
constexpr double kWettedMm = 1e-3;  // a film of air thinner than this isn't there for the light

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct Edge {
  int new_vertex = 0;
  std::array<int, 2> opposite = {-1, -1};  // the second one is -1 on the surface's edge
};

/// One step of Loop's subdivision: triangles become four each (in place of the old one), the returned weights give the
/// new vertices from the old.
Weights subdivide(std::vector<std::array<int, 3>>& triangles, int vertices) {
  std::map<std::pair<int, int>, Edge> edges;
  int next = vertices;
  const auto key = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
  for (const auto& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const auto [edge, is_new] = edges.try_emplace(key(t[k], t[(k + 1) % 3]));
      if (is_new) edge->second.new_vertex = next++;
      edge->second.opposite[is_new ? 0 : 1] = t[(k + 2) % 3];
    }
  }

  std::vector<std::vector<int>> around(vertices);
  std::vector<char> on_border(vertices, 0);
  std::vector<Eigen::Triplet<double>> weights;
  for (const auto& [ends, edge] : edges) {
    const auto [a, b] = ends;
    around[a].push_back(b);
    around[b].push_back(a);
    const bool border = edge.opposite[1] < 0;
    if (border) on_border[a] = on_border[b] = 1;
    for (int end : {a, b}) weights.emplace_back(edge.new_vertex, end, border ? 0.5 : 0.375);
    if (!border) {
      for (int far : edge.opposite) weights.emplace_back(edge.new_vertex, far, 0.125);
    }
  }
  for (int i = 0; i < vertices; ++i) {
    const auto n = static_cast<double>(around[i].size());
    if (on_border[i] || n < 3) {
      weights.emplace_back(i, i, 1.0);
      continue;
    }
    const double share = (0.625 - std::pow(0.375 + 0.25 * std::cos(2.0 * kPi / n), 2)) / n;
    weights.emplace_back(i, i, 1.0 - n * share);
    for (int j : around[i]) weights.emplace_back(i, j, share);
  }

  std::vector<std::array<int, 3>> finer;
  finer.reserve(4 * triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const int ab = edges.at(key(a, b)).new_vertex;
    const int bc = edges.at(key(b, c)).new_vertex;
    const int ca = edges.at(key(c, a)).new_vertex;
    finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  triangles = std::move(finer);
  Weights matrix(next, vertices);
  matrix.setFromTriplets(weights.begin(), weights.end());
  return matrix;
}

/// Where a point of the undeformed surface that subdivision gave truly lies, and the direction along which it is laid
/// onto bodies. On the border only the rim's own points are wanted.
struct TrueSurface {
  std::function<Eigen::Vector3d(const Eigen::Vector3d& point, bool on_border)> place;
  std::function<Eigen::Vector3d(const Eigen::Vector3d& point)> up;
};

Eigen::Vector3d on_cylinder(const Eigen::Vector3d& point, double radius, double z) {
  const Eigen::Vector2d across = radius * point.head<2>().normalized();
  return {across.x(), across.y(), z};
}

TrueSurface true_surface(const fem::GelBody& body) {
  const auto straight_up = [](const Eigen::Vector3d&) { return Eigen::Vector3d(Eigen::Vector3d::UnitZ()); };
  if (const auto* dome = std::get_if<fem::DomeGel>(&body)) {
    const double sphere = dome->sphere_radius;
    const double base = dome->base_radius;
    const double rim_z = std::sqrt(sphere * sphere - base * base) - sphere;
    const Eigen::Vector3d centre(0, 0, -sphere);
    return {[=](const Eigen::Vector3d& point, bool on_border) -> Eigen::Vector3d {
              if (on_border) return on_cylinder(point, base, rim_z);
              return centre + sphere * (point - centre).normalized();
            },
            straight_up};
  }
  if (const auto* tip = std::get_if<fem::FingertipGel>(&body)) {
    const double radius = tip->radius;
    const Eigen::Vector3d centre(0, 0, -radius);
    return {[=](const Eigen::Vector3d& point, bool) -> Eigen::Vector3d {
              if (point.z() < centre.z()) return on_cylinder(point, radius, point.z());
              return centre + radius * (point - centre).normalized();
            },
            [=](const Eigen::Vector3d& point) -> Eigen::Vector3d {
              if (point.z() < centre.z()) return on_cylinder(point, 1.0, 0.0);
              return (point - centre).normalized();
            }};
  }
  return {[](const Eigen::Vector3d& point, bool) { return point; }, straight_up};
}

/// Which vertices lie on the surface's edge.
std::vector<char> border_of(const std::vector<std::array<int, 3>>& triangles, std::size_t vertices) {
  std::map<std::pair<int, int>, int> uses;
  for (const auto& t : triangles) {
    for (int k = 0; k < 3; ++k) ++uses[std::minmax(t[k], t[(k + 1) % 3])];
  }
  std::vector<char> border(vertices, 0);
  for (const auto& [ends, count] : uses) {
    if (count == 1) border[ends.first] = border[ends.second] = 1;
  }
  return border;
}

/// Where lines out of the gel through its points meet the body.
class Above {
 public:
  Above(const fem::ContactShape& shape, const RigidTransform& gel_from_object)
      : shape_(shape), object_from_gel_(gel_from_object.inverse()) {
    const fem::BoundingBall ball = fem::bounding_ball(shape);
    centre_ = gel_from_object * ball.centre;
    radius_ = ball.radius;
  }

  /// Height of the body's surface above the point along the unit vector `up`, negative where the point lies inside;
  /// nothing beside the body.
  std::optional<double> gap(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const {
    if ((point - centre_).cross(up).squaredNorm() > radius_ * radius_) return std::nullopt;
    return fem::first_entry(shape_, object_from_gel_ * point, object_from_gel_.turn(up));
  }

 private:
  const fem::ContactShape& shape_;
  RigidTransform object_from_gel_;
  Eigen::Vector3d centre_;
  double radius_ = 0.0;
};

}  // namespace

VisibleGel::VisibleGel(const fem::Compliance& gel, const fem::GelBody& body)
    : coarse_(gel.triangles), fine_(gel.triangles) {
  const auto n = static_cast<int>(gel.vertices.size());
  rest_.resize(n, 3);
  for (int i = 0; i < n; ++i) rest_.row(i) = gel.vertices[i].transpose();
  averaged_ = gel.mass;
  for (int i = 0; i < n; ++i) averaged_.row(i) /= averaged_.row(i).sum();
  fine_from_coarse_.resize(n, n);
  fine_from_coarse_.setIdentity();
  for (int i = 0; i < kSubdivisions; ++i) {
    const Weights step = subdivide(fine_, static_cast<int>(fine_from_coarse_.rows()));
    fine_from_coarse_ = Weights(step * fine_from_coarse_);
  }
  TS_ASSERT(fine_.size() == kParts * coarse_.size());
  const TrueSurface surface = true_surface(body);
  fine_rest_ = fine_from_coarse_ * rest_;
  const std::vector<char> border = border_of(fine_, static_cast<std::size_t>(fine_rest_.rows()));
  up_.resize(n, 3);
  fine_up_.resize(fine_rest_.rows(), 3);
  for (int i = 0; i < n; ++i) up_.row(i) = surface.up(gel.vertices[i]).transpose();
  for (Eigen::Index i = 0; i < fine_rest_.rows(); ++i) {
    const Eigen::Vector3d place = surface.place(fine_rest_.row(i).transpose(), border[i] != 0);
    fine_rest_.row(i) = place.transpose();
    fine_up_.row(i) = surface.up(place).transpose();
  }
}

TriangleMesh VisibleGel::dry_surface(const fem::PressState& press, const fem::ContactShape& shape) const {
  const PlacedShape body{shape, press.gel_from_object};
  return dry_surface(press, std::span(&body, 1));
}

TriangleMesh VisibleGel::dry_surface(const fem::PressState& press, std::span<const PlacedShape> bodies) const {
  GelSheet whole = sheet(press, bodies);
  TriangleMesh dry{std::move(whole.mesh.vertices), {}};
  for (std::size_t i = 0; i < whole.touched.size(); ++i) {
    if (whole.touched[i] < 0) dry.triangles.push_back(whole.mesh.triangles[i]);
  }
  return dry;
}

ContactPressure VisibleGel::pressure_on(const fem::PressState& press, int body) const {
  constexpr double kPaPerMPa = 1000.0;
  const RigidTransform object_from_gel = press.bodies[static_cast<std::size_t>(body)].gel_from_object.inverse();
  ContactPressure out;
  out.triangles = coarse_;
  for (Eigen::Index i = 0; i < rest_.rows(); ++i) {
    const Eigen::Vector3d now = (rest_.row(i) + press.surface_displacement.row(i)).transpose();
    out.places.emplace_back((object_from_gel * now).head<2>());
    const auto vertex = static_cast<std::size_t>(i);
    const bool touched = press.node_state[vertex] != fem::NodeState::open && press.node_owner[vertex] == body;
    out.kPa.push_back(touched ? std::max(0.0, -kPaPerMPa * press.traction(i, 2)) : 0.0);
  }
  return out;
}

GelSheet VisibleGel::sheet(const fem::PressState& press, std::span<const PlacedShape> bodies) const {
  std::vector<Above> above;
  for (const PlacedShape& body : bodies) above.emplace_back(body.shape, body.gel_from_object);
  const auto owner = [&](int vertex) { return bodies.size() == 1 ? 0 : press.node_owner[vertex]; };
  // Where a body leans against a fingertip's side, the line along the side's normal runs beside its face, to tens of
  // millimetres away: there the point moves straight along z, if that's the shorter one.
  const auto projection_onto = [&](std::size_t body, const Eigen::Vector3d& point, const Eigen::Vector3d& up) {
    constexpr double kFar_mm = 1.0;
    std::optional<std::pair<double, Eigen::Vector3d>> projection;
    if (const auto gap = above[body].gap(point, up)) projection.emplace(*gap, up);
    if (!projection || std::abs(projection->first) <= kFar_mm) return projection;
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    const auto straight = above[body].gap(point, z);
    if (straight && std::abs(*straight) < std::abs(projection->first)) projection.emplace(*straight, z);
    return projection;
  };
  struct Nearest {
    double gap;
    Eigen::Vector3d direction;
    int body;
  };
  // To the body that comes first upwards, or reaches deepest.
  const auto nearest_gap = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& up) {
    std::optional<Nearest> nearest;
    for (std::size_t k = 0; k < above.size(); ++k) {
      const auto projection = projection_onto(k, point, up);
      if (projection && (!nearest || projection->first < nearest->gap))
        nearest = {projection->first, projection->second, static_cast<int>(k)};
    }
    return nearest;
  };
  const auto touches = [&](int vertex) { return press.node_state[vertex] != fem::NodeState::open; };
  Eigen::MatrixX3d moved = averaged_ * press.surface_displacement;
  for (Eigen::Index i = 0; i < moved.rows(); ++i) {
    if (!touches(static_cast<int>(i))) continue;
    const Eigen::Vector3d point = (rest_.row(i) + moved.row(i)).transpose();
    const auto projection =
        projection_onto(static_cast<std::size_t>(owner(static_cast<int>(i))), point, up_.row(i).transpose());
    if (projection) moved.row(i) += (projection->first * projection->second).transpose();
  }
  const Eigen::MatrixX3d fine = fine_rest_ + fine_from_coarse_ * moved;

  std::vector<char> in_contact(fine.rows(), 0);  // inside the contact as mechanics has it
  std::vector<char> contact_triangle(coarse_.size(), 0);
  for (std::size_t i = 0; i < coarse_.size(); ++i) {
    const auto& t = coarse_[i];
    contact_triangle[i] = touches(t[0]) && touches(t[1]) && touches(t[2]);
    if (!contact_triangle[i]) continue;
    for (std::size_t k = 0; k < kParts; ++k) {
      for (int corner : fine_[i * kParts + k]) in_contact[corner] = 1;
    }
  }

  GelSheet sheet;
  TriangleMesh& mesh = sheet.mesh;
  mesh.vertices.resize(fine.rows());
  for (Eigen::Index i = 0; i < fine.rows(); ++i) sheet.rest.emplace_back(fine_rest_.row(i).transpose());
  std::vector<int> touched(fine.rows(), -1);
  for (Eigen::Index i = 0; i < fine.rows(); ++i) {
    mesh.vertices[i] = fine.row(i).transpose();
    const Eigen::Vector3d up = fine_up_.row(i).transpose();
    const auto nearest = nearest_gap(mesh.vertices[i], up);
    if (nearest && (in_contact[i] || nearest->gap < kWettedMm)) {
      mesh.vertices[i] += nearest->gap * nearest->direction;
      touched[i] = nearest->body;
    }
  }
  mesh.triangles = fine_;
  for (std::size_t i = 0; i < fine_.size(); ++i) {
    const auto& t = fine_[i];
    const auto wet = [&](int vertex) { return in_contact[vertex] || touched[vertex] >= 0; };
    if (contact_triangle[i / kParts]) {
      sheet.touched.push_back(touched[t[0]] >= 0 ? touched[t[0]] : owner(coarse_[i / kParts][0]));
    } else if (wet(t[0]) && wet(t[1]) && wet(t[2])) {
      sheet.touched.push_back(std::max({touched[t[0]], touched[t[1]], touched[t[2]], 0}));
    } else {
      sheet.touched.push_back(-1);
    }
  }
  return sheet;
}

}  // namespace touchstone::sim
