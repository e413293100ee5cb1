#include "render/materials/ggx.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {

double ggx_distribution(double cos_m, double alpha) {
  if (cos_m <= 0.0) return 0.0;
  const double a2 = alpha * alpha;
  const double d = 1.0 - cos_m * cos_m * (1.0 - a2);
  return a2 / (kPi * d * d);
}

double ggx_masking(double cos_direction, double alpha) {
  if (cos_direction <= 0.0) return 0.0;
  const double a2 = alpha * alpha;
  return 2.0 * cos_direction / (cos_direction + std::sqrt(a2 + (1.0 - a2) * cos_direction * cos_direction));
}

double ggx_masking_shadowing(double cos_in, double cos_out, double alpha) {
  if (cos_in <= 0.0 || cos_out <= 0.0) return 0.0;
  const double a2 = alpha * alpha;
  const double term_in = cos_out * std::sqrt(a2 + (1.0 - a2) * cos_in * cos_in);
  const double term_out = cos_in * std::sqrt(a2 + (1.0 - a2) * cos_out * cos_out);
  return 2.0 * cos_in * cos_out / (term_in + term_out);
}

Eigen::Vector3d sample_visible_normal(const Eigen::Vector3d& out, double alpha, double u, double v) {
  // In the space where the facets form a hemisphere, the mirrored directions are uniform on a spherical cap.
  const Eigen::Vector3d stretched = Eigen::Vector3d(alpha * out.x(), alpha * out.y(), out.z()).normalized();
  const double angle = 2.0 * kPi * u;
  const double z = (1.0 - v) * (1.0 + stretched.z()) - stretched.z();
  const double radius = std::sqrt(std::clamp(1.0 - z * z, 0.0, 1.0));
  const Eigen::Vector3d half = Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), z) + stretched;
  return Eigen::Vector3d(alpha * half.x(), alpha * half.y(), std::max(half.z(), 1e-12)).normalized();
}

double visible_reflection_density(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha) {
  const Eigen::Vector3d sum = out + in;
  const double length = sum.norm();
  if (out.z() <= 0.0 || length <= 0.0) return 0.0;
  const double cos_m = sum.z() / length;
  return ggx_masking(out.z(), alpha) * ggx_distribution(cos_m, alpha) / (4.0 * out.z());
}

double ggx_reflection(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha) {
  if (out.z() <= 0.0 || in.z() <= 0.0) return 0.0;
  const double cos_m = (out + in).normalized().z();
  return ggx_distribution(cos_m, alpha) * ggx_masking_shadowing(in.z(), out.z(), alpha) / (4.0 * out.z() * in.z());
}

GgxAlbedo::GgxAlbedo(double alpha) {
  constexpr std::uint32_t kReflections = 512;
  for (int k = 0; k < kNodes; ++k) {
    const double root = std::max(k, 1) / static_cast<double>(kNodes - 1);  // at grazing take the next node's value
    const double cosine = root * root;
    const Eigen::Vector3d out(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    double sum = 0.0;
    for (std::uint32_t i = 0; i < kReflections; ++i) {
      SampleSequence numbers(0, static_cast<std::uint64_t>(k), i);
      const auto [u, v] = numbers.next_pair();
      const Eigen::Vector3d facet = sample_visible_normal(out, alpha, u, v);
      const Eigen::Vector3d in = 2.0 * out.dot(facet) * facet - out;
      if (in.z() > 0.0) sum += ggx_masking_shadowing(in.z(), cosine, alpha);
    }
    table_[k] = std::clamp(sum / (kReflections * ggx_masking(cosine, alpha)), 1e-3, 1.0);
  }
}

double GgxAlbedo::operator()(double cosine) const {
  const double place = std::sqrt(std::clamp(cosine, 0.0, 1.0)) * (kNodes - 1);
  const int node = std::min(static_cast<int>(place), kNodes - 2);
  const double part = place - node;
  return (1.0 - part) * table_[node] + part * table_[node + 1];
}

double schlick_weight(double cos_half) {
  const double a = 1.0 - std::clamp(cos_half, 0.0, 1.0);
  const double a2 = a * a;
  return a2 * a2 * a;
}

}  // namespace touchstone::render
