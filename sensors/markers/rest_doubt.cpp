#include "sensors/markers/rest_doubt.h"

#include <algorithm>
#include <cmath>

namespace touchstone::sensors {
namespace {

constexpr double kReach = 1.35;          // of the spacing
constexpr double kMiddle = 0.25;         // of the spacing
constexpr double kPlaceNoise_px = 0.03;  // of a marker's place

}  // namespace

std::vector<MarkerTriple> opposite_neighbours(std::span<const Eigen::Vector2d> places, double spacing_px) {
  std::vector<MarkerTriple> triples;
  const auto count = static_cast<int>(places.size());
  std::vector<int> near;
  for (int i = 0; i < count; ++i) {
    near.clear();
    for (int j = 0; j < count; ++j) {
      if (j != i && (places[j] - places[i]).norm() <= kReach * spacing_px) near.push_back(j);
    }
    while (!near.empty()) {
      const int one = near.back();
      near.pop_back();
      const auto off = [&](int other) { return (0.5 * (places[one] + places[other]) - places[i]).norm(); };
      const auto other = std::min_element(near.begin(), near.end(), [&](int a, int b) { return off(a) < off(b); });
      if (other == near.end() || off(*other) > kMiddle * spacing_px) continue;
      triples.push_back({i, one, *other});
      near.erase(other);
    }
  }
  return triples;
}

RestDoubt rest_doubt(std::span<const MarkerTriple> triples, std::span<const Eigen::Vector2d> rest,
                     std::span<const Eigen::Vector2d> now, std::span<const unsigned char> found) {
  RestDoubt doubt;
  double before = 0.0, after = 0.0, change = 0.0;
  for (const auto& [i, j, k] : triples) {
    if (found[i] == 0 || found[j] == 0 || found[k] == 0) continue;
    const Eigen::Vector2d then = 0.5 * (rest[j] + rest[k]) - rest[i], here = 0.5 * (now[j] + now[k]) - now[i];
    before += then.squaredNorm();
    after += here.squaredNorm();
    change += (here - then).squaredNorm();
    ++doubt.triples;
  }
  if (doubt.triples == 0 || change <= 0.0) return doubt;
  const double n = doubt.triples;
  doubt.change_px = std::sqrt(change / n);
  doubt.bend_px = std::sqrt(after / n);
  doubt.nearer = (before - after) / change;
  // The straighter frame's bends are taken for the layout's own.
  const double own = std::sqrt(std::min(before, after) / n) + kPlaceNoise_px;
  doubt.error = 2.0 * own / (doubt.change_px * std::sqrt(n));
  return doubt;
}

}  // namespace touchstone::sensors
