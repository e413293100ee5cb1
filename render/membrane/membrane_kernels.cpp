#include "render/membrane/membrane_kernels.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/materials/fresnel.h"
#include "render/materials/scattering.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

constexpr int kParts = 256;                    // walks are shared out in parts, whatever the threads
constexpr double kFinestAnnulus = 1.0 / 80.0;  // of the thickness
constexpr double kEvenAnnuli = 1.0;            // up to this many thicknesses; then wider and wider
constexpr double kWidening = 1.06;
constexpr double kFarthestInThicknesses = 30.0;  // of membrane and plate together
constexpr double kLightWalk = 0.05;

void check(const MembraneOptics& optics, const MembraneWalkSettings& settings) {
  const auto within = [](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high)) fail("membrane: {} is {}; allowed is {} to {}", name, value, low, high);
  };
  within("thickness_mm", optics.thickness_mm, 1e-3, 1e3);
  within("index", optics.index, 1.0, 4.0);
  within("absorption_per_mm", optics.absorption_per_mm, 0.0, 1e3);
  within("scattering_per_mm", optics.scattering_per_mm, 0.0, 1e3);
  within("anisotropy", optics.anisotropy, -0.999, 0.999);
  within("plate_thickness_mm", optics.plate_thickness_mm, 0.0, 1e3);
  within("plate_index", optics.plate_index, 1.0, 4.0);
  within("walks", settings.walks, kParts, 1 << 28);
  within("largest_sine", settings.largest_sine, 1e-3, 0.99);
}

std::vector<double> annuli(const MembraneOptics& optics) {
  const double finest = kFinestAnnulus * optics.thickness_mm;
  const double farthest = kFarthestInThicknesses * (optics.thickness_mm + optics.plate_thickness_mm);
  std::vector<double> radii;
  double radius = 0.0;
  double width = finest;
  while (radius < farthest) {
    if (radius >= kEvenAnnuli * optics.thickness_mm) width *= kWidening;
    radius += width;
    radii.push_back(radius);
  }
  return radii;
}

enum class End { kFace, kFront, kFaded };

/// One walk after another, drawn from one stream.
class Walker {
 public:
  Walker(const MembraneOptics& optics, RandomStream stream) : optics_(optics), stream_(stream) {}

  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double weight = 1.0;
  double absorbed = 0.0;
  bool is_straight = true;  ///< neither scattered nor mirrored

  double number() { return stream_.uniform(); }

  /// From `position` in the membrane along `direction`. Roulette keeps weight + absorbed right in the mean.
  End walk() {
    weight = 1.0;
    absorbed = 0.0;
    is_straight = true;
    for (;;) {
      const bool up = direction.z() > 0.0;
      const double rise = std::abs(direction.z());
      const double depth = up ? -position.z() : position.z() + optics_.thickness_mm;
      const double to_face = rise > 0.0 ? std::max(0.0, depth) / rise : INFINITY;
      const double flight =
          optics_.scattering_per_mm > 0.0 ? -std::log1p(-number()) / optics_.scattering_per_mm : INFINITY;
      const double distance = std::min(flight, to_face);
      if (!std::isfinite(distance)) return End::kFaded;  // level in a clear membrane
      fade(distance);
      if (weight < kLightWalk && !goes_on()) return End::kFaded;
      if (flight < to_face) {
        position += flight * direction;
        turn();
        continue;
      }
      position += to_face * direction;
      if (up) return End::kFace;
      position.z() = -optics_.thickness_mm;
      is_straight = false;
      if (!pass_plate()) return End::kFront;
    }
  }

 private:
  void fade(double distance) {
    if (optics_.absorption_per_mm == 0.0) return;
    const double left = std::exp(-optics_.absorption_per_mm * distance);
    absorbed += weight * (1.0 - left);
    weight *= left;
  }

  bool goes_on() {
    if (number() < 0.5) {
      absorbed -= weight;  // what a walk that goes on carries more than it had
      weight *= 2.0;
      return true;
    }
    absorbed += weight;
    return false;
  }

  void turn() {
    is_straight = false;
    const double cosine = sample_henyey_greenstein(optics_.anisotropy, number());
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const double angle = 2.0 * kPi * number();
    const NormalFrame frame(direction);
    direction = frame.to_world({sine * std::cos(angle), sine * std::sin(angle), cosine}).normalized();
  }

  /// At the membrane's back on the path down: up again in the membrane, or false where the light leaves the plate.
  bool pass_plate() {
    const FresnelFace in = fresnel(optics_.index, optics_.plate_index, -direction.z());
    if (number() < in.mean_reflectance()) {
      direction.z() = -direction.z();
      return true;
    }
    const double eta = optics_.index / optics_.plate_index;
    const double cosine = in.cos_refracted;
    const Eigen::Vector2d sideways = eta * direction.head<2>();
    const Eigen::Vector2d step =
        cosine > 0.0 ? Eigen::Vector2d(sideways * (optics_.plate_thickness_mm / cosine)) : Eigen::Vector2d::Zero();
    const double mirrored = fresnel(optics_.plate_index, 1.0, cosine).mean_reflectance();
    const double back = fresnel(optics_.plate_index, optics_.index, cosine).mean_reflectance();
    for (;;) {
      position.head<2>() += step;
      if (number() >= mirrored) return false;
      position.head<2>() += step;
      if (number() < back) continue;
      direction.z() = -direction.z();
      return true;
    }
  }

  const MembraneOptics& optics_;
  RandomStream stream_;
};

struct Tally {
  explicit Tally(std::size_t annuli) : all{std::vector<double>(annuli, 0.0)} {}
  RadialShare all;
  void add(std::size_t annulus, double share) {
    if (annulus < all.in_annulus.size()) {
      all.in_annulus[annulus] += share;
    } else {
      all.beyond += share;
    }
  }
  void add(const Tally& other) {
    for (std::size_t k = 0; k < all.in_annulus.size(); ++k) all.in_annulus[k] += other.all.in_annulus[k];
    all.beyond += other.all.beyond;
  }
};

/// A part of the walks of one start.
struct PartTally {
  explicit PartTally(std::size_t annuli) {
    for (int j = 0; j < kFaceSectors; ++j) {
      outward.emplace_back(annuli);
      for (int term = 0; term < 4; ++term) to[j].emplace_back(annuli);
    }
  }
  std::array<std::vector<Tally>, kFaceSectors> to;  // [sector][term]
  std::vector<Tally> outward;                       // [sector]
  std::array<double, kFaceSectors> arrived = {}, reflected = {};
  std::array<double, 2> absorbed = {};

  void add(const PartTally& other) {
    for (int j = 0; j < kFaceSectors; ++j) {
      for (std::size_t term = 0; term < to[j].size(); ++term) {
        to[j][term].add(other.to[j][term]);
      }
      outward[j].add(other.outward[j]);
      arrived[j] += other.arrived[j];
      reflected[j] += other.reflected[j];
    }
    for (std::size_t term = 0; term < absorbed.size(); ++term) absorbed[term] += other.absorbed[term];
  }
};

int sector_of(const std::array<double, kFaceSectors + 1>& limits, double squared_cosine) {
  int sector = 0;
  while (sector + 1 < kFaceSectors && squared_cosine >= limits[sector + 1]) ++sector;
  return sector;
}

/// All parts of the walks that `one` draws and tallies, put together in one order.
template <typename One>
PartTally all_walks(const MembraneOptics& optics, const MembraneWalkSettings& settings, std::uint64_t start, int walks,
                    std::size_t annuli, const One& one) {
  std::vector<PartTally> parts(kParts, PartTally(annuli));
  tbb::parallel_for(0, kParts, [&](int part) {
    Walker walker(
        optics, RandomStream(settings.seed, start * kParts + static_cast<std::uint64_t>(part), Purpose::kMembraneWalk));
    const int count = walks / kParts;
    for (int k = 0; k < count; ++k) one(walker, parts[part]);
  });
  PartTally sum(annuli);
  for (const PartTally& part : parts) sum.add(part);
  return sum;
}

RadialShare scaled(const RadialShare& share, double factor) {
  RadialShare out = share;
  for (double& value : out.in_annulus) value *= factor;
  out.beyond *= factor;
  return out;
}

double share_of(double part, double whole) {
  return whole > 0.0 ? part / whole : 0.0;
}

}  // namespace

double RadialShare::total() const {
  return std::accumulate(in_annulus.begin(), in_annulus.end(), beyond);
}

std::array<double, kFaceSectors + 1> sector_limits(double index) {
  const double total = index > 1.0 ? 1.0 - 1.0 / (index * index) : 1.0 / 3.0;
  return {0.0, total, 0.5 * (1.0 + total), 1.0};
}

double straight_share(const MembraneOptics& optics, double squared_sine) {
  const double extinction = optics.absorption_per_mm + optics.scattering_per_mm;
  return std::exp(-extinction * optics.thickness_mm / std::sqrt(1.0 - squared_sine));
}

MembraneKernels walk_membrane(const MembraneOptics& optics, const MembraneWalkSettings& settings) {
  check(optics, settings);
  MembraneKernels out;
  out.optics = optics;
  out.largest_sine = settings.largest_sine;
  out.limits = sector_limits(optics.index);
  out.radii_mm = annuli(optics);
  const std::size_t count = out.radii_mm.size();
  const auto annulus_of = [&](double radius) {
    return static_cast<std::size_t>(std::upper_bound(out.radii_mm.begin(), out.radii_mm.end(), radius) -
                                    out.radii_mm.begin());
  };
  const auto reflectance = [&](const Walker& walker) {
    return fresnel(optics.index, 1.0, walker.direction.z()).mean_reflectance();
  };

  const auto along = [](const Walker& walker, const Eigen::Vector2d& away, double radius) {
    const Eigen::Vector2d level = walker.direction.head<2>();
    const double length = level.norm() * radius;
    return length > 0.0 ? level.dot(away) / length : 0.0;
  };

  std::array<double, kFaceSectors> arrived = {};
  std::array<double, kFaceSectors> reflected = {};
  const int walks = settings.walks / kParts * kParts;
  for (int i = 0; i < kFaceSectors; ++i) {
    const double share = out.limits[i + 1] - out.limits[i];
    const PartTally tally =
        all_walks(optics, settings, static_cast<std::uint64_t>(i), walks, count, [&](Walker& walker, PartTally& part) {
          const double squared_cosine = out.limits[i] + share * walker.number();
          walker.position.setZero();
          walker.direction = {std::sqrt(1.0 - squared_cosine), 0.0, -std::sqrt(squared_cosine)};
          const End end = walker.walk();
          part.absorbed[0] += walker.absorbed;
          if (end != End::kFace) return;
          const int j = sector_of(out.limits, walker.direction.z() * walker.direction.z());
          const Eigen::Vector2d away = walker.position.head<2>();
          const double radius = away.norm();
          const std::size_t annulus = annulus_of(radius);
          const double mirrored = reflectance(walker);
          part.to[j][0].add(annulus, walker.weight);
          part.outward[j].add(annulus, walker.weight * (1.0 - mirrored) * along(walker, away, radius));
          part.arrived[j] += walker.weight;
          part.reflected[j] += walker.weight * mirrored;
        });
    for (int j = 0; j < kFaceSectors; ++j) {
      out.exchange[i][j] = scaled(tally.to[j][0].all, 1.0 / walks);
      out.exchange_outward[i][j] = scaled(tally.outward[j].all, 1.0 / walks);
      arrived[j] += share * tally.arrived[j];
      reflected[j] += share * tally.reflected[j];
    }
    out.exchange_absorbed[i] = tally.absorbed[0] / walks;
  }
  for (int j = 0; j < kFaceSectors; ++j) out.exchange_reflectance[j] = share_of(reflected[j], arrived[j]);

  const double square = settings.largest_sine * settings.largest_sine;  // S: s^2 is even over [0, S]
  const PartTally seen =
      all_walks(optics, settings, kFaceSectors, 2 * walks, count, [&](Walker& walker, PartTally& part) {
        const double squared_sine = square * walker.number();
        const double sine = std::sqrt(squared_sine);
        const double cosine = std::sqrt(1.0 - squared_sine);
        walker.position = {0.0, 0.0, -optics.thickness_mm};
        walker.direction = {sine, 0.0, cosine};
        const End end = walker.walk();
        // Projections on the series' terms, which are orthogonal over s^2 and phi.
        const double slant = (squared_sine - square / 2.0) / (square * square / 12.0);
        if (!(end == End::kFace && walker.is_straight)) {
          part.absorbed[0] += walker.absorbed;
          part.absorbed[1] += walker.absorbed * slant;
        }
        if (end != End::kFace || walker.is_straight) return;
        const int j = sector_of(out.limits, walker.direction.z() * walker.direction.z());
        const Eigen::Vector2d away(walker.position.x() - optics.thickness_mm * sine / cosine, walker.position.y());
        const double radius = away.norm();
        const double cos_phi = radius > 0.0 ? away.x() / radius : 0.0;
        const std::size_t annulus = annulus_of(radius);
        part.to[j][0].add(annulus, walker.weight);
        part.to[j][1].add(annulus, walker.weight * slant);
        part.to[j][2].add(annulus, walker.weight * 2.0 * cos_phi * sine / (square / 2.0));
        part.to[j][3].add(
            annulus, walker.weight * 2.0 * (2.0 * cos_phi * cos_phi - 1.0) * squared_sine / (square * square / 3.0));
        const double mirrored = reflectance(walker);
        part.outward[j].add(annulus, walker.weight * (1.0 - mirrored) * along(walker, away, radius));
        part.arrived[j] += walker.weight;
        part.reflected[j] += walker.weight * mirrored;
      });
  const double per_walk = 1.0 / (2.0 * walks);
  for (int j = 0; j < kFaceSectors; ++j) {
    out.view[j] = {scaled(seen.to[j][0].all, per_walk), scaled(seen.to[j][1].all, per_walk),
                   scaled(seen.to[j][2].all, per_walk), scaled(seen.to[j][3].all, per_walk)};
    out.view_outward[j] = scaled(seen.outward[j].all, per_walk);
    out.view_reflectance[j] = share_of(seen.reflected[j], seen.arrived[j]);
  }
  out.view_absorbed = {seen.absorbed[0] * per_walk, seen.absorbed[1] * per_walk};
  return out;
}

}  // namespace touchstone::render
