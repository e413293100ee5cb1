#pragma once
// What the plots share: the paper's width, its colours and its axes. Internal to plots.

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace touchstone::plots {

inline constexpr double kPlotWidth = 640.0;  ///< of the paper
/// Where on it a horizontal axis begins: the same in all plots, so that they may stand under each other.
inline constexpr double kPlotLeft = 78.0;
inline constexpr double kPlotRight = 620.0;  ///< where it ends

/// The colours of curves and states, distinct for the colour-blind [Okabe2008]; after the sixth the first again.
inline const char* plot_colour(std::size_t number) {
  constexpr std::array<const char*, 6> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};
  return kColours[number % kColours.size()];
}

/// One axis: what it shows and where on the paper.
class Axis {
 public:
  /// @param paper_low, paper_high where its ends are on the paper
  Axis(bool logarithmic, double paper_low, double paper_high)
      : logarithmic_(logarithmic), paper_low_(paper_low), paper_high_(paper_high) {}

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0.0); }
  /// @pre it shows the value
  void include(double value);
  /// Some margin at both ends; an axis without extent, or without points, gets one.
  void close();
  /// Where a value is on the paper. @pre closed
  double place(double value) const;
  /// Where its lines and numbers are.
  std::vector<double> ticks() const;

 private:
  double scaled(double value) const { return logarithmic_ ? std::log10(value) : value; }
  std::vector<double> logarithmic_ticks() const;
  std::vector<double> even_ticks() const;

  bool logarithmic_;
  double paper_low_, paper_high_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

/// A text as an SVG element. @param anchor which end of it stands at x: "start", "middle", "end" @param more attributes
std::string text_at(double x, double y, const char* anchor, const std::string& text, const std::string& more = {});

/// An SVG element's beginning, with white paper of kPlotWidth by `height`.
std::string begun_svg(double height);

}  // namespace touchstone::plots
