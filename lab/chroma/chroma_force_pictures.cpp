#include "lab/chroma/chroma_force_pictures.h"

#include <utility>

#include "core/error.h"
#include "sensors/colour/hue_estimator.h"
#include "sensors/tractions/seen_markers.h"

namespace touchstone::lab {
namespace {

constexpr double kLeastMoved_mm = 0.03;  // of a marker that calibration takes: most stand still
constexpr double kFast = 1.5;            // friction that holds the gel

ForceProbe calibration_probe(ProbeShape shape, double width_mm, double depth_mm, Eigen::Vector2d place,
                             double direction_rad) {
  return {shape, width_mm, place, depth_mm, kFast, direction_rad};
}

std::vector<sensors::HueModelForm> forms_to_try() {
  std::vector<sensors::HueModelForm> forms;
  for (const bool coloured_area : {false, true}) {
    for (int degree = 1; degree <= 3; ++degree) {
      for (const double ridge : {1e-3, 1e-5}) {
        sensors::HueModelForm form;
        form.form = sensors::HueForm::kIsotropic;
        form.features.coloured_area = coloured_area;
        form.degree = degree;
        form.ridge = ridge;
        forms.push_back(form);
      }
    }
  }
  return forms;
}

}  // namespace

sim::ObjectSpec visible_object(const ForceProbe& probe) {
  sim::ObjectSpec object;
  object.name = name_of(probe.shape);
  object.friction = probe.friction;
  const fem::ContactShape shape = contact_shape(probe);
  if (const auto* box = std::get_if<fem::BoxShape>(&shape)) {
    object.shape.type = sim::ShapeKind::box;
    object.shape.size_mm = box->size;
  } else if (const auto* cylinder = std::get_if<fem::RoundedCylinder>(&shape)) {
    object.shape.type = sim::ShapeKind::rounded_cylinder;
    object.shape.radius_mm = cylinder->radius;
    object.shape.edge_radius_mm = cylinder->edge_radius;
    object.shape.height_mm = cylinder->height;
  } else {
    object.shape.type = sim::ShapeKind::sphere;
    object.shape.radius_mm = std::get<fem::SphereShape>(shape).radius;
  }
  return object;
}

std::vector<ChromaRecord> photograph_probe(const ForceSetup& setup, const ChromaSetup& camera, const ForceProbe& probe,
                                           const DragSettings& drag, std::uint64_t noise_seed) {
  std::vector<sim::Truth> states;
  play_probe(setup, probe, drag, [&](const ForceFrame& frame) {
    sim::Truth state;
    state.frame = frame.number;
    state.press = frame.press;
    states.push_back(std::move(state));
  });
  return camera.record(visible_object(probe), states, noise_seed);
}

std::vector<ForceProbe> calibration_probes(bool quick) {
  std::vector<ForceProbe> probes = {
      calibration_probe(ProbeShape::hemisphere, 12.0, 1.7, {1.0, 1.2}, 0.4),
      calibration_probe(ProbeShape::cylinder, 9.0, 0.6, {-1.3, 0.8}, 2.3),
      calibration_probe(ProbeShape::hemisphere, 16.0, 1.0, {-2.1, -1.6}, 4.4),
  };
  if (quick) return probes;
  probes.push_back(calibration_probe(ProbeShape::cylinder, 8.0, 1.0, {3.2, -2.4}, 5.6));
  probes.push_back(calibration_probe(ProbeShape::hemisphere, 8.0, 1.6, {-4.6, 3.1}, 1.1));
  probes.push_back(calibration_probe(ProbeShape::cylinder, 9.0, 0.35, {4.3, 3.9}, 3.5));
  probes.push_back(calibration_probe(ProbeShape::hemisphere, 14.0, 1.4, {0.3, -4.7}, 2.8));
  probes.push_back(calibration_probe(ProbeShape::cylinder, 8.0, 0.7, {-5.2, -3.7}, 0.0));
  return probes;
}

sensors::HueModel calibrate_on_probes(const ForceSetup& setup, const ChromaSetup& camera, bool quick,
                                      std::uint64_t noise_seed) {
  const DragSettings drag{.step_mm = quick ? 0.5 : 0.25, .longest_mm = 1.5};
  std::vector<sensors::HueSample> samples;
  int series = 0;
  for (const ForceProbe& probe : calibration_probes(quick)) {
    const auto records = photograph_probe(setup, camera, probe, drag, noise_seed + static_cast<std::uint64_t>(series));
    const auto moved = samples_of_moved(records, kLeastMoved_mm, series++);
    samples.insert(samples.end(), moved.begin(), moved.end());
  }
  return best_hue_model(camera, samples, forms_to_try(), HueAim::displacement);
}

std::vector<sensors::MarkerField> fields_of(const std::vector<ChromaRecord>& records, const ChromaSetup& camera,
                                            const sensors::HueModel& model,
                                            const sensors::MarkerCompliance& compliance) {
  const sensors::HueEstimator estimator(model, camera.rest());
  std::vector<sensors::MarkerField> fields;
  for (const ChromaRecord& record : records) {
    fields.push_back(sensors::as_seen(estimator.estimate(record.reading).field, compliance, model.parallax));
  }
  return fields;
}

MarkerReader fields_from(std::vector<sensors::MarkerField> fields) {
  return [fields = std::move(fields)](const ForceFrame& frame) {
    TS_ASSERT(static_cast<std::size_t>(frame.number) < fields.size());
    return fields[static_cast<std::size_t>(frame.number)];
  };
}

}  // namespace touchstone::lab
