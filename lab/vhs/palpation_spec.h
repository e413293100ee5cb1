#pragma once
// What is palpated, and how: [VisioHaptic2024, sec. 2.3]. Read from scenes/palpation/five-levels.yaml, which says where
// its figures come from.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/yaml_reader.h"
#include "fem/contact/relaxation.h"
#include "sim/grasp/skinned_lump.h"

namespace touchstone::lab {

/// The paper's five levels of softness (sec. 2.3), from soft to hard.
enum class Softness { soft, elastic_soft, elastic_hard, cartilage_like_hard, bone_like_hard };
inline constexpr int kSoftnessLevels = 5;  ///< of Softness
EnumNames<Softness> enum_names(Softness);
/// Their names in order.
std::vector<std::string> softness_names();

/// A material of a lump or of its skin, as drawn from piece to piece.
struct PalpationMaterial {
  std::string name;  ///< of the skin: empty
  Softness level = Softness::soft;
  double youngs_modulus_MPa = 0.1;
  double spread = 0.0;    ///< standard deviation of its logarithm from piece to piece
  double relaxing = 0.0;  ///< part of the modulus that relaxes in each of four decades of time, 1 ms to 1 s
};

/// A motor on a screw with a mass on a spring, see lab/vhs/palpation_press.h.
struct PalpationAxis {
  double mass_kg = 0.08;
  double stiffness_N_mm = 50.0;
  double damping = 0.05;  ///< of critical
  double lead_mm = 2.0;
  double lead_error_um = 5.0;  ///< amplitude, once a turn
  int steps_per_turn = 200;
  double step_error_um = 0.5;  ///< amplitude, once in four full steps
  double acceleration_mm_s2 = 500.0;
  double shake_um = 0.5;  ///< RMS of the free mass
};

/// How the actuator comes down.
struct PalpationMotion {
  double speed_mm_s = 10.0;
  double speed_spread = 0.0;  ///< standard deviation of its logarithm
  double stop_force_N = 5.0;
  double deepest_mm = 2.0;
  double gap_mm = 0.5;
};

/// The force sensor that the paper's figures were had with.
struct PalpationReference {
  double digits_per_N = 328.0;
  double noise_digits = 1.0;  ///< standard deviation, before rounding
  double rate_Hz = 1000.0;
};

/// All of the file, checked.
struct PalpationSpec {
  sim::SkinnedLump lump;
  double density_kg_m3 = 1050.0;
  PalpationMaterial skin;
  std::vector<PalpationMaterial> materials;
  PalpationAxis axis;
  PalpationMotion motion;
  PalpationReference reference;
};

void fields(YamlReader& in, PalpationSpec& spec);

/// @throws Error with file and line; for a level without a material, too
PalpationSpec read_palpation(const std::filesystem::path& file);

/// The series of a material that relaxes by `relaxing` in each decade. Empty for 0.
fem::PronySeries palpation_series(double relaxing);

}  // namespace touchstone::lab
