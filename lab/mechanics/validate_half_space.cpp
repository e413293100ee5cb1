// Contact with a half space: a gel so thick and wide that its plate and sides don't matter to half a percent.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "lab/press/mechanics_press.h"
#include "lab/validation/mechanics_rows.h"

namespace touchstone::lab {
namespace {

using Eigen::Vector3d;

constexpr double kCoarse = 0.2;  // edges under the contact, mm
constexpr double kFine = 0.1;

/// Worst error of the force over Poisson's ratios and depths, on the finest mesh; all meshes in the series.
MechanicsFinding hertz(const MechanicsGels& gels, const std::vector<double>& edges) {
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "worst relative error of the force", {}};
  for (const double edge : edges) {
    double worst = 0.0;
    for (double nu : {0.3, 0.4999}) {
      const fem::Compliance gel = gels.thick(nu, edge);
      for (double depth : {0.05, 0.1, 0.15}) {
        worst = std::max(worst, relative_error(normal_force(gel, fem::SphereShape{8.0}, 8.0 - depth),
                                               closed_forms::hertz_force(kValidationModulus, nu, 8.0, depth)));
      }
    }
    finding.series->points.emplace_back(edge, worst);
    finding.ours = worst;
  }
  return finding;
}

MechanicsFinding flat_punch(const MechanicsGels& gels, const std::vector<double>& edges) {
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "relative error of the mean force, worse nu", {}};
  for (const double edge : edges) finding.series->points.emplace_back(edge, 0.0);
  for (double nu : {0.3, 0.4999}) {
    const double reference = closed_forms::flat_punch_force(kValidationModulus, nu, 1.0, 0.02);
    std::vector<double> forces;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      forces.push_back(mean_flat_punch(gels.thick(nu, edges[k]), 1.0, 0.02, edges[k]));
      double& worst = finding.series->points[k].second;
      worst = std::max(worst, relative_error(forces.back(), reference));
    }
    finding.ours = std::max(finding.ours, relative_error(extrapolated(forces), reference));
  }
  return finding;
}

/// A sphere held by friction and sheared: normal and tangential loads don't couple at nu = 0.5, as the theory assumes.
struct ShearedSphere {
  static constexpr double kNu = 0.4999;
  static constexpr double kFriction = 0.3;
  static constexpr double kForce = 0.25;

  explicit ShearedSphere(const fem::Compliance& gel, double x = 0.0, double y = 0.0)
      : press(gel, fem::SphereShape{8.0}, kFriction), target(press_target(x, y, 0.0)), start(x) {
    target.axis[2] = fem::AxisControl::with_force(kForce);
    contact_radius = closed_forms::hertz_contact_radius(8.0, 8.0 - press.step(target).gel_from_object.translation.z());
  }

  /// Shear to this share of sliding.
  const fem::PressState& shear(double share) {
    target.axis[0] = fem::AxisControl::with_force(-share * kFriction * kForce);
    return press.step(target);
  }

  /// How far it has gone, over what the theory says.
  double displacement_over_theory(double share) {
    const double wanted = closed_forms::mindlin_displacement(kValidationModulus, kNu, contact_radius,
                                                             share * kFriction * kForce, kFriction, kForce);
    return (shear(share).gel_from_object.translation.x() - start) / wanted;
  }

  fem::Press press;
  fem::PressTarget target;
  double start = 0.0;
  double contact_radius = 0.0;
};

MechanicsFinding mindlin(const MechanicsGels& gels, double edge) {
  const fem::Compliance gel = gels.thick(ShearedSphere::kNu, edge);
  ShearedSphere sphere(gel);
  double worst = 0.0;
  for (double share : {0.3, 0.6, 0.9}) worst = std::max(worst, std::abs(sphere.displacement_over_theory(share) - 1.0));
  return {worst, {}};
}

/// Force over displacement at 5 % of sliding, the mean over places. Nearer to no force the slipping ring is much
/// thinner than an edge, all sticks, and the traction is that of a sharp edge: 1.5 % too stiff at 2 % of sliding.
MechanicsFinding tangential_stiffness(const MechanicsGels& gels, const std::vector<double>& edges) {
  constexpr int kPlaces = 3;
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "relative error of the mean stiffness", {}};
  for (const double edge : edges) {
    const fem::Compliance gel = gels.thick(ShearedSphere::kNu, edge);
    double sum = 0.0;
    for (int i = 0; i < kPlaces; ++i) {
      for (int j = 0; j < kPlaces; ++j) {
        ShearedSphere sphere(gel, edge * (i + 0.5) / kPlaces, std::sqrt(0.75) * edge * (j + 0.5) / kPlaces);
        sum += 1.0 / sphere.displacement_over_theory(0.05);
      }
    }
    finding.ours = std::abs(sum / (kPlaces * kPlaces) - 1.0);
    finding.series->points.emplace_back(edge, finding.ours);
  }
  return finding;
}

/// The radius of the circle whose area is that of the sticking vertices, over that of the touching ones.
MechanicsFinding stick_radius(const MechanicsGels& gels, double edge) {
  const fem::Compliance gel = gels.thick(ShearedSphere::kNu, edge);
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.rows());
  ShearedSphere sphere(gel);
  double worst = 0.0;
  for (double share : {0.3, 0.6, 0.9}) {
    const fem::PressState& state = sphere.shear(share);
    double sticking = 0.0;
    for (Eigen::Index i = 0; i < weight.size(); ++i) {
      if (state.node_state[i] == fem::NodeState::stick) sticking += weight[i];
    }
    const double wanted = closed_forms::mindlin_stick_ratio(share, 1.0, 1.0) * sphere.contact_radius;
    worst = std::max(worst, std::abs(std::sqrt(sticking / kPi) - wanted) / sphere.contact_radius);
  }
  return {worst, {}};
}

/// Surface displacements 0.7 to 1.2 mm from a force on one vertex; differences to those at the outer radius, so that
/// what the plate holds back below 60 mm falls out. Root mean square error over that of the closed form.
double point_force(const MechanicsGels& gels, double edge, int axis,
                   const std::function<Vector3d(double, double)>& closed_form) {
  const fem::Compliance gel = gels.thick(0.3, edge);
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.rows());
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  Eigen::Index source = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gel.vertices[i].norm() < gel.vertices[source].norm()) source = i;
  }
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * n);
  traction[3 * source + axis] = (axis == 2 ? -1.0 : 1.0) / weight[source];
  const Eigen::VectorXd response = gel.surface.times(traction);
  Eigen::MatrixX3d difference(n, 3);
  Eigen::MatrixX3d expected(n, 3);
  int rows = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d from = gel.vertices[i] - gel.vertices[source];
    if (from.norm() < 0.7 || from.norm() > 1.2) continue;
    const Vector3d found = response.segment<3>(3 * i) / weight[i];
    expected.row(rows) = closed_form(from.x(), from.y()).transpose();
    difference.row(rows) = found.transpose() - expected.row(rows);
    ++rows;
  }
  const Eigen::RowVector3d held_back = difference.topRows(rows).colwise().mean();
  const auto error = difference.topRows(rows).rowwise() - held_back;
  return error.norm() / expected.topRows(rows).norm();
}

MechanicsFinding boussinesq(const MechanicsGels& gels, double edge) {
  const double error = point_force(gels, edge, 2, [](double x, double y) {
    return closed_forms::boussinesq_displacement(kValidationModulus, 0.3, 1.0, x, y);
  });
  return {error, {}};
}

MechanicsFinding cerruti(const MechanicsGels& gels, double edge) {
  const double error = point_force(gels, edge, 0, [](double x, double y) {
    return closed_forms::cerruti_displacement(kValidationModulus, 0.3, 1.0, x, y);
  });
  return {error, {}};
}

}  // namespace

std::vector<MechanicsCase> half_space_cases(bool quick) {
  const std::vector<double> edges = quick ? std::vector<double>{kCoarse} : std::vector<double>{kCoarse, kFine};
  const double edge = edges.back();
  const std::string flat_mesh =
      quick ? "mean over places, 5 edges a radius" : "mean over places, extrapolated from 5 and 10 edges a radius";
  const double flat_bound = quick ? 0.035 : 0.01;
  const std::string mesh = fmt::format("edges of {} mm", edge);
  return {
      {"mechanics.hertz",
       fmt::format("a sphere on a thick gel, nu 0.3 and 0.4999, 3 to {:.0f} edges a contact radius", 1.1 / edge), 0.0,
       Better::lower, 0.01, [edges](const MechanicsGels& gels) { return hertz(gels, edges); }},
      {"mechanics.flat_punch", "a sharp flat punch on a thick gel, " + flat_mesh, 0.0, Better::lower, flat_bound,
       [edges](const MechanicsGels& gels) { return flat_punch(gels, edges); }},
      {"mechanics.cattaneo_mindlin", "a sheared sphere's displacement to 90 % of sliding, " + mesh, 0.0, Better::lower,
       0.01, [edge](const MechanicsGels& gels) { return mindlin(gels, edge); }},
      {"mechanics.tangential_stiffness",
       "a held sphere's tangential stiffness at 5 % of sliding, mean over places, " + mesh, 0.0, Better::lower, 0.01,
       [edges](const MechanicsGels& gels) { return tangential_stiffness(gels, edges); }},
      {"mechanics.stick_radius",
       "radius of the sticking vertices at 30, 60 and 90 % of sliding, over the contact radius; half an edge is "
       "allowed, " +
           mesh,
       0.0, Better::lower, 0.5 * edge / 1.04, [edge](const MechanicsGels& gels) { return stick_radius(gels, edge); }},
      // A force on one vertex is a cone of two edges, its response a mean over such a cone: at 0.7 mm some
      // (edge / 0.7)^2 / 4 of 1/r.
      {"mechanics.boussinesq", "a normal point force's surface displacement, 0.7 to 1.2 mm away, " + mesh, 0.0,
       Better::lower, quick ? 0.03 : 0.01, [edge](const MechanicsGels& gels) { return boussinesq(gels, edge); }},
      {"mechanics.cerruti", "a tangential point force's surface displacement, 0.7 to 1.2 mm away, " + mesh, 0.0,
       Better::lower, quick ? 0.03 : 0.01, [edge](const MechanicsGels& gels) { return cerruti(gels, edge); }},
  };
}

}  // namespace touchstone::lab
