#include "lab/validation.h"

namespace touchstone::lab {

// Each in a file of its own: validate_mechanics.cpp, validate_vibration.cpp, validate_light.cpp, validate_vhs.cpp.
std::vector<ValidationRow> validate_mechanics(const ValidateOptions& options);
std::vector<ValidationRow> validate_vibration(const ValidateOptions& options);
std::vector<ValidationRow> validate_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs(const ValidateOptions& options);

const std::vector<ValidationGroup>& validation_groups() {
  static const std::vector<ValidationGroup> groups = {
      {"mechanics", validate_mechanics},
      {"vibration", validate_vibration},
      {"light", validate_light},
      {"vhs", validate_vhs},
  };
  return groups;
}

}  // namespace touchstone::lab
