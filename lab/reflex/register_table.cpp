#include "lab/reflex/register_table.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

const std::string kRegisterColumns = "t_us,dx,dy,squal,maximum,minimum,average";
const std::string kForceColumns = ",force_x_N,force_y_N,force_z_N";

/// The lines of one table's estimates.
std::string estimate_lines(const std::string& name, const std::vector<RegisterLine>& lines, sensors::ReflexLoop& loop,
                           bool shear, RegisterRecord& record) {
  std::string text;
  double squares_N2 = 0.0;
  std::int64_t known = 0;
  for (const RegisterLine& line : lines) {
    const sensors::ReflexDecision decision = loop.next(line.statistics);
    ++record.frames;
    if (decision.stop && !record.stop_us) record.stop_us = line.statistics.t_us;
    text += fmt::format("{},{},", name, line.statistics.t_us);
    const bool good = decision.fault == sensors::ChipFault::none;
    if (good) {
      record.in_contact += decision.force_present ? 1 : 0;
      record.largest_N = std::max(record.largest_N, decision.force_N);
      const Eigen::Vector2d& side = decision.shear_N;
      text += fmt::format("{},{},{:.5f},", decision.force_present ? 1 : 0,
                          shear ? fmt::format("{:.5f},{:.5f}", side.x(), side.y()) : ",", decision.force_N);
    } else {
      ++record.faulty;
      text += ",,,,";
    }
    text += fmt::format("{},", decision.stop ? 1 : 0);
    text += line.shear_N ? fmt::format("{:.6g},{:.6g},", line.shear_N->x(), line.shear_N->y()) : ",,";
    text += line.normal_N ? fmt::format("{:.6g},", *line.normal_N) : ",";
    text += (good ? "" : name_of(decision.fault)) + "\n";
    if (!good || !line.normal_N) continue;
    squares_N2 += std::pow(decision.force_N - *line.normal_N, 2);
    ++known;
  }
  if (known > 0) record.rms_N = std::sqrt(squares_N2 / static_cast<double>(known));
  return text;
}

}  // namespace

std::vector<RegisterLine> read_register_table(const fs::path& csv) {
  const std::string head = datasets::header_among(csv, {kRegisterColumns, kRegisterColumns + kForceColumns});
  const bool forces = head != kRegisterColumns;
  std::vector<RegisterLine> lines;
  datasets::for_each_row(csv, head, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    const auto whole = [&](std::size_t at, const char* field) {
      return datasets::whole_number_in<int>(cells[at], field, where);
    };
    RegisterLine line;
    ChipStatistics& chip = line.statistics;
    chip.t_us = datasets::whole_number_in<std::int64_t>(cells[0], "t_us", where);
    if (!lines.empty() && chip.t_us <= lines.back().statistics.t_us) {
      fail_at(where, "t_us: {} isn't after the line before's, {}", chip.t_us, lines.back().statistics.t_us);
    }
    chip.dx = whole(1, "dx");
    chip.dy = whole(2, "dy");
    chip.squal = whole(3, "squal");
    chip.maximum = whole(4, "maximum");
    chip.minimum = whole(5, "minimum");
    chip.average = datasets::number_in(cells[6], "average", where);
    if (forces) {
      line.normal_N = datasets::number_in(cells[9], "force_z_N", where);
      const bool shear = !cells[7].empty() || !cells[8].empty();
      if (!lines.empty() && shear != lines.front().shear_N.has_value()) {
        fail_at(where, "force_x_N, force_y_N: {}; all lines must have them, or none",
                shear ? "are given, unlike those before" : "are empty, unlike those before");
      }
      if (shear) {
        line.shear_N = {datasets::number_in(cells[7], "force_x_N", where),
                        datasets::number_in(cells[8], "force_y_N", where)};
      }
    }
    lines.push_back(line);
  });
  if (lines.empty()) fail("{}: has no frame", csv.string());
  return lines;
}

KnownRegisters read_known_registers(const std::vector<fs::path>& tables, double contact_N) {
  KnownRegisters known;
  for (const fs::path& table : tables) {
    const std::string fault = datasets::fault_in([&] {
      sensors::ReflexRecording recording;
      for (const RegisterLine& line : read_register_table(table)) {
        if (!line.normal_N) {
          fail_at({table.string(), 1}, "there are no forces to learn from; the first line must be '{}{}'",
                  kRegisterColumns, kForceColumns);
        }
        recording.push_back({line.statistics, *line.normal_N > contact_N, *line.normal_N, line.shear_N});
        known.faulty += sensors::fault_of(line.statistics) != sensors::ChipFault::none ? 1 : 0;
      }
      known.recordings.push_back(std::move(recording));
    });
    if (!fault.empty()) known.faults.push_back(fault);
  }
  if (known.recordings.empty()) {
    if (tables.size() == 1) fail("{}", known.faults.front());
    fail("none of {} tables can be used; the first: {}", tables.size(), known.faults.front());
  }
  return known;
}

std::vector<RegisterRecord> write_register_forces(const sensors::ReflexModel& model,
                                                  const std::vector<fs::path>& tables,
                                                  const sensors::ReflexSettings& settings, const fs::path& csv,
                                                  const Progress& progress) {
  const sensors::ReflexLoop fresh(model, settings);  // a model that can't be used is no fault of a table
  WholeFileWriter writer(csv);
  writer.append("file,t_us,force_present,force_x_N,force_y_N,force_z_N,stop,true_x_N,true_y_N,true_z_N,fault\n");
  std::vector<RegisterRecord> records;
  std::vector<std::string> faults;
  for (const fs::path& table : tables) {
    RegisterRecord record;
    record.file = table;
    const std::string name = datasets::csv_cell(table.filename().string());
    record.fault = datasets::fault_in([&] {
      sensors::ReflexLoop loop = fresh;
      writer.append(estimate_lines(name, read_register_table(table), loop, model.shear.has_value(), record));
    });
    if (!record.fault.empty()) {
      writer.append(fmt::format("{},,,,,,,,,,{}\n", name, datasets::csv_cell(record.fault)));
      faults.push_back(record.fault);
    }
    records.push_back(std::move(record));
    if (progress) progress("recordings", std::ssize(records), std::ssize(tables));
  }
  if (faults.size() == 1 && tables.size() == 1) fail("{}", faults.front());
  datasets::require_a_frame(faults, tables.size());
  writer.finish();
  return records;
}

}  // namespace touchstone::lab
