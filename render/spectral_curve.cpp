#include "render/spectral_curve.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::render {
namespace {

constexpr double kShortest_nm = 100.0;
constexpr double kLongest_nm = 10000.0;
constexpr std::string_view kSource = "source:";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::optional<double> number_in(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Both cells of a row, without blanks round them.
std::pair<std::string_view, std::string_view> two_cells(std::string_view row, const SourceLocation& where) {
  const auto comma = row.find(',');
  if (comma == std::string_view::npos || row.find(',', comma + 1) != std::string_view::npos) {
    fail_at(where, "'{}' has {} cells; a spectrum has two, wavelength and value", row,
            1 + std::count(row.begin(), row.end(), ','));
  }
  return {trimmed(row.substr(0, comma)), trimmed(row.substr(comma + 1))};
}

double wavelength_of(std::string_view cell, const SpectralCurve& curve, const SourceLocation& where) {
  const auto value = number_in(cell);
  if (!value || *value < kShortest_nm || *value > kLongest_nm) {
    fail_at(where, "wavelength_nm: '{}' must be a number from {} to {}", cell, kShortest_nm, kLongest_nm);
  }
  if (!curve.wavelengths_nm.empty() && *value <= curve.wavelengths_nm.back()) {
    fail_at(where, "wavelength_nm: {} follows {}; wavelengths must rise", *value, curve.wavelengths_nm.back());
  }
  return *value;
}

double value_of(std::string_view cell, CurveKind kind, const SourceLocation& where) {
  const auto value = number_in(cell);
  if (!value || *value < 0.0 || (kind == CurveKind::share && *value > 1.0)) {
    fail_at(where, "value: '{}' must be a number {}", cell,
            kind == CurveKind::share ? "from 0 to 1 (a share, not percent)" : "of at least 0");
  }
  return *value;
}

/// All points of the curves within a band, and its ends: between them each curve is linear.
std::vector<double> knots_of(std::span<const SpectralCurve> curves, double from_nm, double to_nm) {
  std::vector<double> knots = {from_nm, to_nm};
  for (const SpectralCurve& curve : curves) {
    for (const double at : curve.wavelengths_nm) {
      if (at > from_nm && at < to_nm) knots.push_back(at);
    }
  }
  std::sort(knots.begin(), knots.end());
  return knots;
}

/// Mean of the curves' product over a band, by Simpson's rule between the knots: exact for up to three of them.
double product_mean(std::span<const SpectralCurve> curves, double from_nm, double to_nm) {
  const auto product = [&](double at) {
    double value = 1.0;
    for (const SpectralCurve& curve : curves) value *= curve.at(at);
    return value;
  };
  const std::vector<double> knots = knots_of(curves, from_nm, to_nm);
  double sum = 0.0;
  for (std::size_t k = 1; k < knots.size(); ++k) {
    const double middle = 0.5 * (knots[k - 1] + knots[k]);
    sum += (knots[k] - knots[k - 1]) / 6.0 * (product(knots[k - 1]) + 4.0 * product(middle) + product(knots[k]));
  }
  return sum / (to_nm - from_nm);
}

}  // namespace

double SpectralCurve::at(double wavelength_nm) const {
  TS_ASSERT(!wavelengths_nm.empty() && wavelengths_nm.size() == values.size());
  if (wavelength_nm <= wavelengths_nm.front()) return values.front();
  if (wavelength_nm >= wavelengths_nm.back()) return values.back();
  const auto above = std::upper_bound(wavelengths_nm.begin(), wavelengths_nm.end(), wavelength_nm);
  const auto k = static_cast<std::size_t>(above - wavelengths_nm.begin());
  const double share = (wavelength_nm - wavelengths_nm[k - 1]) / (wavelengths_nm[k] - wavelengths_nm[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}

double SpectralCurve::integral(double from_nm, double to_nm) const {
  TS_ASSERT(from_nm <= to_nm);
  const std::vector<double> knots = knots_of({this, 1}, from_nm, to_nm);
  double sum = 0.0;
  for (std::size_t k = 1; k < knots.size(); ++k) {
    sum += 0.5 * (knots[k] - knots[k - 1]) * (at(knots[k - 1]) + at(knots[k]));
  }
  return sum;
}

double SpectralCurve::mean(double from_nm, double to_nm) const {
  return from_nm == to_nm ? at(from_nm) : integral(from_nm, to_nm) / (to_nm - from_nm);
}

SpectralCurve read_spectral_curve(const std::filesystem::path& file, CurveKind kind) {
  std::istringstream lines(read_whole_file(file));
  SpectralCurve curve;
  int number = 0;
  bool header = false;
  for (std::string line; std::getline(lines, line);) {
    const SourceLocation where{file.string(), ++number};
    const std::string_view text = trimmed(line);
    if (text.empty()) continue;
    if (text.front() == '#') {
      const std::string_view comment = trimmed(text.substr(1));
      if (comment.starts_with(kSource)) curve.source = trimmed(comment.substr(kSource.size()));
      continue;
    }
    const auto [first, second] = two_cells(text, where);
    if (!header) {
      if (first != "wavelength_nm" || second.empty() || number_in(second)) {
        fail_at(where, "'{}' isn't a spectrum's header; 'wavelength_nm,NAME' must stand before the rows", text);
      }
      header = true;
      continue;
    }
    const double wavelength = wavelength_of(first, curve, where);
    curve.values.push_back(value_of(second, kind, where));
    curve.wavelengths_nm.push_back(wavelength);
  }
  if (curve.source.empty()) fail("{}: no comment '# source: ...' says where its figures are from", file.string());
  if (curve.values.size() < 2) fail("{}: has {} rows; a spectrum needs two", file.string(), curve.values.size());
  if (kind == CurveKind::relative && *std::max_element(curve.values.begin(), curve.values.end()) == 0.0) {
    fail("{}: all values are 0; a lamp's spectrum must have light in it", file.string());
  }
  return curve;
}

Spectrum SpectralBands::centres_nm() const {
  Spectrum centres(count());
  for (int k = 0; k < count(); ++k) {
    const auto band = static_cast<std::size_t>(k);
    centres[k] = 0.5 * (edges_nm[band] + edges_nm[band + 1]);
  }
  return centres;
}

SpectralBands even_bands(double from_nm, double to_nm, int count) {
  if (!(from_nm > 0.0 && to_nm > from_nm && std::isfinite(to_nm))) {
    fail("spectral bands from {} to {} nm; they must lie above 0 and rise", from_nm, to_nm);
  }
  if (count < 1 || count > kMaxBands) fail("{} spectral bands; 1 to {} are allowed", count, kMaxBands);
  SpectralBands bands;
  for (int k = 0; k <= count; ++k) bands.edges_nm.push_back(from_nm + (to_nm - from_nm) * k / count);
  return bands;
}

Spectrum band_means(const SpectralCurve& curve, const SpectralBands& bands) {
  Spectrum means(bands.count());
  for (int k = 0; k < bands.count(); ++k) {
    const auto band = static_cast<std::size_t>(k);
    means[k] = curve.mean(bands.edges_nm[band], bands.edges_nm[band + 1]);
  }
  return means;
}

Spectrum band_powers(const SpectralCurve& emission, double power_W, const SpectralBands& bands) {
  const double first = emission.wavelengths_nm.front();
  const double last = emission.wavelengths_nm.back();
  const double all = emission.integral(first, last);
  Spectrum powers(bands.count());
  for (int k = 0; k < bands.count(); ++k) {
    // Beyond its points a lamp has no light that was measured.
    const double from = std::clamp(bands.edges_nm[static_cast<std::size_t>(k)], first, last);
    const double to = std::clamp(bands.edges_nm[static_cast<std::size_t>(k) + 1], first, last);
    powers[k] = power_W * emission.integral(from, to) / all;
  }
  if (power_W > 0.0 && !(powers.sum() > 0.0)) {
    fail("the bands from {} to {} nm see nothing of a lamp that radiates from {} to {} nm", bands.edges_nm.front(),
         bands.edges_nm.back(), first, last);
  }
  return powers;
}

double band_product_error(std::span<const SpectralCurve> curves, const SpectralBands& bands) {
  double worst = 0.0;
  double largest = 0.0;
  for (int k = 0; k < bands.count(); ++k) {
    const double from = bands.edges_nm[static_cast<std::size_t>(k)];
    const double to = bands.edges_nm[static_cast<std::size_t>(k) + 1];
    const double exact = product_mean(curves, from, to);
    double of_means = 1.0;
    for (const SpectralCurve& curve : curves) of_means *= curve.mean(from, to);
    worst = std::max(worst, std::abs(of_means - exact));
    largest = std::max(largest, exact);
  }
  return worst == 0.0 ? 0.0 : worst / largest;
}

int bands_needed(std::span<const std::vector<SpectralCurve>> products, double from_nm, double to_nm, double tolerance) {
  for (const int count : {1, 3, 8}) {
    const SpectralBands bands = even_bands(from_nm, to_nm, count);
    const bool all = std::all_of(products.begin(), products.end(), [&](const std::vector<SpectralCurve>& product) {
      return band_product_error(product, bands) <= tolerance;
    });
    if (all) return count;
  }
  return kMaxBands;
}

}  // namespace touchstone::render
