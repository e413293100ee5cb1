#include "plots/plot_axis.h"

#include <fmt/format.h>

#include <algorithm>

#include "plots/line_plot.h"

namespace touchstone::plots {

void Axis::include(double value) {
  low_ = std::min(low_, scaled(value));
  high_ = std::max(high_, scaled(value));
}

void Axis::close() {
  if (!(low_ <= high_)) low_ = high_ = 0.0;
  const double margin = high_ > low_ ? 0.06 * (high_ - low_) : std::max(0.5, 0.1 * std::abs(high_));
  low_ -= margin;
  high_ += margin;
}

double Axis::place(double value) const {
  return paper_low_ + (scaled(value) - low_) / (high_ - low_) * (paper_high_ - paper_low_);
}

std::vector<double> Axis::ticks() const {
  return logarithmic_ ? logarithmic_ticks() : even_ticks();
}

std::vector<double> Axis::logarithmic_ticks() const {
  const double decades = high_ - low_;
  const int step = decades > 8.0 ? static_cast<int>(std::ceil(decades / 8.0)) : 1;
  std::vector<double> factors = {1.0};
  if (decades < 2.2) factors = {1.0, 2.0, 5.0};
  if (decades < 0.6) factors = {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0};
  std::vector<double> ticks;
  for (int decade = static_cast<int>(std::floor(low_)); decade <= static_cast<int>(std::ceil(high_)); ++decade) {
    if (decade % step != 0) continue;
    for (const double factor : factors) {
      const double at = decade + std::log10(factor);
      if (at >= low_ && at <= high_) ticks.push_back(factor * std::pow(10.0, decade));
    }
  }
  return ticks;
}

std::vector<double> Axis::even_ticks() const {
  const double rough = (high_ - low_) / 6.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * decade;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * decade >= rough) step = factor * decade;
  }
  std::vector<double> ticks;
  for (double k = std::ceil(low_ / step); k * step <= high_; k += 1.0) ticks.push_back(k * step + 0.0);  // not -0
  return ticks;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text, const std::string& more) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escape_markup(text));
}

std::string begun_svg(double height) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "fill=\"#fff\"/>\n",
      kPlotWidth, height);
}

}  // namespace touchstone::plots
