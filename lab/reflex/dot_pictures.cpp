#include "lab/reflex/dot_pictures.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "lab/reflex/press_table.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

/// A chip's picture is grey; a camera or a video may deliver it in colour. @throws Error for 16 bit
cv::Mat grey_of(const cv::Mat& picture) {
  if (picture.depth() != CV_8U) fail("has 16 bit; 8 are needed");
  if (picture.channels() == 1) return picture;
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// The mean of pictures at rest. @throws Error naming the one that can't be read or is of another size
cv::Mat mean_rest(const std::vector<fs::path>& files) {
  cv::Mat sum;
  for (const fs::path& file : files) {
    datasets::on_picture(file, [&](const cv::Mat& picture) {
      const cv::Mat grey = grey_of(picture);
      if (sum.empty()) sum = cv::Mat::zeros(grey.size(), CV_32FC1);
      if (grey.size() != sum.size()) {
        fail("is {} x {}, the first picture at rest is {} x {}", grey.cols, grey.rows, sum.cols, sum.rows);
      }
      cv::accumulate(grey, sum);
    });
  }
  return sum / static_cast<double>(files.size());
}

sensors::ExploreTracker tracker_of(const std::string& name, const cv::Mat& rest,
                                   const sensors::ExploreSettings& settings) {
  try {
    return {rest.depth() == CV_32F ? rest : grey_of(rest), settings};
  } catch (const Error& error) {
    fail("{} (this is the picture at rest; --rest names another): {}", name, error.what());
  }
}

/// Follows all streams. Calls `act(stream, frame, reading, fault)` for each picture: with its reading, or a null
/// pointer and why it is left out. @throws Error for a picture at rest that can't be used
template <typename Act>
void follow(const std::vector<datasets::FrameStream>& streams, const DotPictureSettings& settings, const Act& act) {
  const cv::Mat given = settings.rest.empty() ? cv::Mat() : mean_rest(settings.rest);
  for (std::size_t s = 0; s < streams.size(); ++s) {
    const datasets::FrameStream& stream = streams[s];
    const std::unique_ptr<datasets::FrameSource> source = stream.open();
    std::optional<sensors::ExploreTracker> tracker;
    if (!given.empty()) {
      tracker = tracker_of(settings.rest.front().string(), given, settings.tracker);
    } else if (stream.rest) {
      tracker = tracker_of(stream.name + ": its background", stream.rest(), settings.tracker);
    }
    for (datasets::SourceFrame frame; source->next(frame);) {
      if (!tracker) {
        if (!frame.fault.empty()) fail("{} (this is the picture at rest; --rest names another)", frame.fault);
        tracker = tracker_of(frame.title, frame.image, settings.tracker);
      }
      const sensors::ExploreReading* reading = nullptr;
      const std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
        const sensors::ExploreReading& now = tracker->next({grey_of(image), frame.label.t_us});
        if (now.fault != sensors::PictureFault::none) fail("{}", name_of(now.fault));
        reading = &now;
      });
      act(s, frame, reading, fault);
    }
  }
}

std::string cells_of(const std::optional<Eigen::Vector2d>& both) {
  return both ? fmt::format("{:.5f},{:.5f}", both->x(), both->y()) : ",";
}

}  // namespace

ExploreCalibration calibrate_explore(const std::vector<datasets::FrameStream>& streams, const fs::path& presses,
                                     const DotPictureSettings& settings, int terms, const Progress& progress) {
  std::map<std::string, KnownPress> table = read_press_table(presses);
  const std::int64_t total = datasets::frames_of(streams);
  std::int64_t done = 0;
  ExploreCalibration result;
  std::vector<std::vector<sensors::ExploreSample>> of_stream(streams.size());
  follow(streams, settings,
         [&](std::size_t stream, const datasets::SourceFrame& frame, const sensors::ExploreReading* reading,
             const std::string& fault) {
           if (progress) progress("pictures", ++done, total);
           if (!fault.empty()) result.faults.push_back(fault);
           const auto known = table.find(datasets::name_in_table(frame));
           if (known == table.end()) return;
           const KnownPress& press = known->second;
           if (reading != nullptr) {
             of_stream[stream].push_back(
                 {reading->motion, press.press_mm, press.normal_N, press.lateral_mm, press.shear_N});
           }
           table.erase(known);
         });
  if (!table.empty()) {
    const auto& [name, press] = *table.begin();
    fail_at({presses.string(), press.line}, "file: there is no picture '{}'", name);
  }
  std::vector<sensors::ExploreSample> samples;
  for (const auto& one : of_stream) samples.insert(samples.end(), one.begin(), one.end());
  if (samples.empty()) datasets::require_a_frame(result.faults, result.faults.size());
  result.pictures = std::ssize(samples);
  result.made = sensors::train_explore(samples, terms);
  result.fitted = sensors::test_explore(result.made.model, samples);
  result.left_out = sensors::cross_validate_explore(of_stream, terms);
  return result;
}

ExploreSummary write_explore_forces(const sensors::ExploreModel& model,
                                    const std::vector<datasets::FrameStream>& streams,
                                    const DotPictureSettings& settings, const fs::path& csv, const Progress& progress) {
  const std::int64_t total = datasets::frames_of(streams);
  WholeFileWriter writer(csv);
  writer.append(
      "file,t_us,mode,press_mm,force_x_N,force_y_N,force_z_N,lateral_x_mm,lateral_y_mm,dilation,shift_u_px,shift_v_px,"
      "correlation,true_x_N,true_y_N,true_z_N,fault\n");
  ExploreSummary summary;
  double squares_N2 = 0.0;
  std::int64_t known = 0;
  follow(streams, settings,
         [&](std::size_t, const datasets::SourceFrame& frame, const sensors::ExploreReading* reading,
             const std::string& fault) {
           ++summary.pictures;
           std::string line = fmt::format("{},{},", datasets::csv_cell(datasets::name_in_table(frame)),
                                          frame.label.timed ? fmt::format("{}", frame.label.t_us) : "");
           const std::optional<Eigen::Vector3d>& truth = frame.label.force;
           if (reading != nullptr) {
             (reading->mode == sensors::ExploreMode::absolute ? summary.absolute : summary.relative) += 1;
             const sensors::ExploreForce seen = sensors::estimate(model, reading->motion);
             summary.largest_N = std::max(summary.largest_N, seen.force_N);
             const auto sideways = [&](const Eigen::Vector2d& both) {
               return cells_of(model.shear ? std::optional(both) : std::nullopt);
             };
             line += fmt::format("{},{:.5f},{},{:.5f},{},{:.6f},{},{:.4f},", name_of(reading->mode), seen.press_mm,
                                 sideways(seen.shear_N), seen.force_N, sideways(seen.lateral_mm),
                                 reading->motion.dilation, cells_of(reading->motion.shift_px), reading->correlation);
             if (truth) {
               squares_N2 += std::pow(seen.force_N - truth->z(), 2);
               ++known;
             }
           } else {
             line += "held,,,,,,,,,,,";
             summary.faults.push_back(fault);
           }
           line += truth ? fmt::format("{:.6g},{:.6g},{:.6g},", truth->x(), truth->y(), truth->z()) : ",,,";
           writer.append(line + datasets::csv_cell(fault) + "\n");
           if (progress) progress("pictures", summary.pictures, total);
         });
  datasets::require_a_frame(summary.faults, static_cast<std::size_t>(summary.pictures));
  if (known > 0) summary.rms_N = std::sqrt(squares_N2 / static_cast<double>(known));
  writer.finish();
  return summary;
}

}  // namespace touchstone::lab
