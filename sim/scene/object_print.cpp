#include "sim/scene/object_print.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/cie_colour.h"
#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "sim/files/image_file.h"
#include "sim/files/srgb_reflectance.h"

namespace touchstone::sim {
namespace {

constexpr double kLargest_mm = 1000.0;  // of places and sizes
constexpr int kMostMarks = 1'000'000;
constexpr int kMostPixels = 16'000'000;

Allowed place() {
  return Allowed::within(-kLargest_mm, kLargest_mm);
}

Allowed length() {
  return Allowed::above_up_to(0.0, kLargest_mm);
}

enum class LayerType { rule, hue_circle, specks, image, skin };

EnumNames<LayerType> enum_names(LayerType) {
  return {{RulePrint::kType, LayerType::rule},
          {HueCirclePrint::kType, LayerType::hue_circle},
          {SpecksPrint::kType, LayerType::specks},
          {ImagePrint::kType, LayerType::image},
          {SkinPrint::kType, LayerType::skin}};
}

Colour colour_of(render::SpectralCurve curve) {
  Colour colour;
  colour.curve = std::move(curve);
  colour.smooth = true;
  return colour;
}

bool is_picture(const PrintLayer& layer) {
  return std::holds_alternative<ImagePrint>(layer.kind) || std::holds_alternative<SkinPrint>(layer.kind);
}

/// Linear parts of R, G and B, 0 to 1.
cv::Mat read_linear(const ImagePrint& print) {
  cv::Mat picture;
  try {
    picture = read_image(print.file);
  } catch (const Error& error) {
    fail_at(print.where, "print.file: {}", error.what());
  }
  if (picture.total() > kMostPixels) {
    fail_at(print.where, "print.file: {}: {} x {} pixels; at most {} are allowed", print.file.string(), picture.cols,
            picture.rows, kMostPixels);
  }
  cv::Mat shares;
  picture.convertTo(shares, CV_MAKETYPE(CV_32F, picture.channels()),
                    picture.depth() == CV_8U ? 1.0 / 255 : 1.0 / 65535);
  cv::Mat linear(shares.size(), CV_32FC3);
  for (int row = 0; row < shares.rows; ++row) {
    const auto* from = shares.ptr<float>(row);
    auto* to = linear.ptr<cv::Vec3f>(row);
    for (int column = 0; column < shares.cols; ++column) {
      Eigen::Vector3d srgb;
      for (int k = 0; k < 3; ++k) srgb[k] = shares.channels() == 1 ? from[column] : from[3 * column + 2 - k];
      const Eigen::Vector3d parts = linear_from_srgb(srgb);
      to[column] = cv::Vec3f(static_cast<float>(parts[0]), static_cast<float>(parts[1]), static_cast<float>(parts[2]));
    }
  }
  return linear;
}

render::PrintedPicture image_picture(const ImagePrint& print, const cv::Mat& linear, const SceneBands& bands) {
  std::array<render::Spectrum, 8> corners;
  for (int k = 0; k < 8; ++k) corners[k] = in_bands(colour_of(corner_reflectances()[k]), bands, "print.file");
  render::PrintedPicture picture;
  picture.columns = linear.cols;
  picture.rows = linear.rows;
  picture.pixel_mm = {print.size_mm.x() / linear.cols, print.size_mm.y() / linear.rows};
  picture.low = print.centre_mm - 0.5 * print.size_mm;
  picture.bands = bands.count();
  picture.values.reserve(linear.total() * static_cast<std::size_t>(picture.bands));
  for (int row = 0; row < linear.rows; ++row) {
    for (int column = 0; column < linear.cols; ++column) {
      const auto& parts = linear.at<cv::Vec3f>(row, column);
      const std::array<double, 8> shares = corner_shares({parts[0], parts[1], parts[2]});
      render::Spectrum colour = render::flat_spectrum(picture.bands, 0.0);
      for (int k = 0; k < 8; ++k) colour += shares[k] * corners[k];
      for (Eigen::Index band = 0; band < colour.size(); ++band) {
        picture.values.push_back(std::clamp(static_cast<float>(colour[band]), 0.0f, 1.0f));
      }
    }
  }
  return picture;
}

/// Marks and inks of a layer, added to those of the layers below.
void add_marks(const RulePrint& rule, const SceneBands& bands, render::Print& out) {
  const int ink = static_cast<int>(out.inks.size());
  out.inks.push_back(in_bands(rule.ink, bands, "print.ink"));
  for (const RuleScale& scale : rule.scales) {
    for (int k = 0; k < scale.count; ++k) {
      const Eigen::Vector2d centre = scale.from_mm + Eigen::Vector2d(k * scale.pitch_mm, 0.5 * scale.length_mm);
      out.marks.push_back({centre, 0.5 * scale.width_mm, ink, render::MarkShape::rectangle, 0.5 * scale.length_mm});
    }
  }
}

void add_marks(const HueCirclePrint& circle, const SceneBands& bands, render::Print& out) {
  for (int k = 0; k < circle.patches; ++k) {
    const int ink = static_cast<int>(out.inks.size());
    out.inks.push_back(in_bands(colour_of(srgb_reflectance(disc_srgb(circle, k))), bands, "print"));
    out.marks.push_back({disc_centre(circle, k), 0.5 * circle.diameter_mm, ink});
  }
}

void add_marks(const SpecksPrint& specks, const SceneBands& bands, render::Print& out) {
  const int ink = static_cast<int>(out.inks.size());
  out.inks.push_back(in_bands(specks.ink, bands, "print.ink"));
  for (int k = 0; k < specks.count; ++k) {
    RandomStream random(specks.seed, static_cast<std::uint64_t>(k), Purpose::kPlacement);
    Eigen::Vector2d centre = specks.centre_mm;
    for (int axis = 0; axis < 2; ++axis) centre[axis] += specks.size_mm[axis] * (random.uniform() - 0.5);
    const auto which = static_cast<std::size_t>(random.uniform() * static_cast<double>(specks.diameters_mm.size()));
    out.marks.push_back({centre, 0.5 * specks.diameters_mm[which], ink});
  }
}

}  // namespace

void fields(YamlReader& in, RuleScale& scale) {
  in.required("pitch_mm", scale.pitch_mm, length());
  in.required("width_mm", scale.width_mm, Allowed::above_up_to(0.0, scale.pitch_mm));
  in.required("length_mm", scale.length_mm, length());
  in.required("count", scale.count, Allowed::within(1, kMostMarks));
  in.required("from_mm", scale.from_mm, place());
}

void fields(YamlReader& in, RulePrint& print) {
  in.required("scales", print.scales);
  if (print.scales.empty()) fail_at(in.where("scales"), "scales: there is none; allowed is one or more");
  in.optional("ink", print.ink, Allowed::within(0.0, 1.0));
}

void fields(YamlReader& in, HueCirclePrint& print) {
  in.optional("patches", print.patches, Allowed::within(1, 100));
  in.required("radius_mm", print.radius_mm, length());
  in.required("diameter_mm", print.diameter_mm, length());
  in.optional("saturation", print.saturation, Allowed::within(0.0, 1.0));
  in.optional("lightness", print.lightness, Allowed::within(0.0, 1.0));
  in.optional("first_hue_deg", print.first_hue_deg, Allowed::within(-360.0, 360.0));
  in.optional("centre_mm", print.centre_mm, place());
}

void fields(YamlReader& in, SpecksPrint& print) {
  in.required("count", print.count, Allowed::within(0, kMostMarks));
  in.required("diameters_mm", print.diameters_mm, length());
  if (print.diameters_mm.empty()) {
    fail_at(in.where("diameters_mm"), "diameters_mm: there is none; allowed is one or more");
  }
  in.required("size_mm", print.size_mm, length());
  in.optional("centre_mm", print.centre_mm, place());
  in.optional("seed", print.seed);
  in.optional("ink", print.ink, Allowed::within(0.0, 1.0));
}

void fields(YamlReader& in, ImagePrint& print) {
  std::string file;
  in.required("file", file);
  print.file = in.folder() / file;
  print.where = in.where("file");
  in.required("size_mm", print.size_mm, length());
  in.optional("centre_mm", print.centre_mm, place());
}

void fields(YamlReader& in, PrintLayer& layer) {
  layer.where = in.where();
  LayerType type{};
  in.required("type", type);
  switch (type) {
    case LayerType::rule:
      return fields(in, layer.kind.emplace<RulePrint>());
    case LayerType::hue_circle:
      return fields(in, layer.kind.emplace<HueCirclePrint>());
    case LayerType::specks:
      return fields(in, layer.kind.emplace<SpecksPrint>());
    case LayerType::image:
      return fields(in, layer.kind.emplace<ImagePrint>());
    case LayerType::skin:
      return fields(in, layer.kind.emplace<SkinPrint>());
  }
}

void check_layers(const std::vector<PrintLayer>& layers) {
  for (std::size_t k = 1; k < layers.size(); ++k) {
    if (is_picture(layers[k])) {
      fail_at(layers[k].where, "print: layer {} is a picture, which would hide those below; only the first may be one",
              k + 1);
    }
  }
}

bool depends_on_pressure(const std::vector<PrintLayer>& layers) {
  return !layers.empty() && std::holds_alternative<SkinPrint>(layers.front().kind);
}

Eigen::Vector3d disc_srgb(const HueCirclePrint& print, int k) {
  return srgb_from_hsl(print.first_hue_deg + 360.0 * k / print.patches, print.saturation, print.lightness);
}

Eigen::Vector2d disc_centre(const HueCirclePrint& print, int k) {
  const double angle = 2.0 * kPi * k / print.patches;
  return print.centre_mm + print.radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

std::vector<Colour> inks_of(const std::vector<PrintLayer>& layers) {
  std::vector<Colour> inks;
  for (const PrintLayer& layer : layers) {
    if (const auto* rule = std::get_if<RulePrint>(&layer.kind)) inks.push_back(rule->ink);
    if (const auto* specks = std::get_if<SpecksPrint>(&layer.kind)) inks.push_back(specks->ink);
    if (const auto* circle = std::get_if<HueCirclePrint>(&layer.kind)) {
      for (int k = 0; k < circle->patches; ++k) inks.push_back(colour_of(srgb_reflectance(disc_srgb(*circle, k))));
    }
    if (const auto* skin = std::get_if<SkinPrint>(&layer.kind)) {
      for (const SkinPatch& patch : skin->patches) inks.push_back(patch.colour);
    }
    if (std::holds_alternative<ImagePrint>(layer.kind)) {
      for (const render::SpectralCurve& curve : corner_reflectances()) inks.push_back(colour_of(curve));
    }
  }
  return inks;
}

ReadyPrint ready_print(const std::vector<PrintLayer>& layers) {
  ReadyPrint ready{layers, {}};
  if (layers.empty()) return ready;
  if (const auto* image = std::get_if<ImagePrint>(&layers.front().kind)) ready.image = read_linear(*image);
  return ready;
}

render::Print object_print(const ReadyPrint& print, const SceneBands& bands, const Colour& ground,
                           const ContactPressure* pressure) {
  render::Print out;
  for (const PrintLayer& layer : print.layers) {
    if (const auto* image = std::get_if<ImagePrint>(&layer.kind)) {
      out.picture = std::make_shared<const render::PrintedPicture>(image_picture(*image, print.image, bands));
    } else if (const auto* skin = std::get_if<SkinPrint>(&layer.kind)) {
      out.picture = std::make_shared<const render::PrintedPicture>(skin_picture(*skin, bands, ground, pressure));
    } else if (const auto* rule = std::get_if<RulePrint>(&layer.kind)) {
      add_marks(*rule, bands, out);
    } else if (const auto* circle = std::get_if<HueCirclePrint>(&layer.kind)) {
      add_marks(*circle, bands, out);
    } else if (const auto* specks = std::get_if<SpecksPrint>(&layer.kind)) {
      add_marks(*specks, bands, out);
    }
  }
  return out;
}

}  // namespace touchstone::sim
