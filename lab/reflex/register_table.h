#pragma once
// A motion chip's registers on disk: what a user reads out of a chip frame by frame, maybe beside a force sensor.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/motion_chip.h"
#include "core/progress.h"
#include "sensors/reflex/reflex_loop.h"
#include "sensors/reflex/reflex_training.h"

namespace touchstone::lab {

/// One line of a table.
struct RegisterLine {
  ChipStatistics statistics;  ///< as they stand there: a disturbed line of the chip may have given anything
  std::optional<double> normal_N = {};
  std::optional<Eigen::Vector2d> shear_N = {};
};

/// Reads a CSV with the header `t_us,dx,dy,squal,maximum,minimum,average`, a line a frame in the order of time, behind
/// it maybe `,force_x_N,force_y_N,force_z_N`: the force on the object; the first two may be empty in all lines.
/// @throws Error with file, line and field
std::vector<RegisterLine> read_register_table(const std::filesystem::path& csv);

/// Tables with forces as recordings to learn from: a frame is in contact from a force above `contact_N` on.
struct KnownRegisters {
  std::vector<sensors::ReflexRecording> recordings;
  int faulty = 0;  ///< frames with a fault (sensors/reflex/reflex_loop.h), which nothing is learned from
  std::vector<std::string> faults;  ///< of tables that are left out, naming them
};
/// @throws Error for a table without forces, or if no table can be used
KnownRegisters read_known_registers(const std::vector<std::filesystem::path>& tables, double contact_N);

/// What came of one table.
struct RegisterRecord {
  std::filesystem::path file;
  std::int64_t frames = 0, in_contact = 0, faulty = 0;
  double largest_N = 0.0;
  std::optional<std::int64_t> stop_us = {};  ///< the first frame that stops
  std::optional<double> rms_N = {};          ///< of the normal force, over frames without fault whose force is known
  std::string fault = {};                    ///< why the table is left out
};

/// Shows each table to a loop of its own and writes `csv`, a line a frame:
/// `file,t_us,force_present,force_x_N,force_y_N,force_z_N,stop,true_x_N,true_y_N,true_z_N,fault`; a table that is left
/// out has one line. @throws Error as sensors::ReflexLoop, or if no table can be used
std::vector<RegisterRecord> write_register_forces(const sensors::ReflexModel& model,
                                                  const std::vector<std::filesystem::path>& tables,
                                                  const sensors::ReflexSettings& settings,
                                                  const std::filesystem::path& csv, const Progress& progress = {});

}  // namespace touchstone::lab
