#include "datasets/sets/block_record.h"

#include <algorithm>

#include "datasets/sets/run_identity.h"
#include "sim/press/gel_setup.h"

namespace touchstone::datasets {
namespace {

constexpr int kBackgroundFrame = 1;  // of the unit's noise; samples have seeds of their own

/// Of all but the job, which the sensor's settings and the unit's text stand for.
RunIdentity light_identity(const PreparedDraw& prepared) {
  RunIdentity identity = identity_of(prepared.text, prepared.inputs);
  identity.job_sha256.clear();
  identity.inputs_sha256.clear();
  for (const InputFile& input : prepared.inputs) {
    if (!input.name.ends_with(".yaml")) identity.inputs_sha256 += input.sha256;  // spectra, that devices name
  }
  return identity;
}

Eigen::MatrixX3d rows_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t k = 0; k < points.size(); ++k) rows.row(static_cast<Eigen::Index>(k)) = points[k].transpose();
  return rows;
}

BlockRecord pressed(const PreparedDraw& prepared, const sim::VirtualSensor& sensor, const sim::TouchObject& object,
                    const DrawnTouch& touch) {
  const DrawnOutputs& wanted = prepared.job.outputs;
  sim::TouchOptions options;
  options.picture = wanted.camera();
  options.truth = wanted.height || wanted.contact;
  options.noise_seed = touch.seed;
  const sim::Touch seen = sensor.press(object, press_of(touch), options);
  const fem::PressState& press = seen.press;
  BlockRecord record;
  record.touch = touch;
  record.wrench = press.wrench;
  record.force_error_N = seen.error.force;
  record.pose << press.gel_from_object.rotation, press.gel_from_object.translation;
  record.contact_area_mm2 = press.contact_area;
  record.deepest_mm = std::max(0.0, -press.surface_displacement.col(2).minCoeff());
  record.largest_strain = press.largest_strain;
  record.under_resolved = press.under_resolved;
  if (wanted.frame) record.frame = seen.frame;
  if (wanted.height) record.height = seen.height;
  if (wanted.contact) record.contact = seen.contact;
  if (wanted.beads) record.beads_mm = press.bead_displacement;
  if (wanted.markers) record.markers_mm = seen.marker_displacement;
  if (wanted.traction) record.traction_MPa = press.traction;
  if (wanted.events) record.events = seen.events;
  if (wanted.statistics) record.statistics = seen.statistics.value();
  return record;
}

}  // namespace

sim::VirtualSensorSettings drawn_sensor_settings(const PreparedDraw& prepared, const DrawnUnit& unit) {
  sim::VirtualSensorSettings settings;
  settings.seed = unit.seed;
  settings.deepest_mm = prepared.deepest_mm;
  settings.widest_mm = prepared.widest_mm;
  settings.membrane_um = prepared.job.membrane_um;
  settings.interreflection_tolerance = prepared.job.interreflection_tolerance;
  settings.edge_side = prepared.job.edge_side;
  settings.guides = prepared.job.guides;
  settings.effects = prepared.effects;
  settings.always_friction = true;  // else a straight press would have none beside a tilted one that has
  return settings;
}

SensorSource virtual_sensors(const std::filesystem::path& cache_folder) {
  return [cache_folder](const PreparedDraw& prepared, const DrawnUnit& unit) {
    sim::VirtualSensorSettings settings = drawn_sensor_settings(prepared, unit);
    settings.light_key = to_json(light_identity(prepared)) + unit.text;
    if (const auto accuracy = sim::accuracy_of(unit.device.accuracy, {})) {
      settings.light_key += fmt::format("\naccuracy {} {} {} {} {}", accuracy->force_percent, accuracy->pixel_noise,
                                        accuracy->marker_px, accuracy->height_um, accuracy->event_percent);
    }
    sim::cache_gel_of_unit_modulus(unit.device, cache_folder);
    const auto sensor = std::make_shared<const sim::VirtualSensor>(unit.device, cache_folder, settings);
    UnitSensor made;
    const DrawnOutputs& wanted = prepared.job.outputs;
    made.light = "none: no picture is asked for";
    if (wanted.camera()) {
      made.light = sensor->light().reason;
      made.background = sensor->background(unit.seed, kBackgroundFrame);
    }
    if (wanted.beads) made.bead_places_mm = rows_of(sim::bead_centres(unit.device.beads.value()));
    if (wanted.markers) made.marker_places_mm = sensor->marker_places_mm();
    if (wanted.traction) made.gel_vertices_mm = rows_of(sensor->gel().vertices);
    made.press = [&prepared, sensor](const DrawnTouch& touch, const sim::ObjectSpec& object) {
      const sim::TouchObject touching = sensor->object(object);  // what can't be taken at all isn't drawn again
      try {
        return pressed(prepared, *sensor, touching, touch);
      } catch (const Error& error) {
        throw Unpressable(error.what());
      }
    };
    return made;
  };
}

}  // namespace touchstone::datasets
