#include "sim/relief/tissue_relief.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "sim/relief/relief_fibres.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
constexpr double kFibreLength = 1.8;      // mm, between hardwood and softwood pulp
constexpr double kFoldLength = 1.2;       // mm, along a fold
constexpr double kFormationLength = 1.0;  // mm
enum Part : std::uint64_t { kCrepe, kFibres, kFormation };

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// 1 on a knob or line, 0 beside it, with flanks of a third of the width.
double plateau(double distance, double width) {
  return smooth_step((0.5 * width - distance) / (width / 3.0) + 0.5);
}

/// How far the period is along x and y for the embossing to close.
Eigen::Vector2d closing_size(const TissueRelief& relief) {
  if (relief.embossing == Embossing::none) return Eigen::Vector2d::Constant(relief.size_mm);
  const Eigen::Vector2d cell =
      relief.emboss_mm * Eigen::Vector2d(1.0, relief.embossing == Embossing::dots ? std::sqrt(3.0) : 1.5);
  return {cell.x() * std::ceil(relief.size_mm / cell.x()), cell.y() * std::ceil(relief.size_mm / cell.y())};
}

double embossed(const TissueRelief& relief, double x, double y) {
  if (relief.embossing == Embossing::none) return 0.0;
  const double pitch = relief.emboss_mm;
  if (relief.embossing == Embossing::dots) {
    const double height = std::sqrt(3.0) * pitch;
    double nearest = 1e9;
    for (const double shift : {0.0, 0.5}) {  // two rectangular lattices make a hexagonal one
      const double u = x - pitch * (std::round(x / pitch - shift) + shift);
      const double v = y - height * (std::round(y / height - shift) + shift);
      nearest = std::min(nearest, std::hypot(u, v));
    }
    return plateau(nearest, relief.emboss_width_mm);
  }
  const double slope = 1.5;  // a lozenge is one and a half times as long as wide
  double nearest = 1e9;
  for (const double sign : {1.0, -1.0}) {
    const double phase = x / pitch + sign * y / (slope * pitch);
    const double off = (phase - std::round(phase)) * pitch / std::hypot(1.0, 1.0 / slope);
    nearest = std::min(nearest, std::abs(off));
  }
  return plateau(nearest, relief.emboss_width_mm);
}

}  // namespace

EnumNames<Embossing> enum_names(Embossing) {
  return {{"none", Embossing::none}, {"dots", Embossing::dots}, {"lozenges", Embossing::lozenges}};
}

void fields(YamlReader& in, TissueRelief& relief) {
  in.required("embossing", relief.embossing);
  if (relief.embossing != Embossing::none) {
    in.required("emboss_mm", relief.emboss_mm, Allowed::within(0.3, 10.0));
    in.required("emboss_width_mm", relief.emboss_width_mm, Allowed::above_up_to(0.0, relief.emboss_mm));
    in.required("emboss_um", relief.emboss_um, Allowed::above_up_to(0.0, 2000.0));
  }
  in.required("crepe_mm", relief.crepe_mm, Allowed::within(0.08, 5.0));
  in.required("crepe_um", relief.crepe_um, Allowed::within(0.0, 500.0));
  in.optional("crepe_coherence", relief.crepe_coherence, Allowed::within(0.02, 1.0));
  in.optional("fibres_per_mm2", relief.fibres_per_mm2, Allowed::within(0.0, 500.0));
  in.optional("fibre_um", relief.fibre_um, Allowed::within(5.0, 200.0));
  in.optional("formation_um", relief.formation_um, Allowed::within(0.0, 200.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0, 60.0));
  in.optional("seed", relief.seed);
}

fem::ReliefMap relief_map(const TissueRelief& relief) {
  ReliefTile tile(closing_size(relief), 0.0F);
  RandomStream fibres = relief_stream(relief.seed, kFibres);
  lay_fibres(
      tile,
      {.per_mm2 = relief.fibres_per_mm2,
       .length_mm = kFibreLength,
       .diameter_mm = relief.fibre_um * kMicrometre,
       .curl_per_mm = 0.6,
       .alignment = 0.3},
      [&](double k) { return relief.fibre_um * kMicrometre * k; }, fibres);
  RandomStream folds = relief_stream(relief.seed, kCrepe);
  if (relief.crepe_um > 0.0) {
    const double peak = 1.0 / relief.crepe_mm, band = relief.crepe_coherence * peak;
    const std::vector<float> crepe = random_field(
        tile,
        [&](const Eigen::Vector2d& wave) {
          const double off = (std::abs(wave.y()) - peak) / band;
          return std::exp(-off * off - std::pow(wave.x() * kFoldLength, 2));
        },
        folds);
    for (std::size_t k = 0; k < crepe.size(); ++k) {
      tile.heights[k] += static_cast<float>(relief.crepe_um * kMicrometre * crepe[k]);
    }
  }
  RandomStream formation = relief_stream(relief.seed, kFormation);
  roughen(tile, relief.formation_um * kMicrometre, kFormationLength, formation);
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) {
      const double raised = embossed(relief, i * tile.spacing.x(), j * tile.spacing.y());
      float& height = tile.heights[tile.at(i, j)];
      // What is pressed is pressed flat: half of the rest goes.
      height = static_cast<float>(height * (1.0 - 0.5 * raised) + relief.emboss_um * kMicrometre * raised);
    }
  }
  return tile.map();
}

double finest_detail(const TissueRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
