#include "fem/error/mesh_error.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "fem/contact/press.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;

/// Contact radii over the edge.
constexpr std::array<double, 5> kRadii = {1.6, 2.25, 3.2, 4.5, 6.0};
/// So many say something also where the fine part of the mesh ends before.
constexpr std::size_t kLeastRadii = 2;
/// Where the object is put, in edges: places that are unlike each other in a lattice of triangles.
constexpr std::array<std::array<double, 2>, 6> kPlaces = {
    {{0.026, 0.042}, {0.26, 0.14}, {0.54, 0.38}, {0.12, 0.62}, {-0.38, 0.22}, {0.44, -0.26}}};
/// The radius is another one at each place, so that no radius fits the lattice at all of them.
constexpr std::array<double, 6> kRadiusFactors = {0.95, 1.07, 0.89, 1.01, 1.13, 0.96};
/// At the first so many of them it is sheared as well.
constexpr std::size_t kShearedPlaces = 3;
/// The ladder's factors; if the gel can't be meshed so coarsely, the coarsest that it can be and that one's root.
constexpr double kMiddle = 1.75;
constexpr double kCoarsest = 2.5;
constexpr double kLeastCoarsest = 1.3;
/// Contacts smaller than this, in edges, may fall between the vertices of a level: they say nothing of its order.
constexpr double kLeastRadius = 0.9;
/// A sharp body's contact acts as if it ended by up to this part of an edge too far in, the same at all places:
/// measured against theory for punches on layers, at radii of 0.5 to 5 edges (0.02 to 0.04). A ladder doesn't see it
/// while it is about the same part of the force on all its levels.
constexpr double kOvershoot = 0.04;
/// Spheres are pressed by this part of the contact's radius, but no more than a tenth of the thickness.
constexpr double kDepthPerRadius = 0.25;
constexpr double kMostDepthPerThickness = 0.1;
constexpr double kShearPerDepth = 0.2;
/// How far contacts may go in the fine part of a mesh.
constexpr double kFinePart = 0.8;

/// The weights of a triangle's corners at its point nearest to `p`, and the distance squared.
std::pair<Vector3d, double> nearest_in_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                                const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double area = normal.squaredNorm();
  Vector3d weight((b - p).cross(c - p).dot(normal), (c - p).cross(a - p).dot(normal), (a - p).cross(b - p).dot(normal));
  weight /= area;
  if (weight.minCoeff() < 0.0) {
    // On the nearest edge.
    const std::array<Vector3d, 3> corner = {a, b, c};
    double best = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      const Vector3d& from = corner[k];
      const Vector3d edge = corner[(k + 1) % 3] - from;
      const double along = std::clamp((p - from).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      const double distance = (from + along * edge - p).squaredNorm();
      if (distance < best) {
        best = distance;
        weight.setZero();
        weight[k] = 1.0 - along;
        weight[(k + 1) % 3] = along;
      }
    }
  }
  return {weight, (weight[0] * a + weight[1] * b + weight[2] * c - p).squaredNorm()};
}

/// Takes a field at the vertices of `from` to the vertices of `to`: P1 on the nearest triangle.
Eigen::SparseMatrix<double> field_transfer(const Compliance& from, const Compliance& to) {
  std::vector<Eigen::Triplet<double>> entries(3 * to.vertices.size());
  tbb::parallel_for(std::size_t{0}, to.vertices.size(), [&](std::size_t v) {
    double best = std::numeric_limits<double>::infinity();
    std::array<int, 3> triangle{};
    Vector3d weight = Vector3d::Zero();
    for (const auto& t : from.triangles) {
      const auto [w, distance] =
          nearest_in_triangle(to.vertices[v], from.vertices[t[0]], from.vertices[t[1]], from.vertices[t[2]]);
      if (distance < best) {
        best = distance;
        triangle = t;
        weight = w;
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      entries[3 * v + k] = {static_cast<int>(v), triangle[k], weight[static_cast<Eigen::Index>(k)]};
    }
  });
  Eigen::SparseMatrix<double> transfer(static_cast<Eigen::Index>(to.vertices.size()),
                                       static_cast<Eigen::Index>(from.vertices.size()));
  transfer.setFromTriplets(entries.begin(), entries.end());
  return transfer;
}

struct Level {
  double factor = 1.0;
  Compliance gel;
  Eigen::SparseMatrix<double> to_first;  ///< fields on this level's vertices to those of level 0
};

struct ReferenceBody {
  ContactShape shape;
  double lowest = 0.0;  ///< z of its lowest point, object frame
  double depth = 0.0;   ///< mm
  double reach = 0.0;   ///< mm: displacements are compared this far from its axis
};

/// What one press on one level said; fields on the vertices of level 0. Zero where the press has no answer.
struct Reading {
  double normal = 0.0;
  double shear = 0.0;
  double cross = 0.0;
  double area = 0.0;
  Eigen::MatrixX3d displacement;
  Eigen::MatrixX3d traction;
  Eigen::MatrixX3d beads;
};

PressTarget target_at(const Vector3d& position) {
  PressTarget target;
  for (int a = 0; a < 3; ++a) target.axis[a] = AxisControl::at(position[a]);
  return target;
}

Reading read(const Level& level, const ReferenceBody& body, const Vector3d& place, bool sheared) {
  const Vector3d pressed = place - Vector3d(0.0, 0.0, body.lowest + body.depth);
  Reading result;
  try {
    Press press(level.gel, body.shape, 0.0);
    const PressState& state = press.step(target_at(pressed));
    result.normal = state.wrench[2];
    result.area = state.contact_area;
    result.displacement = level.to_first * state.surface_displacement;
    result.traction = level.to_first * state.traction;
    result.beads = state.bead_displacement;
    if (!sheared) return result;
    Press glued(level.gel, body.shape, std::numeric_limits<double>::infinity());
    glued.step(target_at(pressed));
    const PressState& dragged = glued.step(target_at(pressed + Vector3d(kShearPerDepth * body.depth, 0.0, 0.0)));
    result.shear = -dragged.wrench[0];  // it holds the object back
    result.cross = dragged.wrench[1];
  } catch (const Error&) {
    // A press that can't be made says nothing; there are others.
  }
  return result;
}

/// How two readings of the same press differ; the first sets the scale. Zero for what they don't give.
RelativeErrors difference(const Compliance& gel, const Eigen::VectorXd& weight, const Vector3d& place, double reach,
                          const Reading& first, const Reading& other) {
  RelativeErrors result;
  if (first.normal <= 0.0 || other.displacement.rows() == 0) return result;
  result[ErrorOf::normal_force] = (other.normal - first.normal) / first.normal;
  if (first.shear > 0.0 && other.shear > 0.0) {
    result[ErrorOf::shear_force] = (other.shear - first.shear) / first.shear;
    result[ErrorOf::cross_force] = (other.cross - first.cross) / first.normal;
  }
  double moved = 0.0;
  double near = 0.0;
  double pulled = 0.0;
  for (Eigen::Index v = 0; v < weight.size(); ++v) {
    if ((gel.vertices[static_cast<std::size_t>(v)] - place).norm() < reach) {
      near += weight[v];
      moved += weight[v] * (other.displacement.row(v) - first.displacement.row(v)).squaredNorm();
    }
    pulled += weight[v] * (other.traction.row(v) - first.traction.row(v)).squaredNorm();
  }
  if (near > 0.0) {
    result[ErrorOf::displacement] = std::sqrt(moved / near) / first.displacement.rowwise().norm().maxCoeff();
  }
  result[ErrorOf::traction] = std::sqrt(pulled * first.area) / first.normal;
  if (first.beads.rows() > 0) {
    result[ErrorOf::beads] =
        (other.beads - first.beads).rowwise().norm().maxCoeff() / first.beads.rowwise().norm().maxCoeff();
  }
  return result;
}

bool is_force(int kind) {
  return kind == static_cast<int>(ErrorOf::normal_force) || kind == static_cast<int>(ErrorOf::shear_force);
}

/// The differences between a level and level 0, over the places.
struct Sample {
  double radius = 0.0;  ///< of the contact, over level 0's edge
  double factor = 1.0;
  double scatter = 0.0;  ///< root mean square
};

/// How a stiffness goes with the radius at each radius: d log(stiffness) / d log(radius), at least 1.
std::vector<double> growth(const std::vector<double>& radii, const std::vector<double>& stiffness) {
  std::vector<double> result(radii.size(), 1.0);
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const std::size_t low = k == 0 ? 0 : k - 1;
    const std::size_t high = std::min(k + 1, radii.size() - 1);
    if (stiffness[low] <= 0.0 || stiffness[high] <= 0.0 || radii[high] <= radii[low]) continue;
    result[k] = std::max(1.0, std::log(stiffness[high] / stiffness[low]) / std::log(radii[high] / radii[low]));
  }
  return result;
}

/// e = C radius^-size factor^mesh on a level, and e_0 at factor 1.
struct Law {
  double scale = 0.0;
  double size = 0.0;
  double mesh = 0.0;

  double at(double radius) const { return scale * std::pow(radius, -size); }
};

/// Least squares of the logarithms. Few samples can't separate both orders, so each is drawn a little: the mesh's
/// towards `expected`, with `strength`, the size's towards the mesh's, as it is where the contact's edge makes the
/// error.
Law fit(const std::vector<Sample>& samples, double expected, double strength) {
  constexpr double kDraw = 0.1;
  Law best;
  double least = std::numeric_limits<double>::infinity();
  const auto n = static_cast<double>(samples.size());
  for (double mesh = 0.0; mesh <= 4.0; mesh += 0.05) {
    const auto both = [&](const Sample& s) { return std::sqrt(std::pow(s.factor, 2.0 * mesh) + 1.0); };
    double sx = 0.0;
    double sy = 0.0;
    double sxx = 0.0;
    double sxy = 0.0;
    for (const Sample& s : samples) {
      const double x = -std::log(s.radius);
      const double y = std::log(s.scatter / both(s));
      sx += x / n;
      sy += y / n;
      sxx += x * x / n;
      sxy += x * y / n;
    }
    const double size = (sxy - sx * sy + kDraw * mesh) / (sxx - sx * sx + kDraw);
    double residual = kDraw * (size - mesh) * (size - mesh) + strength * (mesh - expected) * (mesh - expected);
    double squares = 0.0;
    for (const Sample& s : samples) {
      const double ratio = s.scatter / both(s) * std::pow(s.radius, size);
      residual += std::pow(std::log(ratio) - (sy - size * sx), 2) / n;
      squares += ratio * ratio / n;
    }
    if (residual < least) {
      least = residual;
      best = {std::sqrt(squares), size, mesh};
    }
  }
  return best;
}

/// A body whose contact has about this radius.
ReferenceBody reference_body(double radius, double thickness, bool sharp) {
  ReferenceBody body;
  body.depth = std::min(kDepthPerRadius * radius, kMostDepthPerThickness * thickness);
  body.reach = 2.0 * radius;
  if (sharp) {
    body.shape = RoundedCylinder{radius, 0.0, 4.0 * thickness};
  } else {
    const double sphere = radius * radius / body.depth;
    body.shape = SphereShape{sphere};
    body.lowest = -sphere;
  }
  return body;
}

BodyErrors measure_body(const std::vector<Level>& levels, const LadderGel& ladder, bool sharp) {
  const Compliance& gel = levels.front().gel;
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  BodyErrors result;
  std::array<std::vector<Sample>, kErrorKinds> samples;
  std::array<std::vector<double>, kErrorKinds> stiffness;  // of forces, at each radius
  const auto least = static_cast<std::size_t>(ladder_radii(ladder));
  for (std::size_t r = 0; r < kRadii.size(); ++r) {
    if (r >= least && result.radius_per_edge.size() >= kLeastRadii) break;
    const double radius = kRadii[r];
    std::array<ReferenceBody, kPlaces.size()> bodies;
    std::array<Vector3d, kPlaces.size()> places;
    for (std::size_t k = 0; k < places.size(); ++k) {
      bodies[k] = reference_body(radius * kRadiusFactors[k] * ladder.edge, gel.thickness, sharp);
      places[k] = ladder.place + ladder.edge * Vector3d(kPlaces[k][0], kPlaces[k][1], 0.0);
    }
    std::vector<std::array<Reading, kPlaces.size()>> readings(levels.size());
    tbb::parallel_for(std::size_t{0}, levels.size() * places.size(), [&](std::size_t task) {
      const std::size_t k = task % places.size();
      const std::size_t level = task / places.size();
      readings[level][k] = read(levels[level], bodies[k], places[k], k < kShearedPlaces);
    });
    double area = 0.0;
    double normal = 0.0;
    double shear = 0.0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const Reading& reading = readings.front()[k];
      area += reading.area / static_cast<double>(places.size());
      normal += reading.normal / bodies[k].depth;
      shear += reading.shear / bodies[k].depth;
    }
    const double contact = std::sqrt(area / std::numbers::pi) / ladder.edge;
    if (contact <= 0.0) continue;
    result.radius_per_edge.push_back(contact);
    stiffness[static_cast<std::size_t>(ErrorOf::normal_force)].push_back(normal);
    stiffness[static_cast<std::size_t>(ErrorOf::shear_force)].push_back(shear);
    for (std::size_t i = 1; i < levels.size(); ++i) {
      if (radius < kLeastRadius * levels[i].factor) continue;
      RelativeErrors squares;
      std::array<int, kErrorKinds> counts{};
      for (std::size_t k = 0; k < places.size(); ++k) {
        const RelativeErrors one = difference(gel, weight, places[k], bodies[k].reach, readings[0][k], readings[i][k]);
        for (int kind = 0; kind < kErrorKinds; ++kind) {
          squares.values[kind] += one.values[kind] * one.values[kind];
          counts[kind] += one.values[kind] != 0.0;
        }
      }
      for (int kind = 0; kind < kErrorKinds; ++kind) {
        const double n = counts[kind];
        if (n < 2.0) continue;
        Sample sample{contact, levels[i].factor, 0.0};
        sample.scatter = std::sqrt(squares.values[kind] / n);
        if (sample.scatter > 0.0) samples[kind].push_back(sample);
      }
    }
  }
  result.errors.resize(result.radius_per_edge.size());
  for (int kind = 0; kind < kErrorKinds; ++kind) {
    if (samples[kind].empty()) {
      const bool nothing_to_tell = kind == static_cast<int>(ErrorOf::beads) && gel.beads.rows() == 0;
      for (RelativeErrors& errors : result.errors) errors.values[kind] = nothing_to_tell ? 0.0 : 1.0;
      continue;
    }
    // Beside a sharp edge the traction rises like the inverse root of the distance: its square has no finite mean, and
    // no mesh comes nearer to it in the root mean square.
    const bool no_limit = sharp && kind == static_cast<int>(ErrorOf::traction);
    const Law law = no_limit ? fit(samples[kind], 0.0, 100.0) : fit(samples[kind], 1.5, 0.02);
    result.mesh_order.values[kind] = law.mesh;
    result.size_order.values[kind] = law.size;
    std::vector<double> overshoot(result.errors.size(), 0.0);
    if (sharp && is_force(kind)) overshoot = growth(result.radius_per_edge, stiffness[kind]);
    for (std::size_t k = 0; k < result.errors.size(); ++k) {
      const double radius = result.radius_per_edge[k];
      result.errors[k].values[kind] = std::hypot(law.at(radius), kOvershoot * overshoot[k] / radius);
    }
  }
  return result;
}

}  // namespace

RelativeErrors errors_at(const BodyErrors& body, double radius_per_edge) {
  RelativeErrors result;
  const auto& radii = body.radius_per_edge;
  if (radii.empty()) {
    result.values.fill(1.0);
    return result;
  }
  const auto above =
      static_cast<std::size_t>(std::upper_bound(radii.begin(), radii.end(), radius_per_edge) - radii.begin());
  for (int kind = 0; kind < kErrorKinds; ++kind) {
    double error = 0.0;
    if (above == 0) {
      error =
          body.errors.front().values[kind] * std::pow(radius_per_edge / radii.front(), -body.size_order.values[kind]);
    } else if (above == radii.size()) {
      error = body.errors.back().values[kind];
    } else {
      const double low = body.errors[above - 1].values[kind];
      const double high = body.errors[above].values[kind];
      const double part = std::log(radius_per_edge / radii[above - 1]) / std::log(radii[above] / radii[above - 1]);
      error = low > 0.0 && high > 0.0 ? low * std::pow(high / low, part) : 0.0;
    }
    result.values[kind] = std::min(1.0, error);
  }
  return result;
}

LadderGel ladder_of(const GelBody& body, std::span<const ElasticMaterial> materials, std::span<const Bead> beads) {
  LadderGel ladder;
  ladder.edge = fine_edge(body);
  ladder.largest_radius = kFinePart * fine_reach(body);
  ladder.largest_factor = least_extent(body) / ladder.edge;
  ladder.with_edges = [body, own = std::vector<ElasticMaterial>(materials.begin(), materials.end()),
                       all = std::vector<Bead>(beads.begin(), beads.end())](double factor) {
    return compute_compliance(mesh_gel(with_edges(body, factor)), own, all, thickness_of(body));
  };
  return ladder;
}

LadderGel ladder_of(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads) {
  return ladder_of(SlabGel{slab, {}}, std::span(&material, 1), beads);
}

std::vector<double> ladder_factors(double largest_factor) {
  const double coarsest = std::min(kCoarsest, largest_factor);
  if (coarsest < kLeastCoarsest) return {};
  return {coarsest == kCoarsest ? kMiddle : std::sqrt(coarsest), coarsest};
}

int ladder_radii(const LadderGel& ladder) {
  const auto beyond = std::count_if(kRadii.begin(), kRadii.end(),
                                    [&](double radius) { return radius * ladder.edge > ladder.largest_radius; });
  return static_cast<int>(std::max(kLeastRadii, kRadii.size() - static_cast<std::size_t>(beyond)));
}

MeshErrorTable measure_mesh_error(const Compliance& gel, const LadderGel& ladder, const Progress& progress) {
  const std::vector<double> factors = ladder_factors(ladder.largest_factor);
  if (factors.empty()) return {};
  std::vector<Level> levels(1);
  levels.front().gel = gel;
  levels.front().to_first.resize(gel.mass.cols(), gel.mass.cols());
  levels.front().to_first.setIdentity();
  for (std::size_t k = 0; k < factors.size(); ++k) {
    if (progress) progress("mesh error", static_cast<std::int64_t>(k), static_cast<std::int64_t>(factors.size() + 2));
    try {
      levels.push_back({factors[k], ladder.with_edges(factors[k]), {}});
    } catch (const Error&) {
      continue;  // one level less to learn from
    }
    levels.back().to_first = field_transfer(levels.back().gel, gel);
  }
  if (levels.size() < 2) return {};
  MeshErrorTable table;
  table.smooth = measure_body(levels, ladder, false);
  if (progress)
    progress("mesh error", static_cast<std::int64_t>(factors.size() + 1),
             static_cast<std::int64_t>(factors.size() + 2));
  table.sharp = measure_body(levels, ladder, true);
  if (progress)
    progress("mesh error", static_cast<std::int64_t>(factors.size() + 2),
             static_cast<std::int64_t>(factors.size() + 2));
  return table;
}

}  // namespace touchstone::fem
