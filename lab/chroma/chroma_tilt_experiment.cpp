#include "lab/chroma/chroma_tilt_experiment.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "lab/statistics/straight_line.h"
#include "sensors/colour/hue.h"

namespace touchstone::lab {
namespace {

constexpr float kSaturated = 0.5F;
// Blue over red: 0.9 and more beside the film, 0.3 and less under it.
constexpr double kUnderFilm = 0.6;
constexpr std::array kPressed_mm = {0.0, 0.25, 0.5, 0.75, 1.0};
constexpr double kAside_mm = 0.3;
constexpr int kPhases = 4;
const Eigen::Vector2d kPhases_px[kPhases] = {{0.0, 0.0}, {0.5, 0.0}, {0.0, 0.5}, {0.5, 0.5}};

/// The share of a pixel that ink covers, if bare sheet and ink are lit alike.
double ink_cover(const cv::Vec3f& c, const TiltColours& colours) {
  const bool under_film = static_cast<double>(c[2]) < kUnderFilm * static_cast<double>(c[0]);
  const Eigen::Vector3d& sheet = under_film ? colours.film_white : colours.white;
  const Eigen::Vector3d& ink = under_film ? colours.film_magenta : colours.magenta;
  Eigen::Matrix2d parts;
  parts << sheet[0], ink[0], sheet[1], ink[1];
  const Eigen::Vector2d share = parts.inverse() * Eigen::Vector2d(c[0], c[1]);
  if (!(share.sum() > 0.0)) return 0.0;
  return std::clamp(share[1] / share.sum(), 0.0, 1.0);
}

/// Of a sum of hues' directions.
double signed_hue_of(const Eigen::Vector2d& direction) {
  return sensors::hue_difference(sensors::hue_of(direction), 0.0);
}

}  // namespace

TiltReading read_tilt_picture(const cv::Mat& picture, const TiltColours& colours) {
  TS_ASSERT(picture.type() == CV_32FC3);
  TiltReading reading;
  Eigen::Vector2d hue = Eigen::Vector2d::Zero();
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto& c = picture.at<cv::Vec3f>(y, x);
      const float most = std::max({c[0], c[1], c[2]});
      if (!(most - std::min({c[0], c[1], c[2]}) > kSaturated * most)) continue;
      hue += sensors::hue_direction(static_cast<double>(c[2]), static_cast<double>(c[1]), static_cast<double>(c[0]));
      reading.coloured_area_px += 1.0;
      const double cover = ink_cover(c, colours);
      reading.ink_area_px += cover;
      const Eigen::Vector2d place(x + 0.5, y + 0.5);
      moment += cover * place;
      second += cover * place * place.transpose();
    }
  }
  if (!(hue.norm() > 0.0)) fail("the picture has no coloured pixel");
  if (!(reading.ink_area_px > 0.0)) fail("the picture shows no ink");
  reading.hue = signed_hue_of(hue);
  reading.ink_px = moment / reading.ink_area_px;
  const Eigen::Matrix2d variance = second / reading.ink_area_px - reading.ink_px * reading.ink_px.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(variance, Eigen::EigenvaluesOnly);
  reading.ink_width_px = std::sqrt(12.0 * std::max(0.0, axes.eigenvalues()[1]));
  return reading;
}

TiltTable measure_tilt(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker,
                       std::span<const double> tilts, std::uint64_t seed, const Progress& progress) {
  const auto total = static_cast<std::int64_t>(kPressed_mm.size() + 3 + tilts.size());
  std::int64_t done = 0;
  const TiltColours colours = tilt_colours(spectra);
  const auto read_at = [&](const TiltPose& pose, std::uint64_t with_seed) {
    TiltReading mean;
    Eigen::Vector2d hue = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& phase : kPhases_px) {
      TiltSetup shifted = setup;
      shifted.phase_px += phase;
      const TiltReading one = read_tilt_picture(tilt_picture(shifted, spectra, marker, pose, with_seed++), colours);
      hue += Eigen::Vector2d(std::cos(one.hue), std::sin(one.hue));
      mean.ink_px += (one.ink_px - phase) / kPhases;
      mean.ink_area_px += one.ink_area_px / kPhases;
      mean.ink_width_px += one.ink_width_px / kPhases;
      mean.coloured_area_px += one.coloured_area_px / kPhases;
    }
    mean.hue = signed_hue_of(hue);
    if (progress) progress("tilted markers", ++done, total);
    return mean;
  };
  TiltTable table;
  table.marker = marker;
  const TiltReading level = read_at({}, seed);
  std::vector<double> hues;
  std::vector<double> areas;
  std::vector<double> widths;
  for (const double pressed : kPressed_mm) {
    const TiltReading reading = pressed == 0.0 ? level : read_at({0.0, {0.0, 0.0, -pressed}}, seed);
    hues.push_back(sensors::hue_difference(reading.hue, level.hue));
    areas.push_back(reading.ink_area_px / level.ink_area_px - 1.0);
    widths.push_back(reading.ink_width_px / level.ink_width_px - 1.0);
  }
  const StraightLine hue = line_through(kPressed_mm, hues);
  TiltCalibration& calibration = table.calibration;
  calibration.hue_slope = hue.slope;
  calibration.hue_fit_r2 = hue.r2;
  calibration.area_slope = line_through(kPressed_mm, areas).slope;
  calibration.width_slope = line_through(kPressed_mm, widths).slope;
  const TiltReading right = read_at({0.0, {kAside_mm, 0.0, 0.0}}, seed);
  const TiltReading left = read_at({0.0, {-kAside_mm, 0.0, 0.0}}, seed);
  calibration.centroid_gain = (right.ink_px.x() - left.ink_px.x()) / (2.0 * kAside_mm);

  const double um_a_radian = kMicrometresPerMillimetre / calibration.hue_slope;
  const double um_a_pixel = kMicrometresPerMillimetre / calibration.centroid_gain;
  for (const double tilt : tilts) {
    const TiltReading reading = tilt == 0.0 ? level : read_at({tilt, Eigen::Vector3d::Zero()}, seed);
    TiltError error;
    error.tilt = tilt;
    error.hue_change = sensors::hue_difference(reading.hue, level.hue);
    error.normal_um = um_a_radian * error.hue_change;
    error.size_um =
        kMicrometresPerMillimetre * (reading.ink_area_px / level.ink_area_px - 1.0) / calibration.area_slope;
    error.width_um =
        kMicrometresPerMillimetre * (reading.ink_width_px / level.ink_width_px - 1.0) / calibration.width_slope;
    error.lateral_um = um_a_pixel * (reading.ink_px.x() - level.ink_px.x());
    error.across_um = um_a_pixel * (reading.ink_px.y() - level.ink_px.y());
    table.errors.push_back(error);
  }
  const TiltReading again = read_at({}, seed + kPhases);
  table.noise_normal_um = std::abs(um_a_radian * sensors::hue_difference(again.hue, level.hue)) / std::sqrt(2.0);
  table.noise_lateral_um = std::abs(um_a_pixel) * (again.ink_px - level.ink_px).norm() / 2.0;
  return table;
}

}  // namespace touchstone::lab
