#include "lab/gelsight/place_table.h"

#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

}  // namespace

PlaceReader::PlaceReader(HeightSource& source, fs::path marks) : source_(source), marks_(std::move(marks)) {}

sensors::TouchImage PlaceReader::touch_of(const cv::Mat& heights) const {
  const cv::Mat contact = sensors::higher_part(heights);
  return places_ ? sensors::rectified(heights, contact, *places_)
                 : sensors::TouchImage{heights.clone(), contact, source_.mm_per_px()};
}

template <typename Register>
std::vector<PlaceRecord> PlaceReader::for_touches(const Register& with, const Progress& progress) {
  std::vector<PlaceRecord> records;
  std::vector<std::string> faults;
  const std::int64_t total = source_.maps();
  for (SourceHeights map; source_.next(map);) {
    PlaceRecord record;
    record.file = map.file;
    record.fault = map.fault;
    if (map.fault.empty()) {
      // A table of marks that can't be used is no fault of a frame.
      if (!marks_.empty() && !places_) places_ = read_place_map(marks_, map.height_mm.size());
      record.fault = datasets::fault_in(
          [&] { datasets::naming(map.title, [&] { record.found = with(touch_of(map.height_mm)); }); });
    }
    if (!record.fault.empty()) faults.push_back(record.fault);
    records.push_back(std::move(record));
    if (progress) progress("places", std::ssize(records), total);
  }
  datasets::require_a_frame(faults, records.size());
  return records;
}

sensors::TactileMap PlaceReader::build(const sensors::TactileMapSettings& settings, std::vector<PlaceRecord>& records,
                                       const Progress& progress) {
  sensors::TactileMap map(settings);
  records = for_touches([&](const sensors::TouchImage& touch) { return map.add(touch); }, progress);
  if (map.empty()) fail("none of {} files shows contact", records.size());
  return map;
}

std::vector<PlaceRecord> PlaceReader::localise(const sensors::TactileMap& map, const Progress& progress) {
  return for_touches([&](const sensors::TouchImage& touch) { return map.localise(touch); }, progress);
}

std::string to_csv(const std::vector<PlaceRecord>& records) {
  std::string csv = "file,outcome,x_mm,y_mm,angle_deg,confidence,inliers,correlation,overlap,fault\n";
  for (const PlaceRecord& record : records) {
    const std::string file = datasets::csv_cell(record.file);
    const sensors::Registration& found = record.found;
    if (!record.fault.empty()) {
      csv += fmt::format("{},,,,,,,,,{}\n", file, datasets::csv_cell(record.fault));
      continue;
    }
    const std::string pose = found.localised() ? fmt::format("{:.4f},{:.4f},{:.3f}", found.to_from_from.translation.x(),
                                                             found.to_from_from.translation.y(),
                                                             found.to_from_from.angle / kRadiansPerDegree)
                                               : ",,";
    csv += fmt::format("{},{},{},{:.4f},{},{:.4f},{:.4f},\n", file, sensors::name_of(found.outcome), pose,
                       found.confidence, found.inliers, found.correlation, found.overlap);
  }
  return csv;
}

}  // namespace touchstone::lab
