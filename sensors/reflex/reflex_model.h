#pragma once
// All that reflex mode learned [Knoop2013, sec. III.D], and its file.

#include <filesystem>
#include <optional>
#include <string>

#include "sensors/reflex/contact_tree.h"
#include "sensors/reflex/shear_law.h"
#include "sensors/reflex/statistics_force.h"

namespace touchstone::sensors {

/// A calibrated model of one fingertip.
struct ReflexModel {
  ContactTree tree;
  StatisticsForce force;
  std::optional<ShearLaw> shear;  ///< of the counts since the contact began (sensors/reflex/motion_counts.h)
};

/// What is wrong with it; empty if nothing is.
std::string fault_of(const ReflexModel& model);

/// JSON with a checksum, as it is written. @throws Error for a model with a fault
std::string to_json(const ReflexModel& model);
/// @throws Error naming file and field, for what isn't such a file, is damaged, or holds a model with a fault
ReflexModel reflex_model_from_json(const std::string& text, const std::string& name);

/// @throws Error as to_json(), or if the file can't be written
void save(const ReflexModel& model, const std::filesystem::path& path);
/// @throws Error as reflex_model_from_json(), or if the file can't be read
ReflexModel load_reflex_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
