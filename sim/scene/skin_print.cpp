#include "sim/scene/skin_print.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr int kMostPixels = 16'000'000;

/// How much of a patch there is at a distance from its centre: 1 inside, 0 outside, smooth over the rim.
double amount(const SkinPatch& patch, double distance) {
  const double half = 0.5 * patch.rim_mm;
  const double radius = 0.5 * patch.diameter_mm;
  if (distance <= radius - half) return 1.0;
  if (distance >= radius + half) return 0.0;
  const double t = (radius + half - distance) / patch.rim_mm;
  return t * t * (3.0 - 2.0 * t);
}

/// Low and high corner of all patches.
Eigen::Matrix2d box_of(const SkinPrint& skin) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const SkinPatch& patch : skin.patches) {
    const double reach = 0.5 * (patch.diameter_mm + patch.rim_mm);
    low = low.cwiseMin((patch.centre_mm.array() - reach).matrix());
    high = high.cwiseMax((patch.centre_mm.array() + reach).matrix());
  }
  Eigen::Matrix2d box;
  box << low, high;
  return box;
}

}  // namespace

EnumNames<LesionKind> enum_names(LesionKind) {
  return {{"erythema", LesionKind::erythema}, {"purpura", LesionKind::purpura}};
}

void fields(YamlReader& in, SkinPatch& patch) {
  in.required("kind", patch.kind);
  in.required("centre_mm", patch.centre_mm, Allowed::within(-1000.0, 1000.0));
  in.required("diameter_mm", patch.diameter_mm, Allowed::above_up_to(0.0, 1000.0));
  patch.rim_mm = std::min(patch.rim_mm, patch.diameter_mm);
  in.optional("rim_mm", patch.rim_mm, Allowed::within(0.0, patch.diameter_mm));
  in.required("colour", patch.colour, Allowed::within(0.0, 1.0));
}

void fields(YamlReader& in, SkinPrint& skin) {
  in.required("patches", skin.patches);
  if (skin.patches.empty()) fail_at(in.where("patches"), "patches: there is none; allowed is one or more");
  in.optional("arteriole_kPa", skin.arteriole_kPa, Allowed::above_up_to(0.0, 1000.0));
  in.optional("venule_kPa", skin.venule_kPa, Allowed::at_least(0.0));
  if (!(skin.venule_kPa < skin.arteriole_kPa)) {
    fail_at(in.where("venule_kPa"), "venule_kPa: {}; it must be below arteriole_kPa, {}", skin.venule_kPa,
            skin.arteriole_kPa);
  }
  in.optional("pixel_mm", skin.pixel_mm, Allowed::above_up_to(0.0, 10.0));
  const Eigen::Matrix2d box = box_of(skin);
  const Eigen::Vector2d pixels = (box.col(1) - box.col(0)) / skin.pixel_mm;
  if (!(pixels.x() * pixels.y() <= kMostPixels)) {
    fail_at(in.where("pixel_mm"), "pixel_mm: {} makes {:.3g} pixels of the patches' {:.4g} x {:.4g} mm; at most {}",
            skin.pixel_mm, pixels.x() * pixels.y(), pixels.x() * skin.pixel_mm, pixels.y() * skin.pixel_mm,
            kMostPixels);
  }
}

double open_share(const SkinPrint& skin, double kPa) {
  return std::clamp((skin.arteriole_kPa - kPa) / (skin.arteriole_kPa - skin.venule_kPa), 0.0, 1.0);
}

render::PrintedPicture skin_picture(const SkinPrint& skin, const SceneBands& bands, const Colour& ground,
                                    const ContactPressure* pressure) {
  const Eigen::Matrix2d box = box_of(skin);
  render::PrintedPicture picture;
  picture.low = box.col(0);
  picture.pixel_mm.setConstant(skin.pixel_mm);
  picture.columns = std::max(1, static_cast<int>(std::ceil((box(0, 1) - box(0, 0)) / skin.pixel_mm)));
  picture.rows = std::max(1, static_cast<int>(std::ceil((box(1, 1) - box(1, 0)) / skin.pixel_mm)));
  picture.bands = bands.count();
  const std::size_t pixels = static_cast<std::size_t>(picture.columns) * static_cast<std::size_t>(picture.rows);
  std::vector<double> kPa(pixels, 0.0);
  if (pressure != nullptr) kPa = pressure->on_grid(picture.low, skin.pixel_mm, picture.columns, picture.rows);
  const render::Spectrum own = in_bands(ground, bands, "albedo");
  std::vector<render::Spectrum> colours;
  for (const SkinPatch& patch : skin.patches) colours.push_back(in_bands(patch.colour, bands, "print.patches.colour"));

  picture.values.reserve(pixels * static_cast<std::size_t>(picture.bands));
  std::size_t i = 0;
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.columns; ++column, ++i) {
      const Eigen::Vector2d at = picture.low + skin.pixel_mm * Eigen::Vector2d(column + 0.5, row + 0.5);
      render::Spectrum colour = own;
      for (std::size_t k = 0; k < skin.patches.size(); ++k) {
        const SkinPatch& patch = skin.patches[k];
        double share = amount(patch, (at - patch.centre_mm).norm());
        if (patch.kind == LesionKind::erythema) {
          // Its blood stands before the skin; without it the skin shows, whatever other marks it has.
          share *= open_share(skin, kPa[i]);
        }
        colour += share * (colours[k] - colour);
      }
      for (Eigen::Index band = 0; band < colour.size(); ++band) {
        picture.values.push_back(std::clamp(static_cast<float>(colour[band]), 0.0f, 1.0f));
      }
    }
  }
  return picture;
}

}  // namespace touchstone::sim
