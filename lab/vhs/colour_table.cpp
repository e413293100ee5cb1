#include "lab/vhs/colour_table.h"

#include <fmt/format.h>

#include <map>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

}  // namespace

ColourCalibration calibrate_colour(datasets::TableFrames& frames, const std::vector<fs::path>& card, double smooth_px,
                                   const std::vector<KnownPatch>& patches, const Progress& progress) {
  std::vector<cv::Mat> pictures;
  for (const fs::path& file : card) {
    datasets::naming(file, [&] {
      const cv::Mat picture = frames.read(file);
      pictures.push_back(picture);
      if (picture.type() != CV_8UC3) fail("isn't a colour picture of 8 bit");
      if (picture.size() != pictures.front().size()) fail("isn't of the first picture's size");
    });
  }
  const sensors::FlatField field = sensors::flat_field(pictures, smooth_px);
  ColourCalibration made;
  std::map<fs::path, cv::Mat> charts;
  std::vector<sensors::ColourPatch> seen;
  for (const KnownPatch& patch : patches) {
    const std::string fault = datasets::fault_in([&] {
      datasets::naming(patch.where.file, [&] {
        try {
          auto chart = charts.find(patch.file);
          if (chart == charts.end()) chart = charts.emplace(patch.file, frames.read(patch.file)).first;
          const cv::Mat mask = sensors::rectangle_mask(chart->second.size(), patch.place);
          seen.push_back({sensors::mean_of_white(chart->second, field, mask), patch.lab});
        } catch (const Error& error) {
          fail_at(patch.where, "{}", error.what());
        }
      });
    });
    if (!fault.empty()) made.faults.push_back(fault);
    if (progress) progress("patches", std::ssize(seen) + std::ssize(made.faults), std::ssize(patches));
  }
  if (seen.empty()) fail("none of {} patches can be used; the first: {}", patches.size(), made.faults.front());
  made.model = sensors::calibrate_colour(field, seen);
  made.left_out_de2000 = sensors::cross_validate_colour(seen);
  const cv::Mat& trusted = made.model.field.trusted;
  made.trusted_share = cv::countNonZero(trusted) / static_cast<double>(trusted.total());
  return made;
}

std::vector<NamedRegion> read_region_mask(const fs::path& picture, const cv::Size& size) {
  std::vector<NamedRegion> regions;
  datasets::on_picture(picture, [&](const cv::Mat& mask) {
    if (mask.type() != CV_8UC1) fail("isn't a grey picture of 8 bit");
    if (mask.size() != size) {
      fail("is {} x {}, the model's pictures are {} x {}", mask.cols, mask.rows, size.width, size.height);
    }
    for (int number = 1; number <= 255; ++number) {
      const cv::Mat of_number = mask == number;
      if (cv::countNonZero(of_number) > 0) regions.push_back({std::to_string(number), of_number});
    }
    if (regions.empty()) fail("all of it is 0: there is no region");
  });
  return regions;
}

ColourSummary write_colours(const sensors::ColourModel& model, const std::vector<NamedRegion>& regions,
                            const std::vector<datasets::FrameStream>& streams, const fs::path& csv,
                            const Progress& progress) {
  const std::int64_t total = datasets::frames_of(streams);
  WholeFileWriter writer(csv);
  writer.append("file,t_us,region,L,a,b,trusted_percent,fault\n");
  ColourSummary summary;
  std::int64_t done = 0;
  const cv::Size size = model.field.white.size();
  datasets::for_each_frame(streams, [&](const datasets::SourceFrame& frame) {
    const std::string start = fmt::format("{},{},", datasets::csv_cell(datasets::name_in_table(frame)),
                                          frame.label.timed ? fmt::format("{}", frame.label.t_us) : "");
    std::string lines;
    const std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
      if (image.type() != CV_8UC3 || image.size() != size) {
        fail("isn't a colour picture of 8 bit, {} x {}, as the model's", size.width, size.height);
      }
      for (const NamedRegion& region : regions) {
        lines += start + datasets::csv_cell(region.name) + ",";
        const std::string why = datasets::fault_in([&] {
          const sensors::RegionColour colour = sensors::colour_of(model, image, region.mask);
          lines += fmt::format("{:.3f},{:.3f},{:.3f},{:.1f},\n", colour.lab.x(), colour.lab.y(), colour.lab.z(),
                               100.0 * colour.trusted_share);
          ++summary.colours;
        });
        if (!why.empty()) lines += fmt::format(",,,0.0,{}\n", datasets::csv_cell(why));
      }
    });
    if (fault.empty()) {
      ++summary.pictures;
    } else {
      lines = fmt::format("{},,,,,{}\n", start, datasets::csv_cell(fault));
      summary.faults.push_back(fault);
    }
    writer.append(lines);
    if (progress) progress("pictures", ++done, total);
  });
  datasets::require_a_frame(summary.faults, summary.faults.size() + static_cast<std::size_t>(summary.pictures));
  writer.finish();
  return summary;
}

}  // namespace touchstone::lab
