#include "lab/validation.h"

namespace touchstone::lab {

// Each in a file of its own: validate_mechanics.cpp, validate_light.cpp, validate_vhs.cpp.
std::vector<ValidationRow> validate_mechanics(const ValidateOptions& options);
std::vector<ValidationRow> validate_light(const ValidateOptions& options);
std::vector<ValidationRow> validate_vhs(const ValidateOptions& options);

const std::vector<ValidationGroup>& validation_groups() {
  static const std::vector<ValidationGroup> groups = {
#ifdef TOUCHSTONE_VALIDATE_MECHANICS
      {"mechanics", validate_mechanics},
#endif
#ifdef TOUCHSTONE_VALIDATE_LIGHT
      {"light", validate_light},
#endif
#ifdef TOUCHSTONE_VALIDATE_VHS
      {"vhs", validate_vhs},
#endif
  };
  return groups;
}

}  // namespace touchstone::lab
