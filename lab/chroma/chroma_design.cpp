#include "lab/chroma/chroma_design.h"

#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

void require_above_zero(double value, const char* what) {
  if (!(value > 0.0 && std::isfinite(value))) fail("{}: {} must be above 0", what, value);
}

void require_poisson_ratio(double value) {
  if (!(value >= 0.0 && value <= 0.5)) fail("Poisson's ratio: {} must be from 0 to 0.5", value);
}

void require_nearer(double displacement_mm, double distance_mm) {
  require_above_zero(distance_mm, "the distance of the marker, mm");
  if (!(displacement_mm < distance_mm)) {
    fail("a displacement of {} mm must be less than the marker's distance of {} mm", displacement_mm, distance_mm);
  }
}

}  // namespace

double angle_of_view(double focal_length_mm, double sensor_mm) {
  require_above_zero(focal_length_mm, "the focal length, mm");
  require_above_zero(sensor_mm, "the sensor's width, mm");
  return 2.0 * std::atan(0.5 * sensor_mm / focal_length_mm);
}

double distance_in_view(double marker_mm, double angle_of_view, int markers) {
  require_above_zero(marker_mm, "the marker's side, mm");
  if (!(angle_of_view > 0.0 && angle_of_view < kPi)) {
    fail("the angle of view: {} rad must be above 0 and below pi", angle_of_view);
  }
  if (markers < 1) fail("the number of markers: {} must be at least 1", markers);
  const double part = angle_of_view / markers;
  if (!(part < 0.5 * kPi)) fail("{} markers: each has {} rad of the view; it must be below pi / 2", markers, part);
  return marker_mm / std::tan(part);
}

double apparent_change(double displacement_mm, double distance_mm) {
  return stretched_apparent_change(1.0, displacement_mm, distance_mm);
}

double column_strain(double force_N, const SoftMarker& marker) {
  require_above_zero(marker.side_mm, "the marker's side, mm");
  require_above_zero(marker.youngs_modulus_MPa, "Young's modulus, MPa");
  require_poisson_ratio(marker.poisson_ratio);
  if (!(force_N >= 0.0 && std::isfinite(force_N))) fail("the force: {} N must be at least 0", force_N);
  const double full = marker.youngs_modulus_MPa * marker.side_mm * marker.side_mm;
  if (!(force_N < full)) {
    fail("the force: {} N on a marker of {} mm presses it through a gel of {} MPa; it must be below {} N", force_N,
         marker.side_mm, marker.youngs_modulus_MPa, full);
  }
  return force_N / full;
}

double column_displacement(double force_N, const SoftMarker& marker, double thickness_mm) {
  require_above_zero(thickness_mm, "the thickness, mm");
  return column_strain(force_N, marker) * thickness_mm;
}

double column_stretch(double displacement_mm, double thickness_mm, double poisson_ratio) {
  require_above_zero(thickness_mm, "the thickness, mm");
  require_poisson_ratio(poisson_ratio);
  if (!(displacement_mm >= 0.0 && displacement_mm < thickness_mm)) {
    fail("a displacement of {} mm must be from 0 to less than the thickness of {} mm", displacement_mm, thickness_mm);
  }
  return 1.0 + poisson_ratio * displacement_mm / thickness_mm;
}

double stretched_apparent_change(double stretch, double displacement_mm, double distance_mm) {
  require_above_zero(stretch, "the stretch");
  require_nearer(displacement_mm, distance_mm);
  return stretch / (1.0 - displacement_mm / distance_mm) - 1.0;
}

EnumNames<ApparentMeasure> enum_names(ApparentMeasure) {
  return {{"relative_whole_fixed", ApparentMeasure::relative_whole_fixed},
          {"relative_film_fixed", ApparentMeasure::relative_film_fixed},
          {"picture_film_fixed", ApparentMeasure::picture_film_fixed},
          {"area_film_fixed", ApparentMeasure::area_film_fixed},
          {"relative_fills_view", ApparentMeasure::relative_fills_view}};
}

double apparent_measure(ApparentMeasure measure, const ChromaDesign& design, double thickness_mm) {
  require_above_zero(thickness_mm, "the thickness, mm");
  require_above_zero(design.distance_mm, "the distance, mm");
  const bool whole = measure == ApparentMeasure::relative_whole_fixed;
  if (whole && !(thickness_mm < design.distance_mm)) {
    fail("the thickness: {} mm must be less than d + t, {} mm", thickness_mm, design.distance_mm);
  }
  const double distance = whole ? design.distance_mm : design.distance_mm + thickness_mm;
  const double at_rest = design.distance_mm / distance;  // l0 over the filter's picture, where d is held
  SoftMarker marker = design.marker;
  if (measure == ApparentMeasure::relative_fills_view) marker.side_mm /= at_rest;
  const double displacement = column_displacement(design.force_N, marker, thickness_mm);
  const double stretch = column_stretch(displacement, thickness_mm, marker.poisson_ratio);
  const double relative = stretched_apparent_change(stretch, displacement, distance);
  switch (measure) {
    case ApparentMeasure::picture_film_fixed:
      return at_rest * relative;
    case ApparentMeasure::area_film_fixed:
      return at_rest * at_rest * relative * (2.0 + relative);
    default:
      return relative;
  }
}

double best_picture_thickness(const ChromaDesign& design) {
  require_above_zero(design.distance_mm, "the distance, mm");
  const double nu = design.marker.poisson_ratio;
  const double e = column_strain(design.force_N, design.marker);
  const double small = (1.0 - nu) / (1.0 + nu);
  if (e < 1e-8) return design.distance_mm * small;  // 0 / 0 below
  const double s = std::sqrt((1.0 + nu * e) * (1.0 - e));
  return design.distance_mm * (1.0 - s) / (s - (1.0 - e));
}

}  // namespace touchstone::lab
