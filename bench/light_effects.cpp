#include "bench/light_sections.h"

namespace touchstone::bench {

ResultTable light_effects_table(const LightOptions&) {
  return {};
}

}  // namespace touchstone::bench
