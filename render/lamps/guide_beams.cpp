#include "render/lamps/guide_beams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "render/lamps/guide_connection.h"

namespace touchstone::render {
namespace {

constexpr int kMostPoints = 16;
constexpr int kMostImages = 200;
constexpr double kNegligible = 1e-4;  // of the sector's light so far: further images are left out

/// Nodes and weights on [0, 1] of Gauss and Legendre's rule, by Newton's method.
struct Rule {
  std::array<double, kMostPoints> node, weight;

  explicit Rule(int n) {
    for (int i = 0; i < n; ++i) {
      double x = std::cos(kPi * (i + 0.75) / (n + 0.5));
      double slope = 1.0;
      for (int step = 0; step < 50; ++step) {
        double before = 1.0;
        double value = x;
        for (int k = 2; k <= n; ++k) {
          const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
          before = value;
          value = next;
        }
        slope = n * (x * value - before) / (x * x - 1.0);
        const double change = value / slope;
        x -= change;
        if (std::abs(change) < 1e-15) break;
      }
      node[i] = 0.5 * (1.0 - x);
      weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
  }
};

const Rule& rule_of(int points) {
  static const std::array<Rule, kMostPoints> rules = []<std::size_t... k>(std::index_sequence<k...>) {
    return std::array<Rule, kMostPoints>{Rule(static_cast<int>(k) + 1)...};
  }
  (std::make_index_sequence<kMostPoints>{});
  return rules[points - 1];
}

/// How steep light must be in the plate to come in between walls `distance` mm before the receiver: it then meets the
/// layer's face just at their foot, and n cos(elevation) is the same on both sides of a face.
double steepness_between_walls(double plate_index, const Layer& last, double distance) {
  const double flat = distance / std::hypot(distance, last.thickness);
  return std::acos(std::min(1.0, last.index * flat / plate_index));
}

}  // namespace

void guide_beam_flows(const PreparedScene<1>& scene, const PreparedLamp<1>& lamp, const GuideCut& cut, int layer,
                      const Eigen::Vector3d& place, int points, const UprightWalls& walls, Eigen::Vector3d* out) {
  TS_ASSERT(lamp.kind == LampKind::kGuide && points >= 1 && cut.sectors >= 1 && cut.slices >= 1);
  std::fill_n(out, cut.beams(), Eigen::Vector3d::Zero());
  TS_ASSERT(layer != lamp.layer);
  const Receiver receiver{place, Eigen::Vector3d::Zero(), layer, scene.medium_of_layer(layer), false};
  const BeforeGuide before = before_guide(lamp, place);
  if (!(before.forward > 0.0)) return;
  const int medium = scene.medium_of_layer(lamp.layer);
  const double thickness = scene.faces[lamp.layer].z - scene.faces[lamp.layer - 1].z;
  const LayersBeyondPlate beyond = layers_beyond_plate(scene, lamp.layer, receiver);
  const TruncatedNormal azimuths = guide_azimuths(lamp, before);
  const bool up = layer > lamp.layer;
  const Rule& rule = rule_of(std::min(points, kMostPoints));
  const int count = std::min(points, kMostPoints);
  std::uint64_t uncounted = 0;

  for (int sector = 0; sector < cut.sectors; ++sector) {
    Eigen::Vector3d* beams = out + sector * cut.beams_a_sector();
    for (int i = 0; i < count; ++i) {
      const double azimuth = azimuths.value((sector + rule.node[i]) / cut.sectors);
      const double width = rule.weight[i] / (cut.sectors * azimuths.density(azimuth));
      const GuideBearing bearing = guide_bearing(lamp, before.forward, azimuth);
      const auto edge = [&](double height) { return steepness_from(scene, medium, beyond, height, bearing.distance); };
      const double least = walls.empty()
                               ? 0.0
                               : steepness_between_walls(scene.media[medium].index, beyond.layers[beyond.count - 1],
                                                         walls.distance(place.head<2>(), -bearing.toward.head<2>()));
      const auto light_between = [&](double from, double high, int upright_count) {
        const double low = std::max(from, least);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        if (!(high > low)) return sum;
        const Rule& upright = rule_of(upright_count);
        for (int j = 0; j < upright_count; ++j) {
          Arrival<1> arrival;
          const double steepness = low + (high - low) * upright.node[j];
          if (guide_light_along(scene, lamp, beyond, bearing, steepness, up, receiver, uncounted, arrival)) {
            sum -= upright.weight[j] * arrival.irradiance[0] * arrival.direction;
          }
        }
        return Eigen::Vector3d((high - low) * width * sum);
      };
      Eigen::Vector3d all = Eigen::Vector3d::Zero();
      Eigen::Vector3d last = Eigen::Vector3d::Zero();
      double low = edge(0.0);
      for (int beam = 0; beam <= cut.slices; ++beam) {
        const double height = beam < cut.slices ? (beam + 1.0) / cut.slices : 2.0;
        const double high = edge(thickness * height);
        last = light_between(low, high, count);
        beams[beam] += last;
        all += last;
        low = high;
      }
      for (int image = 2; image < kMostImages; ++image) {
        const double high = edge(thickness * (image + 1));
        const Eigen::Vector3d light = light_between(low, high, std::max(1, count / 2));
        beams[cut.slices + 1] += light;
        all += light;
        low = high;
        // Two in a row: of a leaning lobe every second image may be dark.
        if (low > least && light.norm() + last.norm() <= kNegligible * all.norm() && std::abs(bearing.crest) < low)
          break;
        last = light;
      }
    }
  }
}

}  // namespace touchstone::render
