#include "sim/press/shaken_press.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr double kMostTruncation = 0.05;  // of the force's amplitude

}  // namespace

struct ShakenPress::Parts {
  const fem::Compliance& gel;
  const fem::GelVibration& vibration;
  fem::PronySeries relaxation;
  double friction;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> mass;

  // The answer to a vibration with amplitude 1 on the last patch.
  std::vector<int> vertices;
  std::shared_ptr<const fem::CutHats> cuts;
  std::optional<fem::StuckPatch> patch;

  fem::SteadyVibration answer(const fem::PressState& mean, const VibrationSpec& shaking);
  void refuse_unless_it_holds(const fem::PressState& mean, const fem::SteadyVibration& steady,
                              const VibrationSpec& shaking) const;
};

fem::SteadyVibration ShakenPress::Parts::answer(const fem::PressState& mean, const VibrationSpec& shaking) {
  std::vector<int> touching;
  for (std::size_t v = 0; v < mean.node_state.size(); ++v) {
    if (mean.node_state[v] != fem::NodeState::open) touching.push_back(static_cast<int>(v));
  }
  if (!patch || touching != vertices || mean.cuts != cuts) {
    vertices = touching;
    cuts = mean.cuts;
    patch.emplace(gel, vibration, touching, cuts.get());
  }
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();
  amplitude[static_cast<int>(shaking.axis)] = shaking.amplitude_mm;
  return patch->answer(amplitude, 2.0 * kPi * shaking.frequency_Hz, relaxation);
}

void ShakenPress::Parts::refuse_unless_it_holds(const fem::PressState& mean, const fem::SteadyVibration& steady,
                                                const VibrationSpec& shaking) const {
  if (steady.truncation > kMostTruncation) {
    fail(
        "a vibration at {:.4g} Hz is too fast for the gel's {} modes, which end at {:.4g} Hz, or too near a resonance: "
        "those that are left out would change its force by {:.2g} of it; allowed is {}",
        shaking.frequency_Hz, vibration.angular_frequency.size(),
        vibration.angular_frequency.tail<1>()[0] / (2.0 * kPi), steady.truncation, kMostTruncation);
  }
  const Eigen::Vector3d shaken = steady.force.cwiseAbs();
  if (shaken.z() >= mean.wrench[2]) {
    fail("a vibration of {:.4g} mm changes the normal force of {:.4g} N by {:.4g} N: the object would lift off",
         shaking.amplitude_mm, mean.wrench[2], shaken.z());
  }
  const double shear = shaken.head<2>().norm() + mean.wrench.head<2>().norm();
  if (shaking.axis != Axis::z && shear >= friction * (mean.wrench[2] - shaken.z())) {
    fail("a vibration of {:.4g} mm brings the shear to {:.4g} N at a normal force of {:.4g} N: the object would slide",
         shaking.amplitude_mm, shear, mean.wrench[2]);
  }
}

ShakenPress::ShakenPress(const fem::Compliance& gel, const fem::GelVibration& vibration, fem::PronySeries relaxation,
                         double friction)
    : parts_(new Parts{gel, vibration, std::move(relaxation), friction, {}, {}, {}, {}}) {
  parts_->mass.compute(gel.mass);
  if (parts_->mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
}
ShakenPress::~ShakenPress() = default;

fem::PressState ShakenPress::at(const fem::PressState& mean, const VibrationSpec& vibration, double seconds) {
  fem::PressState state = mean;
  const double phase = 2.0 * kPi * vibration.frequency_Hz * seconds;
  state.gel_from_object.translation[static_cast<int>(vibration.axis)] += vibration.amplitude_mm * std::sin(phase);
  if (!state.bodies.empty()) state.bodies.front().gel_from_object = state.gel_from_object;
  if (mean.contact_vertices == 0 || vibration.amplitude_mm == 0.0) return state;
  const fem::SteadyVibration steady = parts_->answer(mean, vibration);
  parts_->refuse_unless_it_holds(mean, steady, vibration);
  const std::complex<double> turn = std::polar(1.0, phase);
  const Eigen::MatrixX3d weighted = (steady.surface_weighted * turn).imag();
  state.surface_displacement += parts_->mass.solve(weighted);
  state.bead_displacement += (steady.bead_displacement * turn).imag();
  state.traction += (steady.traction * turn).imag();
  state.wrench.head<3>() += (steady.force * turn).imag();
  // As in a press: exact for P1 tractions at P1 displaced points.
  const fem::Compliance& gel = parts_->gel;
  state.wrench.tail<3>().setZero();
  const Eigen::MatrixX3d at =
      state.surface_displacement + Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
                                       gel.vertices.front().data(), static_cast<Eigen::Index>(gel.vertices.size()), 3);
  for (Eigen::Index v = 0; v < gel.mass.outerSize(); ++v) {
    const Eigen::Vector3d t = state.traction.row(v);
    if (t.isZero(0.0)) continue;
    for (Eigen::SparseMatrix<double>::InnerIterator it(gel.mass, v); it; ++it) {
      state.wrench.tail<3>() -= it.value() * Eigen::Vector3d(at.row(it.row())).cross(t);
    }
  }
  if (!state.bodies.empty()) state.bodies.front().wrench = state.wrench;
  return state;
}

}  // namespace touchstone::sim
