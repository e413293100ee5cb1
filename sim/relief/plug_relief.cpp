#include "sim/relief/plug_relief.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/units.h"
#include "sim/relief/wave_reliefs.h"

namespace touchstone::sim {
namespace {

constexpr double kPitch_mm = 0.025;
constexpr double kCut_mm = 0.06;             // over which a punched edge falls
constexpr double kCorner_mm = 0.2;           // radius of a window's corners
constexpr double kTail_mm = 1.2;             // half the height of the seam's dovetail
constexpr double kTailNeck_mm = 0.5;         // half its width at the neck, wider by a third at its head
constexpr double kTailFromWindows_mm = 1.0;  // from the windows' far edge to the dovetail

/// Distance to the border of a rectangle with rounded corners about the origin; below 0 inside.
double outside_of(const Eigen::Vector2d& p, const Eigen::Vector2d& half, double corner) {
  const Eigen::Vector2d q = p.cwiseAbs() - half + Eigen::Vector2d::Constant(corner);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - corner;
}

/// How far a bend of this radius lies below the face, at a distance from the edge.
double bend(double radius, double from_edge) {
  const double inside = std::clamp(radius - from_edge, 0.0, radius);
  return radius - std::sqrt(radius * radius - inside * inside);
}

/// The seam's line: x of the sheet's ends at y, straight but for one dovetail.
double seam_at(const PlugRelief& plug, double y) {
  const double tail =
      -0.5 * plug.length_mm + plug.window_from_mouth_mm + plug.window_mm.y() + kTailFromWindows_mm + kTail_mm;
  const double away = std::abs(y - tail) / kTail_mm;
  return away < 1.0 ? kTailNeck_mm * std::min(1.0, 4.0 * (1.0 - away)) : 0.0;
}

}  // namespace

void fields(YamlReader& in, PlugRelief& relief) {
  in.required("width_mm", relief.width_mm, Allowed::above_up_to(0.0, 100.0));
  in.required("length_mm", relief.length_mm, Allowed::above_up_to(0.0, 100.0));
  in.required("sheet_um", relief.sheet_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.required("edge_radius_mm", relief.edge_radius_mm,
              Allowed::within(0.0, 0.5 * std::min(relief.width_mm, relief.length_mm)));
  in.required("window_mm", relief.window_mm, Allowed::above_up_to(0.0, 100.0));
  in.required("window_apart_mm", relief.window_apart_mm,
              Allowed::within(relief.window_mm.x(), relief.width_mm - relief.window_mm.x()));
  in.required("window_from_mouth_mm", relief.window_from_mouth_mm,
              Allowed::within(0.0, std::max(0.0, relief.length_mm - relief.window_mm.y())));
  in.optional("seam_um", relief.seam_um, Allowed::within(0.0, 1000.0));
}

fem::ReliefMap relief_map(const PlugRelief& relief) {
  const double sheet = relief.sheet_um / kMicrometresPerMillimetre, seam = relief.seam_um / kMicrometresPerMillimetre;
  const Eigen::Vector2d face(relief.width_mm, relief.length_mm);
  const Eigen::Vector2i count = (face / kPitch_mm).array().ceil().cast<int>() + 1;
  const Eigen::Vector2d spacing = face.cwiseQuotient((count.array() - 1).matrix().cast<double>());
  const Eigen::Vector2d first = -0.5 * face;
  const Eigen::Vector2d corner = Eigen::Vector2d::Constant(std::min(kCorner_mm, 0.4 * relief.window_mm.minCoeff()));
  std::vector<float> heights;
  heights.reserve(static_cast<std::size_t>(count.x()) * count.y());
  for (int j = 0; j < count.y(); ++j) {
    for (int i = 0; i < count.x(); ++i) {
      const Eigen::Vector2d p = first + spacing.cwiseProduct(Eigen::Vector2d(i, j));
      double height = sheet - bend(relief.edge_radius_mm, 0.5 * relief.width_mm - std::abs(p.x())) -
                      bend(relief.edge_radius_mm, p.y() - first.y());
      const Eigen::Vector2d in_window(std::abs(p.x()) - 0.5 * relief.window_apart_mm,
                                      p.y() - first.y() - relief.window_from_mouth_mm - 0.5 * relief.window_mm.y());
      const double metal = outside_of(in_window, 0.5 * relief.window_mm, corner.x());
      height = std::min(height, sheet * std::clamp(0.5 + metal / kCut_mm, 0.0, 1.0));
      if (seam > 0.0) {
        const double off = std::abs(p.x() - seam_at(relief, p.y())) - 0.5 * seam;
        height = std::min(height, sheet * std::clamp(0.5 + off / kCut_mm, 0.0, 1.0));
      }
      heights.push_back(static_cast<float>(std::max(height, 0.0)));
    }
  }
  return {count.x(), count.y(), first, spacing, {false, false}, std::move(heights)};
}

double finest_detail(const PlugRelief& relief) {
  return relief.window_mm.minCoeff();
}

}  // namespace touchstone::sim
