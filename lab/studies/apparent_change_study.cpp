#include "lab/studies/apparent_change_study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/error.h"
#include "core/named_file.h"
#include "datasets/jobs/job.h"
#include "fem/mesh/gel_body.h"
#include "lab/press/pressed_marker.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"

namespace touchstone::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kColumn = "marker";  // what the formula presses

template <typename E>
std::string name_in(E value) {
  for (const auto& [name, known] : enum_names(E{})) {
    if (known == value) return name;
  }
  TS_ASSERT(false);
  return {};
}

void require_rising(const std::vector<double>& values, const SourceLocation& where, const char* key) {
  if (values.empty()) fail_at(where, "{}: is empty; at least one number is needed", key);
  for (std::size_t k = 1; k < values.size(); ++k) {
    if (!(values[k] > values[k - 1])) {
      fail_at(where, "{}: {} stands after {}; the numbers must rise", key, values[k], values[k - 1]);
    }
  }
}

bool asks_for(const ApparentChangeSpec& spec, ApparentSource source) {
  return std::find(spec.by.begin(), spec.by.end(), source) != spec.by.end();
}

double distance_of(const ApparentChangeSpec& spec, double lens_mm) {
  return distance_in_view(spec.marker_mm, angle_of_view(lens_mm, spec.sensor_mm), spec.markers_in_view);
}

/// A number, or NaN where a formula refuses its arguments.
template <typename Formula>
double or_none(const Formula& formula) {
  try {
    return formula();
  } catch (const Error&) {
    return kNone;
  }
}

ApparentChangeRow formula_row(const ApparentChangeSpec& spec, const sim::GelSpec& gel, double force, double lens) {
  ApparentChangeRow row;
  row.object = kColumn;
  ChromaDesign design;
  design.marker = {spec.marker_mm, gel.youngs_modulus_MPa, gel.poisson_ratio};
  design.force_N = force;
  design.distance_mm = distance_of(spec, lens);
  const double t = gel.thickness_mm;
  row.displacement_mm = or_none([&] { return column_displacement(force, design.marker, t); });
  row.stretch = or_none([&] { return column_stretch(row.displacement_mm, t, gel.poisson_ratio); });
  row.largest_strain = row.displacement_mm / t;
  for (int k = 0; k < kStudiedMeasureCount; ++k) {
    row.measure[k] = or_none([&] { return apparent_measure(kStudiedMeasures[k], design, t); });
  }
  return row;
}

/// A square outline at a height of the gel frame.
std::vector<Eigen::Vector3d> square_at(double side, double z) {
  const double h = 0.5 * side;
  return {{-h, -h, z}, {h, -h, z}, {h, h, z}, {-h, h, z}};
}

ApparentChangeRow seen_row(const ApparentChangeSpec& spec, const sim::DeviceSpec& device, const PressedMarker& pressed,
                           double lens) {
  ApparentChangeRow row;
  row.displacement_mm = pressed.displacement_mm;
  row.stretch = pressed.stretch;
  row.largest_strain = pressed.largest_strain;
  const double t = device.gel.thickness_mm;
  const render::Scene faces =
      bare_faces(t, device.gel.refractive_index, device.plate.thickness_mm, device.plate.refractive_index);
  const double distance = distance_of(spec, lens);
  for (int k = 0; k < kStudiedMeasureCount; ++k) {
    const bool whole = kStudiedMeasures[k] == ApparentMeasure::relative_whole_fixed;
    row.measure[k] = or_none([&] {
      const render::ReadyCamera camera = camera_before(lens, whole ? distance : distance + t);
      const auto side = [&](const std::vector<Eigen::Vector3d>& outline) {
        return std::sqrt(pictured_area(faces, camera, outline));
      };
      const double now = side(pressed.outline);
      const double rest = side(square_at(spec.marker_mm, 0.0));
      if (kStudiedMeasures[k] == ApparentMeasure::picture_film_fixed) {
        return (now - rest) / side(square_at(spec.marker_mm, -t));
      }
      if (kStudiedMeasures[k] == ApparentMeasure::area_film_fixed) {
        return (now * now - rest * rest) / std::pow(side(square_at(spec.marker_mm, -t)), 2);
      }
      return now / rest - 1.0;
    });
  }
  return row;
}

/// The rows of one device: all objects, forces and lenses.
void press_all(const ApparentChangeSpec& spec, const sim::DeviceSpec& device, double value, ApparentSource source,
               const std::filesystem::path& cache, ApparentChangeResult& result) {
  const bool finite = source == ApparentSource::finite;
  const auto linear_gel = finite ? nullptr : sim::set_up_gel(device, cache);
  const auto finite_gel = finite ? sim::set_up_finite_gel(device) : nullptr;
  const auto& vertices = finite ? finite_gel->rest.vertices : linear_gel->vertices;
  const auto& triangles = finite ? finite_gel->rest.triangles : linear_gel->triangles;
  const MarkerPoints marker = square_marker(vertices, triangles, spec.marker_mm);
  for (const sim::ObjectSpec& object : spec.objects) {
    const fem::ContactShape shape = sim::coarse_contact_shape(object, device.mesh.fine_mm);
    const double friction = spec.friction.value_or(object.friction);
    const MarkerPresses presses = finite ? press_marker(*finite_gel, marker, shape, friction, spec.force_N)
                                         : press_marker(*linear_gel, marker, shape, friction, spec.force_N);
    for (const PressedMarker& pressed : presses.presses) {
      for (const double lens : spec.lenses_mm) {
        ApparentChangeRow row = seen_row(spec, device, pressed, lens);
        row.object = object.name;
        row.source = source;
        row.force_N = pressed.force_N;
        row.value = value;
        row.lens_mm = lens;
        result.rows.push_back(row);
      }
    }
    if (!presses.stopped.empty()) {
      result.notes.push_back(fmt::format("{}, {}, {} = {}: nothing from {} N on: {}", object.name, name_in(source),
                                         name_in(spec.vary.field), value, spec.force_N[presses.presses.size()],
                                         presses.stopped));
    }
  }
}

}  // namespace

EnumNames<StudyField> enum_names(StudyField) {
  return {{"gel.thickness_mm", StudyField::gel_thickness_mm},
          {"gel.youngs_modulus_MPa", StudyField::gel_youngs_modulus_MPa},
          {"gel.poisson_ratio", StudyField::gel_poisson_ratio}};
}

std::string name_of(StudyField field) {
  return name_in(field);
}

double& field_of(sim::DeviceSpec& device, StudyField field) {
  switch (field) {
    case StudyField::gel_youngs_modulus_MPa:
      return device.gel.youngs_modulus_MPa;
    case StudyField::gel_poisson_ratio:
      return device.gel.poisson_ratio;
    case StudyField::gel_thickness_mm:
      break;
  }
  return device.gel.thickness_mm;
}

EnumNames<ApparentSource> enum_names(ApparentSource) {
  return {{"formula", ApparentSource::formula}, {"linear", ApparentSource::linear}, {"finite", ApparentSource::finite}};
}

std::string name_of(ApparentSource source) {
  return name_in(source);
}

void fields(YamlReader& in, VarySpec& vary) {
  in.required("field", vary.field);
  const Allowed allowed =
      vary.field == StudyField::gel_poisson_ratio ? Allowed::within(0.0, 0.5) : Allowed::above_up_to(0.0, 1000.0);
  in.required("values", vary.values, allowed);
  require_rising(vary.values, in.where("values"), "vary.values");
}

void fields(YamlReader& in, ApparentChangeSpec& spec) {
  std::string device;
  std::vector<std::string> objects;
  in.required("device", device);
  in.required("vary", spec.vary);
  in.optional("marker_mm", spec.marker_mm, Allowed::above(0.0));
  in.optional("markers_in_view", spec.markers_in_view, Allowed::at_least(1.0));
  in.optional("sensor_mm", spec.sensor_mm, Allowed::above(0.0));
  in.required("lenses_mm", spec.lenses_mm, Allowed::above(0.0));
  in.required("objects", objects);
  in.required("force_N", spec.force_N, Allowed::above(0.0));
  in.optional("friction", spec.friction, Allowed::at_least(0.0));
  in.optional("by", spec.by);
  if (in.describing()) return;  // the files that it names aren't there
  spec.device = sim::read_device(named_file(in, "device", device));
  if (!spec.device.gel.slab() || !spec.device.gel.layers.empty()) {
    fail_at(in.where("device"), "device: {} isn't a slab of one material, which the formula knows alone",
            spec.device.name);
  }
  for (const double value : spec.vary.values) {
    sim::DeviceSpec device_then = spec.device;
    field_of(device_then, spec.vary.field) = value;
    try {
      fem::check(sim::gel_body(device_then));
    } catch (const Error& error) {
      fail_at(in.where("vary"), "vary: with {} = {}: {}", name_in(spec.vary.field), value, error.what());
    }
  }
  require_rising(spec.lenses_mm, in.where("lenses_mm"), "lenses_mm");
  try {
    for (const double lens : spec.lenses_mm) distance_of(spec, lens);
  } catch (const Error& error) {
    fail_at(in.where("lenses_mm"), "lenses_mm: {}", error.what());
  }
  if (objects.empty()) fail_at(in.where("objects"), "objects: is empty; at least one object file is needed");
  for (const std::string& file : objects) {
    const sim::ObjectSpec object = sim::read_object(named_file(in, "objects", file));
    if (object.elastic) {
      fail_at(in.where("objects"), "objects: {} is elastic; a study of this kind presses rigid ones", file);
    }
    if (!datasets::is_folder_name(object.name)) {
      fail_at(in.where("objects"),
              "objects: the name '{}' in {} can't name files; allowed are letters, digits, - and _", object.name, file);
    }
    for (const sim::ObjectSpec& other : spec.objects) {
      if (other.name == object.name) {
        fail_at(in.where("objects"), "objects: {} has the name '{}' a second time", file, object.name);
      }
    }
    spec.objects.push_back(object);
  }
  require_rising(spec.force_N, in.where("force_N"), "force_N");
  if (spec.by.empty()) fail_at(in.where("by"), "by: is empty; allowed are formula, linear and finite");
  for (std::size_t k = 1; k < spec.by.size(); ++k) {
    if (std::find(spec.by.begin(), spec.by.begin() + k, spec.by[k]) != spec.by.begin() + k) {
      fail_at(in.where("by"), "by: {} stands there a second time", name_in(spec.by[k]));
    }
  }
  if (asks_for(spec, ApparentSource::finite) && spec.device.mesh.force_error) {
    fail_at(in.where("by"), "by: finite strain needs a mesh that is given by fine_mm: {} gives it by force_error",
            spec.device.name);
  }
}

ApparentChangeResult run_apparent_change(const ApparentChangeSpec& spec, const std::filesystem::path& cache,
                                         const Progress& progress) {
  ApparentChangeResult result;
  const auto total = static_cast<std::int64_t>(spec.vary.values.size() * spec.by.size());
  std::int64_t done = 0;
  for (const ApparentSource source : spec.by) {
    for (const double value : spec.vary.values) {
      sim::DeviceSpec device = spec.device;
      field_of(device, spec.vary.field) = value;
      if (progress) progress(fmt::format("study by {}", name_in(source)), done, total);
      if (source == ApparentSource::formula) {
        for (const double force : spec.force_N) {
          for (const double lens : spec.lenses_mm) {
            ApparentChangeRow row = formula_row(spec, device.gel, force, lens);
            row.force_N = force;
            row.value = value;
            row.lens_mm = lens;
            result.rows.push_back(row);
          }
        }
      } else {
        press_all(spec, device, value, source, cache, result);
      }
      ++done;
    }
  }
  if (progress) progress("study", done, total);
  std::stable_sort(result.rows.begin(), result.rows.end(), [](const ApparentChangeRow& a, const ApparentChangeRow& b) {
    return std::tie(a.source, a.object, a.force_N, a.lens_mm, a.value) <
           std::tie(b.source, b.object, b.force_N, b.lens_mm, b.value);
  });
  return result;
}

namespace {

/// Where the parabola through three points is highest; the middle one if they don't bend down.
double vertex_of(const double (&x)[3], const double (&y)[3]) {
  const double left = (y[1] - y[0]) / (x[1] - x[0]);
  const double right = (y[2] - y[1]) / (x[2] - x[1]);
  const double bend = (right - left) / (x[2] - x[0]);
  if (!(bend < 0.0)) return x[1];
  return std::clamp(0.5 * (x[0] + x[1]) - 0.5 * left / bend, x[0], x[2]);
}

}  // namespace

std::vector<ApparentOptimum> optima_of(const ApparentChangeResult& result) {
  std::vector<ApparentOptimum> optima;
  const std::vector<ApparentChangeRow>& rows = result.rows;
  const auto belong = [](const ApparentChangeRow& a, const ApparentChangeRow& b) {
    return std::tie(a.source, a.object, a.force_N, a.lens_mm) == std::tie(b.source, b.object, b.force_N, b.lens_mm);
  };
  for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    while (end < rows.size() && belong(rows[begin], rows[end])) ++end;
    for (int k = 0; k < kStudiedMeasureCount; ++k) {
      std::vector<std::size_t> had;
      for (std::size_t i = begin; i < end; ++i) {
        if (std::isfinite(rows[i].measure[k])) had.push_back(i);
      }
      if (had.empty()) continue;
      const auto best = static_cast<std::size_t>(
          std::max_element(had.begin(), had.end(),
                           [&](std::size_t a, std::size_t b) { return rows[a].measure[k] < rows[b].measure[k]; }) -
          had.begin());
      ApparentOptimum optimum;
      optimum.of = rows[begin];
      optimum.measure = kStudiedMeasures[k];
      optimum.change = rows[had[best]].measure[k];
      optimum.interior = best > 0 && best + 1 < had.size();
      optimum.value = rows[had[best]].value;
      if (optimum.interior) {
        double x[3];
        double y[3];
        for (int i = 0; i < 3; ++i) {
          x[i] = rows[had[best + i - 1]].value;
          y[i] = rows[had[best + i - 1]].measure[k];
        }
        optimum.value = vertex_of(x, y);
      }
      optima.push_back(optimum);
    }
  }
  return optima;
}

}  // namespace touchstone::lab
