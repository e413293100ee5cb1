#include "datasets/sets/planned_draw.h"

#include <algorithm>
#include <optional>

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

std::vector<PlannedDraw> planned_draws(const PreparedDraw& prepared) {
  const std::size_t objects = prepared.job.draw.objects.size();
  std::vector<std::optional<DrawnTouch>> first(objects);
  std::size_t found = 0;
  const std::int64_t searched = std::min(prepared.job.samples, kSamplesSearched);
  for (std::int64_t sample = 0; sample < searched && found < objects; ++sample) {
    const DrawnTouch touch = drawn_touch(prepared, sample);
    std::optional<DrawnTouch>& of_object = first[static_cast<std::size_t>(touch.object)];
    if (of_object) continue;
    of_object = touch;
    ++found;
  }
  std::vector<PlannedDraw> all;
  for (const std::optional<DrawnTouch>& touch : first) {
    if (touch) all.push_back(planned(prepared, *touch));
  }
  return all;
}

}  // namespace touchstone::datasets
