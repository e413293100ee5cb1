#pragma once
// Marks of a skin that dermatologists press with a glass: erythema fades, purpura stays [VisioHaptic2024, sec. 2.1].
//
// Erythema is blood in widened vessels. A vessel is open while the pressure in it is above that on the skin; along a
// capillary of human skin it falls from 32 mmHg at the arteriole to 12 mmHg at the venule ([Landis1930]: means of
// micropunctures at the nail fold), taken as evenly. So of the vessels the share (p_a - p) / (p_a - p_v) is open under
// the contact pressure p, within 0 and 1, and the mark's reflectance is that share of its own and the rest of the
// surrounding skin's. Purpura is blood that has left the vessels: no pressure changes it. A press is taken as long
// enough for the blood to flow (a second; "refill time" below 2 s is a healthy one), and what the gel's pressure does
// deeper in the skin isn't solved: it is that of the face.

#include <Eigen/Core>
#include <vector>

#include "core/yaml_reader.h"
#include "render/materials/print.h"
#include "sim/files/colour.h"
#include "sim/scene/contact_pressure.h"

namespace touchstone::sim {

/// Erythema fades under pressure, purpura doesn't.
enum class LesionKind { erythema, purpura };
EnumNames<LesionKind> enum_names(LesionKind);

/// A round mark with a soft rim.
struct SkinPatch {
  LesionKind kind = LesionKind::erythema;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double diameter_mm = 0.0;  ///< to the middle of its rim
  double rim_mm = 0.5;       ///< over which it fades
  Colour colour = 0.5;       ///< of its middle, without pressure
};

/// The marks on a skin and the pressures at which its vessels shut.
struct SkinPrint {
  static constexpr const char* kType = "skin";
  std::vector<SkinPatch> patches;  ///< the later ones over the earlier ones
  double pixel_mm = 0.05;          ///< of the picture that they are drawn as
  double arteriole_kPa = 4.27;     ///< pressure at which the last vessel is shut: 32 mmHg
  double venule_kPa = 1.60;        ///< at which the first one is: 12 mmHg; below the other
};

void fields(YamlReader& in, SkinPatch& patch);
void fields(YamlReader& in, SkinPrint& skin);

/// Share of the vessels that are open under a pressure of `kPa`.
double open_share(const SkinPrint& skin, double kPa);

/// The patches as a picture; `ground` is the skin's own colour, `pressure` null for none.
render::PrintedPicture skin_picture(const SkinPrint& skin, const SceneBands& bands, const Colour& ground,
                                    const ContactPressure* pressure);

}  // namespace touchstone::sim
