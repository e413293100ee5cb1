#include "apps/command.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "core/error.h"

namespace touchstone::apps {

void require_writable_place(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!std::filesystem::is_directory(folder)) fail("{}: there is no folder {}", file.string(), folder.string());
  if (std::filesystem::is_directory(file)) fail("{}: is a folder; a file is wanted here", file.string());
}

void warn_of_faults(const std::vector<std::string>& faults) {
  constexpr std::size_t kMostNamed = 20;
  for (std::size_t i = 0; i < std::min(faults.size(), kMostNamed); ++i) spdlog::warn("{}: left out", faults[i]);
  if (faults.size() > kMostNamed) spdlog::warn("{} more frames are left out", faults.size() - kMostNamed);
}

void add_calibrate_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("calibrate", "Make a sensor's model from frames, simulated or recorded");
  command->require_subcommand(1);
  add_9dtact_calibration(*command, global, action);
  add_chroma_calibration(*command, global, action);
  add_colour_calibration(*command, global, action);
  add_event_force_calibration(*command, global, action);
  add_event_material_calibration(*command, global, action);
  add_gelsight_calibration(*command, global, action);
  add_markers_calibration(*command, global, action);
  add_place_calibration(*command, global, action);
  add_reflex_calibration(*command, global, action);
  add_softness_calibration(*command, global, action);
  add_texture_calibration(*command, global, action);
  add_vhs_calibration(*command, global, action);
}

void add_estimate_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("estimate",
                                         "What a sensor's frames show, by a model that `calibrate` made; "
                                         "displacements, contact and slip of markers by the frames alone");
  command->require_subcommand(1);
  add_9dtact_estimation(*command, global, action);
  add_chroma_estimation(*command, global, action);
  add_colour_estimation(*command, global, action);
  add_event_force_estimation(*command, global, action);
  add_event_material_estimation(*command, global, action);
  add_gelsight_estimation(*command, global, action);
  add_markers_estimation(*command, global, action);
  add_marks_estimation(*command, global, action);
  add_place_estimation(*command, global, action);
  add_reflex_estimation(*command, global, action);
  add_softness_estimation(*command, global, action);
  add_texture_estimation(*command, global, action);
  add_vhs_estimation(*command, global, action);
}

}  // namespace touchstone::apps
