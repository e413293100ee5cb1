#pragma once
// How diffraction at a round hole or a lens's stop spreads the light that a point of the sensor gets.

#include <Eigen/Core>
#include <vector>

#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A round aperture before a sensor that is parallel to it. Lengths in mm.
struct DiffractingAperture {
  double diameter_mm = 0.0;
  double foil_mm = 0.0;        ///< thickness of what the hole is in: seen aslant, it hides a part
  double to_sensor_mm = 0.0;   ///< aperture to sensor
  double per_object_mm = 0.0;  ///< 1 / apparent distance of what is looked at (depth over index, summed up)
  bool in_focus = false;       ///< of a lens: what is looked at is sharp; of a hole nothing is
  double farthest_mm = 0.0;    ///< from the axis to the sensor's farthest point
  Spectrum wavelengths_nm;     ///< one a band
};

/// Fresnel's number a^2 / wavelength (1/object + 1/sensor) of a hole of radius a: far above 1 its picture is the
/// geometric disc, at 1 a hole is as sharp as it gets, far below 1 its picture is Airy's.
double fresnel_number(const DiffractingAperture& aperture, double wavelength_nm);

/// The point spread by Fresnel's diffraction integral [Goodman2005, sec. 4.2] about the chief ray, to second order in
/// the aperture: at an angle theta to the axis the phases of what leaves the aperture's point h for the sensor's point
/// d (both from the chief ray, along the picture's radius r and across it) are 2 pi / wavelength times (h_r^2 cos^3 +
/// h_t^2 cos) (1/object + 1/sensor) / 2 - (h_r d_r cos^3 + h_t d_t cos) / sensor; of a lens that is in focus the first
/// part is zero. What the foil leaves of the hole is the overlap of two discs.
///
/// Kept as tables, for some distances from the axis and each band, out to reach_mm(); the light beyond (about 2 % of
/// it, the rings' tail falls with the third power) is taken to fall as the rest does. What lies nearer or farther than
/// the aperture's object is spread as that is. Safe to use from many threads.
class DiffractionSpread {
 public:
  /// @pre lengths above zero, Fresnel's number of a hole at most kMostFresnel
  explicit DiffractionSpread(const DiffractingAperture& aperture);
  static constexpr double kMostFresnel = 12.0;

  /// Part of a band's light that comes from the direction of another point of the sensor, per mm^2 there. Its integral
  /// is 1. `at`: the point itself, from the axis; `away`: to the other; mm.
  double density(int band, const Eigen::Vector2d& at, const Eigen::Vector2d& away) const;

  /// `away` drawn for two numbers of [0, 1), the same for all bands and points, and its probability per mm^2; with the
  /// ratio of densities as weights means are right for each band.
  struct Draw {
    Eigen::Vector2d away;
    double density;
  };
  /// One draw.
  Draw draw(double u, double v) const;

  double reach_mm() const { return reach_; }              ///< `away` is never longer
  double core_mm() const { return core_; }                ///< most of the light is nearer
  double ring_mm() const { return ring_; }                ///< from one ring to the next, at the shortest wavelength
  int bands() const { return static_cast<int>(bands_); }  ///< of the wavelengths

 private:
  /// Densities over the quarter of `away` where both parts are positive: by row across the radius, by column along it.
  using Table = Eigen::ArrayXXf;
  Table table_of(const DiffractingAperture& aperture, double from_axis, double wavelength_mm) const;
  double look_up(const Table& table, double along, double across) const;

  std::ptrdiff_t bands_ = 0;
  double reach_ = 0.0, core_ = 0.0, ring_ = 0.0, step_ = 0.0;
  double farthest_ = 0.0;
  std::vector<Table> tables_;   // [distance from the axis][band]
  std::vector<double> within_;  // of the draw: probability within each ring's inner edge; rings are step_ wide
};

}  // namespace touchstone::render
