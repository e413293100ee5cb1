#include "sim/files/srgb_reflectance.h"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "core/cie_colour.h"
#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr double kFrom_nm = 380.0;
constexpr double kTo_nm = 780.0;
constexpr int kSteps = 80;  // of 5 nm

/// Relative power of D65 every 10 nm from 380 to 780 nm [CIE15].
constexpr std::array<double, 41> kD65 = {
    49.98,  54.65,  82.75,  91.49,  93.43,  86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80,
    104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79,  88.69,  90.01,  89.60,  87.70,  83.29,  83.70,  80.03,
    80.21,  82.28,  78.28,  69.72,  71.61,  74.35, 61.60,  69.89,  75.09,  63.59,  46.42,  66.81,  63.38};

/// A bell whose sides have widths of their own; `below` and `above` are per nm.
double bell(double nm, double height, double centre, double below, double above) {
  const double t = (nm - centre) * (nm < centre ? below : above);
  return height * std::exp(-0.5 * t * t);
}

Eigen::Vector3d matching_functions(double nm) {
  return {bell(nm, 0.362, 442.0, 0.0624, 0.0374) + bell(nm, 1.056, 599.8, 0.0264, 0.0323) +
              bell(nm, -0.065, 501.1, 0.0490, 0.0382),
          bell(nm, 0.821, 568.8, 0.0213, 0.0247) + bell(nm, 0.286, 530.9, 0.0613, 0.0322),
          bell(nm, 1.217, 437.0, 0.0845, 0.0278) + bell(nm, 0.681, 459.0, 0.0385, 0.0725)};
}

double wavelength_of(int step) {
  return kFrom_nm + (kTo_nm - kFrom_nm) * step / kSteps;
}

/// What reflects at each step counts for X, Y and Z; the columns' sum is kD65White.
const Eigen::Matrix<double, 3, kSteps + 1>& weights() {
  static const auto matrix = [] {
    Eigen::Matrix<double, 3, kSteps + 1> out;
    for (int k = 0; k <= kSteps; ++k) {
      const double d65 = k % 2 == 0 ? kD65[k / 2] : 0.5 * (kD65[k / 2] + kD65[k / 2 + 1]);
      out.col(k) = (k == 0 || k == kSteps ? 0.5 : 1.0) * d65 * matching_functions(wavelength_of(k));
    }
    const Eigen::Vector3d scale = kD65White.cwiseQuotient(out.rowwise().sum());
    return Eigen::Matrix<double, 3, kSteps + 1>(scale.asDiagonal() * out);
  }();
  return matrix;
}

using Samples = Eigen::Matrix<double, kSteps + 1, 1>;

/// The family of spectra, and their derivative by the three coefficients of c.
Samples samples_of(const Eigen::Vector3d& coefficients, Eigen::Matrix<double, kSteps + 1, 3>* derivative) {
  Samples out;
  for (int k = 0; k <= kSteps; ++k) {
    const double t = 2.0 * k / kSteps - 1.0;
    const Eigen::RowVector3d powers(1.0, t, t * t);
    const double c = powers * coefficients;
    const double root = std::sqrt(1.0 + c * c);
    out[k] = 0.5 + 0.5 * c / root;
    if (derivative != nullptr) derivative->row(k) = 0.5 / (root * root * root) * powers;
  }
  return out;
}

/// The spectrum of the family that looks like `xyz`. Newton's method, led from grey to the colour in small steps: the
/// corners' spectra are nearly rectangles.
Samples spectrum_of(const Eigen::Vector3d& xyz) {
  constexpr int kContinuation = 64;
  constexpr int kMostIterations = 50;
  constexpr double kClose = 1e-12;
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();
  for (int step = 1; step <= kContinuation; ++step) {
    const double part = static_cast<double>(step) / kContinuation;
    const Eigen::Vector3d target = (1.0 - part) * 0.5 * kD65White + part * xyz;
    for (int i = 0; i < kMostIterations; ++i) {
      Eigen::Matrix<double, kSteps + 1, 3> derivative;
      const Eigen::Vector3d miss = weights() * samples_of(coefficients, &derivative) - target;
      if (miss.norm() < kClose) break;
      coefficients -= (weights() * derivative).lu().solve(miss);
    }
  }
  const Samples out = samples_of(coefficients, nullptr);
  TS_ASSERT((weights() * out - xyz).norm() < 1e-9);
  return out;
}

render::SpectralCurve curve_of(const Samples& samples) {
  render::SpectralCurve curve;
  curve.source = "sRGB under D65";
  for (int k = 0; k <= kSteps; ++k) {
    curve.wavelengths_nm.push_back(wavelength_of(k));
    curve.values.push_back(samples[k]);
  }
  return curve;
}

Eigen::Vector3d corner(int index) {
  return {(index & 1) != 0 ? 1.0 : 0.0, (index & 2) != 0 ? 1.0 : 0.0, (index & 4) != 0 ? 1.0 : 0.0};
}

}  // namespace

std::array<double, 8> corner_shares(const Eigen::Vector3d& linear) {
  std::array<double, 8> shares{};
  for (int index = 0; index < 8; ++index) {
    const Eigen::Vector3d at = corner(index);
    shares[index] = (at.array() * linear.array() + (1.0 - at.array()) * (1.0 - linear.array())).prod();
  }
  return shares;
}

const std::array<render::SpectralCurve, 8>& corner_reflectances() {
  static const auto curves = [] {
    std::array<render::SpectralCurve, 8> out;
    out[0] = curve_of(Samples::Zero());
    out[7] = curve_of(Samples::Ones());
    for (int index = 1; index < 7; ++index) {
      out[index] = curve_of(spectrum_of(xyz_from_linear_srgb(corner(index))));
    }
    return out;
  }();
  return curves;
}

render::SpectralCurve srgb_reflectance(const Eigen::Vector3d& srgb) {
  const std::array<double, 8> shares = corner_shares(linear_from_srgb(srgb));
  Samples mix = Samples::Zero();
  for (int index = 0; index < 8; ++index) {
    mix += shares[index] * Eigen::Map<const Samples>(corner_reflectances()[index].values.data());
  }
  return curve_of(mix.cwiseMax(0.0).cwiseMin(1.0));
}

render::SpectralCurve single_ink_reflectance(const Eigen::Vector3d& srgb) {
  return curve_of(spectrum_of(xyz_from_linear_srgb(linear_from_srgb(srgb))));
}

Eigen::Vector3d xyz_under_d65(const render::SpectralCurve& reflectance) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k <= kSteps; ++k) sum += weights().col(k) * reflectance.at(wavelength_of(k));
  return sum;
}

}  // namespace touchstone::sim
