#include "sensors/colour/colour_marker.h"

namespace touchstone::sensors {

const char* name_of(MarkerFlaw flaw) {
  switch (flaw) {
    case MarkerFlaw::kNone:
      return "none";
    case MarkerFlaw::kMissing:
      return "missing";
    case MarkerFlaw::kTwoFilters:
      return "two_filters";
    case MarkerFlaw::kOverexposed:
      return "overexposed";
    case MarkerFlaw::kUnderexposed:
      return "underexposed";
    case MarkerFlaw::kColourless:
      return "colourless";
    case MarkerFlaw::kCutOff:
      return "cut_off";
  }
  return "?";
}

}  // namespace touchstone::sensors
