#include "sim/relief/fingerprint_relief.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "sim/relief/wave_reliefs.h"

namespace touchstone::sim {
namespace {

constexpr int kPointsARidge = 12;
constexpr double kElongation = 1.25;  // of the whorl along y
constexpr double kFade_mm = 0.8;      // over which the print runs out

struct Minutia {
  Eigen::Vector2d place;
  double sign = 1.0;
};

std::vector<Minutia> minutiae_of(const FingerprintRelief& relief) {
  RandomStream random(relief.seed, 0, Purpose::kPlacement);
  std::vector<Minutia> minutiae;
  for (int i = 0; i < relief.minutiae; ++i) {
    // Evenly over the inner four fifths of the ellipse; signs in turn, so that no ridges are wound up.
    const double radius = 0.4 * std::sqrt(random.uniform());
    const double angle = 2.0 * kPi * random.uniform();
    minutiae.push_back({relief.size_mm.cwiseProduct(radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))),
                        i % 2 == 0 ? 1.0 : -1.0});
  }
  return minutiae;
}

}  // namespace

void fields(YamlReader& in, FingerprintRelief& relief) {
  in.required("amplitude_um", relief.amplitude_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.optional("ridge_mm", relief.ridge_mm, Allowed::within(0.05, 10.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(1.0, 100.0));
  in.optional("minutiae", relief.minutiae, Allowed::within(0, 1000));
  in.optional("seed", relief.seed);
}

fem::ReliefMap relief_map(const FingerprintRelief& relief) {
  const std::vector<Minutia> minutiae = minutiae_of(relief);
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  const double spacing = relief.ridge_mm / kPointsARidge;
  const int nx = std::max(2, static_cast<int>(std::ceil(relief.size_mm.x() / spacing)) + 1);
  const int ny = std::max(2, static_cast<int>(std::ceil(relief.size_mm.y() / spacing)) + 1);
  const Eigen::Vector2d first(-0.5 * spacing * (nx - 1), -0.5 * spacing * (ny - 1));
  std::vector<float> heights;
  heights.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const Eigen::Vector2d x = first + spacing * Eigen::Vector2d(i, j);
      double phase = 2.0 * kPi / relief.ridge_mm * std::hypot(x.x(), x.y() / kElongation) + std::atan2(x.y(), x.x());
      for (const Minutia& minutia : minutiae) {
        const Eigen::Vector2d offset = x - minutia.place;
        phase += minutia.sign * std::atan2(offset.y(), offset.x());
      }
      const double share = x.cwiseQuotient(0.5 * relief.size_mm).norm();
      const double within_mm = 0.5 * relief.size_mm.minCoeff() * (1.0 - share);
      const double fade = std::clamp(within_mm / kFade_mm, 0.0, 1.0);
      heights.push_back(static_cast<float>(0.5 * amplitude * fade * (1.0 + std::cos(phase))));
    }
  }
  return {nx, ny, first, {spacing, spacing}, {false, false}, std::move(heights)};
}

double finest_detail(const FingerprintRelief& relief) {
  return relief.ridge_mm;
}

}  // namespace touchstone::sim
