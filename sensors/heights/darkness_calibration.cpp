#include "sensors/heights/darkness_calibration.h"

#include <algorithm>
#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "core/units.h"
#include "sensors/numerics/nonnegative_minimum.h"

namespace touchstone::sensors {
namespace {

// The curve's prior, so scaled that it means the same for faint sensors and strong ones: from rest to the darkest, the
// slope may well change by kBend times its mean, while rings are off by kRingError of the whole height.
constexpr double kBend = 3.0;
constexpr double kRingError = 0.01;
constexpr int kDepthPasses = 4;  // where things are on a ball depends a little on its depth
constexpr int kFullRing = 20;    // pixels, from which a ring counts fully

struct Fit {
  DarknessCurve curve;
  std::vector<double> depths_mm;
};

/// The increments between knots that add up to the height at `darkening`, each with its share and sign.
void add_height(double darkening, int first, Eigen::VectorXd& row) {
  const double place = darkening / DarknessCurve::kStep - first;
  const auto intervals = static_cast<int>(row.size());
  for (int i = 0; i < intervals; ++i) {
    const double reached = std::clamp(place - i, 0.0, 1.0);
    row[i] += first + i >= 0 ? reached : reached - 1.0;
  }
}

/// Least squares over all rings for the curve's increments, at least 0, and the depths.
Fit fit_curve(const std::vector<std::vector<PressRing>>& presses) {
  double darkest = 0.0;
  for (const std::vector<PressRing>& rings : presses) {
    for (const PressRing& ring : rings) {
      darkest = std::max(darkest, ring.darkening);
    }
  }
  Fit fit;
  fit.curve.first = static_cast<int>(std::lround(kBrightest / DarknessCurve::kStep));  // noise at rest keeps its mean
  const int last = std::max(1, static_cast<int>(std::ceil(darkest / DarknessCurve::kStep)));
  const int intervals = last - fit.curve.first;
  const auto unknowns = static_cast<Eigen::Index>(intervals + static_cast<int>(presses.size()));
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(unknowns);
  for (std::size_t p = 0; p < presses.size(); ++p) {
    for (const PressRing& ring : presses[p]) {
      Eigen::VectorXd increments = Eigen::VectorXd::Zero(intervals);
      add_height(ring.darkening, fit.curve.first, increments);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns);
      row.head(intervals) = increments;
      row[intervals + static_cast<Eigen::Index>(p)] = -1.0;
      const double weight = std::min(1.0, ring.pixels / static_cast<double>(kFullRing));
      H.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      b += weight * ring.cap_mm * row;
    }
  }
  H = Eigen::MatrixXd(H.selfadjointView<Eigen::Lower>());
  const double stiffness = std::pow(kRingError / kBend * last * last, 2.0);
  for (int i = 0; i + 1 < intervals; ++i) {
    H(i, i) += stiffness;
    H(i + 1, i + 1) += stiffness;
    H(i, i + 1) -= stiffness;
    H(i + 1, i) -= stiffness;
  }
  H.diagonal().array() += 1e-9 * H.diagonal().maxCoeff();
  std::vector<std::uint8_t> sign(static_cast<std::size_t>(unknowns), 1);
  std::fill(sign.begin() + intervals, sign.end(), 0);
  const NonnegativeMinimum minimum = nonnegative_minimum(H, Eigen::LLT<Eigen::MatrixXd>(H), b, sign);
  fit.curve.heights_mm.assign(static_cast<std::size_t>(intervals) + 1, 0.0);
  for (int i = -fit.curve.first; i < intervals; ++i) {
    fit.curve.heights_mm[static_cast<std::size_t>(i) + 1] =
        fit.curve.heights_mm[static_cast<std::size_t>(i)] + minimum.x[i];
  }
  for (int i = -fit.curve.first - 1; i >= 0; --i) {
    fit.curve.heights_mm[static_cast<std::size_t>(i)] =
        fit.curve.heights_mm[static_cast<std::size_t>(i) + 1] - minimum.x[i];
  }
  for (std::size_t p = 0; p < presses.size(); ++p) {
    fit.depths_mm.push_back(minimum.x[intervals + static_cast<Eigen::Index>(p)]);
  }
  return fit;
}

/// Sums of a fit's errors.
struct ErrorSums {
  double sum = 0.0, squares = 0.0, rings = 0.0, largest = 0.0;
  double pixel_squares = 0.0, pixels = 0.0;

  void add_ring(double error) {
    sum += error;
    squares += error * error;
    rings += 1.0;
    largest = std::max(largest, std::abs(error));
  }
  ProfileError result() const {
    return {sum / rings, std::sqrt(squares / rings), largest, std::sqrt(pixel_squares / pixels)};
  }
};

void add_errors(const Fit& fit, const std::vector<DarkPress>& presses, const HalfOfContact& half, ErrorSums& sums) {
  for (std::size_t p = 0; p < presses.size(); ++p) {
    for (const PressRing& ring : rings_of(presses[p], half)) {
      sums.add_ring(fit.curve.height_at(ring.darkening) - (fit.depths_mm[p] + ring.cap_mm));
    }
    for_each_contact_pixel(presses[p], half, [&](int u, int v, double, double cap_mm) {
      if (presses[p].usable.at<unsigned char>(v, u) == 0) return;
      const double height = fit.curve.height_at(static_cast<double>(presses[p].map.at<float>(v, u)));
      sums.pixel_squares += std::pow(height - (fit.depths_mm[p] + cap_mm), 2.0);
      sums.pixels += 1.0;
    });
  }
}

std::vector<std::vector<PressRing>> all_rings(const std::vector<DarkPress>& presses, const HalfOfContact& half) {
  std::vector<std::vector<PressRing>> rings;
  for (const DarkPress& press : presses) rings.push_back(rings_of(press, half));
  return rings;
}

/// How far single pixels are off near each knot; where there are none, as all are.
std::vector<double> spread_of(const Fit& fit, const std::vector<DarkPress>& presses) {
  const std::size_t knots = fit.curve.heights_mm.size();
  std::vector<double> squares(knots, 0.0);
  std::vector<double> counts(knots, 0.0);
  const auto last = static_cast<double>(knots - 1);
  for (std::size_t p = 0; p < presses.size(); ++p) {
    for_each_contact_pixel(presses[p], {}, [&](int u, int v, double, double cap_mm) {
      if (presses[p].usable.at<unsigned char>(v, u) == 0) return;
      const double darkening = static_cast<double>(presses[p].map.at<float>(v, u));
      const double place = std::clamp(darkening / DarknessCurve::kStep - fit.curve.first, 0.0, last);
      const auto knot = static_cast<std::size_t>(std::lround(place));
      squares[knot] += std::pow(fit.curve.height_at(darkening) - (fit.depths_mm[p] + cap_mm), 2.0);
      counts[knot] += 1.0;
    });
  }
  double all_squares = 0.0;
  double all_counts = 0.0;
  for (std::size_t k = 0; k < knots; ++k) {
    all_squares += squares[k];
    all_counts += counts[k];
  }
  std::vector<double> spread;
  for (std::size_t k = 0; k < knots; ++k) {
    spread.push_back(counts[k] > 0.0 ? std::sqrt(squares[k] / counts[k]) : std::sqrt(all_squares / all_counts));
  }
  return spread;
}

}  // namespace

DarknessCalibration calibrate_darkness(std::span<const BallPress> given, const RestPicture& rest,
                                       const DarknessCalibrationSettings& settings) {
  const double mm_per_px = settings.scale.mm_per_px;
  if (!(mm_per_px > 0.0) || !std::isfinite(mm_per_px)) fail("mm_per_px is {}; it must be above 0", mm_per_px);
  if (given.empty()) fail("no presses: at least one frame of a pressed ball is needed");
  std::vector<DarkPress> presses;
  for (const BallPress& press : given)
    presses.push_back(measure_press(press, rest, settings.darkening, settings.scale));

  DarknessCalibration result;
  std::vector<std::vector<PressRing>> rings = all_rings(presses, {});
  Fit fit = fit_curve(rings);
  for (int pass = 0; pass < kDepthPasses && std::isfinite(settings.scale.camera_distance_mm); ++pass) {
    for (std::size_t p = 0; p < presses.size(); ++p) set_depth(presses[p], fit.depths_mm[p]);
    rings = all_rings(presses, {});
    fit = fit_curve(rings);
  }
  double nearest = 1.0;
  for (const std::vector<PressRing>& press : rings) {
    for (const PressRing& ring : press) {
      nearest = std::min(nearest, ring.darkening);
      result.pixels += static_cast<std::size_t>(ring.pixels);
    }
  }
  result.nearest_to_rest = nearest;
  fit.curve.spread_mm = spread_of(fit, presses);
  ErrorSums sums;
  add_errors(fit, presses, {}, sums);
  result.fitted = sums.result();
  if (settings.cross_validate) {
    ErrorSums left_out;
    for (int i = 0; i < 8; ++i) {
      const double angle = kPi * i / 4.0;
      add_errors(fit_curve(all_rings(presses, angle)), presses, angle + kPi, left_out);
    }
    result.held_out = left_out.result();
  }
  result.depths_mm = fit.depths_mm;
  result.model = {mm_per_px, rest, settings.darkening, fit.curve, static_cast<int>(presses.size())};
  if (const std::string fault = fault_of(result.model); !fault.empty()) {
    fail("the presses give no curve from darkness to height: {}", fault);
  }
  return result;
}

}  // namespace touchstone::sensors
