#include "render/spectra/spectral_curve.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/text_file.h"

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

/// All points of the curve within a range, and its ends: between them the curve is linear.
std::vector<double> knots_of(const SpectralCurve& curve, double from_nm, double to_nm) {
  std::vector<double> knots = {from_nm};
  for (const double at : curve.wavelengths_nm) {
    if (at > from_nm && at < to_nm) knots.push_back(at);
  }
  knots.push_back(to_nm);
  return knots;
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

double emitted_at(const SpectralCurve& emission, double wavelength_nm) {
  const bool beyond = wavelength_nm < emission.wavelengths_nm.front() || wavelength_nm > emission.wavelengths_nm.back();
  return beyond ? 0.0 : emission.at(wavelength_nm);
}

double SpectralCurve::integral(double from_nm, double to_nm) const {
  TS_ASSERT(from_nm <= to_nm);
  const std::vector<double> knots = knots_of(*this, from_nm, to_nm);
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
  std::istringstream lines(read_text_file(file));
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

}  // namespace touchstone::render
