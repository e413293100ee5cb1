#include "render/scene/film_screen.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr double kLevel_mm = 1e-4;    // out of one plane
constexpr double kFine_mm = 0.02;     // cells of the map that the camera asks
constexpr double kSigmasPerCell = 8;  // of the map that the lamps ask
constexpr int kMostCells = 3000;      // a side
constexpr int kLines = 16;            // a cell: along each of them what films cover is exact

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

/// Adds to each cell the part of it that a triangle covers; corners in cells.
void add_triangle(const std::array<Eigen::Vector2d, 3>& corners, cv::Mat& share) {
  const auto [low, high] = std::minmax({corners[0].y(), corners[1].y(), corners[2].y()});
  const int first = static_cast<int>(std::ceil(low * kLines - 0.5));
  const int last = static_cast<int>(std::ceil(high * kLines - 0.5)) - 1;
  for (int line = std::max(first, 0); line <= std::min(last, share.rows * kLines - 1); ++line) {
    const double y = (line + 0.5) / kLines;
    double from = share.cols;
    double to = 0.0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d& a = corners[k];
      const Eigen::Vector2d& b = corners[(k + 1) % 3];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      from = std::min(from, x);
      to = std::max(to, x);
    }
    auto* cells = share.ptr<float>(line / kLines);
    for (int i = std::max(0, static_cast<int>(from)); i < std::min(to, double(share.cols)); ++i) {
      cells[i] += static_cast<float>((std::min(to, i + 1.0) - std::max(from, double(i))) / kLines);
    }
  }
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

bool same_film(const Surface& one, const Surface& other) {
  if (!is_film(one) || !is_film(other)) return false;
  const auto& a = std::get<ThinFilm>(one.material);
  const auto& b = std::get<ThinFilm>(other.material);
  return a.index == b.index && a.fresnel == b.fresnel && (a.transmittance == b.transmittance).all() &&
         one.mesh.vertices == other.mesh.vertices && one.mesh.triangles == other.mesh.triangles;
}

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

  camera_ = draw(scene, kFine_mm, camera_radius_mm);
  const double radius_cells = camera_radius_mm * camera_.per_mm;
  if (radius_cells > 0.5) {
    cv::filter2D(camera_.share, camera_.share, -1, disc(radius_cells), {-1, -1}, 0, cv::BORDER_CONSTANT);
  }
  lamps_ = draw(scene, std::max(kFine_mm, lamp_sigma_mm / kSigmasPerCell), 3.0 * lamp_sigma_mm);
  const double sigma_cells = lamp_sigma_mm * lamps_.per_mm;
  if (sigma_cells > 0.1) {
    cv::GaussianBlur(lamps_.share, lamps_.share, {}, sigma_cells, sigma_cells, cv::BORDER_CONSTANT);
  }

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

FilmScreen::Map FilmScreen::draw(const Scene& scene, double cell_mm, double margin_mm) {
  Eigen::AlignedBox2d box = outline_of(scene);
  const double cell = std::max(cell_mm, (box.sizes().maxCoeff() + 2.0 * margin_mm) / kMostCells);
  box.min().array() -= margin_mm + 2.0 * cell;
  box.max().array() += margin_mm + 2.0 * cell;
  Map map;
  map.left = static_cast<float>(box.min().x());
  map.low = static_cast<float>(box.min().y());
  map.per_mm = static_cast<float>(1.0 / cell);
  map.share = cv::Mat::zeros(static_cast<int>(std::ceil(box.sizes().y() / cell)),
                             static_cast<int>(std::ceil(box.sizes().x() / cell)), CV_32F);
  for (const Surface& surface : scene.surfaces) {
    if (!is_film(surface)) continue;
    for (const auto& triangle : surface.mesh.triangles) {
      std::array<Eigen::Vector2d, 3> corners;
      for (int k = 0; k < 3; ++k) {
        corners[k] = (surface.mesh.vertices[triangle[k]].head<2>() - box.min()) / cell;
      }
      add_triangle(corners, map.share);
    }
  }
  map.share = cv::min(map.share, 1.0f);
  return map;
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

void FilmScreen::add(float amount, float cover, float cosine, Light& light) const {
  const float at = std::clamp(cosine, 0.0f, 1.0f) * kCosines;
  const int k = std::min(static_cast<int>(at), kCosines - 1);
  const float share = at - static_cast<float>(k);
  light.plain += amount * (1.0f - cover);
  light.filtered[k] += amount * cover * (1.0f - share);
  light.filtered[k + 1] += amount * cover * share;
}

void FilmScreen::pass(const Light& light, float* out) const {
  std::fill_n(out, bands_, light.plain);
  for (int k = 0; k <= kCosines; ++k) {
    if (light.filtered[k] == 0.0f) continue;
    for (int band = 0; band < bands_; ++band) out[band] += light.filtered[k] * left_by_cosine_[k][band];
  }
}

}  // namespace touchstone::render
