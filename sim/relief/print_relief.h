#pragma once
// Raised print, such as the ink on a banknote.

#include <string>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// A line of letters drawn with a round pen whose ink stands `amplitude_um` high and falls off over the outer third of
/// the pen. It is centred on the z axis and reads along +x with y down, for who looks at the printed
/// side from below, as a device does. Capitals,
/// digits, blanks, and . - $; each letter is 2/3 as wide as it is high.
struct PrintRelief {
  static constexpr const char* kType = "print";
  static constexpr bool kSharp = true;
  double amplitude_um = 0.0;  ///< thickness of the ink
  std::string text;
  double letter_mm = 2.0;   ///< height of a capital
  double stroke_mm = 0.25;  ///< width of the pen
  SourceLocation where;
};

/// @throws Error also for a letter that there isn't
void fields(YamlReader& in, PrintRelief& relief);
/// The text once, not repeated.
fem::ReliefMap relief_map(const PrintRelief& relief);
/// stroke_mm.
double finest_detail(const PrintRelief& relief);

}  // namespace touchstone::sim
