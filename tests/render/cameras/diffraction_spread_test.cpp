#include "render/cameras/diffraction_spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "core/random.h"
#include "core/units.h"

namespace touchstone::render {
namespace {

constexpr double kNm = 1e-6;  // in mm

Spectrum one_band(double wavelength_nm) {
  Spectrum wavelengths(1);
  wavelengths << wavelength_nm;
  return wavelengths;
}

/// A hole of 0.1 mm, 5 mm before the sensor, 20 mm from what it sees.
DiffractingAperture hole() {
  return {.diameter_mm = 0.1,
          .foil_mm = 0.05,
          .to_sensor_mm = 5.0,
          .per_object_mm = 1.0 / 20.0,
          .in_focus = false,
          .farthest_mm = 2.76,
          .wavelengths_nm = one_band(540.0)};
}

double integral(const DiffractionSpread& spread, const Eigen::Vector2d& at, double frequency) {
  constexpr double kStep = 0.002;
  const int half = static_cast<int>(spread.reach_mm() / kStep) + 1;
  double sum = 0.0;
  for (int j = -half; j <= half; ++j) {
    for (int i = -half; i <= half; ++i) {
      const Eigen::Vector2d away(i * kStep, j * kStep);
      sum += spread.density(0, at, away) * std::cos(2.0 * kPi * frequency * away.x()) * kStep * kStep;
    }
  }
  return sum;
}

// Of a lens in focus the spread is Airy's: pi/4 (D / (wavelength s))^2 (2 J1(v)/v)^2, v = pi D r / (wavelength s),
// [Goodman2005, sec. 4.4.2]. What lies beyond the reach of twelve rings, 2/(pi v) = 1.7 %, is counted within it;
// between the table's points lies h^2/8 f'' of the peak, 0.43 % for a twelfth of a ring.
TEST(DiffractionSpread, OfALensInFocusIsAirys) {
  DiffractingAperture lens = hole();
  lens.in_focus = true;
  lens.foil_mm = 0.0;
  const DiffractionSpread spread(lens);
  const double ring = 540.0 * kNm * lens.to_sensor_mm / lens.diameter_mm;
  const double peak = 0.25 * kPi / (ring * ring);
  for (const double rings : {0.01, 0.3, 0.6, 0.9, 1.6, 2.6}) {
    const double v = kPi * rings;
    const double airy = peak * std::pow(2.0 * std::cyl_bessel_j(1.0, v) / v, 2);
    EXPECT_NEAR(spread.density(0, {0, 0}, {rings * ring, 0.0}), airy, 0.02 * airy + 0.0043 * peak) << rings;
  }
}

/// The optical transfer function of a round aperture out of focus: the autocorrelation of its pupil [Hopkins1955].
double hopkins(const DiffractingAperture& aperture, double frequency) {
  const double a = 0.5 * aperture.diameter_mm;
  const double wavelength = aperture.wavelengths_nm[0] * kNm;
  const double half_shift = 0.5 * wavelength * aperture.to_sensor_mm * frequency;
  const double rate = frequency * aperture.to_sensor_mm * (aperture.per_object_mm + 1.0 / aperture.to_sensor_mm);
  const double width = a - half_shift;
  if (width <= 0.0) return 0.0;
  constexpr int kSteps = 4000;
  double sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double x = width * (k + 0.5) / kSteps;
    sum += std::sqrt(a * a - (x + half_shift) * (x + half_shift)) * std::cos(2.0 * kPi * rate * x);
  }
  return 4.0 * sum * width / kSteps / (kPi * a * a);
}

// Lines of 1, 0.6, 0.5, 0.4, 0.3 mm on what is 20 mm before the hole: 67, 40, 30, 18, 9 % of their contrast, where the
// geometric disc leaves 71, 32, 15, -4, -12 %.
TEST(DiffractionSpread, OfAHoleHasHopkinsTransferFunction) {
  for (const double wavelength : {460.0, 540.0, 620.0}) {
    DiffractingAperture aperture = hole();
    aperture.wavelengths_nm = one_band(wavelength);
    const DiffractionSpread spread(aperture);
    EXPECT_NEAR(integral(spread, {0, 0}, 0.0), 1.0, 2e-3);
    for (const double lines_mm : {1.0, 0.6, 0.5, 0.4, 0.3, 0.25}) {
      const double frequency = 4.0 / lines_mm;  // on the sensor
      EXPECT_NEAR(integral(spread, {0, 0}, frequency), hopkins(aperture, frequency), 0.012) << lines_mm;
    }
  }
}

/// Huygens' sum over the places of the hole that both rims let through, by the true lengths of the ways from a point of
/// the object's plane to a point of the sensor, in the open.
double huygens(const DiffractingAperture& aperture, const Eigen::Vector2d& at, const Eigen::Vector2d& away) {
  constexpr int kAcross = 400;
  const double radius = 0.5 * aperture.diameter_mm;
  const double wave = 2.0 * kPi / (aperture.wavelengths_nm[0] * kNm);
  const double away_z = 1.0 / aperture.per_object_mm;
  // What is seen at `at` through the hole's middle lies straight behind it.
  const Eigen::Vector3d object(-at.x() * away_z / aperture.to_sensor_mm, -at.y() * away_z / aperture.to_sensor_mm,
                               away_z);
  const Eigen::Vector3d sensor(at.x() + away.x(), at.y() + away.y(), -aperture.to_sensor_mm);
  const Eigen::Vector2d slope = at / aperture.to_sensor_mm;
  std::complex<double> sum = 0.0;
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      const Eigen::Vector2d place =
          radius * Eigen::Vector2d(2.0 * (i + 0.5) / kAcross - 1.0, 2.0 * (j + 0.5) / kAcross - 1.0);
      const Eigen::Vector2d half = 0.5 * aperture.foil_mm * slope;
      if ((place + half).norm() > radius || (place - half).norm() > radius) continue;
      const Eigen::Vector3d in_hole(place.x(), place.y(), 0.0);
      sum += std::polar(1.0, wave * ((object - in_hole).norm() + (in_hole - sensor).norm()));
    }
  }
  return std::norm(sum);
}

TEST(DiffractionSpread, AslantIsHuygensSum) {
  const DiffractingAperture aperture = hole();
  const DiffractionSpread spread(aperture);
  const double diagonal = std::sqrt(0.5);
  for (const double from_axis : {1.104, 2.208}) {  // where tables are
    const Eigen::Vector2d at(from_axis * diagonal, from_axis * diagonal);
    const double scale = spread.density(0, at, {0, 0}) / huygens(aperture, at, {0, 0});
    const double peak = spread.density(0, at, {0, 0});
    for (const double length : {0.01, 0.02, 0.03, 0.045, 0.06}) {
      for (const Eigen::Vector2d& direction :
           {Eigen::Vector2d(diagonal, diagonal), Eigen::Vector2d(-diagonal, diagonal)}) {
        const Eigen::Vector2d away = length * direction;
        EXPECT_NEAR(spread.density(0, at, away), scale * huygens(aperture, at, away), 0.03 * peak)
            << from_axis << " " << away.transpose();
      }
    }
  }
}

TEST(DiffractionSpread, DrawsMeanWhatDensitiesSay) {
  DiffractingAperture aperture = hole();
  aperture.wavelengths_nm.resize(2);
  aperture.wavelengths_nm << 460.0, 620.0;
  const DiffractionSpread spread(aperture);
  RandomStream random(3, 0, Purpose::kSearch);
  const Eigen::Vector2d at(1.3, -0.9);
  constexpr int kDraws = 200000;
  double sum[2] = {};
  double inner[2] = {};
  double heaviest = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const double u = random.uniform();
    const DiffractionSpread::Draw draw = spread.draw(u, random.uniform());
    ASSERT_LE(draw.away.norm(), spread.reach_mm() * (1.0 + 1e-12));
    for (int band = 0; band < 2; ++band) {
      const double weight = spread.density(band, at, draw.away) / draw.density;
      heaviest = std::max(heaviest, weight);
      sum[band] += weight / kDraws;
      if (draw.away.norm() < 0.03) inner[band] += weight / kDraws;
    }
  }
  for (const double one : sum) EXPECT_NEAR(one, 1.0, 0.01);
  for (int band = 0; band < 2; ++band) {
    double wanted = 0.0;
    constexpr double kStep = 0.0005;
    for (int j = -60; j <= 60; ++j) {
      for (int i = -60; i <= 60; ++i) {
        const Eigen::Vector2d away(i * kStep, j * kStep);
        if (away.norm() < 0.03) wanted += spread.density(band, at, away) * kStep * kStep;
      }
    }
    EXPECT_NEAR(inner[band], wanted, 0.01);
  }
  EXPECT_LT(heaviest, 10.0);
}

}  // namespace
}  // namespace touchstone::render
