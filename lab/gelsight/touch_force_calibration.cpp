#include "lab/gelsight/touch_force_calibration.h"

#include "core/error.h"
#include "datasets/inspection/on_picture.h"

namespace touchstone::lab {

TouchForceCalibration calibrate_touch_forces(const std::vector<datasets::FrameStream>& streams,
                                             const sensors::TouchCalibration& parts, const std::filesystem::path& rest,
                                             const std::string& gel, const std::string& indenter,
                                             const Progress& progress) {
  const std::int64_t total = datasets::frames_of(streams);
  std::int64_t done = 0;
  TouchForceCalibration made;
  std::vector<sensors::TouchForceSample> samples;
  sensors::TouchCalibration without_lines = parts;
  without_lines.normal.reset();
  without_lines.shear.reset();
  const double mm_per_px = parts.height && parts.mm_per_px == 0.0 ? parts.height->mm_per_px : parts.mm_per_px;
  int series = 0;
  for (const datasets::FrameStream& stream : streams) {
    std::optional<sensors::TouchReader> reader;
    const auto rests_on = [&](const cv::Mat& image) { reader.emplace(sensors::at_rest(without_lines, image)); };
    const auto read = [&](const datasets::SourceFrame& frame) {
      std::string fault = datasets::fault_on_frame(frame, [&](const cv::Mat& image) {
        ++made.frames;
        const sensors::TouchReading& touch = reader->read({image, frame.label.t_us});
        if (auto sample = sensors::force_sample(touch, *frame.label.force, mm_per_px, series)) {
          samples.push_back(*sample);
        }
      });
      if (!fault.empty()) made.faults.push_back(std::move(fault));
      ++done;
      if (progress) progress("touches", done, total);
    };
    const auto needs_force = [](const datasets::SourceFrame& frame) {
      if (frame.fault.empty() && !frame.label.force) fail("{}: its force isn't known", frame.title);
    };
    const std::unique_ptr<datasets::FrameSource> source = stream.open();
    if (!rest.empty()) {
      datasets::on_picture(rest, rests_on);
    } else if (stream.rest) {
      datasets::naming(stream.name, [&] { rests_on(stream.rest()); });
    } else {
      const datasets::SourceFrame first = datasets::first_frame(*source, stream.name);
      datasets::naming(first.title, [&] { rests_on(first.image); });
      needs_force(first);
      read(first);
    }
    for (datasets::SourceFrame frame; source->next(frame);) {
      needs_force(frame);
      read(frame);
    }
    ++series;
  }
  datasets::require_a_frame(made.faults, static_cast<std::size_t>(done));
  made.samples = static_cast<int>(samples.size());
  made.fit = sensors::fit_gel_forces(samples, mm_per_px, gel, indenter);
  return made;
}

}  // namespace touchstone::lab
