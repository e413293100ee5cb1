#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sensors/markers/linear_force.h"

namespace touchstone::sensors {

/// What was fitted for one gel: a line for each shape of indenter (measure: height_sum_mm3, mm^3), and one for shear
/// (measure: mean marker displacement, mm).
struct GelForceModel {
  /// The line of one shape of indenter.
  struct Normal {
    std::string indenter;  ///< "ball 12.7 mm"; no two alike
    LinearForce line;
  };
  std::string gel;         ///< the device that it was fitted on; for people
  double mm_per_px = 0.0;  ///< of the pictures that it was fitted to, on the gel's face
  std::vector<Normal> normal;
  std::optional<LinearForce> shear;
};

/// The line for an indenter. @throws Error naming those that the model has
const LinearForce& normal_line(const GelForceModel& model, const std::string& indenter);

/// The line for shear (shear_force_N in linear_force.h). @throws Error if the model has none
const LinearForce& shear_line(const GelForceModel& model);

/// What makes the model unusable, or "": nothing in it, a pixel of no size, an indenter without a name or twice, a
/// number that isn't finite, a slope that isn't positive, r2 above 1, a residual below 0, an empty range, fewer than
/// three samples.
std::string fault_of(const GelForceModel& model);

/// The model as JSON (format "touchstone.gel_force_model", version 2). Numbers are written so that reading gives the
/// same bits. @throws Error if the model is faulty
std::string to_json(const GelForceModel& model);
/// Reads what to_json wrote; `name` stands for the file in messages.
/// @throws Error naming file and field: not JSON, another format or version, a field missing, unknown or of the wrong
/// kind, a faulty model
GelForceModel gel_force_model_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const GelForceModel& model, const std::filesystem::path& path);
/// @throws Error as gel_force_model_from_json, or if the file can't be read
GelForceModel load_gel_force_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
