#include "render/film_screen.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr double kLevel_mm = 1e-4;    // out of one plane
constexpr double kFine_mm = 0.02;     // cells of the map that the camera asks
constexpr int kDrawn = 4;             // times finer in each direction are the cells that the films are drawn in
constexpr double kSigmasPerCell = 8;  // of the map that the lamps ask
constexpr int kMostCells = 4000;      // a side, drawn ones

const Surface* first_film(const Scene& scene) {
  const auto found = std::find_if(scene.surfaces.begin(), scene.surfaces.end(), is_film);
  return found == scene.surfaces.end() ? nullptr : &*found;
}

Eigen::AlignedBox2d outline_of(const Scene& scene) {
  Eigen::AlignedBox2d box;
  for (const Surface& surface : scene.surfaces) {
    if (!is_film(surface)) continue;
    for (const Eigen::Vector3d& vertex : surface.mesh.vertices) box.extend(vertex.head<2>());
  }
  return box;
}

cv::Mat disc(double radius_cells) {
  const int half = static_cast<int>(std::ceil(radius_cells));
  cv::Mat kernel(2 * half + 1, 2 * half + 1, CV_32F);
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      // The rim's cells by how far they lie within, which is their covered share to some percent.
      kernel.at<float>(y + half, x + half) =
          static_cast<float>(std::clamp(radius_cells + 0.5 - std::hypot(x, y), 0.0, 1.0));
    }
  }
  return kernel / cv::sum(kernel)[0];
}

}  // namespace

std::string unfit_for_screen(const Scene& scene) {
  const Surface* first = first_film(scene);
  if (first == nullptr) return {};
  const auto& film = std::get<ThinFilm>(first->material);
  if (first->mesh.vertices.empty()) return "a film has no vertices";
  const double z = first->mesh.vertices.front().z();
  for (const Surface& surface : scene.surfaces) {
    if (!is_film(surface)) continue;
    const auto& other = std::get<ThinFilm>(surface.material);
    if (other.fresnel) return "a film's faces mirror";
    if (other.index != film.index || (other.transmittance != film.transmittance).any()) {
      return "films have different colours";
    }
    for (const Eigen::Vector3d& vertex : surface.mesh.vertices) {
      if (std::abs(vertex.z() - z) > kLevel_mm) return "films don't lie in one level plane";
    }
  }
  return {};
}

FilmScreen::FilmScreen(const Scene& scene, double medium_index, double camera_radius_mm, double lamp_sigma_mm) {
  const Surface* first = first_film(scene);
  if (first == nullptr) return;
  const auto& film = std::get<ThinFilm>(first->material);
  bands_ = static_cast<int>(film.transmittance.size());
  z_ = static_cast<float>(first->mesh.vertices.front().z());

  // Drawn finely, then averaged: a cell's number is the part of it that is film.
  const double margin = camera_radius_mm + 3.0 * lamp_sigma_mm + 2 * kFine_mm;
  Eigen::AlignedBox2d box = outline_of(scene);
  box.min().array() -= margin;
  box.max().array() += margin;
  const double cell = std::max(kFine_mm, box.sizes().maxCoeff() * kDrawn / kMostCells);
  const cv::Size size(static_cast<int>(box.sizes().x() / cell) + 1, static_cast<int>(box.sizes().y() / cell) + 1);
  cv::Mat drawn = cv::Mat::zeros(size * kDrawn, CV_8U);
  constexpr int kShift = 8;  // fixed-point digits of OpenCV's corners, which count from the middle of a cell
  for (const Surface& surface : scene.surfaces) {
    if (!is_film(surface)) continue;
    for (const auto& triangle : surface.mesh.triangles) {
      std::array<cv::Point, 3> corners;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector2d at =
            (surface.mesh.vertices[triangle[k]].head<2>() - box.min()) * (kDrawn / cell) - Eigen::Vector2d(0.5, 0.5);
        corners[k] = {static_cast<int>(std::lround(at.x() * (1 << kShift))),
                      static_cast<int>(std::lround(at.y() * (1 << kShift)))};
      }
      cv::fillConvexPoly(drawn, corners.data(), 3, cv::Scalar(255), cv::LINE_8, kShift);
    }
  }
  cv::Mat share;
  cv::resize(drawn, share, size, 0, 0, cv::INTER_AREA);
  share.convertTo(share, CV_32F, 1.0 / 255.0);

  camera_.left = lamps_.left = static_cast<float>(box.min().x());
  camera_.low = lamps_.low = static_cast<float>(box.min().y());
  camera_.per_mm = static_cast<float>(1.0 / cell);
  const double radius_cells = camera_radius_mm / cell;
  if (radius_cells > 0.5) {
    cv::filter2D(share, camera_.share, -1, disc(radius_cells), {-1, -1}, 0, cv::BORDER_CONSTANT);
  } else {
    camera_.share = share;
  }
  const int coarser = std::max(1, static_cast<int>(lamp_sigma_mm / kSigmasPerCell / cell));
  cv::Mat coarse;
  const cv::Size fewer(std::max(1, size.width / coarser), std::max(1, size.height / coarser));
  cv::resize(
      share(cv::Rect(0, 0, std::min(size.width, fewer.width * coarser), std::min(size.height, fewer.height * coarser))),
      coarse, fewer, 0, 0, cv::INTER_AREA);
  const double sigma = lamp_sigma_mm / (cell * coarser);
  if (sigma > 0.1) cv::GaussianBlur(coarse, coarse, {}, sigma, sigma, cv::BORDER_CONSTANT);
  lamps_.share = coarse;
  lamps_.per_mm = static_cast<float>(1.0 / (cell * coarser));

  left_by_cosine_.resize(kCosines + 1);
  const double eta = medium_index / film.index;
  for (int k = 0; k <= kCosines; ++k) {
    const double cosine = static_cast<double>(k) / kCosines;
    const double inside2 = 1.0 - eta * eta * (1.0 - cosine * cosine);
    for (int band = 0; band < bands_; ++band) {
      left_by_cosine_[k][band] =
          inside2 > 0.0 ? static_cast<float>(std::pow(film.transmittance[band], 1.0 / std::sqrt(inside2))) : 0.0f;
    }
  }
}

float FilmScreen::cover(const Map& map, float x, float y) {
  const float column = (x - map.left) * map.per_mm - 0.5f;
  const float row = (y - map.low) * map.per_mm - 0.5f;
  const auto columns = static_cast<float>(map.share.cols - 1);
  const auto rows = static_cast<float>(map.share.rows - 1);
  if (!(column >= 0.0f && column < columns && row >= 0.0f && row < rows)) return 0.0f;
  const int i = static_cast<int>(column);
  const int j = static_cast<int>(row);
  const float u = column - static_cast<float>(i);
  const float v = row - static_cast<float>(j);
  const float* above = map.share.ptr<float>(j) + i;
  const float* below = map.share.ptr<float>(j + 1) + i;
  return (1 - v) * ((1 - u) * above[0] + u * above[1]) + v * ((1 - u) * below[0] + u * below[1]);
}

void FilmScreen::pass(float cover, float cosine, float* out) const {
  const float at = std::clamp(cosine, 0.0f, 1.0f) * kCosines;
  const int k = std::min(static_cast<int>(at), kCosines - 1);
  const float share = at - static_cast<float>(k);
  for (int band = 0; band < bands_; ++band) {
    const float left = (1.0f - share) * left_by_cosine_[k][band] + share * left_by_cosine_[k + 1][band];
    out[band] = 1.0f - cover * (1.0f - left);
  }
}

}  // namespace touchstone::render
