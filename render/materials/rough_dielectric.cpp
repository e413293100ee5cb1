#include "render/materials/rough_dielectric.h"

#include "core/units.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

/// The share of the light seen along a direction at `cosine` that one facet explains: by the midpoint rule over the
/// numbers that sample_visible_normal takes, half of the turn (the other half is its mirror image) and a height with
/// the square roots at its ends stretched away.
double explained_by_one_facet(double cosine, double alpha, double n_out, double n_in) {
  constexpr int kTurns = 16;
  constexpr int kHeights = 32;
  const Eigen::Vector3d out(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
  const double eta = n_out / n_in;
  const double masking = ggx_masking(cosine, alpha);
  double sum = 0.0;
  for (int j = 0; j < kHeights; ++j) {
    const double t = (j + 0.5) / kHeights;
    const double height = 0.5 * (1.0 - std::cos(kPi * t));
    const double weight = 0.5 * kPi * std::sin(kPi * t) / (kHeights * kTurns);
    for (int i = 0; i < kTurns; ++i) {
      const Eigen::Vector3d facet = sample_visible_normal(out, alpha, 0.5 * (i + 0.5) / kTurns, height);
      const double on_facet = std::clamp(out.dot(facet), 0.0, 1.0);
      const FresnelFace face = fresnel(n_out, n_in, on_facet);
      const double reflectance = face.mean_reflectance();
      const double mirrored = 2.0 * on_facet * facet.z() - cosine;
      const double refracted = eta * cosine - (eta * on_facet - face.cos_refracted) * facet.z();
      sum += weight * (reflectance * ggx_masking_shadowing(mirrored, cosine, alpha) / masking +
                       (1.0 - reflectance) * ggx_masking(refracted, alpha));
    }
  }
  return std::min(1.0, sum);
}

/// The integral of s^3 (a + (b - a) (s - low) / (high - low)) from `low` to `s`.
double part_of_cell(double low, double high, double a, double b, double s) {
  const double slope = (b - a) / (high - low);
  const auto integral = [&](double x) { return x * x * x * x * (0.25 * (a - slope * low) + 0.2 * slope * x); };
  return integral(s) - integral(low);
}

}  // namespace

RoughBoundary::RoughBoundary(double alpha, double n_outside, double n_inside)
    : alpha_(alpha), index_{n_outside, n_inside} {
  if (n_outside == n_inside) return;
  double sum = 0.0;
  for (int side = 0; side < 2; ++side) {
    for (int k = 0; k <= kCells; ++k) {
      const double root = std::max(k, 1) / static_cast<double>(kCells);  // at grazing take the next node's value
      missing_[side][k] = 1.0 - explained_by_one_facet(root * root, alpha, index_[side], index_[1 - side]);
    }
    // With s the root of the cosine, |cos| d omega is 2 pi s^2 d(s^2) = 4 pi s^3 ds.
    for (int k = 0; k < kCells; ++k) {
      const double low = k / static_cast<double>(kCells);
      const double high = (k + 1) / static_cast<double>(kCells);
      sum += 4.0 * kPi * index_[side] * index_[side] *
             part_of_cell(low, high, missing_[side][k], missing_[side][k + 1], high);
      up_to_[side * kCells + k] = sum;
    }
  }
}

double RoughBoundary::missing(double cosine, bool inside) const {
  const double place = std::sqrt(std::clamp(cosine, 0.0, 1.0)) * kCells;
  const int node = std::min(static_cast<int>(place), kCells - 1);
  const double part = place - node;
  const auto& table = missing_[inside ? 1 : 0];
  return (1.0 - part) * table[node] + part * table[node + 1];
}

double RoughBoundary::operator()(const Eigen::Vector3d& out, const Eigen::Vector3d& in, bool inside) const {
  if (!(out.z() > 0.0) || in.z() == 0.0) return 0.0;
  const double n_out = index_[inside ? 1 : 0];
  const double one_facet = rough_dielectric(out, in, alpha_, n_out, index_[inside ? 0 : 1]);
  const double all_missing = up_to_.back();
  if (!(all_missing > 0.0)) return one_facet;
  return one_facet +
         n_out * n_out * missing(out.z(), inside) * missing(std::abs(in.z()), inside == (in.z() > 0.0)) / all_missing;
}

std::optional<Eigen::Vector3d> RoughBoundary::sample(const Eigen::Vector3d& out, bool inside,
                                                     SampleSequence& numbers) const {
  if (!(out.z() > 0.0)) return std::nullopt;
  const auto [u, v] = numbers.next_pair();
  const auto [choice, keep] = numbers.next_pair();
  const RoughSample one =
      sample_rough_dielectric(out, alpha_, index_[inside ? 1 : 0], index_[inside ? 0 : 1], u, v, choice);
  if (keep < one.weight) return one.in;
  if (!(up_to_.back() > 0.0)) return std::nullopt;
  return sample_lobe(inside, numbers);
}

Eigen::Vector3d RoughBoundary::sample_lobe(bool inside, SampleSequence& numbers) const {
  const auto [u, v] = numbers.next_pair();
  const double wanted = u * up_to_.back();
  const auto found = std::upper_bound(up_to_.begin(), up_to_.end() - 1, wanted);
  const auto cell = static_cast<int>(found - up_to_.begin());
  const int side = cell / kCells;
  const int k = cell % kCells;
  const double before = cell == 0 ? 0.0 : up_to_[cell - 1];
  const double low = k / static_cast<double>(kCells);
  const double high = (k + 1) / static_cast<double>(kCells);
  const double a = missing_[side][k];
  const double b = missing_[side][k + 1];
  const double share = (wanted - before) / (up_to_[cell] - before) * part_of_cell(low, high, a, b, high);
  double from = low;
  double to = high;
  constexpr int kHalvings = 40;
  for (int step = 0; step < kHalvings; ++step) {
    const double middle = 0.5 * (from + to);
    (part_of_cell(low, high, a, b, middle) < share ? from : to) = middle;
  }
  const double cosine = std::max(1e-8, from * to);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const double azimuth = 2.0 * kPi * v;
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), (side == 1) == inside ? cosine : -cosine};
}

}  // namespace touchstone::render
