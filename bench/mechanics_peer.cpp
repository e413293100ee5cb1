// GetFEM on the same meshes: the same answer, and the time of each.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "bench/getfem_peer.h"
#include "bench/mechanics_sections.h"
#include "closed_forms/contact_closed_forms.h"

namespace touchstone::bench {
namespace {

const fem::ElasticMaterial kMaterial{1.0, 0.49};

/// Our answer to a problem of the peer: a force or work, and the seconds of a press after set-up.
struct OurAnswer {
  double value = 0.0;
  double seconds = 0.0;
};

/// The work of a P1 pressure 1 - r^2/radius^2 on the face: no contact, the compliance by itself.
OurAnswer work_of_pressure(const fem::Compliance& gel, double radius) {
  const Stopwatch watch;
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(gel.vertices.size()));
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    traction[3 * static_cast<Eigen::Index>(i) + 2] =
        -std::max(0.0, 1.0 - gel.vertices[i].head<2>().squaredNorm() / (radius * radius));
  }
  return {traction.dot(gel.surface.times(traction)), watch.seconds()};
}

OurAnswer ours(const LadderStep& step, const PeerProblem& problem) {
  if (problem.load == "pressure") return work_of_pressure(step.gel, problem.radius);
  if (problem.load == "plate") {
    fem::Press press(step.gel, fem::BoxShape{{60.0, 60.0, 1.0}}, std::numeric_limits<double>::infinity());
    const Stopwatch watch;
    const double force = press.step(at(0.0, 0.0, 0.5 - problem.depth)).wrench[2];
    return {force, watch.seconds()};
  }
  if (problem.load == "sphere") {
    fem::Press press(step.gel, fem::SphereShape{problem.radius}, 0.0);
    return {step.sphere_force, median_step(press, at(0.0, 0.0, problem.radius - problem.depth),
                                           at(0.1, 0.0, problem.radius - 0.7 * problem.depth))};
  }
  fem::Press press(step.gel, fem::RoundedCylinder{problem.radius, 0.0, 3.0}, 0.0);
  return {step.punch_force, median_step(press, at(0.0, 0.0, -problem.depth), at(0.1, 0.0, -0.7 * problem.depth))};
}

double reference(const PeerProblem& problem) {
  if (problem.load == "sphere")
    return closed_forms::sphere_on_layer(1.0, 0.49, 5.0, problem.radius, problem.depth).force;
  if (problem.load == "punch")
    return closed_forms::flat_punch_on_layer(1.0, 0.49, 5.0, problem.radius, problem.depth).force;
  return std::nan("");
}

std::string percent(double value, double wanted) {
  return std::isfinite(wanted) ? fmt::format("{:+.2f}", 100.0 * (value / wanted - 1.0)) : std::string("-");
}

/// The answers of both programs to one problem on the mesh before.
struct Before {
  double theirs = 0.0;
  double ours = 0.0;
};

/// The error bars, by what each program's answer changed since the mesh before, in percent of it; and whether the two
/// answers lie within both.
std::array<std::string, 3> error_bars(double theirs, double ours, const std::optional<Before>& before) {
  if (!before) return {"-", "-", "-"};
  const double peer_bar = std::abs(theirs - before->theirs);
  const double our_bar = std::abs(ours - before->ours);
  return {fmt::format("{:.2f}", 100.0 * peer_bar / theirs), fmt::format("{:.2f}", 100.0 * our_bar / ours),
          std::abs(theirs - ours) <= peer_bar + our_bar ? "yes" : "NO"};
}

}  // namespace

ResultTable peer_table(const std::vector<LadderStep>& ladder, const BenchOptions& options) {
  ResultTable table;
  table.name = "mechanics-peer";
  table.title = "A peer in the same run: GetFEM on the same meshes";
  table.columns = {"edge, mm",
                   "load",
                   "peer's element",
                   "peer",
                   "ours",
                   "they differ by",
                   "peer's bar, %",
                   "our bar, %",
                   "within bars",
                   "peer's error, %",
                   "our error, %",
                   "peer's solve, s",
                   "of it Newton, s",
                   "one factorisation, s",
                   "our set-up, s",
                   "our press, ms",
                   "solve / press"};
  if (const std::string why = why_no_peer(); !why.empty()) {
    table.remarks = {"Not measured: " + why + "."};
    return table;
  }
  std::vector<PeerProblem> problems = {{"taylor_hood", "sphere", kMaterial, 8.0, 0.3}};
  if (!options.quick) {
    problems.push_back({"taylor_hood", "punch", kMaterial, 2.0, 0.1});
    problems.push_back({"p2", "sphere", kMaterial, 8.0, 0.3});
    problems.push_back({"p1", "sphere", kMaterial, 8.0, 0.3});
    problems.push_back({"taylor_hood", "pressure", kMaterial, 3.0, 0.0});
    problems.push_back({"taylor_hood", "plate", kMaterial, 8.0, 0.1});
  }
  std::vector<plots::PlotCurve> curves = {{"Taylor-Hood (GetFEM)", {}, false},
                                          {"P2 (GetFEM)", {}, false},
                                          {"P1 (GetFEM)", {}, false},
                                          {"ours, set-up", {}, false},
                                          {"ours, a press", {}, false}};
  std::map<std::string, std::optional<Before>> before;
  double least_ratio = std::numeric_limits<double>::infinity();
  double worst_sphere = 0.0;
  double longest_setup = 0.0;  // over the peer's solve
  for (const LadderStep& step : ladder) {
    const bool too_fine = step.edge < (options.quick ? 0.7 : 0.35);  // minutes for the peer
    if (too_fine) continue;
    const std::filesystem::path mesh = options.scratch / fmt::format("pad-{}.txt", step.edge);
    write_peer_mesh(step.mesh, mesh);
    for (const PeerProblem& problem : problems) {
      const bool once = problem.load == "pressure" || problem.load == "plate";
      if (once && step.edge < 0.7) continue;  // one mesh shows it
      const PeerResult peer = run_peer(mesh, problem);
      const OurAnswer our = ours(step, problem);
      const double theirs = problem.load == "pressure" ? peer.work : peer.force;
      const double wanted = reference(problem);
      std::array<std::string, 3> bars = {"-", "-", "-"};
      if (problem.element == "taylor_hood") {
        std::optional<Before>& last = before[problem.load];
        bars = error_bars(theirs, our.value, last);
        last = Before{theirs, our.value};
      }
      const double ratio = peer.total_seconds / our.seconds;
      table.rows.push_back({fmt::format("{}", step.edge), problem.load, problem.element,
                            fmt::format("{:.8g}{}", theirs, peer.converged ? "" : " (not converged)"),
                            fmt::format("{:.8g}", our.value), fmt::format("{:.1e}", std::abs(theirs / our.value - 1.0)),
                            bars[0], bars[1], bars[2], percent(theirs, wanted), percent(our.value, wanted),
                            fmt::format("{:.2f}", peer.total_seconds), fmt::format("{:.2f}", peer.newton_seconds),
                            fmt::format("{:.2f}", peer.factorise_seconds), fmt::format("{:.2f}", step.setup_seconds),
                            fmt::format("{:.3f}", 1e3 * our.seconds), fmt::format("{:.0f}", ratio)});
      if (problem.load != "sphere") continue;
      const std::size_t curve = problem.element == "taylor_hood" ? 0 : problem.element == "p2" ? 1 : 2;
      curves[curve].points.emplace_back(peer.total_seconds, std::abs(theirs / wanted - 1.0));
      if (curve != 0) continue;
      curves[3].points.emplace_back(step.setup_seconds, std::abs(our.value / wanted - 1.0));
      curves[4].points.emplace_back(our.seconds, std::abs(our.value / wanted - 1.0));
      least_ratio = std::min(least_ratio, ratio);
      longest_setup = std::max(longest_setup, step.setup_seconds / peer.total_seconds);
      worst_sphere = std::max(worst_sphere, std::abs(theirs / our.value - 1.0));
    }
  }
  table.plots = {{"A sphere's force error against seconds, by element and program", "seconds",
                  "relative error of the force", true, true, curves}};
  table.remarks = {
      fmt::format(
          "A press of a sphere after set-up is at least {:.0f} times faster than the peer's solve on the same "
          "mesh, at the same error: the two forces differ by at most {:.0e} (we look the gap up where the patch of "
          "contact has gone to, the peer where it was at rest).",
          least_ratio, worst_sphere),
      "A bar is what a Taylor-Hood answer has changed since the mesh before; an error is against the integral equation "
      "of an endless layer.",
      "GetFEM 5.4 with its basic contact brick (symmetric augmented Lagrangian, semismooth Newton) and MUMPS, one BLAS "
      "thread; its solve is mesh and spaces, gaps, assembly and Newton, without reading the file and starting Python. "
      "Its multipliers are P1 with weighted gaps as ours are, so on one mesh both have the same error; under a sharp "
      "punch it takes the vertices under the face for the contact, we the share of each hat that is covered: there the "
      "two differ by what the mesh leaves open.",
      "`pressure` (N mm, the work of a given P1 pressure) and `plate` (N, the whole face bonded to a plate that goes "
      "down by 0.1 mm) have no contact search: both programs solve the same linear system.",
      "p2 and p1 have displacement unknowns alone: the peer's, for comparison; ours is Taylor-Hood in all rows."};
  return table;
}

}  // namespace touchstone::bench
