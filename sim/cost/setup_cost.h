#pragma once
// What is done once: a gel's compliance, elastic objects.

#include <filesystem>
#include <optional>

#include "fem/elements/compliance.h"
#include "sim/cost/machine_rates.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Seconds of setting a device's gel up, counted on its meshes; 0 if the cache has it, or the one of 1 MPa that it is
/// made from. Nothing where the mesh is found by its error: how many are tried isn't known.
std::optional<double> gel_setup_seconds(const DeviceSpec& device, const MachineRates& rates,
                                        const std::filesystem::path& cache);

/// Likewise of an elastic object. @pre it is elastic. @throws Error if it can't be meshed
double elastic_setup_seconds(const ObjectSpec& object, const MachineRates& rates);

/// Operations of one factorisation of the device's gel at finite strain. @throws Error if it can't be meshed
double gel_factorisation_operations(const DeviceSpec& device);

/// The gel of a device as it is meshed, without its compliance: what is seen of it at rest can be.
/// @throws Error if it can't be meshed
fem::Compliance unpressed_gel(const DeviceSpec& device);

}  // namespace touchstone::sim
