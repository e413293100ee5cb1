// Presses a second, and how cost grows with the surface.

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <numbers>
#include <thread>

#include "bench/machine.h"
#include "bench/mechanics_sections.h"
#include "core/error.h"
#include "fem/error/compliance_cache.h"
#include "fem/fine_relief/pixel_contact.h"
#include "sim/press/gel_setup.h"

namespace touchstone::bench {
namespace {

/// Steps a second of `threads` presses at once over one gel, each to and fro between its two targets.
double steps_per_second(const fem::Compliance& gel, const fem::ContactShape& shape, double friction, int threads,
                        double seconds, const fem::PressTarget& one, const fem::PressTarget& other) {
  std::atomic<int> ready = 0;
  std::atomic<bool> go = false;
  std::atomic<bool> stop = false;
  std::atomic<std::int64_t> steps = 0;
  std::vector<std::thread> workers;
  for (int k = 0; k < threads; ++k) {
    workers.emplace_back([&] {
      fem::Press press(gel, shape, friction, {}, {}, fem::PressOutput::forces);
      press.step(one);
      press.step(other);
      ++ready;
      while (!go) std::this_thread::yield();
      std::int64_t mine = 0;
      while (!stop) press.step(mine++ % 2 == 0 ? one : other);
      steps += mine;
    });
  }
  while (ready < threads) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const Stopwatch watch;
  go = true;
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  stop = true;
  for (std::thread& worker : workers) worker.join();
  return static_cast<double>(steps) / watch.seconds();
}

double file_mb(const std::filesystem::path& file) {
  std::error_code failed;
  const auto size = std::filesystem::file_size(file, failed);
  return failed ? 0.0 : static_cast<double>(size) / 1e6;
}

}  // namespace

ResultTable throughput_table(const BenchOptions& options) {
  ResultTable table;
  table.name = "mechanics-throughput";
  table.title = "The vhs gel: set-up, and presses a second";
  table.columns = {"edge, mm", "surface unknowns", "set-up, s",     "from the cache, s", "force, N",
                   "step",     "one step, ms",     "1 thread, 1/s", "2 threads, 1/s",    "4 threads, 1/s"};
  sim::DeviceSpec device = sim::read_device(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/vhs.yaml");
  const fem::RoundedCylinder probe{3.0, 0.3, 6.0};
  const double seconds = options.quick ? 0.3 : 1.5;
  std::vector<double> edges = {device.mesh.fine_mm};
  if (!options.quick) edges.push_back(0.3);
  std::vector<double> forces;
  for (const double edge : edges) {
    device.mesh.fine_mm = edge;
    const Stopwatch setup;
    const auto gel = sim::set_up_gel(device, options.scratch);
    const double setup_seconds = setup.seconds();
    const Stopwatch load;
    sim::set_up_gel(device, options.scratch);
    const double load_seconds = load.seconds();
    const auto add = [&](const char* name, double friction, const fem::PressTarget& one,
                         const fem::PressTarget& other) {
      fem::Press press(*gel, probe, friction, {}, {}, fem::PressOutput::forces);
      const double median = median_step(press, one, other);
      std::vector<std::string> row = {fmt::format("{}", edge),
                                      fmt::format("{}", 3 * gel->vertices.size()),
                                      fmt::format("{:.2f}", setup_seconds),
                                      fmt::format("{:.3f}", load_seconds),
                                      fmt::format("{:.4f}", press.step(at(0.0, 0.0, -0.5)).wrench[2]),
                                      name,
                                      fmt::format("{:.3f}", 1e3 * median)};
      for (const int threads : {1, 2, 4}) {
        row.push_back(fmt::format("{:.0f}", steps_per_second(*gel, probe, friction, threads, seconds, one, other)));
      }
      table.rows.push_back(std::move(row));
    };
    fem::Press still(*gel, probe, 0.0);
    forces.push_back(still.step(at(0.0, 0.0, -0.5)).wrench[2]);
    add("frictionless press", 0.0, at(0.0, 0.0, -0.3), at(0.0, 0.0, -0.5));
    add("shear step, mu 0.8", 0.8, at(0.05, 0.0, -0.5), at(0.1, 0.0, -0.5));
    fem::PressTarget one = at(0.0, 0.0, 0.0);
    one.axis[2] = fem::AxisControl::with_force(3.5);
    one.axis[0] = fem::AxisControl::with_force(0.3);
    fem::PressTarget other = one;
    other.axis[0] = fem::AxisControl::with_force(0.6);
    add("force-controlled step, mu 0.8", 0.8, one, other);
  }
  table.remarks = {
      "The probe is that of [VisioHaptic2024], 6 mm wide with an edge of 0.3 mm radius. Presses are independent "
      "objects over one compliance, a thread each, for forces and beads without the surface's displacement "
      "(PressOutput::forces)."};
  if (forces.size() > 1) {
    table.remarks.push_back(fmt::format("From {} to {} mm edges the frictionless force changes by {:.2f} %.", edges[0],
                                        edges[1], 100.0 * std::abs(forces[0] / forces[1] - 1.0)));
  }
  return table;
}

ResultTable growth_table(const BenchOptions& options) {
  ResultTable table;
  table.name = "mechanics-growth";
  table.title = "Growth with the surface";
  table.columns = {
      "surface unknowns", "edge, mm",       "tetrahedra", "volume unknowns", "set-up, s", "peak memory of it, MB",
      "left out",         "cache file, MB", "from it, s", "a press, ms",     "in contact"};
  const std::vector<double> wanted = options.quick ? std::vector<double>{1000, 2000}
                                                   : std::vector<double>{1000, 2000, 4000, 8000, 12000, 20000, 32000};
  plots::PlotCurve setup_curve{"set-up, s", {}, false};
  plots::PlotCurve press_curve{"a press, s", {}, false};
  plots::PlotCurve memory_curve{"peak memory, GB", {}, false};
  std::string stop;
  double last_seconds = 0.0;
  double last_unknowns = 1.0;
  for (const double unknowns : wanted) {
    // Equilateral triangles: n = area / (edge^2 sqrt(3)/2), and three unknowns a vertex.
    const double edge = std::sqrt(3.0 * 400.0 / (unknowns * std::sqrt(0.75)));
    const fem::SlabMesh slab{20.0, 20.0, 5.0, edge, std::max(edge, 2.5), 10.0, 10.0, 0.0};
    const double foreseen = last_seconds * std::pow(unknowns / last_unknowns, 2.0);
    if (foreseen > 600.0) {
      stop = fmt::format("{:.0f} surface unknowns would take some {:.0f} s of set-up: left out.", unknowns, foreseen);
      break;
    }
    try {
      forget_peak_memory();
      const Stopwatch setup;
      const fem::Compliance gel = fem::cached_compliance(slab, {1.0, 0.49}, {}, options.scratch);
      last_seconds = setup.seconds();
      last_unknowns = unknowns;
      const double peak = peak_memory_mb();
      const std::filesystem::path file =
          fem::compliance_file(options.scratch, fem::compliance_key(slab, {1.0, 0.49}, {}));
      const Stopwatch load;
      fem::cached_compliance(slab, {1.0, 0.49}, {}, options.scratch);
      const double load_seconds = load.seconds();
      fem::Press press(gel, fem::SphereShape{8.0}, 0.0);
      const double press_seconds = median_step(press, at(0.0, 0.0, 7.7), at(0.1, 0.0, 7.8));
      const auto found = static_cast<double>(3 * gel.vertices.size());
      table.rows.push_back(
          {fmt::format("{:.0f}", found), fmt::format("{:.3f}", edge), fmt::format("{}", gel.report.tetrahedra),
           fmt::format("{}", gel.report.unknowns), fmt::format("{:.2f}", last_seconds), fmt::format("{:.0f}", peak),
           gel.surface.whole() != nullptr ? "-" : fmt::format("{:.1g}", gel.report.compression_error),
           fmt::format("{:.0f}", file_mb(file)), fmt::format("{:.3f}", load_seconds),
           fmt::format("{:.3f}", 1e3 * press_seconds), fmt::format("{}", press.state().contact_vertices)});
      setup_curve.points.emplace_back(found, last_seconds);
      press_curve.points.emplace_back(found, press_seconds);
      memory_curve.points.emplace_back(found, peak / 1e3);
      std::filesystem::remove(file);
    } catch (const Error& error) {
      stop = fmt::format("{:.0f} surface unknowns are refused: {}.", unknowns, error.what());
      break;
    }
  }
  table.plots = {{"Cost against surface unknowns",
                  "surface unknowns",
                  "seconds, GB",
                  true,
                  true,
                  {setup_curve, press_curve, memory_curve}}};
  table.remarks = {
      "A pad of 20 x 20 x 5 mm, meshed evenly on all of its face and growing coarser below it; a sphere of 8 mm radius "
      "goes 0.3 mm deep. Up to 7800 surface unknowns the compliance is a full matrix; of larger ones the far parts are "
      "compressed. Left out: the Frobenius norm of what that leaves out, over the mean diagonal entry."};
  const auto order = [](const plots::PlotCurve& curve, std::size_t from) {
    return std::log(curve.points.back().second / curve.points[from].second) /
           std::log(curve.points.back().first / curve.points[from].first);
  };
  if (setup_curve.points.size() > 4) {
    const std::size_t from = setup_curve.points.size() - 4;
    table.remarks.push_back(
        fmt::format("From {:.0f} to {:.0f} unknowns set-up grows as their power {:.1f}, a press as {:.1f}.",
                    setup_curve.points[from].first, setup_curve.points.back().first, order(setup_curve, from),
                    order(press_curve, from)));
  }
  if (!stop.empty()) table.remarks.push_back(stop);
  return table;
}

ResultTable pixel_growth_table(const BenchOptions& options) {
  ResultTable table;
  table.name = "mechanics-pixel-growth";
  table.title = "Growth of the contact of fine relief with its pixels";
  table.columns = {"pixels",     "pitch, um",  "set-up, s",  "solve, s",
                   "memory, MB", "iterations", "in contact", "gap moved, um"};
  constexpr double kSide = 5.0;        // mm
  constexpr double kWave = 0.5;        // mm, of the bumps that the ball bears
  constexpr double kBump = 0.01;       // mm
  constexpr double kBallRadius = 8.0;  // mm
  constexpr double kForce = 1.0;       // N
  const std::vector<int> sides =
      options.quick ? std::vector<int>{64, 128} : std::vector<int>{64, 128, 256, 512, 1024, 2048};
  plots::PlotCurve solve_curve{"solve, s", {}, false};
  plots::PlotCurve memory_curve{"peak memory, GB", {}, false};
  double before = 0.0;
  for (const int side : sides) {
    const double pitch = kSide / side;
    const double first = -0.5 * kSide + 0.5 * pitch;
    fem::PixelGrid grid{side, side, pitch, {first, first}};
    std::vector<double> gap(grid.size());
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const Eigen::Vector2d at = grid.centre(i, j);
        const double k = 2.0 * std::numbers::pi / kWave;
        gap[grid.at(i, j)] =
            at.squaredNorm() / (2.0 * kBallRadius) + kBump * (1.0 - std::cos(k * at.x()) * std::cos(k * at.y()));
      }
    }
    forget_peak_memory();
    const double resting = peak_memory_mb();
    const Stopwatch setup;
    const fem::LayerResponse layer({0.33, 0.49}, 5.0, grid, fem::GridEdges::free);
    const double setup_seconds = setup.seconds();
    const Stopwatch solve;
    const fem::PixelContactAnswer answer = fem::solve_pixel_contact(layer, {gap, kForce});
    const double solve_seconds = solve.seconds();
    if (!answer.converged) fail("{} x {} pixels don't converge", side, side);
    const double peak = peak_memory_mb() - resting;
    const double pixels = static_cast<double>(grid.size());
    table.rows.push_back({fmt::format("{}", grid.size()), fmt::format("{:.1f}", 1e3 * pitch),
                          fmt::format("{:.3f}", setup_seconds), fmt::format("{:.3f}", solve_seconds),
                          fmt::format("{:.0f}", peak), fmt::format("{}", answer.iterations),
                          fmt::format("{}", answer.pixels_in_contact),
                          before == 0.0 ? "" : fmt::format("{:.2f}", 1e3 * std::abs(answer.shift - before))});
    before = answer.shift;
    solve_curve.points.emplace_back(pixels, solve_seconds);
    memory_curve.points.emplace_back(pixels, peak / 1e3);
  }
  table.plots = {{"Cost against pixels", "pixels", "seconds, GB", true, true, {solve_curve, memory_curve}}};
  table.remarks = {
      fmt::format("A ball of {} mm radius with bumps of {} mm, {} mm apart, pressed with {} N on {} x {} mm of a layer "
                  "5 mm thick. Each pixel is an unknown; by Fourier transforms, so cost grows as n log n. The "
                  "last column is by how much the ball moves when pixels are halved.",
                  kBallRadius, 2.0 * kBump, kWave, kForce, kSide, kSide)};
  return table;
}

}  // namespace touchstone::bench
