#include "lab/bench/body_draw.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "lab/bench/body_meshes.h"

namespace touchstone::lab {
namespace {

using Eigen::Vector2d;

constexpr double kLeastDepth = 0.01;  // of the gel's thickness
constexpr double kMostDepth = 0.05;   // linear elasticity holds
constexpr double kFarthestPlace_mm = 1.8;
constexpr double kLift_mm = 2.0;
constexpr double kPlate_mm = 3.0;  // thicker than anything that comes up beside a body
constexpr std::array<double, 3> kTurns_deg = {0.0, 45.0, 17.0};

/// Draws for one trial.
class Draw {
 public:
  Draw(std::uint64_t seed, int index) : stream_(seed, static_cast<std::uint64_t>(index), Purpose::kStudy) {}

  double between(double low, double high) { return low + (high - low) * stream_.uniform(); }
  /// As likely between 1 and 2 as between 2 and 4; of three digits, so that the words say all of it.
  double size(double low, double high) {
    return std::round(1000.0 * low * std::pow(high / low, stream_.uniform())) / 1000.0;
  }
  int whole(int low, int high) { return low + static_cast<int>(std::floor((high - low + 1) * stream_.uniform())); }
  template <typename List>
  auto one_of(const List& list) {
    return list[static_cast<std::size_t>(whole(0, static_cast<int>(std::size(list)) - 1))];
  }

 private:
  RandomStream stream_;
};

fem::ContactShape mesh_shape(TriangleMesh mesh) {
  return fem::MeshShape(std::move(mesh));
}

/// A pattern on a plate whose `shape` is still missing: `make` gives it for a height.
TrialBody on_plate(TrialBody body, double height, const std::function<TriangleMesh(double height)>& make) {
  body.shape = mesh_shape(make(height));
  body.height_mm = height;
  body.lifted = mesh_shape(make(height + kLift_mm));
  return body;
}

BodySide side_at(double x) {
  return {{x, 0.0}, Vector2d::UnitY()};
}

TrialBody ball(Draw& draw) {
  const double radius = draw.size(2.0, 30.0);
  return {"ball", fmt::format("radius {}", radius), fem::SphereShape{radius}, 2.0 * radius, 0.0, {}};
}

TrialBody cylinder(Draw& draw) {
  const double radius = draw.size(0.8, 3.4);
  const double edge = draw.whole(0, 2) == 0 ? 0.3 * radius : 0.0;
  return {"cylinder",
          fmt::format("radius {}, edge radius {}", radius, edge),
          fem::RoundedCylinder{radius, edge, kPlate_mm},
          2.0 * radius,
          radius,
          {}};
}

TrialBody prism(Draw& draw) {
  const int sides = draw.whole(3, 8);
  const double radius = draw.size(1.0, 3.4);
  const double inner = radius * std::cos(std::numbers::pi / sides);
  return {"prism",
          fmt::format("{} sides, radius {}", sides, radius),
          mesh_shape(turned_profile({{0.0, 0.0}, {radius, 0.0}, {radius, kPlate_mm}, {0.0, kPlate_mm}}, sides)),
          2.0 * inner,
          radius,
          side_at(inner)};
}

TrialBody box(Draw& draw) {
  const double x = draw.size(1.0, 6.0);
  const double y = draw.size(1.0, 6.0);
  return {"box",          fmt::format("{} x {}", x, y), fem::BoxShape{{x, y, 2.0 * kPlate_mm}},
          std::min(x, y), 0.5 * std::hypot(x, y),       side_at(0.5 * x)};
}

TrialBody tilted_box(Draw& draw) {
  const double y = draw.size(1.0, 6.0);
  return {"tilted box", fmt::format("8 x {}", y), fem::BoxShape{{8.0, y, 8.0}}, y, 0.5 * y, {}};
}

TrialBody block_on_plate(Draw& draw) {
  const double x = draw.size(1.2, 7.0);
  const double y = draw.size(1.2, 7.0);
  const double height = draw.size(0.05, 1.0);
  const std::vector<double> lines_x = {-0.5 * x - 0.5, -0.5 * x, 0.5 * x, 0.5 * x + 0.5};
  const std::vector<double> lines_y = {-0.5 * y - 0.5, -0.5 * y, 0.5 * y, 0.5 * y + 0.5};
  const std::vector<bool> raised = {false, false, false, false, true, false, false, false, false};
  return on_plate({"block on plate",
                   fmt::format("{} x {} x {}, plate 1 wider", x, y, height),
                   {},
                   std::min(x, y),
                   0.5 * std::hypot(x, y),
                   side_at(0.5 * x)},
                  height, [&](double h) { return pattern_on_plate(lines_x, lines_y, raised, h, kPlate_mm); });
}

TrialBody letter(Draw& draw) {
  const char sign = draw.one_of(letters_known());
  const double stroke = draw.size(0.4, 0.9);
  const double height = draw.size(0.05, 1.0);
  return on_plate({"letter on plate",
                   fmt::format("{} of stroke {} x {}", sign, stroke, height),
                   {},
                   stroke,
                   4.3 * stroke,
                   side_at(sign == 'I' || sign == 'T' ? 0.5 * stroke : -2.5 * stroke)},
                  height, [&](double h) { return letter_on_plate(sign, stroke, h, kPlate_mm); });
}

/// What is raised in rows on a plate.
struct Rows {
  int count;
  double pitch, width, height;
  double outer;  ///< from the middle to the last one's outer side
};

Rows rows(Draw& draw, int most, double least_pitch) {
  const int count = draw.whole(2, most);
  const double pitch = draw.size(least_pitch, 6.0 / count);
  const double width = std::round(1000.0 * pitch * draw.between(0.35, 0.7)) / 1000.0;
  const double height = draw.size(0.05, 1.0);
  return {count, pitch, width, height, 0.5 * (count - 1) * pitch + 0.5 * width};
}

TrialBody studs(Draw& draw) {
  const auto [count, pitch, width, height, outer] = rows(draw, 5, 0.6);
  return on_plate({"studs on plate",
                   fmt::format("{0} x {0}, {1} wide, {2} apart, {3} high", count, width, pitch, height),
                   {},
                   width,
                   std::numbers::sqrt2 * outer,
                   side_at(outer)},
                  height, [=](double h) { return studs_on_plate(count, width, pitch, h, kPlate_mm); });
}

TrialBody ridges(Draw& draw) {
  const auto [count, pitch, width, height, outer] = rows(draw, 6, 0.5);
  return on_plate({"ridges on plate",
                   fmt::format("{}, {} wide, {} apart, {} high, 5 long", count, width, pitch, height),
                   {},
                   width,
                   std::hypot(outer, 2.5),
                   side_at(outer)},
                  height, [=](double h) { return ridges_on_plate(count, width, pitch, 5.0, h, kPlate_mm); });
}

TrialBody ring(Draw& draw) {
  const double outer = draw.size(1.2, 3.4);
  const double wall = draw.size(0.4, 0.8 * outer);
  const double inner = std::round(1000.0 * (outer - wall)) / 1000.0;
  return {"ring",
          fmt::format("radii {} and {}", inner, outer),
          mesh_shape(turned_profile({{inner, 0.0}, {outer, 0.0}, {outer, kPlate_mm}, {inner, kPlate_mm}}, 96)),
          wall,
          outer,
          {}};
}

TrialBody gear(Draw& draw) {
  const int teeth = draw.whole(6, 16);
  const double tip = draw.size(1.5, 3.4);
  const double foot = std::round(1000.0 * tip * draw.between(0.7, 0.88)) / 1000.0;
  const double height = draw.size(0.05, 1.0);
  const double plate = tip + 0.5;
  const auto teeth_of = [tip, foot](int point, int step) {
    return (point == 1 || point == 2) && step % 4 < 2 ? tip / foot : 1.0;
  };
  return on_plate({"gear on plate",
                   fmt::format("{} teeth, radii {} and {}, {} high", teeth, foot, tip, height),
                   {},
                   std::numbers::pi * tip / teeth,
                   tip,
                   {}},
                  height, [&](double h) {
                    return turned_profile(
                        {{0.0, 0.0}, {foot, 0.0}, {foot, h}, {plate, h}, {plate, h + kPlate_mm}, {0.0, h + kPlate_mm}},
                        4 * teeth, teeth_of);
                  });
}

TrialBody thread(Draw& draw) {
  const double radius = draw.size(1.5, 4.0);
  const double pitch = draw.size(0.4, 1.5);
  const int turns = static_cast<int>(std::ceil(6.0 / pitch));
  return {"thread",
          fmt::format("radius {}, pitch {}, {} turns", radius, pitch, turns),
          mesh_shape(threaded_rod(radius, pitch, turns)),
          pitch,
          0.5 * turns * pitch,
          {}};
}

TrialBody cone(Draw& draw) {
  const double slope_deg = std::round(10.0 * draw.size(3.0, 20.0)) / 10.0;
  const double radius = 4.0;
  const double height = radius * std::tan(slope_deg * std::numbers::pi / 180.0);
  return {"cone",
          fmt::format("{} degrees from flat", slope_deg),
          mesh_shape(turned_profile({{0.0, 0.0}, {radius, height}, {0.0, height + kPlate_mm}}, 96)),
          0.0,
          0.0,
          {}};
}

TrialBody needle(Draw& draw) {
  const double tip = draw.size(0.1, 0.5);
  const double slope_deg = std::round(draw.between(55.0, 80.0));
  const double outer = tip + 4.0 / std::tan(slope_deg * std::numbers::pi / 180.0);
  return {"needle",
          fmt::format("tip's radius {}, flanks {} degrees from flat", tip, slope_deg),
          mesh_shape(turned_profile({{0.0, 0.0}, {tip, 0.0}, {outer, 4.0}, {0.0, 4.0}}, 48)),
          2.0 * tip,
          tip,
          {}};
}

using Maker = TrialBody (*)(Draw&);
constexpr std::array<Maker, 14> kMakers = {ball,  cylinder, prism, box,  tilted_box, block_on_plate, letter,
                                           studs, ridges,   ring,  gear, thread,     cone,           needle};

/// A node or an edge of the gel's surface within `farthest` of its axis, seen along z.
template <typename Candidate>
Candidate pick(Draw& draw, const std::vector<std::pair<double, Candidate>>& by_distance, double farthest) {
  std::vector<Candidate> near;
  for (const auto& [distance, candidate] : by_distance) {
    if (distance <= farthest) near.push_back(candidate);
  }
  if (near.empty()) {
    return std::min_element(by_distance.begin(), by_distance.end(),
                            [](const auto& a, const auto& b) { return a.first < b.first; })
        ->second;
  }
  return draw.one_of(near);
}

Vector2d random_node(Draw& draw, const fem::Compliance& gel, double farthest) {
  std::vector<std::pair<double, Vector2d>> nodes;
  for (const auto& vertex : gel.vertices) nodes.emplace_back(vertex.head<2>().norm(), vertex.head<2>());
  return pick(draw, nodes, farthest);
}

/// The edges of the gel's surface, seen along z, each once.
std::vector<std::pair<Vector2d, Vector2d>> edges_of(const fem::Compliance& gel) {
  std::vector<std::pair<Vector2d, Vector2d>> edges;
  for (const auto& t : gel.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(t[k]);
      const auto b = static_cast<std::size_t>(t[(k + 1) % 3]);
      if (a < b) edges.emplace_back(gel.vertices[a].head<2>(), gel.vertices[b].head<2>());
    }
  }
  return edges;
}

Vector2d random_middle(Draw& draw, const fem::Compliance& gel, double farthest) {
  std::vector<std::pair<double, Vector2d>> middles;
  for (const auto& [from, to] : edges_of(gel)) middles.emplace_back((0.5 * (from + to)).norm(), 0.5 * (from + to));
  return pick(draw, middles, farthest);
}

/// A place and a turn that put the side over an edge.
struct SidePlace {
  Vector2d place;
  double yaw = 0.0;
};

SidePlace along_random_edge(Draw& draw, const fem::Compliance& gel, const BodySide& side, double farthest) {
  std::vector<std::pair<double, SidePlace>> places;
  for (const auto& [from, to] : edges_of(gel)) {
    const Vector2d along = to - from;
    const double turned = std::atan2(along.y(), along.x()) - std::atan2(side.direction.y(), side.direction.x());
    for (const double yaw : {turned, turned + std::numbers::pi}) {
      const Vector2d place = from - Eigen::Rotation2Dd(yaw) * side.point;
      places.emplace_back(place.norm(), SidePlace{place, yaw});
    }
  }
  return pick(draw, places, farthest);
}

void put(Draw& draw, const TrialGel& trial_gel, BodyTrial& trial) {
  const fem::Compliance& gel = *trial_gel.own;
  constexpr std::array<BodyPlace, 8> kPlaces = {BodyPlace::anywhere, BodyPlace::anywhere,  BodyPlace::anywhere,
                                                BodyPlace::on_node,  BodyPlace::on_edge,   BodyPlace::on_axis,
                                                BodyPlace::on_axis,  BodyPlace::along_edge};
  trial.placed = draw.one_of(kPlaces);
  const int turn = draw.whole(0, 3);
  trial.yaw_deg = turn < 3 ? kTurns_deg[static_cast<std::size_t>(turn)] : draw.between(0.0, 360.0);
  // Far enough for every place on an edge's triangles, and no farther than the fine part goes.
  const double farthest =
      std::clamp(trial_gel.device.mesh.fine_half_extent_mm.x() - 0.3 - trial.body.reach_mm, 0.6, kFarthestPlace_mm);
  switch (trial.placed) {
    case BodyPlace::anywhere:
      trial.place_mm = {draw.between(-farthest, farthest), draw.between(-farthest, farthest)};
      return;
    case BodyPlace::on_node:
      trial.place_mm = random_node(draw, gel, farthest);
      return;
    case BodyPlace::on_edge:
      trial.place_mm = random_middle(draw, gel, farthest);
      return;
    case BodyPlace::on_axis:
      trial.place_mm.setZero();
      return;
    case BodyPlace::along_edge: {
      if (!trial.body.side || trial.tilt_deg != 0.0) {
        trial.place_mm = random_node(draw, gel, farthest);
        return;
      }
      const SidePlace found = along_random_edge(draw, gel, *trial.body.side, farthest);
      trial.place_mm = found.place;
      trial.yaw_deg = found.yaw * 180.0 / std::numbers::pi;
      return;
    }
  }
}

/// `edge_mm` up to `half_mm` from the middle.
TrialGel gel_of(const std::string& name, decltype(sim::GelSpec::shape) shape, double thickness_mm, double edge_mm,
                double half_mm) {
  TrialGel gel{name, {}};
  gel.device.gel.shape = std::move(shape);
  gel.device.gel.thickness_mm = thickness_mm;
  gel.device.gel.youngs_modulus_MPa = 0.3;
  gel.device.gel.poisson_ratio = 0.48;
  gel.device.mesh.fine_mm = edge_mm;
  gel.device.mesh.coarse_mm = 2.5;
  gel.device.mesh.fine_half_extent_mm = {half_mm, half_mm};
  gel.device.mesh.fine_depth_mm = 0.5 * edge_mm;
  return gel;
}

}  // namespace

const std::vector<std::string>& body_families() {
  static const std::vector<std::string> families = [] {
    std::vector<std::string> names;
    Draw draw(0, 0);
    for (const Maker make : kMakers) names.push_back(make(draw).family);
    return names;
  }();
  return families;
}

std::string name_of(BodyPlace place) {
  switch (place) {
    case BodyPlace::anywhere:
      return "anywhere";
    case BodyPlace::on_node:
      return "on a node";
    case BodyPlace::on_edge:
      return "on an edge's middle";
    case BodyPlace::on_axis:
      return "on the axis";
    case BodyPlace::along_edge:
      break;
  }
  return "side along an edge";
}

std::vector<TrialGel> trial_gels(bool quick) {
  const double part = quick ? 0.5 : 1.0;
  std::vector<TrialGel> gels = {gel_of("slab", sim::SlabSpec{14.0, 14.0}, 5.0, 0.6, 3.9 * part),
                                gel_of("dome", sim::DomeSpec{20.0, 7.5}, 5.0, 0.5, 3.6 * part),
                                gel_of("fingertip", sim::FingertipSpec{6.0, 2.5, 1.5}, 8.5, 0.45, 3.3 * part)};
  for (TrialGel& gel : gels) gel.reference_edges = quick ? 0.5 : 0.35;
  return gels;
}

BodyTrial draw_trial(std::uint64_t seed, int index, const std::vector<TrialGel>& gels) {
  TS_ASSERT(index >= 0 && !gels.empty());
  Draw draw(seed, index);
  BodyTrial trial;
  trial.seed = seed;
  trial.index = index;
  trial.gel = static_cast<std::size_t>(draw.whole(0, static_cast<int>(gels.size()) - 1));
  const TrialGel& gel = gels[trial.gel];
  trial.friction = draw.whole(0, 1) == 0 ? 0.0 : 0.5;
  trial.depth_mm = std::round(1000.0 * gel.own->thickness * draw.between(kLeastDepth, kMostDepth)) / 1000.0;
  trial.shear_deg = draw.between(0.0, 360.0);
  trial.body = kMakers[static_cast<std::size_t>(index) % kMakers.size()](draw);
  if (trial.body.family == "tilted box") trial.tilt_deg = draw.one_of(std::array<double, 2>{17.0, 45.0});
  put(draw, gel, trial);
  return trial;
}

std::string in_words(const BodyTrial& trial) {
  return fmt::format(
      "seed {} number {}: {} ({} mm), {} at ({:.6g}, {:.6g}) mm, tilted {:.6g}, turned {:.6g} degrees, "
      "{:.4g} mm deep, mu {}",
      trial.seed, trial.index, trial.body.family, trial.body.words, name_of(trial.placed), trial.place_mm.x(),
      trial.place_mm.y(), trial.tilt_deg, trial.yaw_deg, trial.depth_mm, trial.friction);
}

}  // namespace touchstone::lab
