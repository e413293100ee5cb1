#include "core/named_file.h"
#include "datasets/sets/csv_cells.h"
#include "datasets/sources/frame_sequence.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr const char* kForceColumns = "file,t_us,force_x_N,force_y_N,force_z_N";
constexpr const char* kNumberedColumns = "frame,t_us,force_x_N,force_y_N,force_z_N";

Eigen::Vector3d force_in(const std::vector<std::string>& cells, const SourceLocation& where) {
  return {number_in(cells[2], "force_x_N", where), number_in(cells[3], "force_y_N", where),
          number_in(cells[4], "force_z_N", where)};
}

}  // namespace

FrameSequence frames_of_force_table(const fs::path& folder, const fs::path& csv) {
  FrameSequence sequence;
  sequence.name = folder.filename().string();
  for_each_row(csv, kForceColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    LabelledFrame frame;
    frame.file = folder / cells[0];
    if (const std::string fault = fault_of_file(frame.file); !fault.empty()) fail_at(where, "{}", fault);
    frame.t_us = whole_number_in<std::int64_t>(cells[1], "t_us", where);
    if (!sequence.frames.empty() && frame.t_us <= sequence.frames.back().t_us) {
      fail_at(where, "t_us: {} isn't later than the line before", frame.t_us);
    }
    frame.frame = static_cast<int>(sequence.frames.size());
    frame.force = force_in(cells, where);
    sequence.frames.push_back(std::move(frame));
  });
  if (sequence.frames.empty()) fail("{}: has no frame", csv.string());
  return sequence;
}

std::vector<NumberedForce> read_numbered_forces(const fs::path& csv) {
  std::vector<NumberedForce> table;
  for_each_row(csv, kNumberedColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    NumberedForce one;
    one.frame = whole_number_in<std::int64_t>(cells[0], "frame", where);
    one.t_us = whole_number_in<std::int64_t>(cells[1], "t_us", where);
    one.force = force_in(cells, where);
    one.line = where.line;
    if (one.frame < 0) fail_at(where, "frame: {} must be 0 or more", one.frame);
    if (!table.empty() && one.frame <= table.back().frame) {
      fail_at(where, "frame: {} doesn't come after the line before", one.frame);
    }
    if (!table.empty() && one.t_us <= table.back().t_us) {
      fail_at(where, "t_us: {} isn't later than the line before", one.t_us);
    }
    table.push_back(one);
  });
  if (table.empty()) fail("{}: has no frame", csv.string());
  return table;
}

}  // namespace touchstone::datasets
