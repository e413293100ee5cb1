#include "sensors/heights/ball_imprint.h"

#include <math.h>  // ::j0 of POSIX: libc++ has no std::cyl_bessel_j
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>

#include "core/error.h"
#include "core/gauss_rule.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

constexpr int kNodes = 40;             // of the density
constexpr double kHighestWave = 16.0;  // by the thickness: the layer's share of the kernel is below 1e-11 there
constexpr int kWaves = 800;            // Simpson's rule: phases of at most 0.6 a step, with kReach
constexpr double kReach = 8.0;         // thicknesses beyond the rim: heights have fallen below 1e-4 of the depth
constexpr int kOutside = 160;          // over that reach: finer towards the rim, where the slope falls as a root
constexpr double kThinnest = 0.2;      // by the contact radius
constexpr double kThickest = 20.0;     // likewise

/// Transform of an incompressible bonded layer's compliance by a half-space's, less 1, at wave number `q` by the
/// thickness: (2 sinh 2q - 4q) / (2 cosh 2q + 4q^2 + 2) - 1.
double layer_share(double q) {
  const double e = std::exp(-2.0 * q);
  const double below = 1.0 + e * e + e * (4.0 * q * q + 2.0);
  return (1.0 - e * e - 4.0 * q * e) / below - 1.0;
}

/// The wave numbers of the layer's share, 1/mm, and what Simpson's rule weighs that share with.
struct Waves {
  Eigen::ArrayXd number;
  Eigen::ArrayXd weight;

  explicit Waves(double thickness) : number(kWaves + 1), weight(kWaves + 1) {
    const double step = kHighestWave / kWaves;
    for (int i = 0; i <= kWaves; ++i) {
      const double simpson = i == 0 || i == kWaves ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
      number[i] = i * step / thickness;
      weight[i] = simpson * step / (3.0 * thickness) * layer_share(i * step);
    }
  }
};

/// What a half-space's density would be for a ball at depth 0: -d/ds of the integral of s's sphere.
double sphere_density(double s, double ball_radius) {
  return -0.5 * s * std::log((ball_radius + s) / (ball_radius - s));
}

}  // namespace

// Heights are the integral over s of density(s) times that over k of L(k) cos(ks) J0(kr), L the layer's compliance by
// the half-space's. Such heights press on nothing beyond the contact radius. That they are the ball's within it is an
// integral equation of the second kind, whose solution is linear in the depth; the depth follows from the density's
// vanishing at the rim.
BallImprint::BallImprint(double ball_radius, double contact_radius, double thickness)
    : ball_radius_(ball_radius), contact_radius_(contact_radius) {
  TS_ASSERT(contact_radius > 0.0 && contact_radius < ball_radius && thickness > 0.0 && std::isfinite(ball_radius));
  const double layer = std::clamp(thickness, kThinnest * contact_radius, kThickest * contact_radius);
  const Waves waves(layer);
  static const GaussRule rule = gauss_rule(kNodes);
  const Eigen::VectorXd nodes = contact_radius * rule.nodes;
  const Eigen::VectorXd weights = contact_radius * rule.weights;
  const Eigen::MatrixXd cosines = (nodes * waves.number.matrix().transpose()).array().cos().matrix();
  const Eigen::MatrixXd kernel = cosines * waves.weight.matrix().asDiagonal() * cosines.transpose();
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(kNodes, kNodes) + 2.0 / kPi * kernel * weights.asDiagonal();
  Eigen::MatrixXd right(kNodes, 2);  // for a depth of 1 without a ball, and for the ball at depth 0
  for (int i = 0; i < kNodes; ++i) right.row(i) << 2.0 / kPi, 2.0 / kPi * sphere_density(nodes[i], ball_radius);
  const Eigen::MatrixXd found = matrix.partialPivLu().solve(right);
  // The density anywhere, by the equation itself: its waves are summed over the nodes once.
  const Eigen::MatrixXd sums = cosines.transpose() * weights.asDiagonal() * found;
  const auto at = [&](double s) -> Eigen::Vector2d {
    const Eigen::VectorXd wave = ((waves.number * s).cos() * waves.weight).matrix();
    return 2.0 / kPi * (Eigen::Vector2d(1.0, sphere_density(s, ball_radius)) - sums.transpose() * wave);
  };
  const Eigen::Vector2d at_rim = at(contact_radius);
  depth_ = -at_rim[1] / at_rim[0];

  constexpr int kGrid = 400;
  std::vector<double> density(kGrid + 1);
  for (int i = 0; i <= kGrid; ++i) {
    const Eigen::Vector2d both = at(contact_radius * i / kGrid);
    density[static_cast<std::size_t>(i)] = depth_ * both[0] + both[1];
  }
  const auto density_at = [&](double s) {
    const double place = std::min(s / contact_radius, 1.0) * kGrid;
    const int i = std::min(static_cast<int>(place), kGrid - 1);
    const double share = place - i;
    return (1.0 - share) * density[static_cast<std::size_t>(i)] + share * density[static_cast<std::size_t>(i) + 1];
  };
  const Eigen::ArrayXd spectrum = waves.weight * (depth_ * sums.col(0) + sums.col(1)).array();
  reach_ = kReach * layer;
  for (int i = 0; i <= kOutside; ++i) {
    const double r = contact_radius + reach_ * i * i / (kOutside * kOutside);
    const double widest = std::asin(contact_radius / r);
    double sum = 0.0;  // of the half-space: s = r sin(angle)
    for (int n = 0; n < kNodes; ++n) sum += widest * rule.weights[n] * density_at(r * std::sin(widest * rule.nodes[n]));
    for (int k = 0; k <= kWaves; ++k) sum += spectrum[k] * ::j0(waves.number[k] * r);
    outside_.push_back(sum);
  }
}

double BallImprint::place_of(double r) const {
  return kOutside * std::sqrt((r - contact_radius_) / reach_);
}

double BallImprint::height(double r) const {
  if (r <= contact_radius_) return depth_ - ball_radius_ + std::sqrt(ball_radius_ * ball_radius_ - r * r);
  const double place = place_of(r);
  const auto i = static_cast<std::size_t>(std::min<double>(place, kOutside));
  if (i >= kOutside) return 0.0;
  const double share = place - static_cast<double>(i);
  return (1.0 - share) * outside_[i] + share * outside_[i + 1];
}

double BallImprint::slope(double r) const {
  if (r <= contact_radius_) return -r / std::sqrt(ball_radius_ * ball_radius_ - r * r);
  // Of the parabola through the three nearest heights, by the places: r grows with a place's square.
  const double place = std::max(place_of(r), 0.5);
  const auto i = static_cast<std::size_t>(std::min<double>(place + 0.5, kOutside));
  if (i >= kOutside) return 0.0;
  const double offset = place - static_cast<double>(i);
  const double first = 0.5 * (outside_[i + 1] - outside_[i - 1]);
  const double second = outside_[i + 1] - 2.0 * outside_[i] + outside_[i - 1];
  return (first + offset * second) * (kOutside * kOutside) / (2.0 * place * reach_);
}

}  // namespace touchstone::sensors
