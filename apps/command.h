#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace touchstone::apps {

/// Options that stand before the command.
struct GlobalOptions {
  int threads = 0;  ///< 0: as many as the machine has
  bool quiet = false;
  std::filesystem::path cache;
};

/// What the command line has chosen. It runs after the line was read; mistakes are thrown as Error.
using Action = std::function<void()>;

// Each adds one command to the line. When it is chosen, it sets `action`. `global` is read when the action runs.
void add_plan_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_render_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_fit_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_compare_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_generate_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_merge_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_calibrate_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_estimate_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_validate_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_inspect_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_export_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_record_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_serve_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_bench_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_study_command(CLI::App& app, const GlobalOptions& global, Action& action);
void add_schema_command(CLI::App& app, Action& action);

/// @throws Error if a result can't be written at `file`: its folder isn't there, or it's a folder itself
void require_writable_place(const std::filesystem::path& file);

/// Warns of frames that couldn't be used, by what is wrong with each; of many it names some.
void warn_of_faults(const std::vector<std::string>& faults);

/// That a data set was there already, as generate and merge find it.
void print_finished(const std::filesystem::path& out, std::int64_t samples);

// What calibrate and estimate do differs from sensor to sensor: each sensor's form is a command below them.
void add_9dtact_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_chroma_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_colour_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_markers_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_place_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_reflex_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_softness_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_texture_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_vhs_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_event_force_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_event_material_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_gelsight_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action);
void add_9dtact_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_chroma_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_colour_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_markers_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_marks_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_place_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_reflex_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_softness_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_texture_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_vhs_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_event_force_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_event_material_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);
void add_gelsight_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action);

// Below export.
void add_webdataset_export(CLI::App& exports, const GlobalOptions& global, Action& action);

}  // namespace touchstone::apps
