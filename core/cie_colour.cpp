#include "core/cie_colour.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace touchstone {
namespace {

constexpr double kKnee = 6.0 / 29.0;  // of CIE 1976's cube root

/// Columns: the primaries' chromaticities of ITU-R BT.709, scaled so that their sum is D65.
const Eigen::Matrix3d& primaries() {
  static const Eigen::Matrix3d matrix = [] {
    const Eigen::Vector2d chromaticities[3] = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}};
    Eigen::Matrix3d out;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d& c = chromaticities[k];
      out.col(k) << c.x() / c.y(), 1.0, (1.0 - c.sum()) / c.y();
    }
    const Eigen::Vector3d shares = out.inverse() * kD65White;
    return Eigen::Matrix3d(out * shares.asDiagonal());
  }();
  return matrix;
}

/// The angle of (a, b), degrees, 0 to 360; 0 for grey.
double hue_deg(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double angle = std::atan2(b, a) / kRadiansPerDegree;
  return angle < 0.0 ? angle + 360.0 : angle;
}

double cos_deg(double angle) {
  return std::cos(angle * kRadiansPerDegree);
}

}  // namespace

Eigen::Vector3d linear_from_srgb(const Eigen::Vector3d& srgb) {
  return srgb.unaryExpr([](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); });
}

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

Eigen::Vector3d xyz_from_linear_srgb(const Eigen::Vector3d& linear) {
  return primaries() * linear;
}

Eigen::Vector3d lab_from_xyz(const Eigen::Vector3d& xyz) {
  const Eigen::Vector3d f = xyz.cwiseQuotient(kD65White).unaryExpr(
      [](double t) { return t > kKnee * kKnee * kKnee ? std::cbrt(t) : t / (3.0 * kKnee * kKnee) + 4.0 / 29.0; });
  return {116.0 * f.y() - 16.0, 500.0 * (f.x() - f.y()), 200.0 * (f.y() - f.z())};
}

Eigen::Vector3d xyz_from_lab(const Eigen::Vector3d& lab) {
  const double y = (lab.x() + 16.0) / 116.0;
  const Eigen::Vector3d f(y + lab.y() / 500.0, y, y - lab.z() / 200.0);
  const auto share = [](double at) { return at > kKnee ? at * at * at : 3.0 * kKnee * kKnee * (at - 4.0 / 29.0); };
  return f.unaryExpr(share).cwiseProduct(kD65White);
}

Eigen::Vector3d lab_from_srgb(const Eigen::Vector3d& srgb) {
  return lab_from_xyz(xyz_from_linear_srgb(linear_from_srgb(srgb)));
}

Eigen::Vector3d srgb_from_hsl(double hue_deg, double saturation, double lightness) {
  const double chroma = (1.0 - std::abs(2.0 * lightness - 1.0)) * saturation;
  Eigen::Vector3d out;
  for (int k = 0; k < 3; ++k) {
    double away = std::fmod(hue_deg - 120.0 * k, 360.0);  // from the primary's own hue
    if (away < 0.0) away += 360.0;
    away = std::min(away, 360.0 - away);
    const double share = std::clamp(2.0 - away / 60.0, 0.0, 1.0);
    out[k] = lightness + chroma * (share - 0.5);
  }
  return out;
}

double ciede2000(const Eigen::Vector3d& lab_1, const Eigen::Vector3d& lab_2) {
  const auto seventh_share = [](double chroma) {  // c^7 / (c^7 + 25^7), under the root
    const double c7 = std::pow(chroma, 7);
    return std::sqrt(c7 / (c7 + std::pow(25.0, 7)));
  };
  // a* is stretched near grey.
  const double mean_plain = 0.5 * (lab_1.tail<2>().norm() + lab_2.tail<2>().norm());
  const double stretch = 1.0 + 0.5 * (1.0 - seventh_share(mean_plain));
  const Eigen::Vector2d ab_1(stretch * lab_1[1], lab_1[2]);
  const Eigen::Vector2d ab_2(stretch * lab_2[1], lab_2[2]);
  const double chroma_1 = ab_1.norm();
  const double chroma_2 = ab_2.norm();
  const double hue_1 = hue_deg(ab_1.x(), ab_1.y());
  const double hue_2 = hue_deg(ab_2.x(), ab_2.y());
  const bool grey = chroma_1 * chroma_2 == 0.0;

  double turn = grey ? 0.0 : hue_2 - hue_1;  // the shorter arc
  if (turn > 180.0) turn -= 360.0;
  if (turn < -180.0) turn += 360.0;
  const double lightness = lab_2[0] - lab_1[0];
  const double chroma = chroma_2 - chroma_1;
  const double hue = 2.0 * std::sqrt(chroma_1 * chroma_2) * std::sin(0.5 * turn * kRadiansPerDegree);

  const double mean_lightness = 0.5 * (lab_1[0] + lab_2[0]);
  const double mean_chroma = 0.5 * (chroma_1 + chroma_2);
  double mean_hue = hue_1 + hue_2;
  if (!grey) {
    const bool apart = std::abs(hue_1 - hue_2) > 180.0;
    mean_hue = 0.5 * (apart ? (mean_hue < 360.0 ? mean_hue + 360.0 : mean_hue - 360.0) : mean_hue);
  }
  const double t = 1.0 - 0.17 * cos_deg(mean_hue - 30.0) + 0.24 * cos_deg(2.0 * mean_hue) +
                   0.32 * cos_deg(3.0 * mean_hue + 6.0) - 0.20 * cos_deg(4.0 * mean_hue - 63.0);
  const double from_middle = std::pow(mean_lightness - 50.0, 2);
  const double scale_l = 1.0 + 0.015 * from_middle / std::sqrt(20.0 + from_middle);
  const double scale_c = 1.0 + 0.045 * mean_chroma;
  const double scale_h = 1.0 + 0.015 * mean_chroma * t;
  const double blue = 30.0 * std::exp(-std::pow((mean_hue - 275.0) / 25.0, 2));
  const double rotation = -2.0 * seventh_share(mean_chroma) * std::sin(2.0 * blue * kRadiansPerDegree);
  const double l = lightness / scale_l;
  const double c = chroma / scale_c;
  const double h = hue / scale_h;
  return std::sqrt(l * l + c * c + h * h + rotation * c * h);
}

}  // namespace touchstone
