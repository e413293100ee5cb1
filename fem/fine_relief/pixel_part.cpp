#include "fem/fine_relief/pixel_part.h"

#include <algorithm>
#include <limits>

namespace touchstone::fem {
namespace {

constexpr double kWorthwhile = 0.7;  // of the whole: a larger part saves less than the last application costs

bool is_worthwhile(const PixelGrid& part, const PixelGrid& whole) {
  return part.nx > 0 && part.ny > 0 &&
         static_cast<double>(part.size()) < kWorthwhile * static_cast<double>(whole.size());
}

/// Does the body reach deeper into the free surface than the tolerance allows?
bool overlaps(const PixelContact& contact, const PixelContactAnswer& answer, double gap_mm) {
  for (std::size_t k = 0; k < answer.pressure.size(); ++k) {
    if (answer.pressure[k] > 0.0) continue;
    const double share = contact.share.empty() ? 1.0 : contact.share[k];
    if (contact.gap[k] + answer.displacement[k] + share * answer.shift < -gap_mm) return true;
  }
  return false;
}

}  // namespace

PixelContactAnswer solve_in_part(const ResponseOf& response, const PixelBox& whole, const PixelBox& part_of,
                                 double pitch, const PixelContact& contact, const PixelTolerance& tolerance,
                                 const std::vector<double>& start) {
  const PixelGrid grid = whole.grid(pitch);
  const auto layer = response(grid);
  const std::vector<double> whole_gap(contact.gap.begin(), contact.gap.end());
  std::vector<double> pressure = start;
  for (PixelBox part = of_kept_size(part_of, whole);;) {
    const PixelGrid small = part.grid(pitch);
    if (!is_worthwhile(small, grid)) break;
    const std::vector<double> gap = on_grid(grid, whole_gap, small, std::numeric_limits<double>::infinity());
    // A force wants a body to rest on.
    if (std::none_of(gap.begin(), gap.end(), [](double g) { return g < std::numeric_limits<double>::infinity(); }))
      break;
    const std::vector<double> share = contact.share.empty()
                                          ? std::vector<double>()
                                          : on_grid(grid, {contact.share.begin(), contact.share.end()}, small, 1.0);
    const std::vector<double> begin = pressure.empty() ? pressure : on_grid(grid, pressure, small, 0.0);
    PixelContactAnswer answer = solve_pixel_contact(*response(small), {gap, contact.force, share}, tolerance, begin);
    pressure = on_grid(small, answer.pressure, grid, 0.0);
    if (const PixelBox wider = common(widened(part, small, answer.pressure), whole); !(wider == part)) {
      part = of_kept_size(wider, whole);
      continue;
    }
    if (!answer.converged) break;
    answer.pressure = pressure;
    answer.displacement.resize(grid.size());
    layer->apply(answer.pressure, answer.displacement, *layer->make_scratch());
    ++answer.applications;
    if (overlaps(contact, answer, tolerance.gap_mm)) break;
    return answer;
  }
  return solve_pixel_contact(*layer, contact, tolerance, pressure);
}

}  // namespace touchstone::fem
