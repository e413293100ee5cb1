#include "fem/mesh/gel_outline.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "fem/mesh/layer_columns.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
/// Inside a boundary that it may not split TetGen makes fewer tetrahedra: measured 0.80 to 0.83.
constexpr double kKeptBoundary = 0.82;

}  // namespace

double Outline::rim_angle(double depth) const {
  if (smooth()) return kPi / 2.0;
  const double radius = sphere - depth;
  return cylinder() > 0.0 ? std::asin(base / radius) : std::acos((sphere - thickness) / radius);
}

double Outline::edge_at(const Vector3d& x) const {
  const double wide = std::hypot(x.x(), x.y());
  const double above = x.z() + sphere;  // the sphere's centre
  const double along = above > 0.0 ? sphere * std::atan2(wide, above) : sphere * kPi / 2.0 - above;
  const double deep = above > 0.0 ? sphere - std::hypot(wide, above) : 0.0;
  const double distance = std::max({0.0, along - fine_radius, deep - fine_depth});
  return std::min(fine + kEdgeGrowth * distance, coarse_edge());
}

Outline outline_of(const DomeGel& d) {
  Outline outline{"the dome", d.sphere_radius, d.base_radius, d.thickness,  0.0,     false,
                  d.fine,     d.coarse,        d.fine_radius, d.fine_depth, d.layers};
  if (d.thickness == 0.0) outline.thickness = outline.sagitta();
  return outline;
}

Outline outline_of(const FingertipGel& f) {
  return {"the fingertip", f.radius, f.radius,      f.radius + f.length, f.sleeve, true,
          f.fine,          f.coarse, f.fine_radius, f.fine_depth,        f.layers};
}

double estimated_tetrahedra(const Outline& outline) {
  // The size field's integral over the body, and three tetrahedra a prism of the layers.
  constexpr int kSteps = 200;
  double body = 0.0;
  double surface = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    // Steps shrink towards the apex, where edges are fine.
    const auto at = [&](double part) { return part * part; };
    const double r0 = outline.base * at(static_cast<double>(i) / kSteps);
    const double r1 = outline.base * at((i + 1.0) / kSteps);
    const double r = 0.5 * (r0 + r1);
    const double root = std::sqrt(std::max(0.0, outline.sphere * outline.sphere - r * r));
    const double top = -r * r / (outline.sphere + root);
    const double ring = kPi * (r1 * r1 - r0 * r0);
    surface +=
        ring * outline.sphere / std::max(root, 0.1 * outline.sphere) / std::pow(outline.edge_at({r, 0.0, top}), 2);
    const double height = outline.thickness + top;
    for (int k = 0; k < kSteps; ++k) {
      const double d0 = height * at(static_cast<double>(k) / kSteps);
      const double d1 = height * at((k + 1.0) / kSteps);
      body += ring * (d1 - d0) / std::pow(outline.edge_at({r, 0.0, top - 0.5 * (d0 + d1)}), 3);
    }
  }
  double count = kKeptBoundary * kTetrahedraPerCube * body;
  if (!outline.layers.empty()) {
    const LayerSheets sheets = layer_sheets(outline.layers, outline.fine, outline.fine_depth);
    if (outline.layers_on_side()) {
      surface += 2.0 * kPi * outline.base * outline.cylinder() / std::pow(outline.coarse_edge(), 2);
    }
    count += 3.0 * 2.3 * surface * static_cast<double>(sheets.region.size());
  }
  return count;
}

void check(const Outline& o) {
  const auto positive = [&](const char* what, double value) {
    if (!std::isfinite(value) || value <= 0.0) {
      fail("{}'s {} is {} mm; it must be finite and above zero", o.name, what, value);
    }
  };
  const auto not_negative = [&](const char* what, double value) {
    if (!std::isfinite(value) || value < 0.0) {
      fail("{}'s {} is {} mm; it must be finite and not below zero", o.name, what, value);
    }
  };
  positive("radius", o.sphere);
  positive("base radius", o.base);
  if (o.base > o.sphere) {
    fail("{}'s base radius is {} mm; it must not be above its sphere's radius, {} mm", o.name, o.base, o.sphere);
  }
  positive("thickness", o.thickness);
  not_negative("sleeve", o.sleeve);
  positive("fine edge length", o.fine);
  positive("coarse edge length", o.coarse);
  not_negative("fine radius", o.fine_radius);
  not_negative("fine depth", o.fine_depth);
  if (o.fine > o.coarse) {
    fail("{}'s fine edge length is {} mm; it must not be above the coarse one, {} mm", o.name, o.fine, o.coarse);
  }
  const double narrowest = std::min(o.base, o.thickness);
  if (std::max(2.0 * o.base, o.thickness) > 200.0 * narrowest) {
    fail("{} is {} mm wide and {} mm thick; one may be at most 200 times the other", o.name, 2.0 * o.base, o.thickness);
  }
  if (o.fine > narrowest) {
    fail("{}'s fine edge length is {} mm; it must not be above its radius and thickness, {} mm", o.name, o.fine,
         narrowest);
  }
  const double cylinder = o.cylinder();
  if (cylinder < 0.0) {
    fail("{} is {} mm thick, but its cap alone is {} mm high", o.name, o.thickness, o.sagitta());
  }
  if (cylinder > 0.0 && cylinder < 0.5 * o.fine) {
    fail("{}'s cylinder is {} mm high; it must be zero or at least half its fine edge length, {} mm", o.name, cylinder,
         o.fine);
  }
  if (cylinder == 0.0 && o.rim_angle() < kSharpestRim) {
    fail(
        "{} meets its base at {:.3g} degrees; it must be at least {:.3g}: give it a cylinder below (a thickness above "
        "{} mm)",
        o.name, o.rim_angle() * 180.0 / kPi, kSharpestRim * 180.0 / kPi, o.sagitta());
  }
  if (o.sleeve > cylinder * (1.0 + 1e-9)) {
    fail("{}'s sleeve is {} mm long; it must not be longer than its cylinder, {} mm", o.name, o.sleeve, cylinder);
  }
  const double free = cylinder - o.sleeve;
  for (const double part : {free, o.sleeve}) {
    if (part > 1e-9 * o.thickness && part < 0.5 * o.fine) {
      fail(
          "{}'s sleeve of {} mm parts its cylinder of {} mm so that {} mm are left; it must be zero or at least half "
          "its fine edge length, {} mm",
          o.name, o.sleeve, cylinder, part, o.fine);
    }
  }
  const double layers = total_thickness(o.layers);
  if (layers > 0.0) {
    const double space =
        std::min({o.thickness, o.smooth() ? o.base : o.thickness,
                  cylinder > 0.0 && !o.smooth() ? std::min(cylinder, o.sphere - 1.02 * o.base) : o.thickness}) -
        0.5 * o.fine;
    if (layers > space) {
      fail("{}'s layers are {} mm thick together; there is space for {:.3g} mm", o.name, layers, std::max(0.0, space));
    }
  }
  check_tetrahedra(estimated_tetrahedra(o), o.name, o.fine, "fine part");
}

}  // namespace touchstone::fem
