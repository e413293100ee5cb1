#include "sim/files/colour.h"

#include <algorithm>
#include <cctype>

#include "core/short_text.h"
#include "sim/files/srgb_reflectance.h"

namespace touchstone::sim {

namespace {

/// "#rrggbb" as three numbers, 0 to 1.
Eigen::Vector3d srgb_of(const YamlReader& in, const std::string& text, Allowed allowed) {
  constexpr std::size_t kLength = 7;
  const bool sound = text.size() == kLength &&
                     std::all_of(text.begin() + 1, text.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!sound)
    fail_at(in.where(), "{}is '{}'; an sRGB colour is # and six hexadecimal digits", in.context(), short_text(text));
  if (allowed.high != 1.0) {
    fail_at(in.where(), "{}is '{}'; only what reflects can have an sRGB colour", in.context(), short_text(text));
  }
  Eigen::Vector3d srgb;
  for (int k = 0; k < 3; ++k)
    srgb[k] = std::stoi(text.substr(1 + 2 * static_cast<std::size_t>(k), 2), nullptr, 16) / 255.0;
  return srgb;
}

}  // namespace

double Colour::largest() const {
  const std::vector<double>& values = curve ? curve->values : numbers;
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

void read_value(YamlReader& in, Colour& colour, Allowed allowed) {
  colour = Colour();
  colour.where = in.where();
  if (in.is_list()) {
    colour.numbers = in.numbers(allowed);
    if (colour.numbers.empty() || colour.numbers.size() > render::kMaxBands) {
      fail_at(in.where(), "{}has {} numbers; allowed are 1 to {}, one a band", in.context(), colour.numbers.size(),
              render::kMaxBands);
    }
    return;
  }
  if (const auto srgb = in.text_with("#", "")) {
    colour.curve = srgb_reflectance(srgb_of(in, *srgb, allowed));
    colour.smooth = true;
    return;
  }
  const auto file = in.text_with("", ".csv");
  if (!file) {
    colour.numbers = {in.number(allowed)};
    return;
  }
  const auto kind = allowed.high <= 1.0 ? render::CurveKind::share : render::CurveKind::per_mm;
  try {
    colour.curve = render::read_spectral_curve(in.folder() / *file, kind);
  } catch (const Error& error) {
    fail_at(in.where(), "{}{}", in.context(), error.what());
  }
}

render::Spectrum in_bands(const Colour& colour, const SceneBands& bands, const char* what) {
  if (colour.curve) {
    if (!bands.ranges && colour.smooth) {
      return bands.centres_nm.unaryExpr([&](double nm) { return colour.curve->at(nm); });
    }
    if (!bands.ranges) {
      fail_at(colour.where,
              "{}: is a spectrum, but the device doesn't say its `bands`, which it could be averaged over", what);
    }
    return render::band_means(*colour.curve, *bands.ranges);
  }
  const auto given = static_cast<int>(colour.numbers.size());
  const bool grey = std::ranges::all_of(colour.numbers, [&](double value) { return value == colour.numbers.front(); });
  if (grey) return render::flat_spectrum(bands.count(), colour.numbers[0]);
  if (given != bands.count()) {
    fail_at(colour.where,
            "{}: has {} numbers, but the scene has {} bands; allowed is one number for all, {}{}, or, "
            "for what reflects, an sRGB colour such as '#c29a84'",
            what, given, bands.count(), bands.count() > 1 ? fmt::format("or {}", bands.count()) : "no list of others",
            bands.ranges ? ", or a spectrum's file" : "");
  }
  return Eigen::Map<const Eigen::ArrayXd>(colour.numbers.data(), given);
}

std::vector<std::string> channel_names(const SceneBands& bands) {
  const render::Spectrum& at = bands.centres_nm;
  if (at.size() == 1) return {"Y"};
  if (at.size() == 3 && at[0] > at[1] && at[1] > at[2]) return {"R", "G", "B"};
  std::vector<std::string> names;
  for (const double nm : at) {
    std::string name = fmt::format("S0.{:.1f}nm", nm);
    std::ranges::replace(name.begin() + 3, name.end(), '.', ',');
    names.push_back(name);
  }
  return names;
}

Eigen::Vector3d display_colour(const Colour& colour) {
  if (colour.curve) return {colour.curve->mean(600, 700), colour.curve->mean(500, 600), colour.curve->mean(400, 500)};
  if (colour.numbers.size() == 3) return {colour.numbers[0], colour.numbers[1], colour.numbers[2]};
  double mean = 0.0;
  for (const double value : colour.numbers) mean += value / static_cast<double>(colour.numbers.size());
  return Eigen::Vector3d::Constant(mean);
}

}  // namespace touchstone::sim
