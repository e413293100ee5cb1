#pragma once
// A lump under a skin, as dermatologists feel for: a domed piece of one material, glued to a plate on its back, with a
// layer of another over it ([VisioHaptic2024, sec. 2.3]: benchmark materials under a pseudo-skin of 2 mm).
//
// Both materials are linear elastic with one Poisson's ratio, so the piece's answer depends on the ratio of their
// moduli, and its stiffness on the skin's besides: one set-up serves all pieces of a ratio.

#include <filesystem>
#include <memory>

#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "fem/vibration/vibration.h"

namespace touchstone::sim {

/// Piece frame as fem::DomeGel's: top of the dome at the origin, z out of it; all in mm.
struct SkinnedLump {
  double sphere_radius_mm = 20.0;  ///< of the domed top
  double base_radius_mm = 10.0;    ///< of the round piece
  double height_mm = 10.0;         ///< of the top over the plate
  double skin_mm = 2.0;            ///< 0: no skin
  double poisson_ratio = 0.49;     ///< of both
  double mesh_mm = 0.8;            ///< edges where it is touched
};

/// The piece as a gel that can be pressed. @throws Error as fem::check(GelBody)
fem::GelBody lump_body(const SkinnedLump& lump);

/// Its compliance for a skin of 1 MPa over a core of `core_over_skin` MPa (without a skin the piece is of that
/// altogether), from the cache if it is there. With s times both moduli it is 1/s of that: see fem::with_modulus.
/// @throws Error as fem::cached_compliance, and for a ratio that isn't finite and above zero
std::shared_ptr<const fem::Compliance> set_up_lump(const SkinnedLump& lump, double core_over_skin,
                                                   const std::filesystem::path& cache_folder);

/// The same piece upside down, as a body that presses on a gel, with `skin_MPa` as its skin's modulus: in the frame of
/// a sphere of `sphere_radius_mm` about the origin.
std::shared_ptr<const fem::Compliance> as_pressing_body(const SkinnedLump& lump, const fem::Compliance& piece,
                                                        double skin_MPa);

/// A plate for lumps whose skin has 1 MPa: a pad a thousand times as stiff, which gives way by less than a hundredth of
/// what they do. So a plate meets a lump as a gel does, flat against round: a press that took the dome for the gel
/// would let contact act along its normals, and be a quarter too stiff at a sixth of the radius. Its edges are longer
/// than the lump's: without a give of its own a finer one would ask for more than the lump's vertices can resolve.
std::shared_ptr<const fem::Compliance> set_up_plate(const SkinnedLump& lump, const std::filesystem::path& cache_folder);

/// Its `count` lowest modes for the same moduli and a density in kg/m^3, cached likewise. With s times both moduli
/// frequencies are sqrt(s) times those.
fem::GelVibration set_up_lump_vibration(const SkinnedLump& lump, double core_over_skin, double density_kg_m3, int count,
                                        const std::filesystem::path& cache_folder);

}  // namespace touchstone::sim
