#include "lab/gelsight/height_maps.h"

#include <iterator>
#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "datasets/sets/csv_cells.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr double kLevelsPerMm = 10000.0;
constexpr double kZeroLevel = 10000.0;

std::string csv_of(const std::vector<HeightRecord>& records) {
  std::string csv = "file,highest_mm,volume_mm3,contact_mm2,saturated_percent,trusted,contact_at_border,fault\n";
  for (const HeightRecord& record : records) {
    const std::string file = datasets::csv_cell(record.file);
    if (!record.fault.empty()) {
      csv += fmt::format("{},,,,,0,,{}\n", file, datasets::csv_cell(record.fault));
      continue;
    }
    csv += fmt::format("{},{:.5f},{:.5f},{:.4f},{:.3f},{},{},\n", file, record.highest_mm, record.volume_mm3,
                       record.contact_mm2, record.saturated_percent, record.trusted ? 1 : 0,
                       record.contact_at_border ? 1 : 0);
  }
  return csv;
}

}  // namespace

void write_height_map(const cv::Mat& height_mm, fs::path file, HeightFormat format) {
  if (file.has_parent_path()) fs::create_directories(file.parent_path());
  if (format == HeightFormat::exr) {
    sim::write_exr(file.replace_extension(".exr"), height_mm, {"height_mm"});
    return;
  }
  cv::Mat levels;
  height_mm.convertTo(levels, CV_16U, kLevelsPerMm, kZeroLevel);
  sim::write_png(
      file.replace_extension(".png"), levels,
      {{"mm_per_level", fmt::format("{}", 1.0 / kLevelsPerMm)}, {"zero_level", fmt::format("{}", kZeroLevel)}});
}

std::vector<HeightRecord> write_height_maps(
    const sensors::HeightModel& model, const sensors::HeightSettings& settings,
    const std::vector<datasets::FrameStream>& streams, const fs::path& folder, HeightFormat format,
    const Progress& progress,
    const std::function<void(const datasets::SourceFrame& frame, const sensors::HeightResult& result)>& show) {
  sensors::HeightEstimator estimator(model, settings);
  fs::create_directories(folder);
  const double pixel_mm2 = model.mm_per_px * model.mm_per_px;
  const std::int64_t total = datasets::frames_of(streams);
  std::vector<HeightRecord> records;
  datasets::for_each_frame(streams, [&](const datasets::SourceFrame& frame) {
    HeightRecord record;
    record.file = datasets::name_in_table(frame);
    cv::Mat height_mm;
    record.fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      const sensors::HeightResult& result = estimator.estimate(image);
      cv::minMaxLoc(result.height_mm, nullptr, &record.highest_mm);
      record.volume_mm3 = pixel_mm2 * cv::sum(result.height_mm)[0];
      record.contact_mm2 = pixel_mm2 * result.contact_pixels;
      record.saturated_percent = 100.0 * result.saturated_share;
      record.trusted = result.trusted();
      record.contact_at_border = result.contact_at_border;
      height_mm = result.height_mm;
      if (show) show(frame, result);
    });
    if (record.fault.empty()) {
      write_height_map(height_mm, folder / (frame.stem + ".png"), format);
    } else {
      record.trusted = false;
    }
    records.push_back(record);
    if (progress) progress("heights", std::ssize(records), total);
  });
  faults_of(records);  // an error where there is nothing to write
  write_whole_file(folder / "heights.csv", csv_of(records));
  return records;
}

}  // namespace touchstone::lab
