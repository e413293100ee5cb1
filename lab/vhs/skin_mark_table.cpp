#include "lab/vhs/skin_mark_table.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

std::string mark_lines(const std::string& start, const std::vector<sensors::SkinMark>& marks, MarkSummary& summary) {
  if (marks.empty()) return start + ",,,,,,,,,\n";
  std::string lines;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const sensors::SkinMark& mark = marks[i];
    switch (mark.kind) {
      case sensors::SkinMarkKind::erythema:
        ++summary.erythema;
        break;
      case sensors::SkinMarkKind::purpura:
        ++summary.purpura;
        break;
      case sensors::SkinMarkKind::unknown:
        ++summary.unknown;
        break;
    }
    lines += fmt::format("{}{},{},{:.2f},{:.2f},{:.0f},{:.3f},{:.3f},{:.4f},{:.4f},\n", start, i,
                         sensors::name_of(mark.kind), mark.centre.x(), mark.centre.y(), mark.area_px, mark.index_before,
                         mark.index_pressed, mark.blanched, mark.darkened);
  }
  return lines;
}

}  // namespace

MarkSummary write_skin_marks(const std::vector<datasets::FrameStream>& streams, const fs::path& before,
                             const sensors::SkinMarkSettings& settings, const fs::path& csv, const Progress& progress) {
  const std::int64_t total = datasets::frames_of(streams);
  WholeFileWriter writer(csv);
  writer.append("file,t_us,mark,kind,u_px,v_px,area_px,index_before,index_pressed,blanched,darkened,fault\n");
  MarkSummary summary;
  std::int64_t done = 0;
  cv::Mat given;
  if (!before.empty()) given = sim::read_image(before);
  for (const datasets::FrameStream& stream : streams) {
    const std::unique_ptr<datasets::FrameSource> source = stream.open();
    const cv::Mat rest = given.empty() ? datasets::first_frame(*source, stream.name).image : given;
    if (given.empty()) ++done;
    for (datasets::SourceFrame frame; source->next(frame);) {
      const std::string start = fmt::format("{},{},", datasets::csv_cell(datasets::name_in_table(frame)),
                                            frame.label.timed ? fmt::format("{}", frame.label.t_us) : "");
      std::string lines;
      const std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
        lines = mark_lines(start, sensors::skin_marks(rest, image, settings), summary);
      });
      if (fault.empty()) {
        ++summary.pictures;
      } else {
        lines = fmt::format("{},,,,,,,,,{}\n", start, datasets::csv_cell(fault));
        summary.faults.push_back(fault);
      }
      writer.append(lines);
      if (progress) progress("pictures", ++done, total);
    }
  }
  const std::size_t all = summary.faults.size() + static_cast<std::size_t>(summary.pictures);
  if (all == 0) fail("there is no picture under pressure: the only one is that before it");
  datasets::require_a_frame(summary.faults, all);
  writer.finish();
  return summary;
}

}  // namespace touchstone::lab
