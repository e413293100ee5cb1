#include "fem/vibration/vibration.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/units.h"
#include "fem/contact/contact_block.h"
#include "fem/contact/cut_compliance.h"
#include "fem/elements/dense_factor.h"
#include "fem/elements/surface_coupling.h"
#include "fem/vibration/eigenmodes.h"

namespace touchstone::fem {
namespace {

using Complex = std::complex<double>;

/// Reciprocal condition below which an answer has lost ten digits: nearer to an undamped resonance it is rounding.
constexpr double kLeastCondition = 1e-10;

/// Rows over nodes, times modes: three rows of the result for each.
Eigen::MatrixXd seen_by(const Eigen::SparseMatrix<double>& rows, const Eigen::MatrixXd& displacement) {
  Eigen::MatrixXd seen(3 * rows.rows(), displacement.cols());
  for (Eigen::Index k = 0; k < displacement.cols(); ++k) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::VectorXd component = displacement.col(k)(Eigen::seqN(a, rows.cols(), Eigen::fix<3>));
      seen.col(k)(Eigen::seqN(a, rows.rows(), Eigen::fix<3>)) = rows * component;
    }
  }
  return seen;
}

Eigen::MatrixX3cd by_rows(const Eigen::VectorXcd& stacked) {
  Eigen::MatrixX3cd rows(stacked.size() / 3, 3);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = stacked.segment<3>(3 * i).transpose();
  return rows;
}

/// The compliance among these vertices with what cut hats change in it, in the gel's axes. That is near them alone,
/// where inertia has no say.
Eigen::MatrixXd compliance_among(const std::vector<int>& vertices, const CutHats& cuts, const Compliance& gel) {
  const ContactSurface surface(gel);
  ContactBlock block(gel, surface);
  block.hold(vertices);
  Eigen::MatrixXd own = block.compliance();
  add_cut_compliance(own, cuts, surface, gel, vertices, block.axes(), false);
  Eigen::MatrixXd result(own.rows(), own.cols());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (std::size_t j = 0; j < vertices.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      const auto column = static_cast<Eigen::Index>(3 * j);
      result.block<3, 3>(row, column) =
          block.axes(vertices[i]) * own.block<3, 3>(row, column) * block.axes(vertices[j]).transpose();
    }
  }
  return result;
}

/// A real matrix times a complex vector.
Eigen::VectorXcd times(const Eigen::MatrixXd& a, const Eigen::VectorXcd& x) {
  Eigen::VectorXcd result(a.rows());
  result.real() = a * x.real();
  result.imag() = a * x.imag();
  return result;
}

}  // namespace

GelVibration compute_vibration(const TetMesh& mesh, const ElasticMaterial& material, std::span<const Bead> beads,
                               double density, int count, std::span<const int> held) {
  const std::vector<ElasticMaterial> materials(static_cast<std::size_t>(region_count(mesh)), material);
  return compute_vibration(mesh, materials, beads, density, count, held);
}

GelVibration compute_vibration(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                               std::span<const Bead> beads, double density, int count, std::span<const int> held) {
  const TaylorHoodSpace space = make_space(mesh, materials);
  const Eigenmodes modes = lowest_eigenmodes(space, materials, density, count, held);
  GelVibration vibration;
  vibration.angular_frequency = modes.angular_frequency;
  vibration.surface = seen_by(surface_coupling(space, outer_surface(mesh)), modes.displacement);
  vibration.beads = seen_by(bead_means(space, beads), modes.displacement);
  const Eigen::SparseMatrix<double> mass = density * volume_mass(space);
  const Eigen::MatrixXd total = Eigen::RowVectorXd::Ones(space.nodes) * mass;
  vibration.effective_mass = seen_by(total.sparseView(), modes.displacement).cwiseAbs2();
  vibration.mass = mass.sum();
  return vibration;
}

double layer_shear_frequency(const ElasticMaterial& material, double density, double thickness) {
  return std::sqrt(shear_modulus(material) / density) / (4.0 * thickness);
}

struct StuckPatch::Parts {
  Parts(const Compliance& compliance, const GelVibration& modes, const std::vector<int>& vertices, const CutHats* cuts)
      : gel(compliance), vibration(modes) {
    if (vertices.empty()) fail("a body that shakes the gel must stick to at least one vertex of its surface");
    if (vibration.surface.rows() != gel.surface.rows()) {
      fail("the modes have {} rows and the gel's surface {}: they are of different gels", vibration.surface.rows(),
           gel.surface.rows());
    }
    const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.rows());
    const auto p = static_cast<Eigen::Index>(vertices.size());
    rigid = Eigen::MatrixX3d::Zero(3 * p, 3);
    for (Eigen::Index j = 0; j < p; ++j) {
      const int v = vertices[j];
      TS_ASSERT(v >= 0 && v < gel.mass.rows());
      for (int a = 0; a < 3; ++a) {
        rows.push_back(3 * v + a);
        rigid(3 * j + a, a) = weight[v];
      }
    }
    const Eigen::MatrixXd block =
        cuts != nullptr ? compliance_among(vertices, *cuts, gel) : gel.surface.block(vertices, vertices);
    DenseCholesky factor;
    if (!factor.compute(block)) fail("the gel's surface compliance isn't positive definite");
    modal = vibration.surface(rows, Eigen::all);
    from_rigid = factor.solve(rigid);
    from_modal = factor.solve(modal);
    overlap = modal.transpose() * from_modal;
    compliance_here = block;
  }

  SteadyVibration answer(const Eigen::Vector3d& amplitude, double omega, const PronySeries& relaxation,
                         bool inertia) const;

  const Compliance& gel;
  const GelVibration& vibration;
  std::vector<int> rows;   // of the patch, in the surface's freedoms
  Eigen::MatrixX3d rigid;  // weighted displacement by a unit translation
  Eigen::MatrixXd modal;   // modes at the patch
  Eigen::MatrixXd compliance_here;
  Eigen::MatrixXd from_rigid;  // H0^-1 of both
  Eigen::MatrixXd from_modal;
  Eigen::MatrixXd overlap;  // modal^T H0^-1 modal
};

SteadyVibration StuckPatch::Parts::answer(const Eigen::Vector3d& amplitude, double omega, const PronySeries& relaxation,
                                          bool inertia) const {
  TS_ASSERT(omega >= 0.0 && std::isfinite(omega));
  const Complex s = complex_modulus(relaxation, omega);
  const Eigen::ArrayXd squares = vibration.angular_frequency.array().square();
  const double turn = inertia ? omega * omega : 0.0;
  // (H0/s + W D W^T)^-1 by Woodbury's formula, with (s D)^-1 = omega_k^2 (s omega_k^2 - omega^2) / omega^2, which stays
  // finite at an undamped resonance.
  const Eigen::VectorXd still = from_rigid * amplitude;
  Eigen::VectorXcd traction = s * still.cast<Complex>();
  Eigen::VectorXcd weights = Eigen::VectorXcd::Zero(squares.size());  // D W^T traction
  if (turn > 0.0 && squares.size() > 0) {
    Eigen::MatrixXcd inner = overlap.cast<Complex>();
    inner.diagonal().array() += squares * (s * squares - turn) / turn;
    // Modes of one size, or the condition would be that of their frequencies.
    const Eigen::VectorXd scale =
        (overlap.diagonal().array().abs() + (squares * (std::abs(s) * squares + turn) / turn)).sqrt().inverse();
    inner = (scale.asDiagonal() * inner * scale.asDiagonal()).eval();
    const Eigen::PartialPivLU<Eigen::MatrixXcd> factor(inner);
    if (!(factor.rcond() > kLeastCondition)) {
      fail(
          "at {:.6g} Hz the gel under the body that sticks to it resonates and nothing damps it: there is no steady "
          "vibration. Allowed is another frequency, or a gel that relaxes",
          omega / (2.0 * kPi));
    }
    const Eigen::VectorXd push = modal.transpose() * still;
    weights = scale.asDiagonal() * factor.solve((scale.asDiagonal() * push).cast<Complex>());
    traction -= s * times(from_modal, weights);
  }
  SteadyVibration steady;
  Eigen::VectorXcd all = Eigen::VectorXcd::Zero(gel.surface.rows());
  for (std::size_t j = 0; j < rows.size(); ++j) all[rows[j]] = traction[static_cast<Eigen::Index>(j)];
  steady.traction = by_rows(all);
  steady.force = -(rigid.transpose().cast<Complex>() * traction);
  const Eigen::VectorXcd moving = all / s;
  Eigen::VectorXcd surface = gel.surface.times(moving.real()) + Complex(0.0, 1.0) * gel.surface.times(moving.imag());
  Eigen::VectorXcd beads = Eigen::VectorXcd::Zero(gel.beads.rows());
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const Complex t = traction[static_cast<Eigen::Index>(j)] / s;
    beads += t * gel.beads.view().col(rows[j]);
  }
  if (turn > 0.0) {
    surface += times(vibration.surface, weights);
    beads += times(vibration.beads, weights);
  }
  steady.surface_weighted = by_rows(surface);
  steady.bead_displacement = by_rows(beads);

  const double work = std::abs(steady.force.dot(amplitude.cast<Complex>()));
  if (turn > 0.0 && work > 0.0) {
    steady.truncation = std::numeric_limits<double>::infinity();
    const double last = squares.size() > 0 ? squares[squares.size() - 1] : 0.0;
    if (std::abs(s) * last > turn) {
      const Eigen::VectorXcd through = times(compliance_here, traction);
      const Eigen::VectorXcd seen = times(modal.transpose(), traction);
      const double left = traction.dot(through).real() - (seen.cwiseAbs2().array() / squares).sum();
      steady.truncation = std::max(0.0, left) * turn / (std::abs(s) * (std::abs(s) * last - turn)) / work;
    }
  }
  return steady;
}

StuckPatch::StuckPatch(const Compliance& gel, const GelVibration& vibration, std::vector<int> vertices,
                       const CutHats* cuts)
    : parts_(std::make_unique<const Parts>(gel, vibration, vertices, cuts)) {}
StuckPatch::~StuckPatch() = default;
StuckPatch::StuckPatch(StuckPatch&&) noexcept = default;
StuckPatch& StuckPatch::operator=(StuckPatch&&) noexcept = default;

SteadyVibration StuckPatch::answer(const Eigen::Vector3d& amplitude, double angular_frequency,
                                   const PronySeries& relaxation) const {
  return parts_->answer(amplitude, angular_frequency, relaxation, true);
}

SteadyVibration StuckPatch::without_inertia(const Eigen::Vector3d& amplitude, double angular_frequency,
                                            const PronySeries& relaxation) const {
  return parts_->answer(amplitude, angular_frequency, relaxation, false);
}

}  // namespace touchstone::fem
