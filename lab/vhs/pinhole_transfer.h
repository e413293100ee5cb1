#pragma once
// How much of a fine pattern's contrast a pinhole camera leaves, in closed form. Lengths in mm.

namespace touchstone::lab {

/// The camera and how far the pattern is from it.
struct PinholeOptics {
  double hole_mm = 0.0;       ///< diameter
  double to_sensor_mm = 0.0;  ///< hole to sensor
  double to_object_mm = 0.0;  ///< hole to object, apparent: depth over index, summed over the layers between
  double pixel_mm = 0.0;      ///< side of what a pixel averages; 0 for a point
};

/// Object's frequency (1/mm) that has `frequency` on the sensor is that times to_sensor / to_object.
double on_sensor(const PinholeOptics& optics, double frequency);

/// Contrast that is left of a sine of `frequency` (1/mm on the object), near the axis and for a thin foil, without
/// diffraction: the blur is the hole's disc, seen from the sensor, so 2 J1(u)/u with u = pi d f, d = hole (1 +
/// to_object / to_sensor); times the pixel's sinc. Negative where light and dark change places.
double transfer_of_disc(const PinholeOptics& optics, double frequency);

/// The same with diffraction in monochromatic light: the optical transfer function of a round aperture with its defect
/// of focus [Hopkins1955]: the autocorrelation of the pupil exp(i pi r^2 / (wavelength F)),
/// 1/F = 1/to_object + 1/to_sensor, at the shift wavelength * to_object * frequency. For short waves it is the disc's.
double transfer_with_diffraction(const PinholeOptics& optics, double frequency, double wavelength_nm);

}  // namespace touchstone::lab
