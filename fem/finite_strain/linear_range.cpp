#include "fem/finite_strain/linear_range.h"

#include <chrono>
#include <optional>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"

namespace touchstone::fem {

std::vector<LinearRangeRow> measure_linear_range(const Compliance& linear, const FiniteGel& gel,
                                                 const ContactShape& shape, double friction,
                                                 std::span<const double> depths, const Progress& progress) {
  TS_ASSERT(linear.vertices.size() == gel.rest.vertices.size());
  PressTolerance tolerance;
  tolerance.outlines = false;  // the forces may differ by what the strain makes of them alone
  Press press(linear, shape, friction, tolerance);
  tolerance.most_factorisations = kRangeFactorisations;
  FinitePress finite(gel, shape, friction, tolerance);
  const std::optional<RigidTransform> touching = finite.touching(RigidTransform());
  if (!touching) fail("the body isn't over the gel's middle: no reference press can be made");
  const double height = touching->translation.z();
  std::vector<LinearRangeRow> range;
  double before = 0.0;
  for (const double part : depths) {
    if (!(part > before)) fail("the depths of reference presses must be above zero and rise; {} doesn't", part);
    before = part;
    LinearRangeRow row;
    row.depth = part * gel.thickness;
    PressTarget target;
    target.axis[2] = AxisControl::at(height - row.depth);
    try {
      const auto begun = std::chrono::steady_clock::now();
      const PressState& state = press.step(target);
      const auto between = std::chrono::steady_clock::now();
      row.linear_force = state.wrench[2];
      row.largest_strain = state.largest_strain;
      row.finite_force = finite.step(target).wrench[2];
      const auto ended = std::chrono::steady_clock::now();
      row.linear_seconds = std::chrono::duration<double>(between - begun).count();
      row.finite_seconds = std::chrono::duration<double>(ended - between).count();
    } catch (const Error&) {
      break;  // the rows so far are what can be said
    }
    if (!(row.finite_force > 0.0)) continue;  // the body slips between the mesh's vertices
    range.push_back(row);
    if (progress) {
      progress("range of linear elasticity", static_cast<std::int64_t>(range.size()),
               static_cast<std::int64_t>(depths.size()));
    }
  }
  return range;
}

}  // namespace touchstone::fem
