#include "lab/vhs/palpation_spec.h"

#include <algorithm>

namespace touchstone::lab {
namespace {

constexpr std::array<double, 4> kRelaxationTimes_s = {1e-3, 1e-2, 1e-1, 1.0};
constexpr double kMostRelaxing = 0.2;  // a decade: four of them leave a fifth of the modulus

void read_elasticity(YamlReader& in, PalpationMaterial& material) {
  in.required("youngs_modulus_MPa", material.youngs_modulus_MPa, Allowed::above(0.0));
  in.required("spread", material.spread, Allowed::within(0.0, 0.5));
  in.required("relaxing", material.relaxing, Allowed::within(0.0, kMostRelaxing));
}

struct Skin {
  PalpationMaterial material;
};

void fields(YamlReader& in, Skin& skin) {
  read_elasticity(in, skin.material);
}

}  // namespace

EnumNames<Softness> enum_names(Softness) {
  return {{"soft", Softness::soft},
          {"elastic soft", Softness::elastic_soft},
          {"elastic hard", Softness::elastic_hard},
          {"cartilage-like hard", Softness::cartilage_like_hard},
          {"bone-like hard", Softness::bone_like_hard}};
}

std::vector<std::string> softness_names() {
  std::vector<std::string> names;
  for (const auto& [name, level] : enum_names(Softness{})) names.push_back(name);
  return names;
}

void fields(YamlReader& in, PalpationMaterial& material) {
  in.required("name", material.name);
  in.required("level", material.level);
  read_elasticity(in, material);
}

void fields(YamlReader& in, PalpationAxis& axis) {
  in.required("mass_kg", axis.mass_kg, Allowed::above(0.0));
  in.required("stiffness_N_mm", axis.stiffness_N_mm, Allowed::above(0.0));
  in.required("damping", axis.damping, Allowed::above(0.0));
  in.required("lead_mm", axis.lead_mm, Allowed::above(0.0));
  in.required("lead_error_um", axis.lead_error_um, Allowed::at_least(0.0));
  in.required("steps_per_turn", axis.steps_per_turn, Allowed::at_least(4.0));
  in.required("step_error_um", axis.step_error_um, Allowed::at_least(0.0));
  in.required("acceleration_mm_s2", axis.acceleration_mm_s2, Allowed::above(0.0));
  in.required("shake_um", axis.shake_um, Allowed::at_least(0.0));
}

void fields(YamlReader& in, PalpationMotion& motion) {
  in.required("speed_mm_s", motion.speed_mm_s, Allowed::above(0.0));
  in.required("speed_spread", motion.speed_spread, Allowed::within(0.0, 0.5));
  in.required("stop_force_N", motion.stop_force_N, Allowed::above(0.0));
  in.required("deepest_mm", motion.deepest_mm, Allowed::above(0.0));
  in.required("gap_mm", motion.gap_mm, Allowed::at_least(0.0));
}

void fields(YamlReader& in, PalpationReference& reference) {
  in.required("digits_per_N", reference.digits_per_N, Allowed::above(0.0));
  in.required("noise_digits", reference.noise_digits, Allowed::at_least(0.0));
  in.required("rate_Hz", reference.rate_Hz, Allowed::above(0.0));
}

}  // namespace touchstone::lab

namespace touchstone::sim {

// Beside the struct, so that the reader finds it.
static void fields(YamlReader& in, SkinnedLump& lump) {
  in.required("sphere_radius_mm", lump.sphere_radius_mm, Allowed::above(0.0));
  in.required("base_radius_mm", lump.base_radius_mm, Allowed::above(0.0));
  in.required("height_mm", lump.height_mm, Allowed::above(0.0));
  in.required("skin_mm", lump.skin_mm, Allowed::above(0.0));
  in.required("poisson_ratio", lump.poisson_ratio, Allowed::within(0.0, 0.5));
  in.required("mesh_mm", lump.mesh_mm, Allowed::above(0.0));
}

}  // namespace touchstone::sim

namespace touchstone::lab {

void fields(YamlReader& in, PalpationSpec& spec) {
  in.required("lump", spec.lump);
  in.required("density_kg_m3", spec.density_kg_m3, Allowed::above(0.0));
  Skin skin;
  in.required("skin", skin);
  spec.skin = skin.material;
  in.required("materials", spec.materials);
  in.required("axis", spec.axis);
  in.required("motion", spec.motion);
  in.required("reference", spec.reference);
  for (const auto& [name, level] : enum_names(Softness{})) {
    if (std::none_of(spec.materials.begin(), spec.materials.end(),
                     [&](const PalpationMaterial& material) { return material.level == level; })) {
      fail_at(in.where("materials"), "materials: none is {}; each level needs one", name);
    }
  }
}

PalpationSpec read_palpation(const std::filesystem::path& file) {
  return read_yaml<PalpationSpec>(file);
}

fem::PronySeries palpation_series(double relaxing) {
  fem::PronySeries series;
  for (const double time : kRelaxationTimes_s) {
    if (relaxing > 0.0) series.push_back({relaxing, time});
  }
  fem::check(series);
  return series;
}

}  // namespace touchstone::lab
