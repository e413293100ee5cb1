#pragma once
// The coloured films of a fixture as direct light sees them: a flat screen that camera rays and lamps' light pass.

#include <Eigen/Geometry>
#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "render/scene/scene.h"

namespace touchstone::render {

/// Whether a surface is a film: it takes light away and stops no ray.
inline bool is_film(const Surface& surface) {
  return std::holds_alternative<ThinFilm>(surface.material);
}

/// Are two surfaces films of one shape, place and kind?
bool same_film(const Surface& one, const Surface& other);

/// Why a scene's films can't be taken for a screen; empty if they can, or if there are none: all of them must lie in
/// one level plane, have one dye and index, and no faces that mirror. They are taken not to overlap.
std::string unfit_for_screen(const Scene& scene);

/// Which part of what passes a place of the films' plane meets film, and what film leaves of it.
///
/// Two means over the plane stand for many rays. A camera whose hole or lens sees a point of a membrane through a disc
/// of the plane gets the mean over that disc: exact where the membrane is in focus. The light that reaches a place
/// from a wide lamp comes through much of the plane, so films in its path count by their share of it, the mean of a
/// Gaussian: what that leaves out, the soft shadows of single films, measure_direct_error tells.
class FilmScreen {
 public:
  FilmScreen() = default;
  /// `camera_radius_mm` of that disc, 0 for single rays; `lamp_sigma_mm` of that Gaussian. `medium_index`: of what the
  /// films lie in. @pre unfit_for_screen(scene).empty()
  FilmScreen(const Scene& scene, double medium_index, double camera_radius_mm, double lamp_sigma_mm);

  bool empty() const { return bands_ == 0; }
  float z() const { return z_; }
  float camera_cover(float x, float y) const { return cover(camera_, x, y); }
  float lamp_cover(float x, float y) const { return cover(lamps_, x, y); }
  /// Light that goes through the plane: what meets no film, and what does, shared out to the table's cosines.
  static constexpr int kCosines = 16;
  /// Shares of the light, by the cosine at which it passes the films.
  struct Light {
    float plain = 0.0f;
    float filtered[kCosines + 1] = {};
  };
  /// Adds `amount` that crosses at `cosine` (of the medium) to the normal, of which the share `cover` meets film.
  void add(float amount, float cover, float cosine, Light& light) const;
  /// What is left of it in each band: film leaves t^(1 / cos inside the film). Writes as many numbers as the scene has
  /// bands.
  void pass(const Light& light, float* out) const;

 private:
  struct Map {
    cv::Mat share;  ///< CV_32FC1, 0 to 1; 0 beyond
    float left = 0.0f, low = 0.0f, per_mm = 0.0f;
  };
  static Map draw(const Scene& scene, double cell_mm, double margin_mm);
  static float cover(const Map& map, float x, float y);

  int bands_ = 0;
  float z_ = 0.0f;
  Map camera_, lamps_;
  std::vector<std::array<float, kMaxBands>> left_by_cosine_;  ///< kCosines + 1 of them, cosine 0 to 1
};

}  // namespace touchstone::render
