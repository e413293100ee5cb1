#pragma once
// What bench_mechanics measures, a table each.

#include <filesystem>
#include <memory>
#include <vector>

#include "bench/result_table.h"
#include "bench/stopwatch.h"
#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/slab.h"

namespace touchstone::bench {

struct BenchOptions {
  bool quick = false;             ///< under half a minute
  std::filesystem::path scratch;  ///< an empty folder for caches and meshes
};

/// Median seconds of one step of a press that goes to and fro between two targets, after two steps to warm up; at least
/// 20 steps and a quarter of a second.
double median_step(fem::Press& press, const fem::PressTarget& one, const fem::PressTarget& other);

/// Upright at (x, y, z).
fem::PressTarget at(double x, double y, double z);

/// One mesh of the pad that accuracy is measured on: 5 mm thick, half-width 4 thicknesses, nu 0.49, 1 MPa.
struct LadderStep {
  double edge = 0.0;  ///< mm, where the pad is touched
  fem::TetMesh mesh;
  fem::Compliance gel;
  double mesh_seconds = 0.0;
  double setup_seconds = 0.0;  ///< mesh and compliance
  double press_seconds = 0.0;  ///< a frictionless press of the sphere
  double sphere_error = 0.0;   ///< relative, root mean square over 9 places, against integral equations
  double punch_error = 0.0;    ///< relative, of the mean over 16 places
  double sphere_force = 0.0;   ///< N, at the origin
  double punch_force = 0.0;    ///< N, at the origin
};
std::vector<LadderStep> make_ladder(const BenchOptions& options);

ResultTable mesh_table(const std::vector<LadderStep>& ladder);
/// GetFEM on the same meshes; a table with one remark where it can't be run.
ResultTable peer_table(const std::vector<LadderStep>& ladder, const BenchOptions& options);
ResultTable tolerance_table(const LadderStep& pad);
ResultTable throughput_table(const BenchOptions& options);
ResultTable growth_table(const BenchOptions& options);
ResultTable pixel_growth_table(const BenchOptions& options);

}  // namespace touchstone::bench
