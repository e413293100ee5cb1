#include "lab/gelsight/mark_table.h"

#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {

sensors::PlaceMap read_place_map(const std::filesystem::path& csv, const cv::Size& size) {
  std::vector<Eigen::Vector2d> pixels, places;
  datasets::for_each_row(csv, "u_px,v_px,x_mm,y_mm",
                         [&](const SourceLocation& where, const std::vector<std::string>& cells) {
                           const auto number = [&](std::size_t i, const char* field) {
                             return datasets::number_in(cells[i], field, where);
                           };
                           pixels.emplace_back(number(0, "u_px") - 0.5, number(1, "v_px") - 0.5);  // continuous indices
                           places.emplace_back(number(2, "x_mm"), number(3, "y_mm"));
                         });
  sensors::PlaceMap map;
  datasets::naming(csv, [&] { map = sensors::fit_place_map(pixels, places, size); });
  return map;
}

}  // namespace touchstone::lab
