#pragma once
// Direct light for a scene's camera: found good enough by measurement, or not taken.

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/direct/direct_error.h"
#include "sim/press/truth.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

/// Rays a pixel that are tried in turn; with one, shadows of wide lamps have no soft rims.
inline constexpr int kRaysTried[] = {1, 16, 64};

/// What finding direct light comes to, but for what the scene says anyhow (field.fixture is empty).
struct FoundLight {
  LightChoice choice;
  int rays = 1;  ///< a pixel; the rest is for a choice of direct light
  render::LightField field;
  cv::Mat bounced;
};

/// What finding direct light takes, but for the pictures that are tried.
struct DirectWork {
  render::LightFieldCount field;
  double rest_paths = 0.0;   ///< traced for the bounced light of the gel at rest
  double error_paths = 0.0;  ///< traced to measure its error; four times as many where that leaves it open
};

/// Counts it. `relief`: of the state that is pressed deepest. @pre as DirectLight. @throws Error where a light field
/// can't be had
DirectWork count_direct_work(const SceneView& view, const render::Camera& camera, std::span<const Truth> truths,
                             const std::optional<fem::ReliefAnswer>& relief);

/// How direct light is found, besides what the scene says.
struct DirectLightSettings {
  std::span<const int> rays = kRaysTried;              ///< a pixel, tried in turn until the scene's tolerance holds
  int edge_side = render::DirectSettings{}.edge_side;  ///< render::DirectSettings
  render::GuideCut guides;                             ///< render::LightFieldSettings
  double field_accuracy = 0.0;                         ///< render::DirectChoiceSettings
  /// The fine contact of the state that is pressed deepest, where it has been solved already.
  const std::optional<fem::ReliefAnswer>* relief = nullptr;
};

/// Tier 1 of the renderers for one scene. Made once; `render` is pure and may be called from several threads.
class DirectLight {
 public:
  /// Measures on the state of `truths` that is pressed deepest, with ever more rays a pixel until the scene's tolerance
  /// holds; `choice` then says what became of it. Where the scene switches direct light on, the last is taken.
  /// @pre the plan has direct light, neither `truths` nor the rays are empty
  /// @throws Error with the scene's place if the scene switches direct light on and it can't be had
  DirectLight(const SceneView& view, const render::Camera& camera, std::span<const Truth> truths,
              const DirectLightSettings& wanted = {});

  /// As it was found before, of the same scene and camera and with the same edge_side. `still`: the gel untouched.
  /// @throws Error if its lamps, bands or pixels aren't the scene's and the camera's
  DirectLight(const SceneView& view, const render::Camera& camera, const fem::PressState& still, FoundLight found,
              int edge_side);

  const LightChoice& choice() const { return choice_; }
  /// For the constructor above.
  FoundLight found() const;

  /// The picture of a scene as SceneView::seen gives it; nothing if the gel has gone where the light field doesn't
  /// reach. @pre choice().direct
  std::optional<render::DirectImage> render(render::Scene scene, const render::SamplePart& part = {}) const;
  /// The part of its rays a pixel that one of several moments takes whose mean is wanted, `together` of which a pixel
  /// sees (render::SamplePart).
  render::SamplePart part_of(std::size_t moment, double together) const;

  /// Have its pictures points that can be moved (DirectRenderer::sheet_points)? Those of one ray a pixel have.
  bool has_points() const { return choice_.direct && settings_.samples == 1; }
  /// The points of a scene; nothing where the gel has gone too far, as render, or the renderer has none for it.
  /// @pre has_points()
  std::optional<render::SheetPoints> points(const render::Scene& scene) const;
  /// The picture of their radiance, as DirectRenderer::picture_of. @pre has_points()
  void picture_of(std::vector<float>& radiance, cv::Mat& irradiance) const;

 private:
  /// `work` with a renderer of this thread's own.
  template <typename Work>
  auto with_renderer(const Work& work) const;
  bool is_within_reach(const render::Scene& direct) const;
  std::unique_ptr<render::DirectRenderer> borrow() const;

  LightChoice choice_;
  render::Camera camera_;
  render::Scene rest_;
  render::LightField field_;
  cv::Mat bounced_;
  render::DirectSettings settings_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<render::DirectRenderer>> idle_;  // a renderer serves one thread at a time
};

}  // namespace touchstone::sim
