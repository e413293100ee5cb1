#include "lab/gelsight/ball_press_table.h"

#include "datasets/sets/csv_cells.h"
#include "sim/files/image_file.h"

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

std::vector<AnnotatedPress> read_ball_press_table(const fs::path& folder, const fs::path& csv) {
  std::vector<AnnotatedPress> table;
  datasets::for_each_row(csv, kColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    AnnotatedPress press;
    press.where = where;
    press.file = datasets::file_in(folder, cells[0], where);
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

sensors::Background read_background(const std::vector<fs::path>& files) {
  std::vector<cv::Mat> frames;
  for (const fs::path& file : files) {
    frames.push_back(sim::read_image(file));
    const cv::Size size = frames.front().size();
    const std::string fault = sensors::frame_fault(frames.back(), size);
    if (!fault.empty()) fail("{}: {}", file.string(), fault);
  }
  return sensors::mean_background(frames);
}

std::vector<sensors::BallPress> read_ball_presses(const std::vector<AnnotatedPress>& table) {
  std::vector<sensors::BallPress> presses;
  for (const AnnotatedPress& annotated : table) {
    try {
      sensors::BallPress press;
      press.name = annotated.file.filename().string();
      press.frame = sim::read_image(annotated.file);
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
