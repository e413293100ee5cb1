#include "lab/validation/validation.h"

namespace touchstone::lab {

// Each in a file of its own, named for it.
std::vector<ValidationRow> validate_mechanics(const ValidateOptions& options);
std::vector<ValidationRow> validate_vibration(const ValidateOptions& options);
std::vector<ValidationRow> validate_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_force(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_vibration(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_design(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_cycle(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_distribution(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_speed(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_palpation(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs_visual(const ValidateOptions& options);
std::vector<ValidationRow> validate_dvs_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_dvs_design(const ValidateOptions& options);
std::vector<ValidationRow> validate_dvs_force(const ValidateOptions& options);
std::vector<ValidationRow> validate_dvs_material(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_marker(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_field(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_force(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_robustness(const ValidateOptions& options);
std::vector<ValidationRow> validate_chroma_design(const ValidateOptions& options);
std::vector<ValidationRow> validate_reflex(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_design(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_height(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_dome(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_map(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_slip(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_grasp(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_texture(const ValidateOptions& options);
std::vector<ValidationRow> validate_gelsight_unit(const ValidateOptions& options);

const std::vector<ValidationGroup>& validation_groups() {
  static const std::vector<ValidationGroup> groups = {
      {"mechanics", validate_mechanics},
      {"vibration", validate_vibration},
      {"light", validate_light},
      {"vhs.force", validate_vhs_force},
      {"vhs.vibration", validate_vhs_vibration},
      {"vhs.design", validate_vhs_design},
      {"vhs.cycle", validate_vhs_cycle},
      {"vhs.distribution", validate_vhs_distribution},
      {"vhs.speed", validate_vhs_speed},
      {"vhs.palpation", validate_vhs_palpation},
      {"vhs.visual", validate_vhs_visual},
      {"dvs.light", validate_dvs_light},
      {"dvs.force", validate_dvs_force},
      {"dvs.material", validate_dvs_material},
      {"dvs.design", validate_dvs_design},
      {"chroma.light", validate_chroma_light},
      {"chroma.marker", validate_chroma_marker},
      {"chroma.field", validate_chroma_field},
      {"chroma.force", validate_chroma_force},
      {"chroma.robustness", validate_chroma_robustness},
      {"chroma.design", validate_chroma_design},
      {"reflex", validate_reflex},
      {"gelsight.light", validate_gelsight_light},
      {"gelsight.height", validate_gelsight_height},
      {"gelsight.design", validate_gelsight_design},
      {"gelsight.dome", validate_gelsight_dome},
      {"gelsight.map", validate_gelsight_map},
      {"gelsight.force", validate_gelsight_slip},
      {"gelsight.grasp", validate_gelsight_grasp},
      {"gelsight.texture", validate_gelsight_texture},
      {"gelsight.unit", validate_gelsight_unit},
  };
  return groups;
}

}  // namespace touchstone::lab
