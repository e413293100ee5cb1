#include "fem/vibration/vibration.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "fem/elements/surface_coupling.h"
#include "fem/vibration/eigenmodes.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Complex = std::complex<double>;
using Eigen::Vector3d;

constexpr double kDensity = 1.05e-9;  // tonne/mm^3
constexpr double kModulus = 0.33;     // MPa
const PronySeries kSeries = {{0.15, 0.0003}, {0.2, 0.002}};

/// A gel with one bead, its vibration, and the vertices of its face within a radius.
struct Gel {
  TetMesh mesh;
  ElasticMaterial material;
  std::vector<Bead> beads;
  Compliance compliance;

  Gel(TetMesh made, double nu, Vector3d bead, double radius)
      : mesh(std::move(made)),
        material{kModulus, nu},
        beads{{bead, radius}},
        compliance(compute_compliance(mesh, material, beads, 2.0)) {}

  GelVibration vibration(int count) const { return compute_vibration(mesh, material, beads, kDensity, count); }
  std::vector<int> within(double radius) const {
    std::vector<int> vertices;
    for (int v = 0; v < static_cast<int>(compliance.vertices.size()); ++v) {
      if (compliance.vertices[v].norm() < radius) vertices.push_back(v);
    }
    return vertices;
  }
};

const Gel& small_gel() {
  static const Gel gel(fixtures::box_mesh({3, 3, 2}, 3, 3, 2, 0.1), 0.45, {0.2, 0.1, -0.6}, 0.3);
  return gel;
}

/// A column that Poisson's ratio doesn't narrow: everything is a function of z alone.
const Gel& column() {
  static const Gel gel(fixtures::box_mesh({2, 2, 5}, 2, 2, 6, 0.1), 0.0, {0.0, 0.0, -2.0}, 0.5);
  return gel;
}

/// The answer without modes: the whole complex system, dense.
SteadyVibration direct(const Gel& gel, const std::vector<int>& patch, const Vector3d& amplitude, double omega,
                       const PronySeries& series) {
  const TaylorHoodSpace space = make_space(gel.mesh);
  const Scales scales = make_scales(gel.mesh, gel.material);
  const SymmetricEntries entries = assemble(space, scales);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(entries.size, entries.size);
  for (std::size_t k = 0; k < entries.values.size(); ++k) {
    all(entries.rows[k], entries.columns[k]) += entries.values[k];
    if (entries.rows[k] != entries.columns[k]) all(entries.columns[k], entries.rows[k]) += entries.values[k];
  }
  std::vector<int> free;
  std::vector<int> place(space.nodes, -1);
  for (int node = 0; node < space.nodes; ++node) {
    if (space.clamped[node]) continue;
    place[node] = static_cast<int>(free.size());
    for (int a = 0; a < 3; ++a) free.push_back(space.displacement[node] + a);
  }
  const Eigen::MatrixXd coupling = all(space.pressure, free);
  const Eigen::MatrixXd against = -all(space.pressure, space.pressure);
  Eigen::MatrixXd stiffness = all(free, free) + coupling.transpose() * against.llt().solve(coupling);
  stiffness *= scales.stress * scales.length;
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(stiffness.rows(), stiffness.cols());
  const Eigen::MatrixXd nodal = volume_mass(space);
  const Eigen::MatrixXd hats = surface_coupling(space, outer_surface(gel.mesh));
  const Eigen::MatrixXd means = bead_means(space, gel.beads);
  const auto p = static_cast<Eigen::Index>(patch.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * p, stiffness.cols());
  Eigen::MatrixXd bead = Eigen::MatrixXd::Zero(3, stiffness.cols());
  Eigen::VectorXd held(3 * p);
  const Eigen::VectorXd weight = hats.rowwise().sum();
  for (Eigen::Index j = 0; j < p; ++j) held.segment<3>(3 * j) = weight[patch[j]] * amplitude;
  for (int i = 0; i < space.nodes; ++i) {
    if (place[i] < 0) continue;
    for (int a = 0; a < 3; ++a) {
      for (int j = 0; j < space.nodes; ++j) {
        if (place[j] >= 0) mass(place[i] + a, place[j] + a) = kDensity * nodal(i, j);
      }
      for (Eigen::Index j = 0; j < p; ++j) rows(3 * j + a, place[i] + a) = hats(patch[j], i);
      bead(a, place[i] + a) = means(0, i);
    }
  }
  const Complex s = complex_modulus(series, omega);
  const Eigen::Index u = stiffness.rows();
  Eigen::MatrixXcd system = Eigen::MatrixXcd::Zero(u + 3 * p, u + 3 * p);
  system.topLeftCorner(u, u) = s * stiffness.cast<Complex>() - (omega * omega * mass).cast<Complex>();
  system.bottomLeftCorner(3 * p, u) = rows.cast<Complex>();
  system.topRightCorner(u, 3 * p) = -rows.transpose().cast<Complex>();
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(u + 3 * p);
  right.tail(3 * p) = held.cast<Complex>();
  const Eigen::VectorXcd found = system.partialPivLu().solve(right);
  SteadyVibration steady;
  for (Eigen::Index j = 0; j < p; ++j) steady.force -= weight[patch[j]] * found.segment<3>(u + 3 * j);
  steady.bead_displacement = (bead.cast<Complex>() * found.head(u)).transpose();
  return steady;
}

double force_error(const SteadyVibration& a, const SteadyVibration& b) {
  return (a.force - b.force).norm() / b.force.norm();
}

TEST(Vibration, TheModalAnswerIsTheDirectOneWithinItsStatedTruncation) {
  const Gel& gel = small_gel();
  const std::vector<int> patch = gel.within(1.2);
  ASSERT_GE(patch.size(), 4u);
  const GelVibration few = gel.vibration(10);
  const GelVibration many = gel.vibration(80);
  const double lowest = few.angular_frequency[0];
  for (const Vector3d& amplitude : {Vector3d(0, 0, -0.01), Vector3d(0.02, 0.01, 0.0)}) {
    for (const double part : {0.05, 0.3, 0.8}) {
      const double omega = part * lowest;
      const SteadyVibration wanted = direct(gel, patch, amplitude, omega, kSeries);
      const SteadyVibration rough = StuckPatch(gel.compliance, few, patch).answer(amplitude, omega, kSeries);
      const SteadyVibration fine = StuckPatch(gel.compliance, many, patch).answer(amplitude, omega, kSeries);
      EXPECT_LT(force_error(rough, wanted), rough.truncation + 1e-9) << part;
      EXPECT_LT(force_error(fine, wanted), fine.truncation + 1e-9) << part;
      EXPECT_LT(fine.truncation, rough.truncation);
      EXPECT_LT(fine.truncation, 0.02) << part;
      EXPECT_LT((fine.bead_displacement - wanted.bead_displacement).norm(), 0.01 * wanted.bead_displacement.norm());
    }
  }
}

TEST(Vibration, SlowMotionIsQuasiStatic) {
  const Gel& gel = small_gel();
  const GelVibration vibration = gel.vibration(10);
  const StuckPatch patch(gel.compliance, vibration, gel.within(1.2));
  const Vector3d amplitude(0.003, 0.0, -0.01);
  const SteadyVibration still = patch.answer(amplitude, 0.0, kSeries);
  EXPECT_EQ(still.force.imag().norm(), 0.0);
  EXPECT_EQ(still.truncation, 0.0);
  const double omega = 1e-3 * vibration.angular_frequency[0];
  const SteadyVibration slow = patch.answer(amplitude, omega, kSeries);
  const Complex change = complex_modulus(kSeries, omega) / lasting_share(kSeries);
  EXPECT_LT((slow.force - change * still.force).norm(), 1e-5 * still.force.norm());
  EXPECT_LT((slow.bead_displacement - still.bead_displacement).norm(), 1e-5 * still.bead_displacement.norm());
  // Without inertia the displacement doesn't know the modulus, at any frequency, and what sticks moves along.
  const SteadyVibration without = patch.without_inertia(amplitude, 1e4, kSeries);
  EXPECT_LT((without.bead_displacement - still.bead_displacement).norm(), 1e-12 * still.bead_displacement.norm());
  const Eigen::VectorXd weight = gel.compliance.mass * Eigen::VectorXd::Ones(gel.compliance.mass.rows());
  for (const int v : gel.within(1.2)) {
    const Eigen::Vector3cd mean = slow.surface_weighted.row(v).transpose() / weight[v];
    EXPECT_LT((mean - amplitude.cast<Complex>()).norm(), 1e-10);
  }
}

// nu = 0, the whole face shaken along z: F = A E k cot(k h) a with k = omega sqrt(rho / E), E complex; a point at
// height z over the plate moves by a sin(k z) / sin(k h), the mean over a bead's surface of radius r by sin(k r) / (k
// r) of that.
TEST(Vibration, AColumnAnswersAsTheWaveEquationSays) {
  const Gel& gel = column();
  const GelVibration vibration = gel.vibration(60);
  const StuckPatch patch(gel.compliance, vibration, gel.within(10.0));
  const Vector3d amplitude(0.0, 0.0, 0.01);
  const double first = 0.5 * kPi / 5.0 * std::sqrt(kModulus / kDensity);
  for (const double part : {0.1, 0.5, 1.0, 1.4}) {
    const double omega = part * first;
    const Complex modulus = kModulus * complex_modulus(kSeries, omega);
    const Complex k = omega * std::sqrt(kDensity / modulus);
    const Complex force = -4.0 * modulus * k / std::tan(k * 5.0) * 0.01;
    const SteadyVibration found = patch.answer(amplitude, omega, kSeries);
    const double scale = 4.0 * kModulus / 5.0 * 0.01;
    EXPECT_LT(std::abs(found.force.z() - force), 2e-3 * scale) << part << " " << found.truncation;
    EXPECT_LT(found.force.head<2>().norm(), 2e-3 * scale);
    const Complex bead = 0.01 * std::sin(k * 3.0) / std::sin(k * 5.0) * std::sin(k * 0.5) / (k * 0.5);
    EXPECT_LT(std::abs(found.bead_displacement(0, 2) - bead), 3e-3 * 0.01) << part;
  }
}

// One degree of freedom: a spring with a third of its own mass at its end (Rayleigh).
TEST(Vibration, ASlowColumnIsASpringWithAThirdOfItsMass) {
  const Gel& gel = column();
  const GelVibration vibration = gel.vibration(60);
  EXPECT_NEAR(vibration.mass, kDensity * 20.0, 1e-9 * vibration.mass);
  const StuckPatch patch(gel.compliance, vibration, gel.within(10.0));
  const double omega = 0.1 * vibration.angular_frequency[0];
  const Vector3d amplitude(0.0, 0.0, 1.0);
  const Complex missing =
      patch.answer(amplitude, omega, {}).force.z() - patch.without_inertia(amplitude, omega, {}).force.z();
  EXPECT_NEAR(missing.real() / (omega * omega), vibration.mass / 3.0, 0.01 * vibration.mass / 3.0);
}

TEST(Vibration, TheBeadsMoveMostAtTheEigenfrequencyOfTheGelWithThePatchHeld) {
  const Gel& gel = small_gel();
  const std::vector<int> patch = gel.within(1.2);
  const TaylorHoodSpace space = make_space(gel.mesh);
  // The lowest is a twist, which a translation doesn't drive; the two next sway along x and y.
  const Eigen::VectorXd modes = lowest_eigenmodes(space, gel.material, kDensity, 3, patch).angular_frequency;
  const double held = modes[1];
  const GelVibration vibration = gel.vibration(80);
  ASSERT_GT(modes[0], 1.02 * vibration.angular_frequency[0]);
  const StuckPatch shaken(gel.compliance, vibration, patch);
  double most = 0.0;
  double best = 0.0;
  for (double part = 0.6; part < 1.15; part += 0.0025) {
    // Little damping: 1 % at the held frequency.
    const SteadyVibration answer = shaken.answer({0.01, 0.004, 0.003}, part * held, {{0.02, 1.0 / held}});
    const double motion = answer.bead_displacement.norm();
    if (motion > most) {
      most = motion;
      best = part;
    }
  }
  EXPECT_NEAR(best, 1.0, 0.005);
}

TEST(Vibration, TheForceLeadsByTheLossAngleAndTheGelTakesEnergy) {
  const Gel& gel = small_gel();
  const GelVibration vibration = gel.vibration(40);
  const StuckPatch patch(gel.compliance, vibration, gel.within(1.2));
  for (const double part : {0.01, 0.3, 0.9, 1.0, 1.3, 2.0}) {
    const double omega = part * vibration.angular_frequency[0];
    const SteadyVibration answer = patch.answer({0.0, 0.0, 0.01}, omega, kSeries);
    EXPECT_GT(-answer.force.z().imag(), 0.0) << part;  // the body's own force on the gel is ahead of its motion
  }
  const double slow = 0.01 * vibration.angular_frequency[0];
  EXPECT_NEAR(std::arg(-patch.answer({0.0, 0.0, 0.01}, slow, kSeries).force.z()),
              std::arg(complex_modulus(kSeries, slow)), 1e-4);
}

TEST(Vibration, ModesAddUpToTheStaticCompliance) {
  const Gel& gel = small_gel();
  const GelVibration vibration = gel.vibration(100);
  double before = gel.compliance.surface.view().norm();
  for (const int count : {10, 30, 100}) {
    const auto modes = vibration.surface.leftCols(count);
    const Eigen::VectorXd inverse = vibration.angular_frequency.head(count).cwiseAbs2().cwiseInverse();
    const Eigen::MatrixXd left = gel.compliance.surface.view() - modes * inverse.asDiagonal() * modes.transpose();
    EXPECT_LT(left.norm(), before);
    before = left.norm();
    EXPECT_GT(left.llt().info() == Eigen::Success, 0) << "what is left is positive definite";
  }
  EXPECT_LT(before, 0.05 * gel.compliance.surface.view().norm());
  EXPECT_LT(vibration.effective_mass.rowwise().sum().maxCoeff(), vibration.mass);
  EXPECT_GT(vibration.effective_mass.rowwise().sum().minCoeff(), 0.7 * vibration.mass);
}

TEST(Vibration, AWideLayerShearsAtAQuarterWave) {
  EXPECT_NEAR(layer_shear_frequency({0.33, 0.49}, 1.05e-9, 5.0), 513.5, 0.5);
  const TetMesh mesh = fixtures::box_mesh({12, 12, 1}, 8, 8, 1);
  const double wanted = 2.0 * kPi * layer_shear_frequency({kModulus, 0.45}, kDensity, 1.0);
  const GelVibration vibration = compute_vibration(mesh, {kModulus, 0.45}, {}, kDensity, 2);
  EXPECT_LT(vibration.angular_frequency[0], wanted);
  EXPECT_GT(vibration.angular_frequency[0], 0.95 * wanted);
}

TEST(Vibration, APatchWithoutVerticesAndAnotherGelsModesAreRefused) {
  const GelVibration vibration = small_gel().vibration(2);
  EXPECT_THROW(StuckPatch(small_gel().compliance, vibration, {}), Error);
  EXPECT_THROW(StuckPatch(small_gel().compliance, column().vibration(3), {0}), Error) << "modes of another gel";
}

}  // namespace
}  // namespace touchstone::fem
