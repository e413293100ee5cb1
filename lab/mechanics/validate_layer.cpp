// Layers of gel bonded to a plate: contact, loads all over the face, and blocks between two plates.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "lab/press/mechanics_press.h"
#include "lab/statistics/straight_line.h"
#include "lab/validation/mechanics_rows.h"

namespace touchstone::lab {
namespace {

using Eigen::Vector3d;

/// A sphere of 8 mm radius on the layer of 5 mm: worst error against the integral equations.
MechanicsFinding sphere_errors(const MechanicsGels& gels, const std::vector<double>& ratios,
                               const std::vector<double>& depths) {
  double worst = 0.0;
  for (const double nu : ratios) {
    const fem::Compliance gel = gels.layer(nu);
    for (const double depth : depths) {
      worst =
          std::max(worst, relative_error(normal_force(gel, fem::SphereShape{8.0}, 8.0 - depth),
                                         closed_forms::sphere_on_layer(kValidationModulus, nu, 5.0, 8.0, depth).force));
    }
  }
  return {worst, {}};
}

constexpr double kPunch = 2.0;  // mm
constexpr double kPunchDepth = 0.1;

/// A sharp flat punch on the layer of 5 mm, meshes of these edges (two: the force extrapolated), against `wanted(nu)`.
MechanicsFinding flat_errors(const MechanicsGels& gels, const std::vector<double>& edges,
                             const std::vector<double>& ratios, const std::function<double(double)>& wanted) {
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "relative error of the mean force, worse nu", {}};
  for (const double edge : edges) finding.series->points.emplace_back(edge, 0.0);
  for (const double nu : ratios) {
    std::vector<double> forces;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      forces.push_back(mean_flat_punch(gels.layer(nu, edges[k]), kPunch, kPunchDepth, edges[k]));
      double& worst = finding.series->points[k].second;
      worst = std::max(worst, relative_error(forces.back(), wanted(nu)));
    }
    finding.ours = std::max(finding.ours, relative_error(extrapolated(forces), wanted(nu)));
  }
  return finding;
}

double layer_punch_force(double nu) {
  return closed_forms::flat_punch_on_layer(kValidationModulus, nu, 5.0, kPunch, kPunchDepth).force;
}

double hayes_force(double nu) {
  const double shear_modulus = kValidationModulus / (2.0 * (1.0 + nu));
  return 4.0 * shear_modulus * kPunch * closed_forms::hayes_kappa(kPunch / 5.0) * kPunchDepth / (1.0 - nu);
}

MechanicsFinding dimitriadis(const MechanicsGels& gels) {
  constexpr double kRadius = 20.0;
  constexpr double kDepth = 0.05;  // chi = sqrt(R d) / h = 0.2
  return {relative_error(normal_force(gels.layer(0.5), fem::SphereShape{kRadius}, kRadius - kDepth),
                         closed_forms::dimitriadis_force(kValidationModulus, kRadius, 5.0, kDepth)),
          {}};
}

/// A layer of 1 mm under a contact of some 9 mm radius, incompressible.
MechanicsFinding thin_layer(const MechanicsGels& gels, double edge) {
  constexpr double kRadius = 1000.0;
  constexpr double kDepth = 0.025;
  const fem::Compliance gel = gels.slab({24.0, 24.0, 1.0, edge, edge, 12.0, 12.0, 1.0}, 0.5);
  return {relative_error(normal_force(gel, fem::SphereShape{kRadius}, kRadius - kDepth),
                         closed_forms::sphere_on_layer(kValidationModulus, 0.5, 1.0, kRadius, kDepth).force),
          {}};
}

/// How far the formula for contacts much wider than the layer is from the integral equations, which know no such
/// limit; at a = 20 h.
MechanicsFinding thin_layer_formula(const MechanicsGels&) {
  MechanicsFinding finding;
  finding.series = ValidationSeries{"thickness over the formula's contact radius", "the formula's error", {}};
  for (const double ratio : {5.0, 10.0, 15.0, 20.0}) {
    const double radius = 100.0 * ratio * ratio;
    const double depth = ratio * ratio / (4.0 * radius);
    const double exact = closed_forms::sphere_on_layer(kValidationModulus, 0.5, 1.0, radius, depth).force;
    finding.ours = relative_error(closed_forms::thin_layer_force(kValidationModulus, radius, 1.0, depth), exact);
    finding.series->points.emplace_back(1.0 / ratio, finding.ours);
  }
  return finding;
}

/// The force's error on a wide layer, root mean square over places on the mesh, with ever shorter edges; the order is
/// that of the straight line through all of it.
MechanicsFinding order_of_force(const MechanicsGels& gels, const std::vector<double>& edges) {
  constexpr double kDepth = 0.5;
  constexpr int kPlaces = 3;
  const double wanted = closed_forms::sphere_on_layer(kValidationModulus, 0.49, 5.0, 8.0, kDepth).force;
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "relative error of the force", {}};
  std::vector<double> log_edges, log_errors;
  for (const double edge : edges) {
    const fem::Compliance gel = gels.slab({60.0, 60.0, 5.0, edge, 4.0, 3.0, 3.0, 1.0}, 0.49);
    double squares = 0.0;
    for (int i = 0; i < kPlaces; ++i) {
      for (int j = 0; j < kPlaces; ++j) {
        fem::Press press(gel, fem::SphereShape{8.0}, 0.0);
        const double x = edge * (i + 0.5) / kPlaces;
        const double y = std::sqrt(0.75) * edge * (j + 0.5) / kPlaces;
        const double error = press.step(press_target(x, y, 8.0 - kDepth)).wrench[2] / wanted - 1.0;
        squares += error * error;
      }
    }
    const double error = std::sqrt(squares) / kPlaces;
    finding.series->points.emplace_back(edge, error);
    log_edges.push_back(std::log(edge));
    log_errors.push_back(std::log(error));
  }
  finding.ours = line_through(log_edges, log_errors).slope;
  return finding;
}

/// Displacement of the middle of the face under the tractions `load`: mean over the hats within 1 mm of the origin of
/// component `axis` over `shape`, least squares.
double response_in_the_middle(const fem::Compliance& gel, int axis,
                              const std::function<double(const Vector3d&)>& load) {
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(n);
  Eigen::VectorXd nodal(n);
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) traction[3 * i + axis] = nodal[i] = load(gel.vertices[i]);
  const Eigen::VectorXd response = gel.surface.times(traction);
  const Eigen::VectorXd means = gel.mass * nodal;  // of the load, over the hats
  double product = 0.0;
  double square = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gel.vertices[i].norm() > 2.0) continue;
    product += response[3 * i + axis] * means[i] / (weight[i] * weight[i]);
    square += means[i] * means[i] / (weight[i] * weight[i]);
  }
  return product / square;
}

/// A wide block under even pressure is confined, under even shear it shears.
MechanicsFinding block(const MechanicsGels& gels) {
  double worst = 0.0;
  for (double nu : {0.0, 0.3}) {
    const fem::Compliance gel = gels.even(nu);
    const double shear_modulus = kValidationModulus / (2.0 * (1.0 + nu));
    const double confined = 2.0 * shear_modulus * (1.0 - nu) / (1.0 - 2.0 * nu);
    const auto even = [](const Vector3d&) { return 1.0; };
    worst = std::max(worst, relative_error(response_in_the_middle(gel, 2, even), gel.thickness / confined));
    worst = std::max(worst, relative_error(response_in_the_middle(gel, 0, even), gel.thickness / shear_modulus));
  }
  return {worst, {}};
}

/// A pressure cos(kx) on the layer, whose free sides have an effect far into an almost incompressible one, at wave
/// numbers 1 and 1.5 over the thickness.
MechanicsFinding wavy(const MechanicsGels& gels, double width) {
  double worst = 0.0;
  for (double nu : {0.3, 0.49}) {
    const fem::Compliance gel = gels.even(nu, width);
    for (double q : {1.0, 1.5}) {
      const double k = q / gel.thickness;
      const double wanted = 2.0 * (1.0 - nu * nu) / (kValidationModulus * k) * closed_forms::bonded_layer_kernel(nu, q);
      const auto waves = [k](const Vector3d& x) { return std::cos(k * x.x()); };
      worst = std::max(worst, relative_error(response_in_the_middle(gel, 2, waves), wanted));
    }
  }
  return {worst, {}};
}

/// A disc of 1 mm thickness, bonded at z = -1, of `rings` elements along its radius and `layers` through its thickness:
/// squares of vertices bent to circles (|x|, |y| <= 1 goes to its largest coordinate as radius), cut into boxes of six
/// tetrahedra. Mirrored in both planes, so that no element has two edges on the rim. The polygon has the disc's area.
fem::TetMesh disc(double radius, int rings, int layers) {
  fem::TetMesh mesh;
  const int side = 2 * rings + 1;
  const auto index = [=](int i, int j, int k) { return (k * side + j + rings) * side + i + rings; };
  const double step = kPi / (4.0 * rings);  // of the angle along the rim
  const double rim = radius * std::sqrt(step / std::sin(step));
  for (int k = 0; k <= layers; ++k) {
    for (int j = -rings; j <= rings; ++j) {
      for (int i = -rings; i <= rings; ++i) {
        const double largest = std::max(std::abs(i), std::abs(j));
        Vector3d x(0.0, 0.0, static_cast<double>(k) / layers - 1.0);
        if (largest > 0.0) {
          const bool along_x = std::abs(i) >= std::abs(j);
          const double angle = kPi / 4.0 * (along_x ? j : i) / largest;  // from the nearer axis
          const double r = rim * largest / rings;
          const double main = r * std::cos(angle) * ((along_x ? i : j) > 0 ? 1.0 : -1.0);
          (along_x ? x.x() : x.y()) = main;
          (along_x ? x.y() : x.x()) = r * std::sin(angle);
        }
        mesh.vertices.push_back(x);
      }
    }
  }
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k < layers; ++k) {
    for (int j = 0; j < rings; ++j) {
      for (int i = 0; i < rings; ++i) {
        for (const auto& order : kOrders) {
          for (const int sign_x : {1, -1}) {
            for (const int sign_y : {1, -1}) {
              std::array<int, 3> corner = {i, j, k};
              std::array<int, 4> tetrahedron = {index(sign_x * i, sign_y * j, k), 0, 0, 0};
              for (int edge = 0; edge < 3; ++edge) {
                ++corner[order[edge]];
                tetrahedron[edge + 1] = index(sign_x * corner[0], sign_y * corner[1], corner[2]);
              }
              if (fem::volume(mesh, tetrahedron) < 0.0) std::swap(tetrahedron[2], tetrahedron[3]);
              mesh.tetrahedra.push_back(tetrahedron);
            }
          }
        }
      }
    }
  }
  for (const auto& face : fem::boundary_faces(mesh)) {
    const auto level = [&](double z) {
      return std::all_of(face.begin(), face.end(), [&](int v) { return mesh.vertices[v].z() == z; });
    };
    if (level(0.0)) mesh.outer.push_back(face);
    if (level(-1.0)) mesh.bonded.push_back(face);
  }
  return mesh;
}

/// Apparent modulus of a disc of this radius and 1 mm thickness between two plates, bonded to both.
double apparent_modulus(double radius, int rings, int layers) {
  constexpr double kSqueeze = 0.01;
  const fem::Compliance gel = fem::compute_compliance(disc(radius, rings, layers), {kValidationModulus, 0.5}, {}, 1.0);
  const fem::BoxShape plate{Vector3d(3.0 * radius, 3.0 * radius, 1.0)};
  fem::Press press(gel, plate, std::numeric_limits<double>::infinity());
  const double force = press.step(press_target(0.0, 0.0, 0.5 - kSqueeze)).wrench[2];
  return force / (kPi * radius * radius * kSqueeze);
}

MechanicsFinding gent_lindley(double radius) {
  return {relative_error(apparent_modulus(radius, 12, 3),
                         closed_forms::gent_lindley_modulus(kValidationModulus, radius, 1.0)),
          {}};
}

}  // namespace

std::vector<MechanicsCase> layer_cases(bool quick) {
  // Below 0.4 mm what is left, some 0.05 %, is the mesh further out, which isn't made finer with the rest.
  const std::vector<double> edges =
      quick ? std::vector<double>{1.2, 0.8, 0.5} : std::vector<double>{1.2, 1.0, 0.8, 0.6, 0.5, 0.4};
  const std::vector<double> flat_edges = quick ? std::vector<double>{0.8, 0.4} : std::vector<double>{0.4, 0.2};
  const std::string flat_mesh = fmt::format("mean over 16 places, extrapolated from {} and {} edges a radius",
                                            kPunch / flat_edges[0], kPunch / flat_edges[1]);
  const double flat_bound = quick ? 0.02 : 0.01;
  const std::vector<double> nearly = quick ? std::vector<double>{0.5} : std::vector<double>{0.4999, 0.5};
  const double wavy_width = quick ? 24.0 : 36.0;
  const double thin_edge = quick ? 0.8 : 0.6;
  return {
      {"mechanics.locking",
       fmt::format("a sphere on a bonded layer at nu {} against integral equations", fmt::join(nearly, " and ")), 0.0,
       Better::lower, 0.01,
       [nearly](const MechanicsGels& gels) {
         return sphere_errors(gels, nearly, {0.3, 0.5});
       }},
      {"mechanics.layer_sphere", "a sphere on a bonded layer, nu 0.3 and 0.49, against integral equations", 0.0,
       Better::lower, 0.01,
       [](const MechanicsGels& gels) {
         return sphere_errors(gels, {0.3, 0.49}, {0.3, 0.5});
       }},
      // Where contact ends the displacement is smooth up to H^(5/2) only, so that quadratic elements reach order 3/2 in
      // the energy's norm [Belhachmi2003]; twice that in the energy, whose derivative the force is.
      {"mechanics.order_force",
       fmt::format("order of the force's error in the edge length, {} to {} mm, a sphere on a bonded layer",
                   edges.front(), edges.back()),
       3.0, Better::higher, 2.0, [edges](const MechanicsGels& gels) { return order_of_force(gels, edges); }},
      {"mechanics.layer_flat",
       "a flat punch on a bonded layer, nu 0.3 and 0.49, against integral equations, " + flat_mesh, 0.0, Better::lower,
       flat_bound,
       [flat_edges](const MechanicsGels& gels) {
         return flat_errors(gels, flat_edges, {0.3, 0.49}, layer_punch_force);
       }},
      {"mechanics.hayes", "a flat punch on a bonded layer, nu 0.3, a/h 0.4, against [Hayes1972], " + flat_mesh, 0.0,
       Better::lower, flat_bound,
       [flat_edges](const MechanicsGels& gels) { return flat_errors(gels, flat_edges, {0.3}, hayes_force); }},
      {"mechanics.dimitriadis",
       "a sphere on an incompressible bonded layer, chi 0.2, where [Dimitriadis2002] itself is 1.1 % low", 0.0,
       Better::lower, 0.02, dimitriadis},
      {"mechanics.thin_layer",
       fmt::format("a sphere on a thin incompressible layer, a/h 9, against integral equations, edges of {} h",
                   thin_edge),
       0.0, Better::lower, 0.01, [thin_edge](const MechanicsGels& gels) { return thin_layer(gels, thin_edge); }},
      {"mechanics.thin_layer_formula",
       "pi E a^6/(96 R h^3), a = 2 sqrt(R d), against integral equations at a/h 20 (15 % off at 10)", 0.0,
       Better::lower, 0.05, thin_layer_formula},
      {"mechanics.gent_lindley", "a disc bonded between plates, nu 0.5, S = 1, against E (1 + 2 S^2)", 0.0,
       Better::lower, 0.01, [](const MechanicsGels&) { return gent_lindley(2.0); }},
      {"mechanics.gent_lindley_wide",
       "the same at S = 2.5, where the formula itself is some 2 % high (finer meshes lead away from it)", 0.0,
       Better::lower, 0.025, [](const MechanicsGels&) { return gent_lindley(5.0); }},
      {"mechanics.block", "a wide block under even pressure and shear", 0.0, Better::lower, 0.01, block},
      {"mechanics.wavy",
       fmt::format("a wavy pressure on a bonded layer, nu 0.3 and 0.49, half-width {} thicknesses", 0.25 * wavy_width),
       0.0, Better::lower, quick ? 0.02 : 0.01,
       [wavy_width](const MechanicsGels& gels) { return wavy(gels, wavy_width); }},
  };
}

}  // namespace touchstone::lab
