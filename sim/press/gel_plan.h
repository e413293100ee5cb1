#pragma once

#include <filesystem>
#include <string>

#include "sim/scene/device.h"

namespace touchstone::sim {

/// What a device's gel takes. Sizes are estimates (see fem::SetupEstimate) unless it's set up already.
struct GelPlan {
  std::filesystem::path file;  ///< of its set-up in the cache
  bool ready = false;          ///< a sound one is there: nothing will be set up
  bool sized = true;           ///< false: the mesh is found at set-up by its error, and only `file_mb`'s limit is known
  double surface_vertices = 0.0;
  double compression_error = 0.0;  ///< see fem::ComplianceReport; 0 of a gel whose compliance is kept whole
  double file_mb = 0.0;
  double setup_mb = 0.0;
  double press_mb = 0.0;      ///< beside the mapped file, with all of the finely meshed box in contact
  double smooth_error = 0.0;  ///< relative error of the force where ready: of a sphere whose contact is 1 mm in radius,
  double sharp_error = 0.0;   ///< and of a punch of that radius
};

/// Looks into the cache, but sets nothing up.
GelPlan plan_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder);

/// The same in words, one sentence a line.
std::string describe(const GelPlan& plan);

}  // namespace touchstone::sim
