#include "lab/fit/recorded_balls.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "lab/likeness/contact_depth.h"
#include "lab/likeness/likeness.h"

namespace touchstone::lab {
namespace {

constexpr double kSpare = 1e-6;  // mm, of a depth that an error is kept off the deepest by

/// One standard deviation of a depth: by how much it changes with the contact's radius.
double depth_deviation(const DepthTable& depths, double radius_px, double deviation_px) {
  const double beside = std::max(0.5 * radius_px, radius_px - deviation_px);
  const double here = depths.depth_of(radius_px).value_or(depths.depth_mm.back());
  return here - depths.depth_of(beside).value_or(depths.depth_mm.back());
}

}  // namespace

UnitFitSpec with_recording(UnitFitSpec spec, const std::filesystem::path& cache_folder, const Progress& progress) {
  if (!spec.recording) return spec;
  const RecordingSpec from = *spec.recording;
  sim::DeviceSpec device = sim::read_device(spec.device);
  device.background = cv::Mat();
  device.residual = nullptr;

  LikenessSpec how;
  how.recording = from.folder;
  how.mm_per_px = from.mm_per_px;
  how.learn = from.presses;
  how.rest.assign(from.rest.begin(), from.rest.end());
  BallRecording recording;
  try {
    recording = read_ball_recording(how);
  } catch (const Error& error) {
    fail_at(from.where, "recording: {}", error.what());
  }
  check_recorded_by(device, recording);
  const sim::VirtualSensorSettings settings = settings_for_recordings(device, spec.seed, spec.deepest_mm);
  const sim::VirtualSensor sensor(device, cache_folder, settings, progress);
  check_scale(sensor, recording);

  for (const std::string& name : from.rest) spec.backgrounds.push_back(from.folder / name);
  std::map<double, RecordedBall> balls;
  for (std::size_t i = 0; i < recording.presses.size(); ++i) {
    if (!from.presses.empty() && !recording.learned[i]) continue;
    const sensors::BallPress& seen = recording.presses[i];
    const RecordedBall& ball = recorded_ball(balls, sensor, seen.ball_radius_mm, settings.deepest_mm, progress);
    const DepthTable& depths = ball.depths;
    RecordedPress press;
    press.where = from.where;
    press.picture = seen.name;
    press.frame = frame_for_fit(recording, i);
    press.body = ball.object.spec();
    press.place_mm = sensor.gel_from_pixel(seen.circle->centre);
    if (const auto depth = depths.depth_of(seen.circle->radius)) {
      press.depth_mm = *depth;
    } else {
      press.depth_mm = settings.deepest_mm;
      spec.doubts.push_back(
          fmt::format("{}: the contact of {:.1f} px takes more than the {:.3g} mm that it's pressed in by", seen.name,
                      seen.circle->radius, settings.deepest_mm));
    }
    if (from.radius_sd_px > 0.0) {
      // Three of them stay within what is deepest.
      press.depth_sd_mm = std::clamp(depth_deviation(depths, seen.circle->radius, from.radius_sd_px), 0.0,
                                     std::max(0.0, (settings.deepest_mm - *press.depth_mm) / 3.0 - kSpare));
    }
    spec.presses.push_back(std::move(press));
  }
  if (!spec.deepest_mm) spec.deepest_mm = settings.deepest_mm;
  return spec;
}

}  // namespace touchstone::lab
