#include "datasets/sets/planned_draw.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "datasets/sets/block_record.h"

namespace touchstone::datasets {
namespace {

constexpr std::int64_t kSamplesSearched = 10'000;  // some milliseconds; jobs may have 1e9

/// The outputs of a scene that has what a sample has: a sensor lights and exposes a frame for each sample that asks its
/// camera for anything, and reads height and contact from what each pixel's ray hits first.
sim::OutputSpec outputs_of(const DrawnOutputs& wanted) {
  sim::OutputSpec outputs;
  outputs.frames = wanted.camera();
  outputs.depth = wanted.height;
  outputs.contact = wanted.contact;
  return outputs;
}

/// By force or depth, whichever the job draws; then by the drag.
bool is_harder(const DrawnTouch& one, const DrawnTouch& other) {
  const auto hardness = [](const DrawnTouch& touch) {
    return std::pair(std::isnan(touch.depth_mm) ? touch.force_N : touch.depth_mm, touch.drag_mm);
  };
  return hardness(one) > hardness(other);
}

PlannedDraw planned(const PreparedDraw& prepared, const DrawnTouch& touch) {
  const DrawnUnit unit = drawn_unit(prepared, touch.unit);
  const sim::ObjectSpec object = drawn_object(prepared, touch.object, touch.piece);
  const DrawnOutputs& wanted = prepared.job.outputs;
  PlannedDraw one;
  one.object = prepared.job.draw.objects[static_cast<std::size_t>(touch.object)].file.stem().string();
  one.sample = touch.sample;
  one.unit = touch.unit;
  // A sample that misses the gel is drawn again; to its plan it makes no difference where it would touch.
  double touch_mm = 0.0;
  try {
    touch_mm = sim::first_touch(press_of(touch), object, unit.device.gel);
  } catch (const Error&) {
    touch_mm = 0.0;
  }
  const double rate_Hz = unit.device.camera ? unit.device.camera->frame_rate_Hz : sim::MotionSpec().frame_rate_Hz;
  const sim::MotionSpec motion = sim::press_motion(press_of(touch), touch_mm, object.friction, rate_Hz);
  one.scene = sim::touch_scene(unit.device, drawn_sensor_settings(prepared, unit), object, motion, wanted.camera());
  one.by_maps = wanted.camera() && !one.scene.outputs.camera();
  if (one.scene.outputs.camera()) one.scene.outputs = outputs_of(wanted);
  one.scene.where = prepared.job.where;
  return one;
}

}  // namespace

std::vector<PlannedDraw> planned_draws(const PreparedDraw& prepared, StandsFor which) {
  std::vector<std::optional<DrawnTouch>> chosen(prepared.job.draw.objects.size());
  std::size_t found = 0;
  const std::int64_t searched = std::min(prepared.job.samples, kSamplesSearched);
  for (std::int64_t sample = 0; sample < searched; ++sample) {
    const DrawnTouch touch = drawn_touch(prepared, sample);
    std::optional<DrawnTouch>& of_object = chosen[static_cast<std::size_t>(touch.object)];
    found += of_object ? 0 : 1;
    if (!of_object || (which == StandsFor::hardest && is_harder(touch, *of_object))) of_object = touch;
    if (which == StandsFor::first && found == chosen.size()) break;
  }
  std::vector<PlannedDraw> all;
  for (const std::optional<DrawnTouch>& touch : chosen) {
    if (touch) all.push_back(planned(prepared, *touch));
  }
  return all;
}

}  // namespace touchstone::datasets
