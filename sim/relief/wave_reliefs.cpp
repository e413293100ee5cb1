#include "sim/relief/wave_reliefs.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr int kPointsAWave = 64;
constexpr int kPointsAHair = 64;

template <typename Waves>
void read_waves(YamlReader& in, Waves& waves) {
  in.required("amplitude_um", waves.amplitude_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.required("pitch_mm", waves.pitch_mm, Allowed::above_up_to(0.0, 100.0));
}

}  // namespace

void fields(YamlReader& in, WavesRelief& relief) {
  read_waves(in, relief);
}

void fields(YamlReader& in, GridRelief& relief) {
  read_waves(in, relief);
}

void fields(YamlReader& in, HairRelief& relief) {
  in.required("amplitude_um", relief.amplitude_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.optional("pitch_mm", relief.pitch_mm, Allowed::within(relief.amplitude_um / kMicrometresPerMillimetre, 100.0));
}

fem::ReliefMap relief_map(const WavesRelief& relief) {
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  std::vector<float> heights;
  for (int i = 0; i < kPointsAWave; ++i) {
    heights.push_back(static_cast<float>(0.5 * amplitude * (1.0 - std::cos(2.0 * kPi * i / kPointsAWave))));
  }
  return {kPointsAWave, 1, {0, 0}, {relief.pitch_mm / kPointsAWave, 1.0}, {true, true}, std::move(heights)};
}

fem::ReliefMap relief_map(const GridRelief& relief) {
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  std::vector<float> heights;
  for (int j = 0; j < kPointsAWave; ++j) {
    for (int i = 0; i < kPointsAWave; ++i) {
      const double sum = std::cos(2.0 * kPi * i / kPointsAWave) + std::cos(2.0 * kPi * j / kPointsAWave);
      heights.push_back(static_cast<float>(0.25 * amplitude * (2.0 - sum)));
    }
  }
  return {kPointsAWave, kPointsAWave,      {0, 0}, Eigen::Vector2d::Constant(relief.pitch_mm / kPointsAWave),
          {true, true}, std::move(heights)};
}

fem::ReliefMap relief_map(const HairRelief& relief) {
  // Seen from below: at the hair's sides the map falls straight to the floor.
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  const double radius = 0.5 * amplitude;
  const bool repeated = relief.pitch_mm > 0.0;
  const double step = amplitude / kPointsAHair;
  const int points = repeated ? std::max(1, static_cast<int>(std::lround(relief.pitch_mm / step))) : kPointsAHair;
  const double spacing = repeated ? relief.pitch_mm / points : step;
  const double first = -0.5 * spacing * (points - 1);
  std::vector<float> heights;
  for (int i = 0; i < points; ++i) {
    const double x = first + spacing * i;
    const double rest = radius * radius - x * x;
    heights.push_back(rest > 0.0 ? static_cast<float>(radius + std::sqrt(rest)) : 0.0F);
  }
  return {points, 1, {first, 0}, {spacing, 1.0}, {repeated, true}, std::move(heights)};
}

double finest_detail(const WavesRelief& relief) {
  return relief.pitch_mm;
}

double finest_detail(const GridRelief& relief) {
  return relief.pitch_mm;
}

double finest_detail(const HairRelief& relief) {
  return relief.amplitude_um / kMicrometresPerMillimetre;
}

}  // namespace touchstone::sim
