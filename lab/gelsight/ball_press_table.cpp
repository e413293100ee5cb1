#include "lab/gelsight/ball_press_table.h"

#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kColumns = "file,u_px,v_px,radius_px,ball_diameter_mm";

double above_zero(const std::string& cell, const char* field, const SourceLocation& where) {
  const double value = datasets::number_in(cell, field, where);
  if (!(value > 0.0)) fail_at(where, "{}: {} must be above 0", field, value);
  return value;
}

}  // namespace

std::vector<AnnotatedPress> read_ball_press_table(datasets::TableFrames& frames, const fs::path& csv) {
  std::vector<AnnotatedPress> table;
  datasets::for_each_row(csv, kColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    AnnotatedPress press;
    press.where = where;
    press.file = frames.named(cells[0], where);
    if (!(cells[1].empty() && cells[2].empty() && cells[3].empty())) {
      sensors::ContactCircle circle;
      circle.centre.x() = datasets::number_in(cells[1], "u_px", where);
      circle.centre.y() = datasets::number_in(cells[2], "v_px", where);
      circle.radius = above_zero(cells[3], "radius_px", where);
      press.circle = circle;
    }
    press.ball_diameter_mm = above_zero(cells[4], "ball_diameter_mm", where);
    table.push_back(std::move(press));
  });
  if (table.empty()) fail("{}: has no press", csv.string());
  return table;
}

std::vector<fs::path> rest_files(datasets::TableFrames& frames, const std::vector<fs::path>& names) {
  std::vector<fs::path> files;
  for (const fs::path& name : names) files.push_back(frames.named_or_file(name));
  return files;
}

sensors::Background read_background(datasets::TableFrames& frames, const std::vector<fs::path>& files) {
  std::vector<cv::Mat> pictures;
  for (const fs::path& file : files) {
    pictures.push_back(frames.read(file));
    const cv::Size size = pictures.front().size();
    const std::string fault = sensors::frame_fault(pictures.back(), size);
    if (!fault.empty()) fail("{}: {}", file.string(), fault);
  }
  return sensors::mean_background(pictures);
}

std::vector<sensors::BallPress> read_ball_presses(datasets::TableFrames& frames,
                                                  const std::vector<AnnotatedPress>& table) {
  std::vector<sensors::BallPress> presses;
  for (const AnnotatedPress& annotated : table) {
    try {
      sensors::BallPress press;
      press.name = annotated.file.filename().string();
      press.frame = frames.read(annotated.file);
      press.ball_radius_mm = 0.5 * annotated.ball_diameter_mm;
      press.circle = annotated.circle;
      presses.push_back(std::move(press));
    } catch (const Error& error) {
      fail_at(annotated.where, "{}", error.what());
    }
  }
  return presses;
}

}  // namespace touchstone::lab
