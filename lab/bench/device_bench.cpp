#include "lab/bench/device_bench.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/seconds_since.h"
#include "fem/elements/element.h"
#include "fem/mesh/gel_body.h"
#include "lab/bench/device_bench_parts.h"
#include "lab/statistics/straight_line.h"
#include "sim/scene/device_gel.h"

namespace touchstone::lab {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kBenchPresses = 6;
constexpr double kFriction = 0.5;
constexpr double kDepth = 0.1;  // of the gel's thickness
constexpr std::array kEdges = {2.5, 2.0, 1.6, 1.25, 1.0, 0.8};
constexpr std::array kElementEdges = {2.0, 1.5, 1.0};
// Of the reference: tried from the finest on until it's small enough.
constexpr std::array kReferenceEdges = {0.4, 0.45, 0.5, 0.57, 0.65, 0.75};
constexpr double kReferenceCoarse = 0.7;  // its edges far from the presses, times the device's own

void check(const sim::DeviceSpec& device, const BenchSettings& settings) {
  const auto above_zero = [](const char* field, double value) {
    if (!(value > 0.0 && std::isfinite(value))) fail("{} is {}; allowed are numbers above 0", field, value);
  };
  above_zero("force error", settings.force_error);
  above_zero("pixel error", settings.pixel_error);
  if (settings.depth_mm) above_zero("depth", *settings.depth_mm);
  if (settings.most_pixels < 1000) fail("pixels are {}; allowed are at least 1000", settings.most_pixels);
  check(settings.estimator);
  if (settings.most_tetrahedra < 1) fail("tetrahedra are {}; allowed is at least 1", settings.most_tetrahedra);
  if (device.mesh.force_error) {
    fail_at(device.where, "mesh.force_error: a bench varies the mesh's edges, so it needs fine_mm and coarse_mm");
  }
  if (settings.object && settings.object->elastic) {
    fail("object {}: a bench takes rigid objects; this one is elastic", settings.object->name);
  }
}

/// The mesh that the others are measured against: fine only where the presses go.
sim::DeviceSpec reference_device(const sim::DeviceSpec& device, double reach_mm, int most_tetrahedra, double& edges) {
  sim::DeviceSpec finest = device;
  for (const double factor : kReferenceEdges) {
    edges = factor;
    finest.mesh.fine_mm = factor * device.mesh.fine_mm;
    finest.mesh.coarse_mm = std::max(finest.mesh.fine_mm, kReferenceCoarse * device.mesh.coarse_mm);
    const double half = reach_mm + 3.0 * device.mesh.fine_mm;
    finest.mesh.fine_half_extent_mm = device.mesh.fine_half_extent_mm.cwiseMin(half);
    if (fem::estimated_tetrahedra(sim::gel_body(finest)) <= most_tetrahedra) break;
  }
  return finest;
}

double beads_difference_um(const PressForces& forces, const PressForces& than) {
  if (forces.beads_mm.rows() == 0) return kUnknown;
  return 1e3 * std::sqrt((forces.beads_mm - than.beads_mm).rowwise().squaredNorm().mean());
}

double mean_normal_force(const PressForces& forces) {
  double sum = 0.0;
  for (const Eigen::Vector3d& force : forces.force_N) sum += force.z();
  return sum / static_cast<double>(forces.force_N.size());
}

std::string edges_in_words(const sim::MeshSpec& mesh) {
  return fmt::format("fine_mm {:.3g}, coarse_mm {:.3g}", mesh.fine_mm, mesh.coarse_mm);
}

/// A device on its mesh against the reference; what can't be had is in the point's note.
BenchPoint measured_mesh(const BenchParts& parts, const sim::DeviceSpec& device, fem::Element element, bool pictures) {
  BenchPoint point;
  point.value = device.mesh.fine_mm;
  try {
    const MadeGel made = make_gel(device, element);
    const PressForces forces = solve_presses(parts.presses, made.gel, device, device.mesh.fine_mm);
    point.once_s = made.seconds;
    point.each_s = forces.seconds;
    point.work = 1e-9 * made.gel.report.operations;
    point.force_error = force_difference(forces.force_N, parts.finest_forces.force_N);
    point.beads_um = beads_difference_um(forces, parts.finest_forces);
    if (pictures) point.pixel_error = mesh_pixel_error(parts, device, made.gel);
  } catch (const Error& error) {
    point.note = error.what();
  }
  return point;
}

BenchCurve mesh_curve(const BenchParts& parts, const Progress& progress) {
  BenchCurve curve;
  curve.name = "mesh";
  curve.what = fmt::format(
      "Edges of the gel's mesh, all times the same number. Forces of {} presses, pressed and dragged; pictures of the "
      "first. Against a mesh with edges of {:.3g} mm.",
      parts.presses.specs.size(), parts.finest_device.mesh.fine_mm);
  curve.once = "set-up, s";
  curve.each = "a press, ms";
  curve.work = "operations of the set-up, 1e9";
  for (std::size_t k = 0; k < kEdges.size(); ++k) {
    if (progress) progress("mesh", static_cast<std::int64_t>(k), kEdges.size());
    curve.points.push_back(mesh_point(parts, kEdges[k]));
  }
  return curve;
}

BenchCurve element_curve(const BenchParts& parts, const Progress& progress) {
  using fem::Element;
  constexpr std::array kElements = {Element::taylor_hood, Element::quadratic_constant_pressure, Element::quadratic,
                                    Element::linear};
  BenchCurve curve;
  curve.name = "element";
  curve.what =
      "Elements on the same meshes. Touchstone's is Taylor-Hood's; the others are what it buys accuracy against (they "
      "can't be chosen). The same presses and reference.";
  curve.once = "set-up, s";
  curve.each = "a press, ms";
  curve.work = "operations of the set-up, 1e9";
  std::int64_t done = 0;
  for (const Element element : kElements) {
    for (const double edges : kElementEdges) {
      if (progress) progress("element", done++, kElements.size() * kElementEdges.size());
      const sim::DeviceSpec device = with_edges(parts.device, edges);
      BenchPoint point = measured_mesh(parts, device, element, false);
      point.series = fem::name_of(element);
      point.setting = fmt::format("{}, fine_mm {:.3g}", point.series, device.mesh.fine_mm);
      point.as_is = element == Element::taylor_hood && edges == 1.0;
      curve.points.push_back(point);
    }
  }
  return curve;
}

/// On the device's own mesh, against the tightest: what the contact solver leaves.
BenchCurve contact_curve(const BenchParts& parts) {
  BenchCurve curve;
  curve.name = "contact";
  curve.what =
      "How exactly the laws of contact hold: the largest violation of a traction's, relative to the largest pressure; "
      "then the longest step that friction is followed by. On the device's own mesh, against the tightest of each.";
  curve.each = "a press, ms";
  curve.work = "systems solved a press";
  const double states = 3.0 * static_cast<double>(parts.presses.specs.size());
  const auto run = [&](const fem::PressTolerance& tolerance) {
    return solve_presses(parts.presses, parts.own_gel, parts.device, parts.device.mesh.fine_mm, tolerance);
  };
  const auto add = [&](const char* series, const PressForces& forces, const PressForces& than, double value,
                       const std::string& setting, bool as_is) {
    BenchPoint point;
    point.series = series;
    point.setting = setting;
    point.value = value;
    point.each_s = forces.seconds;
    point.work = static_cast<double>(forces.solves) / states;
    point.force_error = force_difference(forces.force_N, than.force_N);
    point.beads_um = beads_difference_um(forces, than);
    point.as_is = as_is;
    curve.points.push_back(point);
  };
  fem::PressTolerance tight;
  tight.traction = 1e-13;
  tight.lookup_mm = 1e-9;
  const PressForces tightest = run(tight);
  const PressForces by_default = run({});
  for (const double traction : {1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10}) {
    fem::PressTolerance tolerance;
    tolerance.traction = traction;
    tolerance.lookup_mm = std::max(tolerance.lookup_mm, traction);
    const bool own = traction == fem::PressTolerance{}.traction;
    add("tolerance of the laws", own ? by_default : run(tolerance), tightest, traction,
        fmt::format("traction to {:.0e}", traction), own);
  }
  const double drag = parts.presses.specs.front().drag_mm.norm();
  fem::PressTolerance short_steps;
  short_steps.largest_motion = drag / 64;
  const PressForces shortest = run(short_steps);
  const char* steps = "steps of friction";
  add(steps, by_default, shortest, drag, "one step a frame", true);
  for (const double share : {2.0, 4.0, 8.0, 16.0, 32.0}) {
    fem::PressTolerance tolerance;
    tolerance.largest_motion = drag / share;
    add(steps, run(tolerance), shortest, tolerance.largest_motion,
        fmt::format("steps of {:.2g} mm at most", tolerance.largest_motion), false);
  }
  return curve;
}

/// What the reference is off itself, by the law that the coarser meshes follow.
std::string reference_in_words(const BenchParts& parts, const BenchCurve& mesh) {
  std::vector<double> x, y;
  for (const BenchPoint& point : mesh.points) {
    if (!(point.force_error > 0.0)) continue;
    x.push_back(std::log(point.value / parts.device.mesh.fine_mm));
    y.push_back(std::log(point.force_error));
  }
  std::string words = fmt::format("a mesh with edges of {:.3g} mm ({:.2g} times the device's; {} tetrahedra, {:.0f} s)",
                                  parts.finest_device.mesh.fine_mm, parts.finest_edges,
                                  parts.finest_gel.report.tetrahedra, parts.finest_seconds);
  if (x.size() >= 3) {
    const StraightLine line = line_through(x, y);
    words += fmt::format(", whose own force error is some {:.2g} % if the others' law (edge^{:.2g}) holds on to it",
                         100.0 * std::exp(line.offset + line.slope * std::log(parts.finest_edges)), line.slope);
  }
  return words;
}

}  // namespace

sim::ObjectSpec bench_ball(double radius_mm) {
  sim::ObjectSpec ball;
  ball.name = fmt::format("a ball of {:.3g} mm", 2.0 * radius_mm);
  ball.shape.type = sim::ShapeKind::sphere;
  ball.shape.radius_mm = radius_mm;
  ball.albedo = 0.5;
  ball.friction = kFriction;
  return ball;
}

sim::DeviceSpec with_edges(sim::DeviceSpec device, double factor) {
  device.mesh.fine_mm *= factor;
  device.mesh.coarse_mm *= factor;
  return device;
}

MadeGel make_gel(const sim::DeviceSpec& device, fem::Element element) {
  const auto begun = Clock::now();
  const fem::GelBody body = sim::gel_body(device);
  MadeGel made;
  made.gel = fem::compute_compliance(fem::mesh_gel(body), sim::gel_materials(device.gel), sim::gel_beads(device),
                                     fem::thickness_of(body), element);
  made.gel.report.fine_edge = device.mesh.fine_mm;
  made.seconds = seconds_since(begun);
  return made;
}

BenchPoint mesh_point(const BenchParts& parts, double edges) {
  const sim::DeviceSpec device = with_edges(parts.device, edges);
  BenchPoint point = measured_mesh(parts, device, fem::Element::taylor_hood, parts.truth.has_value());
  point.setting = edges_in_words(device.mesh);
  point.as_is = edges == 1.0;
  return point;
}

DeviceBench bench_device(const sim::DeviceSpec& device, const BenchSettings& settings, const Progress& progress) {
  check(device, settings);
  const auto tell = [&](const char* stage) {
    if (progress) progress(stage, 0, 1);
  };
  DeviceBench bench;
  bench.device = device.name;
  bench.settings = settings;

  BenchParts parts;
  parts.settings = settings;
  parts.whole_device = device;
  parts.device = device.camera ? middle_of(device, settings.most_pixels) : device;
  tell("the device's own gel");
  MadeGel own = make_gel(device);
  parts.own_gel = std::move(own.gel);
  const double thickness = parts.own_gel.thickness;
  parts.presses.object = settings.object ? *settings.object : bench_ball(thickness);
  parts.depth_mm = settings.depth_mm.value_or(kDepth * thickness);
  const auto estimator = [&] {
    return bench_estimator({device, parts.own_gel, own.seconds, parts.presses.object, parts.depth_mm, settings.seed},
                           settings.estimator, progress);
  };
  if (settings.estimator.alone) {
    bench.estimator = estimator();
    return bench;
  }
  parts.presses.touch_mm = sim::first_touch(sim::PressSpec{}, parts.presses.object, device.gel);
  parts.presses.specs = bench_presses(kBenchPresses, device.mesh.fine_mm, parts.depth_mm, settings.seed);
  const PressForces forces = solve_presses(parts.presses, parts.own_gel, device, device.mesh.fine_mm);
  bench.presses = fmt::format(
      "{}, pressed {:.3g} mm deep (a fifth more or less) at {} places within an edge of the middle and dragged by "
      "{:.3g} mm; {:.3g} N on the mean",
      parts.presses.object.name, parts.depth_mm, kBenchPresses, parts.presses.specs.front().drag_mm.norm(),
      mean_normal_force(forces));

  tell("the reference's gel");
  parts.finest_device = reference_device(parts.device, forces.reach_mm, settings.most_tetrahedra, parts.finest_edges);
  MadeGel finest = make_gel(parts.finest_device);
  parts.finest_gel = std::move(finest.gel);
  parts.finest_seconds = finest.seconds;
  parts.finest_forces = solve_presses(parts.presses, parts.finest_gel, device, parts.finest_device.mesh.fine_mm);

  tell("the reference's pictures");
  bench.pictures = prepare_pictures(parts);
  bench.least_pixel_error = parts.least_pixel_error;
  if (settings.planned_alone) {
    bench.reference = reference_in_words(parts, {});
    bench.planned = planned_bench(parts, progress);
    return bench;
  }

  bench.curves.push_back(mesh_curve(parts, progress));
  bench.reference = reference_in_words(parts, bench.curves.back());
  bench.curves.push_back(element_curve(parts, progress));
  tell("contact");
  bench.curves.push_back(contact_curve(parts));
  std::vector<LightSetting> tries;
  for (BenchCurve& curve : light_curves(parts, tries, progress)) bench.curves.push_back(std::move(curve));
  bench.choice = cheapest_choice(parts, bench.curves.front(), tries, progress);
  bench.effects = effect_shares(parts, progress);
  bench.planned = planned_bench(parts, progress);
  if (settings.estimator.on) {
    try {
      bench.estimator = estimator();
    } catch (const Error& error) {
      bench.estimator.emplace().none = error.what();  // all else is measured and kept
    }
  }
  return bench;
}

}  // namespace touchstone::lab
