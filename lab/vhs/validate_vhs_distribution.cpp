// Force at several points at once, what [VisioHaptic2024, sec. 5.1] leaves for future work: balls of 1.5 mm radius are
// pressed on together, each with a force of its own; beads are seen by the sensor's own camera with noise of 0.1 px,
// twice the tracker's; their motions are inverted with the gel's compliance. Which force belongs to which point is
// judged by the patches nearest to each. The sensor's own 3x3 beads, and finer grids over 6 mm.

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/random_pairs.h"
#include "lab/validation/row_list.h"
#include "lab/vhs/bead_tractions.h"
#include "lab/vhs/vhs_distribution.h"

namespace touchstone::lab {
namespace {

constexpr double kForceError_N = 0.1;  // what the paper reaches for one force
constexpr double kNoise_px = 0.1;
constexpr double kDip = 0.75;  // of the pressure between two points, to count as two
constexpr std::uint64_t kFirstSeed = 1000;

struct Layout {
  int grid;
  double spacing_mm;
};

/// Mean errors over some presses of `count` points, `apart_mm` from each other.
struct DistributionScore {
  double each_N = 0.0, total_N = 0.0, place_mm = 0.0, dip = 0.0;
};

DistributionScore score_points(const DistributionSetup& setup, sensors::TractionInversion& inversion, int count,
                               double apart_mm, int presses) {
  DistributionScore score;
  for (int press = 0; press < presses; ++press) {
    const std::uint64_t seed = kFirstSeed + static_cast<std::uint64_t>(press);
    RandomStream random(seed, 0, Purpose::kPlacement);
    const double turn = 2.0 * std::numbers::pi * random.uniform();
    const Eigen::Vector2d middle = (uniform_pair(random).array() - 0.5).matrix();
    const double radius = 0.5 * apart_mm / std::sin(std::numbers::pi / count);
    std::vector<LoadPoint> points;
    for (int k = 0; k < count; ++k) {
      const double angle = turn + 2.0 * std::numbers::pi * k / count;
      points.push_back(
          {middle + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)), 0.2 + 0.6 * random.uniform()});
    }
    const DistributionTrial trial = press_points(setup, inversion, points, kNoise_px, seed);
    for (std::size_t k = 0; k < points.size(); ++k) {
      score.each_N += std::abs(trial.estimated_N[k] - points[k].force_N) / (presses * count);
      score.place_mm += trial.place_mm[k] / (presses * count);
    }
    score.total_N += std::abs(trial.total_N - trial.true_total_N) / presses;
    score.dip += trial.dip / presses;
  }
  return score;
}

}  // namespace

std::vector<ValidationRow> validate_vhs_distribution(const ValidateOptions& options) {
  RowList rows("vhs.distribution.", options, RowList::Since::last_row);
  const sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "vhs.yaml");
  const int presses = options.quick ? 24 : 96;
  for (const Layout layout : {Layout{3, 2.0}, Layout{5, 1.5}, Layout{7, 1.0}}) {
    const DistributionSetup setup =
        set_up_distribution(device, layout.grid, layout.spacing_mm, options.cache, options.progress);
    sensors::TractionInversion inversion(setup.compliance, bead_inversion());
    const std::string name = fmt::format("{0}x{0}_", layout.grid);
    const std::string beads = fmt::format("{0}x{0} beads {1} mm apart", layout.grid, layout.spacing_mm);
    const auto add = [&](const char* id, const std::string& title, const char* unit, double bound, double ours) {
      rows.add_bounded(name + id, title + ", " + beads, unit, Better::lower, bound, false, ours);
    };
    constexpr double kApart_mm = 3.0;
    const DistributionScore two = score_points(setup, inversion, 2, kApart_mm, presses);
    add("each_N", "mean error of each of two forces of 0.2 to 0.8 N, 3 mm apart", "N", kForceError_N, two.each_N);
    add("total_N", "mean error of their sum", "N", kForceError_N, two.total_N);
    add("place_mm", "mean error of each one's place", "mm", 0.5 * layout.spacing_mm, two.place_mm);
    const DistributionScore three = score_points(setup, inversion, 3, kApart_mm, presses);
    add("three_N", "mean error of each of three forces, 3 mm apart", "N", kForceError_N, three.each_N);
    double nearest_mm = 4.5;  // further apart than was tried
    for (const double apart_mm : {4.0, 3.0, 2.5, 2.0, 1.5, 1.0}) {
      const DistributionScore pair = score_points(setup, inversion, 2, apart_mm, presses);
      if (pair.dip > kDip) break;
      nearest_mm = apart_mm;
    }
    add("nearest_mm", "how near two forces may be to show as two maxima of pressure", "mm", 2.0 * layout.spacing_mm,
        nearest_mm);
  }
  return rows.rows();
}

}  // namespace touchstone::lab
