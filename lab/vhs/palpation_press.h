#pragma once
// One press of a linear actuator on a lump: the force over time [VisioHaptic2024, sec. 2.3.1].
//
// The face is a mass on the spring of its holder. Along the motion, s being its travel beyond the touch:
//   m s'' = k (x - s) + c (x' - s') - F + shake
// x is the screw's nut: the commanded ramp, and on it the errors of the screw's turn and of the motor's steps. F is the
// elastic force of the law at the depth d, relaxed by the hereditary integral of fem/contact/relaxation.h with the
// series of skin and core, each times its share of the stiffness: to first order in the relaxing parts. The lump's own
// inertia moves its top by its modes, as in fem/vibration/vibration.h, where the law holds their static part already:
//   d = s - sum w_k (q_k - w_k F / omega_k^2),   q_k'' + 2 zeta_k omega_k q_k' + omega_k^2 q_k = w_k F.
// w_k is the mode's mean over a round contact as large as that where the press ends. Left out: the gel's inertia (14 %
// of the force at 400 Hz, docs/sensors/vhs.md), adhesion, the lump's tilt.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "fem/contact/relaxation.h"
#include "lab/vhs/palpation_law.h"
#include "lab/vhs/palpation_spec.h"

namespace touchstone::lab {

/// A mode of a lump as a face on its top meets it.
struct LumpMode {
  double angular_frequency = 0.0;  ///< rad/s
  /// w: mean displacement along the press of the top within each of kTopRadii_mm, tonne^-1/2.
  Eigen::Vector<double, 5> top = Eigen::Vector<double, 5>::Zero();
  double damping = 0.0;  ///< zeta
};

/// Radii of the lump's top at which LumpMode::top is given, mm.
inline constexpr std::array<double, 5> kTopRadii_mm = {1.5, 3.0, 4.5, 6.0, 7.5};

/// How many modes are computed, on which mesh.
struct LumpModeSettings {
  int count = 40;  ///< modes of all shapes; those that don't move the top are left out
  double mesh_mm = 1.5;
};

/// The modes of each of the spec's materials as it is in the middle, under the middle skin; none for a core whose
/// quarter wave of shear is over five times `highest_Hz`. @throws Error as sim::set_up_lump_vibration
std::vector<std::vector<LumpMode>> lump_modes(const PalpationSpec& spec, double highest_Hz,
                                              const LumpModeSettings& settings, const std::filesystem::path& cache,
                                              const Progress& progress = {});

/// A piece: one of a material's, no two alike.
struct PalpationPiece {
  int material = 0;
  double skin_MPa = 0.0;
  double core_MPa = 0.0;
};
/// Moduli drawn log-normally within three spreads. A pure function of its arguments.
PalpationPiece draw_piece(const PalpationSpec& spec, int material, std::uint64_t seed, std::uint64_t index);

/// What a press needs of its piece.
struct PressedPiece {
  PalpationLaw law;
  fem::PronySeries relaxation;  ///< of the force
  std::vector<LumpMode> modes;  ///< of the piece's own moduli
};
/// Law, relaxation and modes of one piece, with the moduli that it has.
PressedPiece pressed_piece(const PalpationSpec& spec, const PalpationTable& table, const PalpationPiece& piece,
                           const std::vector<std::vector<LumpMode>>& modes);

/// One press, sampled evenly.
struct PalpationRun {
  double step_s = 0.0;
  std::vector<double> force_N;   ///< true, evenly in time from the start on
  std::vector<double> depth_mm;  ///< at which the elastic law has this force: what a gel that doesn't relax shows
  double touch_s = 0.0;
  double stop_s = 0.0;  ///< when the actuator began to brake
};

/// Plays a press for `seconds` from the touch on. A pure function of its arguments. @throws Error if it goes beyond
/// what the law was computed for
PalpationRun play_press(const PalpationSpec& spec, const PressedPiece& piece, double seconds, std::uint64_t seed,
                        std::uint64_t index);

}  // namespace touchstone::lab
