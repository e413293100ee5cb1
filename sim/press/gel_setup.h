#pragma once
// A device's gel set up for pressing, from the cache where it is there.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/vibration/vibration.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Where set-up results are kept between runs: $TOUCHSTONE_CACHE, else $XDG_CACHE_HOME/touchstone, else
/// ~/.cache/touchstone, else touchstone-cache-<user's number> in the system's temporary folder. TOUCHSTONE_CACHE is
/// taken as it is. The others are this user's own: made for nobody else (0700) where they aren't there.
/// @throws Error if one of the others belongs to another user than this one and root, or may be written by others
std::filesystem::path default_cache_folder();

/// A device set up for pressing. Set-up is shared by all scenes with the same gel, mesh and beads.
std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress = {});

/// The modes of the device's gel, where the plan wants inertia for a motion that vibrates; else nothing.
std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder);

/// The gel for presses at finite strain: the mesh that its compliance was made with. The mesh must be given by fine_mm.
std::shared_ptr<const fem::FiniteGel> set_up_finite_gel(const DeviceSpec& device);

/// Under what the gel's set-up is kept in the cache.
std::string gel_key(const DeviceSpec& device);

/// For who is about to set up many gels that differ in their modulus alone: keeps the one of 1 MPa that they are made
/// from, unless the device's own is there. Without it each is worked out anew. Nothing is kept for gels with layers,
/// whose moduli would have to vary together. @throws Error as set_up_gel()
void cache_gel_of_unit_modulus(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                               const Progress& progress = {});

}  // namespace touchstone::sim
