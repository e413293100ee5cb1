#include "lab/dtact/darkness_maps.h"

#include <iterator>
#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "datasets/sets/csv_cells.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

std::string csv_of(const std::vector<DarknessRecord>& records) {
  std::string csv =
      "file,highest_mm,volume_mm3,contact_mm2,exposure,exposure_followed,deeper_percent,bulged_percent,"
      "saturated_percent,trusted,contact_at_border,fault\n";
  for (const DarknessRecord& record : records) {
    const std::string file = datasets::csv_cell(record.file);
    if (!record.fault.empty()) {
      csv += fmt::format("{},,,,,,,,,0,,{}\n", file, datasets::csv_cell(record.fault));
      continue;
    }
    csv += fmt::format("{},{:.5f},{:.5f},{:.4f},{:.5f},{},{:.3f},{:.3f},{:.3f},{},{},\n", file, record.highest_mm,
                       record.volume_mm3, record.contact_mm2, record.exposure, record.exposure_followed ? 1 : 0,
                       record.deeper_percent, record.bulged_percent, record.saturated_percent, record.trusted ? 1 : 0,
                       record.contact_at_border ? 1 : 0);
  }
  return csv;
}

DarknessRecord record_of(const sensors::DarknessResult& result, double pixel_mm2) {
  DarknessRecord record;
  cv::minMaxLoc(result.height_mm, nullptr, &record.highest_mm);
  record.volume_mm3 = pixel_mm2 * cv::sum(result.height_mm)[0];
  record.contact_mm2 = pixel_mm2 * result.contact_pixels;
  record.exposure = result.exposure;
  record.exposure_followed = result.exposure_followed;
  record.deeper_percent = 100.0 * result.deeper_share;
  record.bulged_percent = 100.0 * result.bulged_share;
  record.saturated_percent = 100.0 * result.saturated_share;
  record.trusted = result.trusted();
  record.contact_at_border = result.contact_at_border;
  return record;
}

}  // namespace

std::vector<DarknessRecord> write_darkness_maps(const sensors::DarknessModel& model,
                                                const std::vector<datasets::FrameStream>& streams,
                                                const fs::path& folder, HeightFormat format, bool doubt,
                                                const Progress& progress, const ShownDarkness& show) {
  sensors::DarknessEstimator estimator(model);
  fs::create_directories(folder);
  const double pixel_mm2 = model.mm_per_px * model.mm_per_px;
  const std::int64_t total = datasets::frames_of(streams);
  std::vector<DarknessRecord> records;
  datasets::for_each_frame(streams, [&](const datasets::SourceFrame& frame) {
    DarknessRecord record;
    const sensors::DarknessResult* result = nullptr;
    const std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      result = &estimator.estimate(image);
      record = record_of(*result, pixel_mm2);
      if (show) show(frame, *result);
    });
    record.file = datasets::name_in_table(frame);
    if (fault.empty()) {
      write_height_map(result->height_mm, folder / (frame.stem + ".png"), format);
      if (doubt) sim::write_png(folder / (frame.stem + "-doubt.png"), result->doubt);
    } else {
      record.trusted = false;
      record.fault = fault;
    }
    records.push_back(record);
    if (progress) progress("heights", std::ssize(records), total);
  });
  faults_of(records);  // an error where there is nothing to write
  write_whole_file(folder / "heights.csv", csv_of(records));
  return records;
}

}  // namespace touchstone::lab
