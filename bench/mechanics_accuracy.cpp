// Error against time: mesh, contact tolerance.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/mechanics_sections.h"
#include "closed_forms/contact_closed_forms.h"

namespace touchstone::bench {
namespace {

constexpr double kThickness = 5.0;
constexpr double kSphere = 8.0;  // radius, mm
constexpr double kSphereDepth = 0.3;
constexpr double kPunch = 2.0;
constexpr double kPunchDepth = 0.1;
const fem::ElasticMaterial kMaterial{1.0, 0.49};

double sphere_force(const fem::Compliance& gel, double x, double y) {
  return fem::Press(gel, fem::SphereShape{kSphere}, 0.0).step(at(x, y, kSphere - kSphereDepth)).wrench[2];
}

double punch_force(const fem::Compliance& gel, double x, double y) {
  return fem::Press(gel, fem::RoundedCylinder{kPunch, 0.0, 3.0}, 0.0).step(at(x, y, -kPunchDepth)).wrench[2];
}

void measure_errors(LadderStep& step) {
  const double sphere = closed_forms::sphere_on_layer(1.0, 0.49, kThickness, kSphere, kSphereDepth).force;
  const double punch = closed_forms::flat_punch_on_layer(1.0, 0.49, kThickness, kPunch, kPunchDepth).force;
  constexpr int kPlaces = 3;
  double squares = 0.0;
  double sum = 0.0;
  for (int i = 0; i < kPlaces; ++i) {
    for (int j = 0; j < kPlaces; ++j) {
      const double x = step.edge * (i + 0.5) / kPlaces;
      const double y = std::sqrt(0.75) * step.edge * (j + 0.5) / kPlaces;
      squares += std::pow(sphere_force(step.gel, x, y) / sphere - 1.0, 2);
      sum += punch_force(step.gel, x, y) / punch - 1.0;
    }
  }
  step.sphere_error = std::sqrt(squares) / kPlaces;
  step.punch_error = std::abs(sum) / (kPlaces * kPlaces);
}

}  // namespace

fem::PressTarget at(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

double median_step(fem::Press& press, const fem::PressTarget& one, const fem::PressTarget& other) {
  press.step(one);
  press.step(other);
  std::vector<double> seconds;
  const Stopwatch all;
  while (seconds.size() < 20 || all.seconds() < 0.25) {
    const Stopwatch step;
    press.step(seconds.size() % 2 == 0 ? one : other);
    seconds.push_back(step.seconds());
  }
  const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return *middle;
}

std::vector<LadderStep> make_ladder(const BenchOptions& options) {
  const std::vector<double> edges =
      options.quick ? std::vector<double>{0.8, 0.5} : std::vector<double>{0.8, 0.6, 0.5, 0.4, 0.3, 0.25};
  std::vector<LadderStep> ladder;
  for (const double edge : edges) {
    LadderStep step;
    step.edge = edge;
    const Stopwatch setup;
    step.mesh = fem::mesh_slab({40.0, 40.0, kThickness, edge, 2.5, 2.4, 2.4, 0.6});
    step.mesh_seconds = setup.seconds();
    step.gel = fem::compute_compliance(step.mesh, kMaterial, {}, kThickness);
    step.setup_seconds = setup.seconds();
    measure_errors(step);
    step.sphere_force = sphere_force(step.gel, 0.0, 0.0);
    step.punch_force = punch_force(step.gel, 0.0, 0.0);
    fem::Press press(step.gel, fem::SphereShape{kSphere}, 0.0);
    step.press_seconds = median_step(press, at(0.0, 0.0, kSphere - kSphereDepth), at(0.1, 0.0, kSphere - 0.2));
    ladder.push_back(std::move(step));
  }
  return ladder;
}

ResultTable mesh_table(const std::vector<LadderStep>& ladder) {
  ResultTable table;
  table.name = "mechanics-mesh";
  table.title = "Mesh: force error against seconds";
  table.columns = {"edge, mm",         "tetrahedra", "unknowns",          "surface unknowns", "meshing, s",
                   "set-up in all, s", "press, ms",  "sphere's error, %", "punch's error, %"};
  plots::PlotCurve sphere_setup{"sphere, set-up", {}, false};
  plots::PlotCurve punch_setup{"flat punch, set-up", {}, false};
  plots::PlotCurve sphere_press{"sphere, a press", {}, false};
  plots::PlotCurve punch_press{"flat punch, a press", {}, false};
  const LadderStep* knee = &ladder.front();
  for (const LadderStep& step : ladder) {
    table.rows.push_back({fmt::format("{}", step.edge), fmt::format("{}", step.gel.report.tetrahedra),
                          fmt::format("{}", step.gel.report.unknowns), fmt::format("{}", 3 * step.gel.vertices.size()),
                          fmt::format("{:.2f}", step.mesh_seconds), fmt::format("{:.2f}", step.setup_seconds),
                          fmt::format("{:.3f}", 1e3 * step.press_seconds),
                          fmt::format("{:.3f}", 100.0 * step.sphere_error),
                          fmt::format("{:.2f}", 100.0 * step.punch_error)});
    sphere_setup.points.emplace_back(step.setup_seconds, step.sphere_error);
    punch_setup.points.emplace_back(step.setup_seconds, step.punch_error);
    sphere_press.points.emplace_back(step.press_seconds, step.sphere_error);
    punch_press.points.emplace_back(step.press_seconds, step.punch_error);
    if (step.sphere_error * step.setup_seconds < knee->sphere_error * knee->setup_seconds) knee = &step;
  }
  table.plots = {{"Force error against seconds, by mesh",
                  "seconds",
                  "relative error of the force",
                  true,
                  true,
                  {sphere_press, punch_press, sphere_setup, punch_setup}}};
  table.remarks = {
      "The pad is 40 x 40 x 5 mm, nu 0.49; the sphere has 8 mm radius and goes 0.3 mm deep, the sharp flat punch 2 mm "
      "and 0.1 mm. The reference is the integral equation of an endless layer, some 10 digits; the pad's finite width "
      "leaves 0.1 to 0.2 %. The sphere's error is the root mean square over 9 places on the mesh, the punch's that of "
      "the mean over them.",
      fmt::format(
          "The knee, where error times set-up seconds is least for the sphere, is at {} mm: {:.2f} % for {:.1f} "
          "s of set-up, once, and {:.2f} ms a press.",
          knee->edge, 100.0 * knee->sphere_error, knee->setup_seconds, 1e3 * knee->press_seconds)};
  return table;
}

namespace {

/// A sphere pressed, sheared and turned back: the forces that are left, and the seconds that it took.
struct SlidePath {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  double seconds = 0.0;
};

SlidePath slide(const fem::Compliance& gel, const fem::PressTolerance& tolerance) {
  constexpr int kRepeats = 5;
  SlidePath path;
  std::vector<double> seconds;
  for (int k = 0; k < kRepeats; ++k) {
    fem::Press press(gel, fem::SphereShape{kSphere}, 0.5, tolerance);
    const Stopwatch watch;
    press.step(at(0.0, 0.0, kSphere - 0.3));
    for (const double x : {0.05, 0.1, 0.15, 0.1, 0.05}) press.step(at(x, 0.5 * x, kSphere - 0.3));
    seconds.push_back(watch.seconds());
    path.force = press.state().wrench.head<3>();
  }
  path.seconds = *std::min_element(seconds.begin(), seconds.end());
  return path;
}

}  // namespace

ResultTable tolerance_table(const LadderStep& pad) {
  ResultTable table;
  table.name = "mechanics-tolerance";
  table.title = "Contact tolerance: change of the force against seconds";
  table.columns = {"tolerance", "set to", "path of 6 steps, ms", "change of the force, relative"};
  fem::PressTolerance tight;
  tight.traction = 1e-13;
  tight.lookup_mm = 1e-10;
  const SlidePath best = slide(pad.gel, tight);
  const auto add = [&](const std::string& name, double value, const fem::PressTolerance& tolerance,
                       plots::PlotCurve& curve) {
    const SlidePath path = slide(pad.gel, tolerance);
    const double change = (path.force - best.force).norm() / best.force.norm();
    table.rows.push_back(
        {name, fmt::format("{:.0e}", value), fmt::format("{:.2f}", 1e3 * path.seconds), fmt::format("{:.1e}", change)});
    curve.points.emplace_back(path.seconds, std::max(change, 1e-16));
  };
  plots::PlotCurve traction{"contact laws (traction)", {}, false};
  plots::PlotCurve lookup{"place of the gap (lookup_mm)", {}, false};
  for (const double value : {1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    fem::PressTolerance tolerance = tight;
    tolerance.traction = value;
    add("traction", value, tolerance, traction);
  }
  for (const double value : {1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8}) {
    fem::PressTolerance tolerance = tight;
    tolerance.lookup_mm = value;
    add("lookup_mm", value, tolerance, lookup);
  }
  table.plots = {{"Change of the force against seconds, by contact tolerance",
                  "seconds for the path",
                  "relative change of the force",
                  true,
                  true,
                  {traction, lookup}}};
  table.remarks = {
      fmt::format("Edges of {} mm, a sphere of 8 mm radius, mu = 0.5: pressed 0.3 mm, sheared 0.17 mm and "
                  "turned back by two thirds. The other tolerance is at its tightest (traction 1e-13, "
                  "lookup 1e-10 mm), which is also the reference.",
                  pad.edge)};
  return table;
}

}  // namespace touchstone::bench
