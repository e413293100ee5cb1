#include "core/named_file.h"
#include "datasets/sets/csv_cells.h"
#include "datasets/sets/frame_sequence.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr const char* kForceColumns = "file,t_us,force_x_N,force_y_N,force_z_N";

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
    frame.force = Eigen::Vector3d{number_in(cells[2], "force_x_N", where), number_in(cells[3], "force_y_N", where),
                                  number_in(cells[4], "force_z_N", where)};
    sequence.frames.push_back(std::move(frame));
  });
  if (sequence.frames.empty()) fail("{}: has no frame", csv.string());
  return sequence;
}

}  // namespace touchstone::datasets
