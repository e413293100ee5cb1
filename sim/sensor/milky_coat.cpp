#include "sim/sensor/milky_coat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "core/grid_places.h"
#include "render/cameras/first_hits.h"
#include "render/membrane/coat_walks.h"
#include "render/paths/path_tracer.h"
#include "sim/scene/device_faces.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

constexpr double kCellsAThickness = 10.0;  // of the walks' squares; the camera's looked-at pixels are as far apart
constexpr double kSmooth = 0.4;            // thicknesses: over which the traced light at rest is averaged
constexpr int kRestPaths = 128;            // a looked-at pixel
constexpr int kFlatPaths = 16;             // a looked-at pixel, of each flat state: all of them count as one
constexpr int kJudgedPaths = 256;          // a pixel that the error is measured on, twice
constexpr int kPolynomial = 4;             // of the light at rest: what averaging has to add is small
constexpr double kReach = 3.2;             // thicknesses: how far aside walks are followed
constexpr int kColumns = 9, kRows = 7;     // places where lamps' light is looked at
constexpr double kLeast = 1e-3;            // thicknesses: of what is pressed through

cv::Size size_of_camera(const render::Camera& camera) {
  const Eigen::Vector2i size = render::size_of(camera);
  return {size.x(), size.y()};
}

/// Every `stride`-th pixel of every such row, from the middle of the first square on.
struct Looked {
  int stride = 1;
  cv::Size size, camera;
  int first() const { return stride / 2; }
  cv::Mat mask() const {
    cv::Mat mask = cv::Mat::zeros(camera, CV_8UC1);
    for (int y = first(); y < camera.height; y += stride) {
      for (int x = first(); x < camera.width; x += stride) mask.at<std::uint8_t>(y, x) = 255;
    }
    return mask;
  }
  cv::Mat of(const cv::Mat& picture) const {
    cv::Mat out(size, picture.type());
    for (int j = 0; j < size.height; ++j) {
      for (int i = 0; i < size.width; ++i) {
        const std::size_t bytes = picture.elemSize();
        std::copy_n(picture.ptr(first() + j * stride, first() + i * stride), bytes, out.ptr(j, i));
      }
    }
    return out;
  }
};

Looked looked_at(const cv::Size& camera, double cell_px) {
  Looked looked;
  looked.camera = camera;
  looked.stride = std::clamp(static_cast<int>(std::lround(cell_px)), 1, std::min(camera.width, camera.height));
  const auto count = [&](int pixels) { return (pixels - looked.first() + looked.stride - 1) / looked.stride; };
  looked.size = {count(camera.width), count(camera.height)};
  return looked;
}

/// Noise averaged away: a polynomial, and what it leaves averaged over a Gaussian. One channel.
cv::Mat smooth(const cv::Mat& noisy, double sigma) {
  std::vector<Eigen::Vector2i> powers;
  for (int i = 0; i <= kPolynomial; ++i) {
    for (int j = 0; i + j <= kPolynomial; ++j) powers.emplace_back(i, j);
  }
  const auto terms = static_cast<Eigen::Index>(powers.size());
  const auto row_of = [&](int x, int y, Eigen::VectorXd& row) {
    const double u = 2.0 * (x + 0.5) / noisy.cols - 1.0;
    const double v = 2.0 * (y + 0.5) / noisy.rows - 1.0;
    for (Eigen::Index k = 0; k < terms; ++k) {
      row[k] =
          std::pow(u, powers[static_cast<std::size_t>(k)].x()) * std::pow(v, powers[static_cast<std::size_t>(k)].y());
    }
  };
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(terms);
  Eigen::VectorXd row(terms);
  for (int y = 0; y < noisy.rows; ++y) {
    for (int x = 0; x < noisy.cols; ++x) {
      row_of(x, y, row);
      normal += row * row.transpose();
      right += noisy.at<float>(y, x) * row;
    }
  }
  const Eigen::VectorXd factors = normal.colPivHouseholderQr().solve(right);
  cv::Mat fitted(noisy.size(), CV_32FC1);
  for (int y = 0; y < noisy.rows; ++y) {
    for (int x = 0; x < noisy.cols; ++x) {
      row_of(x, y, row);
      fitted.at<float>(y, x) = static_cast<float>(factors.dot(row));
    }
  }
  cv::Mat left = noisy - fitted;
  cv::GaussianBlur(left, left, {0, 0}, sigma, sigma, cv::BORDER_REFLECT);
  return fitted + left;
}

/// The gel as if something as wide as it had pressed it in evenly.
fem::PressState flat_state(fem::PressState rest, double depth_mm) {
  rest.surface_displacement.col(2).setConstant(-depth_mm);
  return rest;
}

cv::Mat trace(const SceneView& view, const fem::PressState& press, const render::Camera& camera, const cv::Mat& mask,
              int paths, std::uint64_t seed) {
  render::RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = settings.max_samples = paths;
  return view.tracer(press, std::nullopt).render(camera, settings, mask).irradiance;
}

bool is_even(const render::Spectrum& spectrum) {
  return spectrum.size() == 0 || spectrum.maxCoeff() - spectrum.minCoeff() <= 1e-9 * spectrum.maxCoeff();
}

double pixel_mm(const render::Scene& faces, const render::Camera& camera) {
  constexpr double kStep_mm = 0.1;
  const render::ReadyCamera ready = render::make_ready(camera);
  const auto here = render::project_through_faces(faces, ready, {0, 0, 0});
  const auto there = render::project_through_faces(faces, ready, {kStep_mm, 0, 0});
  if (!here || !there) fail("the camera doesn't see the gel's middle");
  return kStep_mm / (*there - *here).norm();
}

}  // namespace

std::string unfit_for_milky_coat(const DeviceSpec& device, const render::Scene& at_rest) {
  if (device.gel.slab() == nullptr) return "the gel isn't a slab";
  const render::Medium& gel = at_rest.media[kGel];
  if (!is_even(gel.scattering) || !is_even(gel.absorption)) return "the gel scatters its bands differently";
  if (device.beads || device.films || device.pins || device.coating->print) {
    return "there's something else in the gel or on its coating";
  }
  if (device.coating->transmittance.largest() > 0.0) return "the coating lets light through";
  if (at_rest.lamps.empty()) return "the device has no lamps";
  for (const render::Lamp& lamp : at_rest.lamps) {
    if (std::holds_alternative<render::GuideLamp>(lamp)) return "a light guide's light isn't that of a point";
    if (render::is_visible(lamp)) return "a lamp has a body that is seen";
    if (render::lamp_position(lamp).z() > -device.gel.thickness_mm) return "a lamp stands in the gel";
  }
  return {};
}

MilkyCoat::MilkyCoat(const SceneView& view, const render::Camera& camera, const fem::PressState& rest,
                     std::uint64_t seed) {
  set_up(view, camera, rest, seed);
  const cv::Size size = size_of_camera(camera);
  const double cell_px = light_->grid().spacing_mm / pixel_mm(clear_layers(view.scene.device), camera);
  const Looked looked = looked_at(size, cell_px);
  const cv::Mat mask = looked.mask();
  std::vector<cv::Mat> bands;
  cv::split(looked.of(trace(view, rest, camera, mask, kRestPaths, seed)), bands);
  const double sigma = kSmooth * thickness_mm_ / light_->grid().spacing_mm * cell_px / looked.stride;
  for (cv::Mat& band : bands) band = smooth(band, sigma);
  traced_.shares.resize(bands.size());
  for (double part : kFlatStates) {
    std::vector<cv::Mat> flat;
    const fem::PressState state = flat_state(rest, (1.0 - part) * thickness_mm_);
    cv::split(looked.of(trace(view, state, camera, mask, kFlatPaths, seed)), flat);
    for (std::size_t b = 0; b < bands.size(); ++b) {
      const double whole = cv::sum(bands[b])[0];
      traced_.shares[b].push_back(whole > 0.0 ? cv::sum(flat[b])[0] / whole : 1.0);
    }
  }
  const double scale = 1.0 / looked.stride;
  const double shift = -looked.first() * scale;
  const cv::Matx23d from_pixel(scale, 0, shift, 0, scale, shift);
  for (cv::Mat& band : bands) {
    cv::warpAffine(band, band, from_pixel, size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  }
  cv::merge(bands, traced_.rest);
  learn();
}

MilkyCoat::MilkyCoat(const SceneView& view, const render::Camera& camera, const fem::PressState& rest,
                     std::uint64_t seed, TracedSlab traced)
    : traced_(std::move(traced)) {
  const Eigen::Index bands = view.seen(rest, std::nullopt).environment.size();
  if (traced_.rest.size() != size_of_camera(camera) || traced_.rest.channels() != bands) {
    fail("the light that was traced has {} x {} pixels of {} bands; it is another camera's", traced_.rest.cols,
         traced_.rest.rows, traced_.rest.channels());
  }
  set_up(view, camera, rest, seed);
  learn();
}

void MilkyCoat::learn() {
  const render::FaceGrid& grid = light_->grid();
  std::vector<cv::Mat> bands;
  cv::split(traced_.rest, bands);
  std::vector<std::vector<Eigen::Vector2d>> points(bands.size(), {{1.0, 1.0}});
  for (std::size_t k = 0; k < std::size(kFlatStates); ++k) {
    const cv::Mat walked =
        light_->share(cv::Mat(grid.rows, grid.columns, CV_32FC1, cv::Scalar(kFlatStates[k] * thickness_mm_)));
    for (std::size_t b = 0; b < bands.size(); ++b) {
      const double whole = cv::sum(bands[b])[0];  // of a band without light any curve will do
      points[b].emplace_back(whole > 0.0 ? walked.dot(bands[b]) / whole : cv::mean(walked)[0], traced_.shares[b][k]);
    }
  }
  for (std::vector<Eigen::Vector2d>& band : points) {
    std::sort(band.begin(), band.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
    share_of_walks_.emplace_back(band);
  }
}

void MilkyCoat::set_up(const SceneView& view, const render::Camera& camera, const fem::PressState& rest,
                       std::uint64_t seed) {
  const DeviceSpec& device = view.scene.device;
  const render::Scene scene = view.seen(rest, std::nullopt);
  const auto& slab = *device.gel.slab();
  const render::Medium& gel = scene.media[kGel];
  thickness_mm_ = device.gel.thickness_mm;
  render::CoatedSlab coated;
  coated.thickness_mm = thickness_mm_;
  coated.absorption_per_mm = gel.absorption.size() > 0 ? gel.absorption[0] : 0.0;
  coated.scattering_per_mm = gel.scattering.size() > 0 ? gel.scattering[0] : 0.0;
  coated.anisotropy = gel.anisotropy;
  coated.index = gel.index;
  coated.index_below = scene.media[kPlate].index;
  const Eigen::Vector2d size(slab.size_x_mm, slab.size_y_mm);
  const std::vector<render::LampArrival> arrivals =
      render::arrivals_at_back(scene, -thickness_mm_, size, kColumns, kRows);
  render::CoatWalkSettings settings;
  settings.seed = seed;
  settings.cell_mm = thickness_mm_ / kCellsAThickness;
  settings.reach_mm = kReach * thickness_mm_;
  light_ = std::make_unique<const render::CoatLight>(render::walk_under_coat(coated, arrivals, settings), scene, camera,
                                                     size, arrivals, kColumns, kRows);
}

void MilkyCoat::measure(const SceneView& view, const fem::PressState& press, const SeenGeometry& seen,
                        const render::Camera& camera, std::uint64_t seed) {
  render::DirectErrorSettings settings;
  settings.seed = seed + 1;
  settings.samples = kJudgedPaths;
  traced_.error = render::measure_direct_error(irradiance(seen.inside.surfaces.front().mesh),
                                               view.seen_coating(press, seen), camera, settings);
}

cv::Mat MilkyCoat::thickness(const TriangleMesh& sheet) const {
  const render::FaceGrid& grid = light_->grid();
  cv::Mat map(grid.rows, grid.columns, CV_32FC1, cv::Scalar(INFINITY));
  const Eigen::Vector2d first(grid.left_mm, grid.top_mm);
  for (const std::array<int, 3>& corners : sheet.triangles) {
    std::array<Eigen::Vector2d, 3> cells;
    for (int k = 0; k < 3; ++k) {
      cells[k] = ((sheet.vertices[corners[k]].head<2>() - first) / grid.spacing_mm).array() - 0.5;
    }
    const double z = sheet.vertices[corners[0]].z();
    const double z1 = sheet.vertices[corners[1]].z() - z;
    const double z2 = sheet.vertices[corners[2]].z() - z;
    for_places_in(cells, grid.columns, grid.rows, [&](int i, int j, double b, double c) {
      float& lowest = map.at<float>(j, i);  // of a sheet that folds
      const double here = z + b * z1 + c * z2 + thickness_mm_;
      lowest = std::min(lowest, static_cast<float>(std::max(here, kLeast * thickness_mm_)));
    });
  }
  // Beside the sheet, at the rim of a gel that has been dragged aside, it's as at rest.
  map.setTo(thickness_mm_, map == INFINITY);
  return map;
}

cv::Mat MilkyCoat::irradiance(const TriangleMesh& sheet) const {
  const cv::Mat walked = light_->share(thickness(sheet));
  std::vector<cv::Mat> bands;
  cv::split(traced_.rest, bands);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const MonotoneCurve& curve = share_of_walks_[b];
    for (int y = 0; y < walked.rows; ++y) {
      const auto* share = walked.ptr<float>(y);
      auto* to = bands[b].ptr<float>(y);
      for (int x = 0; x < walked.cols; ++x) to[x] *= static_cast<float>(std::max(0.0, curve.at(share[x])));
    }
  }
  cv::Mat light;
  cv::merge(bands, light);
  return light;
}

}  // namespace touchstone::sim
