#include "lab/studies/force_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "fem/contact/press.h"

namespace touchstone::lab {
namespace {

constexpr int kPressSteps = 5;
constexpr int kShearSteps = 3;
constexpr double kForceStep = 0.01;      // of the load, to either side
constexpr double kPlaceStep_mm = 0.02;   // likewise
constexpr double kStep_mm = 1e-3;        // of differences of projections
constexpr double kUndetermined = 1e-12;  // of the largest eigenvalue of the scaled information

struct Pressed {
  Eigen::VectorXd pixels;
  double z_mm = 0.0;
  double strain = 0.0;
};

Eigen::VectorXd as_rows(const Eigen::MatrixX2d& pixels) {
  Eigen::VectorXd rows(2 * pixels.rows());
  for (Eigen::Index i = 0; i < pixels.rows(); ++i) rows.segment<2>(2 * i) = pixels.row(i).transpose();
  return rows;
}

Pressed press_to(const fem::Compliance& gel, const BeadView& view, const fem::ContactShape& object, double friction,
                 double start_z_mm, const BoundLoad& load, bool strain) {
  const auto output = strain ? fem::PressOutput::fields : fem::PressOutput::forces;
  fem::Press press(gel, object, friction, {}, {}, output);
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(load.place_mm.x()), fem::AxisControl::at(load.place_mm.y()),
                 fem::AxisControl::at(start_z_mm)};
  press.step(target);
  for (int k = 1; k <= kPressSteps; ++k) {
    target.axis = {fem::AxisControl::with_force(0.0), fem::AxisControl::with_force(0.0),
                   fem::AxisControl::with_force(load.force_N.z() * k / kPressSteps)};
    press.step(target);
  }
  const Eigen::Vector2d shear = load.force_N.head<2>();
  for (int k = 1; k <= kShearSteps && !shear.isZero(0.0); ++k) {
    for (int a = 0; a < 2; ++a) target.axis[a] = fem::AxisControl::with_force(shear[a] * k / kShearSteps);
    press.step(target);
  }
  const fem::PressState& state = press.state();
  return {as_rows(bead_pixels(view, state.bead_displacement)), state.gel_from_object.translation.z(),
          state.largest_strain};
}

}  // namespace

ForceSensitivity force_sensitivity(const fem::Compliance& gel, const BeadView& view, const fem::ContactShape& object,
                                   double friction, double start_z_mm, const BoundLoad& load) {
  TS_ASSERT(load.force_N.z() > 0.0);
  const Pressed at = press_to(gel, view, object, friction, start_z_mm, load, true);
  ForceSensitivity found;
  found.pixels = at.pixels;
  found.force.resize(at.pixels.size(), 3);
  found.place.resize(at.pixels.size(), 2);
  found.depth_mm = start_z_mm - at.z_mm;
  found.largest_strain = at.strain;
  const auto slope = [&](auto&& change, double step) -> Eigen::VectorXd {
    BoundLoad more = load;
    BoundLoad less = load;
    change(more, step);
    change(less, -step);
    return (press_to(gel, view, object, friction, start_z_mm, more, false).pixels -
            press_to(gel, view, object, friction, start_z_mm, less, false).pixels) /
           (2.0 * step);
  };
  for (int a = 0; a < 3; ++a) {
    found.force.col(a) = slope([a](BoundLoad& of, double by) { of.force_N[a] += by; }, kForceStep * load.force_N.z());
  }
  for (int a = 0; a < 2; ++a) {
    found.place.col(a) = slope([a](BoundLoad& of, double by) { of.place_mm[a] += by; }, kPlaceStep_mm);
  }
  return found;
}

Eigen::VectorXd least_deviations(const Eigen::MatrixXd& sensitivity, const Eigen::VectorXd& deviation) {
  TS_ASSERT(sensitivity.rows() == deviation.size() && (deviation.array() > 0.0).all());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Index n = sensitivity.cols();
  const Eigen::MatrixXd weighted = deviation.cwiseInverse().asDiagonal() * sensitivity;
  // Unknowns of different units are scaled to equal information before what can't be identified is separated from
  // rounding.
  Eigen::VectorXd scale = weighted.colwise().norm();
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!(scale[k] > 0.0)) scale[k] = 1.0;
  }
  const Eigen::MatrixXd scaled = weighted * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd(scaled.transpose() * scaled));
  const double least = kUndetermined * std::max(eigen.eigenvalues().maxCoeff(), 1e-300);
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::ArrayXd part = eigen.eigenvectors().col(k).array().square();
    if (eigen.eigenvalues()[k] > least) {
      variance.array() += part / eigen.eigenvalues()[k];
    } else {
      for (Eigen::Index i = 0; i < n; ++i) {
        if (part[i] > kUndetermined) variance[i] = kInfinity;
      }
    }
  }
  return variance.cwiseSqrt().cwiseQuotient(scale);
}

ForceBound force_bound(const ForceSensitivity& sensitivity, const Eigen::VectorXd& deviation_px) {
  Eigen::MatrixXd both(sensitivity.force.rows(), 5);
  both << sensitivity.force, sensitivity.place;
  return {least_deviations(sensitivity.force, deviation_px), least_deviations(both, deviation_px).head<3>()};
}

Eigen::Matrix3Xd distribution_bound(const sensors::MarkerCompliance& compliance, const BeadView& view,
                                    const Eigen::VectorXd& deviation_px) {
  const auto beads = static_cast<Eigen::Index>(view.rest_mm.size());
  TS_ASSERT(compliance.displacement.rows() == 3 * beads);
  // Of each bead: pixels per mm.
  Eigen::MatrixXd pixels = Eigen::MatrixXd::Zero(2 * beads, 3 * beads);
  for (int a = 0; a < 3; ++a) {
    Eigen::MatrixX3d by = Eigen::MatrixX3d::Zero(beads, 3);
    by.col(a).setConstant(kStep_mm);
    const Eigen::MatrixX2d slope = (bead_pixels(view, by) - bead_pixels(view, -by)) / (2.0 * kStep_mm);
    for (Eigen::Index i = 0; i < beads; ++i) pixels.block<2, 1>(2 * i, 3 * i + a) = slope.row(i).transpose();
  }
  // Per force of a patch, which is its traction times its area.
  const Eigen::MatrixXd sensitivity = pixels * compliance.displacement / compliance.patch_area();
  const Eigen::VectorXd deviations = least_deviations(sensitivity, deviation_px);
  return Eigen::Map<const Eigen::Matrix3Xd>(deviations.data(), 3, deviations.size() / 3);
}

}  // namespace touchstone::lab
