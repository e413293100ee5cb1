#include "lab/gelsight/touch_force_calibration.h"

#include "core/error.h"
#include "datasets/inspection/on_picture.h"

namespace touchstone::lab {

TouchForceCalibration calibrate_touch_forces(const std::vector<datasets::FrameSequence>& sequences,
                                             const sensors::TouchCalibration& parts, const std::filesystem::path& rest,
                                             const std::string& gel, const std::string& indenter,
                                             const Progress& progress) {
  std::int64_t total = 0, done = 0;
  for (const datasets::FrameSequence& sequence : sequences) total += std::ssize(sequence.frames);
  TouchForceCalibration made;
  std::vector<sensors::TouchForceSample> samples;
  sensors::TouchCalibration without_lines = parts;
  without_lines.normal.reset();
  without_lines.shear.reset();
  const double mm_per_px = parts.height && parts.mm_per_px == 0.0 ? parts.height->mm_per_px : parts.mm_per_px;
  int series = 0;
  for (const datasets::FrameSequence& sequence : sequences) {
    std::optional<sensors::TouchReader> reader;
    datasets::on_picture(rest.empty() ? sequence.frames.front().file : rest,
                         [&](const cv::Mat& image) { reader.emplace(sensors::at_rest(without_lines, image)); });
    for (const datasets::LabelledFrame& frame : sequence.frames) {
      if (!frame.force) fail("{}: its force isn't known", frame.file.string());
      std::string fault = datasets::fault_on_picture(frame.file, [&](const cv::Mat& image) {
        ++made.frames;
        const sensors::TouchReading& touch = reader->read({image, frame.t_us});
        if (auto sample = sensors::force_sample(touch, *frame.force, mm_per_px, series)) samples.push_back(*sample);
      });
      if (!fault.empty()) made.faults.push_back(std::move(fault));
      if (progress) progress("touches", ++done, total);
    }
    ++series;
  }
  datasets::require_a_frame(made.faults, static_cast<std::size_t>(total));
  made.samples = static_cast<int>(samples.size());
  made.fit = sensors::fit_gel_forces(samples, mm_per_px, gel, indenter);
  return made;
}

}  // namespace touchstone::lab
