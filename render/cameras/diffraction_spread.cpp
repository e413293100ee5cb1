#include "render/cameras/diffraction_spread.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::render {
namespace {

constexpr double kMmPerNm = 1e-6;
constexpr double kReach = 12.0;        // of wavelength * sensor / diameter, beyond the geometric disc
constexpr double kCore = 4.0;          // the same
constexpr double kStepsARing = 12.0;   // of that length, too
constexpr int kDistances = 6;          // from the axis to the farthest point
constexpr double kPointsARing = 16.0;  // of the aperture's integral

}  // namespace

double fresnel_number(const DiffractingAperture& aperture, double wavelength_nm) {
  const double radius = 0.5 * aperture.diameter_mm;
  return radius * radius / (wavelength_nm * kMmPerNm) * (aperture.per_object_mm + 1.0 / aperture.to_sensor_mm);
}

DiffractionSpread::DiffractionSpread(const DiffractingAperture& aperture)
    : bands_(aperture.wavelengths_nm.size()), farthest_(aperture.farthest_mm) {
  TS_ASSERT(bands_ > 0 && aperture.diameter_mm > 0.0 && aperture.to_sensor_mm > 0.0 && farthest_ > 0.0);
  TS_ASSERT(aperture.in_focus || fresnel_number(aperture, aperture.wavelengths_nm.minCoeff()) <= kMostFresnel);
  const double ring = kMmPerNm * aperture.to_sensor_mm / aperture.diameter_mm;  // times the wavelength
  const double disc =
      aperture.in_focus ? 0.0 : 0.5 * aperture.diameter_mm * (1.0 + aperture.to_sensor_mm * aperture.per_object_mm);
  reach_ = disc + kReach * ring * aperture.wavelengths_nm.maxCoeff();
  core_ = disc + kCore * ring * aperture.wavelengths_nm.maxCoeff();
  ring_ = ring * aperture.wavelengths_nm.minCoeff();
  step_ = ring_ / kStepsARing;
  tables_.resize(kDistances * bands_);
  tbb::parallel_for(std::size_t{0}, tables_.size(), [&](std::size_t k) {
    const auto band = static_cast<std::ptrdiff_t>(k) % bands_;
    const double from_axis =
        farthest_ * static_cast<double>(static_cast<std::ptrdiff_t>(k) / bands_) / (kDistances - 1);
    tables_[k] = table_of(aperture, from_axis, aperture.wavelengths_nm[band] * kMmPerNm);
  });
  // Draws follow the mean of all tables round each ring; none is so rare that its weight gets large.
  constexpr int kAngles = 32;
  const double evenly = aperture.in_focus ? 0.0 : 0.02;  // a lens's draws have no weights
  const int rings = static_cast<int>(std::ceil(reach_ / step_));
  std::vector<double> part(rings);
  double whole = 0.0;
  for (int i = 0; i < rings; ++i) {
    const double radius = (i + 0.5) * step_;
    for (int k = 0; k < kAngles; ++k) {
      const double angle = 0.5 * kPi * (k + 0.5) / kAngles;
      for (const Table& table : tables_) part[i] += look_up(table, radius * std::cos(angle), radius * std::sin(angle));
    }
    part[i] *= radius;
    whole += part[i];
  }
  within_.assign(1, 0.0);
  for (int i = 0; i < rings; ++i) {
    within_.push_back(within_.back() + (1.0 - evenly) * part[i] / whole + evenly / rings);
  }
  for (double& one : within_) one /= within_.back();
}

DiffractionSpread::Table DiffractionSpread::table_of(const DiffractingAperture& aperture, double from_axis,
                                                     double wavelength_mm) const {
  const double radius = 0.5 * aperture.diameter_mm;
  const double slope = from_axis / aperture.to_sensor_mm;
  const double cosine = 1.0 / std::sqrt(1.0 + slope * slope);
  const double along = 2.0 * kPi / wavelength_mm * cosine * cosine * cosine;  // phase per mm of path, foreshortened
  const double across = 2.0 * kPi / wavelength_mm * cosine;
  const double curved = aperture.in_focus ? 0.0 : aperture.per_object_mm + 1.0 / aperture.to_sensor_mm;
  // The foil may hide all of the hole; what little is left then says how the last light is spread.
  const double shift = std::min(0.5 * aperture.foil_mm * slope, 0.95 * radius);
  const double height = std::sqrt(radius * radius - shift * shift);
  const auto size = static_cast<std::ptrdiff_t>(std::ceil(reach_ / step_)) + 2;
  // Points enough for the fastest phase, that of the farthest place.
  const double turns = along / (2.0 * kPi) * radius * (reach_ / aperture.to_sensor_mm + curved * radius);
  const auto points = static_cast<std::ptrdiff_t>(std::ceil(32.0 + kPointsARing * turns));

  Eigen::ArrayXXcd sum = Eigen::ArrayXXcd::Zero(size, size);
  Eigen::ArrayXcd row(size);
  Eigen::ArrayXd wave(size);
  const auto fill_wave = [&](double phase_a_step) {  // cos(j phase), by Chebyshev's recurrence
    wave[0] = 1.0;
    wave[1] = std::cos(phase_a_step);
    for (std::ptrdiff_t j = 2; j < size; ++j) wave[j] = 2.0 * wave[1] * wave[j - 1] - wave[j - 2];
  };
  for (std::ptrdiff_t i = 0; i < points; ++i) {
    const double angle = 0.5 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(points);
    const double y = height * std::sin(angle);  // close where the chord ends
    const double chord = std::sqrt(radius * radius - y * y) - shift;
    if (chord <= 0.0) continue;
    row.setZero();
    const double step = chord / static_cast<double>(points);
    for (std::ptrdiff_t j = 0; j < points; ++j) {
      const double x = step * (static_cast<double>(j) + 0.5);
      fill_wave(along * x * step_ / aperture.to_sensor_mm);
      row += std::polar(step, 0.5 * along * curved * x * x) * wave;
    }
    fill_wave(across * y * step_ / aperture.to_sensor_mm);
    row *= std::polar(height * std::cos(angle) / static_cast<double>(points), 0.5 * across * curved * y * y);
    for (std::ptrdiff_t j = 0; j < size; ++j) sum.col(j) += row[j] * wave;
  }
  Table table = sum.abs2().cast<float>();
  double whole = 0.0;
  for (std::ptrdiff_t j = 0; j < size; ++j) {
    for (std::ptrdiff_t i = 0; i < size; ++i) {
      if (std::hypot(i, j) * step_ > reach_) continue;
      whole += table(i, j) * (i == 0 ? 0.5 : 1.0) * (j == 0 ? 0.5 : 1.0);
    }
  }
  return table * static_cast<float>(1.0 / (4.0 * whole * step_ * step_));
}

double DiffractionSpread::look_up(const Table& table, double along, double across) const {
  const double x = along / step_;
  const double y = across / step_;
  const auto j = std::min(static_cast<std::ptrdiff_t>(x), table.cols() - 2);
  const auto i = std::min(static_cast<std::ptrdiff_t>(y), table.rows() - 2);
  const double px = std::min(1.0, x - static_cast<double>(j));
  const double py = std::min(1.0, y - static_cast<double>(i));
  return (1.0 - py) * ((1.0 - px) * table(i, j) + px * table(i, j + 1)) +
         py * ((1.0 - px) * table(i + 1, j) + px * table(i + 1, j + 1));
}

double DiffractionSpread::density(int band, const Eigen::Vector2d& at, const Eigen::Vector2d& away) const {
  if (away.squaredNorm() > reach_ * reach_) return 0.0;
  const double from_axis = at.norm();
  const Eigen::Vector2d radial = from_axis > 0.0 ? Eigen::Vector2d(at / from_axis) : Eigen::Vector2d::UnitX();
  const double along = std::abs(away.dot(radial));
  const double across = std::abs(away.y() * radial.x() - away.x() * radial.y());
  const double place = std::min(from_axis / farthest_, 1.0) * (kDistances - 1);
  const auto low = std::min(static_cast<std::ptrdiff_t>(place), static_cast<std::ptrdiff_t>(kDistances - 2));
  const double part = place - static_cast<double>(low);
  const auto table = [&](std::ptrdiff_t k) {
    return look_up(tables_[static_cast<std::size_t>(k * bands_ + band)], along, across);
  };
  return (1.0 - part) * table(low) + (part > 0.0 ? part * table(low + 1) : 0.0);
}

DiffractionSpread::Draw DiffractionSpread::draw(double u, double v) const {
  const auto next = std::upper_bound(within_.begin() + 1, within_.end() - 1, u);
  const auto ring = static_cast<double>(next - within_.begin() - 1);
  const double below = *(next - 1);
  const double share = *next - below;
  // Evenly over the ring's area.
  const double inner = ring * step_;
  const double outer = std::min(inner + step_, reach_);
  const double square = inner * inner + std::clamp((u - below) / share, 0.0, 1.0) * (outer * outer - inner * inner);
  const double radius = std::sqrt(square);
  const double angle = 2.0 * kPi * v;
  return {{radius * std::cos(angle), radius * std::sin(angle)}, share / (kPi * (outer * outer - inner * inner))};
}

}  // namespace touchstone::render
