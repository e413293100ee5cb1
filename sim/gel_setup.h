#pragma once
// From a device's file to what fem asks for.

#include <memory>
#include <string>
#include <vector>

#include "fem/compliance.h"
#include "fem/finite_gel.h"
#include "fem/gel_body.h"
#include "sim/device.h"

namespace touchstone::sim {

fem::GelBody gel_body(const DeviceSpec& device);

/// The body's, then the layers' from the outer surface inwards.
std::vector<fem::ElasticMaterial> gel_materials(const GelSpec& gel);

std::vector<fem::Bead> gel_beads(const DeviceSpec& device);

/// Height (gel frame's z, mm) of the undeformed outer surface over a place; of a dome or fingertip beyond its rim that
/// of the rim. @pre the gel isn't a mesh
double rest_height(const GelSpec& gel, const Eigen::Vector2d& place);

/// The gel for presses at finite strain: the mesh that its compliance was made with. The mesh must be given by fine_mm.
std::shared_ptr<const fem::FiniteGel> set_up_finite_gel(const DeviceSpec& device);

/// Under what the gel's set-up is kept in the cache.
std::string gel_key(const DeviceSpec& device);

/// For who is about to set up many gels that differ in their modulus alone: keeps the one of 1 MPa that they are made
/// from, unless the device's own is there. Without it each is worked out anew. Nothing is kept for gels with layers,
/// whose moduli would have to vary together. @throws Error as set_up_gel()
void keep_gel_of_unit_modulus(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                              const Progress& progress = {});

}  // namespace touchstone::sim
