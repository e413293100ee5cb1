#include "sim/need/picture_needs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/imager/mean_electrons.h"
#include "sim/need/switched_effect.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/background_light.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/photocurrent.h"
#include "sim/view/pixel_truth.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

constexpr double kAboutContact = 0.5;  // of the contact's radius

/// CV_8U, 255 for so many pixels as are looked at, drawn from those that see the contact or what is about it; of a
/// picture that doesn't show it from all.
cv::Mat looked_at(const SceneView& view, const render::Camera& camera, const fem::PressState& press, int pixels) {
  const std::optional<fem::ReliefAnswer> relief = view.relief(press);
  OutputSpec contact;
  contact.contact = true;
  const cv::Mat touching = pixel_truth(view.geometry(press, relief), camera, contact).image > 0.5;
  cv::Mat near = touching;
  const int seen = cv::countNonZero(touching);
  if (seen == 0) {
    near = cv::Mat(touching.size(), CV_8U, cv::Scalar(255));
  } else {
    const int reach = std::max(1, static_cast<int>(std::lround(kAboutContact * std::sqrt(seen / kPi))));
    cv::dilate(touching, near, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * reach + 1, 2 * reach + 1}));
  }
  std::vector<cv::Point> places;
  cv::findNonZero(near, places);
  cv::Mat mask = cv::Mat::zeros(near.size(), CV_8U);
  RandomStream random(view.scene.seed, 0, Purpose::kSearch);
  const std::size_t count = std::min(static_cast<std::size_t>(pixels), places.size());
  for (std::size_t k = 0; k < count; ++k) {
    const auto left = static_cast<double>(places.size() - k);
    std::swap(places[k], places[k + static_cast<std::size_t>(random.uniform() * left)]);
    mask.at<std::uint8_t>(places[k]) = 255;
  }
  return mask;
}

/// Of a state, from each of two sets of random numbers.
using TwoPictures = std::array<cv::Mat, 2>;

/// What a scene's cameras get of a state. Without events asked for, `contrast` is empty, without pictures `electrons`.
struct SeenState {
  TwoPictures electrons;  ///< mean
  TwoPictures contrast;   ///< log of the photocurrent over that of the untouched gel
};

/// Of a device with a background the electrons have what that adds where nothing is pressed, as the sensor's own
/// pictures: it gives back most of what an effect makes of the untouched unit, so that much less than its whole light
/// is left to change.
SeenState seen_state(const SceneView& view, const render::Camera& camera, const fem::PressState& press,
                     const cv::Mat& mask, int paths, const std::vector<render::ImagerResponse>& responses) {
  const render::Tracer tracer = view.tracer(press);
  const cv::Mat& background = view.scene.device.background;
  const bool events = view.scene.outputs.events;
  std::optional<render::Tracer> rest;
  if (events || !background.empty()) rest.emplace(view.seen(at_rest(press), {}));
  const render::Imager ideal = imager(view.scene.device, view.plan.bands, false);
  const Photocurrents currents(view.scene.device, view.plan.bands);
  render::RenderSettings settings;
  settings.min_samples = settings.max_samples = paths;
  SeenState seen;
  for (std::size_t k = 0; k < seen.electrons.size(); ++k) {
    settings.seed = view.scene.seed + k * kOtherSeed;
    cv::Mat light = tracer.render(camera, settings, mask).irradiance;
    const cv::Mat untouched = rest ? rest->render(camera, settings, mask).irradiance : cv::Mat();
    if (events) {
      const auto& pixels = view.scene.device.camera->events.value().pixels;
      seen.contrast[k] = currents.log_of(light, pixels) - currents.log_of(untouched, pixels);
    }
    if (!view.scene.outputs.light()) continue;
    if (!background.empty()) {
      light = with_numbers(light, missing_at_rest(background, untouched, ideal), irradiance_per_number(ideal));
    }
    seen.electrons[k] = render::mean_electrons(light, responses);
  }
  return seen;
}

/// Adds up squares of changes of contrast, and of the contrast. Sums of two sets of random numbers have no noise in
/// the mean.
struct ContrastSum {
  double changed = 0.0;
  double all = 0.0;

  void add(const TwoPictures& one, const TwoPictures& other, const cv::Mat& mask) {
    for (int row = 0; row < mask.rows; ++row) {
      for (int column = 0; column < mask.cols; ++column) {
        if (mask.at<std::uint8_t>(row, column) == 0) continue;
        const auto at = [&](const cv::Mat& picture) { return static_cast<double>(picture.at<float>(row, column)); };
        changed += (at(one[0]) - at(other[0])) * (at(one[1]) - at(other[1]));
        all += 0.5 * (at(one[0]) * at(one[1]) + at(other[0]) * at(other[1]));
      }
    }
  }
  double percent() const { return all > 0.0 ? 100.0 * std::sqrt(std::max(0.0, changed) / all) : 0.0; }
};

/// Adds up squares of differences over the noise.
struct NoiseSum {
  double squares = 0.0;
  std::int64_t values = 0;

  void add(const TwoPictures& one, const TwoPictures& other, const cv::Mat& mask,
           const std::vector<render::ImagerResponse>& responses) {
    const int channels = static_cast<int>(responses.size());
    for (int row = 0; row < mask.rows; ++row) {
      for (int column = 0; column < mask.cols; ++column) {
        if (mask.at<std::uint8_t>(row, column) == 0) continue;
        for (int c = 0; c < channels; ++c) {
          const int i = column * channels + c;
          const render::ImagerResponse& response = responses[static_cast<std::size_t>(c)];
          const double level = 0.25 * (one[0].ptr<float>(row)[i] + one[1].ptr<float>(row)[i] +
                                       other[0].ptr<float>(row)[i] + other[1].ptr<float>(row)[i]);
          if (level >= response.full_well_e) continue;
          const double noise = render::noise_e(response, level);
          squares += (one[0].ptr<float>(row)[i] - other[0].ptr<float>(row)[i]) *
                     (one[1].ptr<float>(row)[i] - other[1].ptr<float>(row)[i]) / (noise * noise);
          ++values;
        }
      }
    }
  }
  double root() const { return values == 0 ? 0.0 : std::sqrt(std::max(0.0, squares / static_cast<double>(values))); }
};

/// mm: how far the surface's height differs at most with the fine contact and without. @pre `view` has it
double height_change(const SceneView& view, const fem::PressState& press) {
  const cv::Mat fine = view.membrane->height(press, view.relief(press));
  return cv::norm(fine, view.membrane->height(press, {}), cv::NORM_INF);
}

}  // namespace

void add_picture_needs(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                       std::span<const Truth> truths, std::span<const int> frames, const NeedSettings& settings,
                       const LightLimits& limits, SceneNeeds& needs) {
  if (plan.scattering || frames.empty()) return;
  const SceneView view(scene, plan, gel);
  const render::Camera camera = planned_camera(scene, plan);
  const std::vector<render::ImagerResponse> responses =
      render::channel_responses(imager(scene.device, plan.bands, true));
  std::vector<cv::Mat> masks;
  std::vector<SeenState> planned;
  for (const int k : frames) {
    const fem::PressState& press = truths[static_cast<std::size_t>(k)].press;
    masks.push_back(looked_at(view, camera, press, settings.pixels));
    planned.push_back(seen_state(view, camera, press, masks.back(), settings.paths, responses));
  }
  if (scene.outputs.light() && !plan.direct_light && !plan.shared_paths) {
    NoiseSum twice;  // of the difference of two pictures, which has two pictures' noise
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const auto& [one, other] = planned[k].electrons;
      twice.add({one, one}, {other, other}, masks[k], responses);
    }
    const double with_most =
        twice.root() / std::sqrt(2.0) * std::sqrt(static_cast<double>(settings.paths) / limits.max_samples);
    EffectNeed need{kMorePaths, {}, {}};
    need.change.emplace().pixel_noise = std::max(limits.noise_fraction, with_most);
    needs.push_back(std::move(need));
  }
  for (const SwitchedEffect& one : kSeenEffects) {
    const std::optional<SwitchedScene> way = switched(scene, plan, one);
    if (!way) continue;
    EffectNeed need{one.name, {}, {}};
    try {
      const SceneView turned(way->scene, way->plan, gel, view);
      const render::Camera seen_by = planned_camera(way->scene, way->plan);
      NoiseSum sum;
      ContrastSum contrast;
      for (std::size_t k = 0; k < frames.size(); ++k) {
        const fem::PressState& press = truths[static_cast<std::size_t>(frames[k])].press;
        const SeenState other = seen_state(turned, seen_by, press, masks[k], settings.paths, responses);
        if (scene.outputs.light()) sum.add(planned[k].electrons, other.electrons, masks[k], responses);
        if (scene.outputs.events) contrast.add(planned[k].contrast, other.contrast, masks[k]);
      }
      need.change.emplace();
      if (scene.outputs.light()) need.change->pixel_noise = sum.root();
      if (scene.outputs.events) need.change->event_percent = contrast.percent();
      const SceneView& fine = plan.fine_relief ? view : turned;
      if (one.planned == &Plan::fine_relief && (scene.device.coating || scene.outputs.height)) {
        double most = 0.0;
        for (const int k : frames) {
          most = std::max(most, height_change(fine, truths[static_cast<std::size_t>(k)].press));
        }
        need.change->height_um = 1e3 * most;
      }
    } catch (const Error& error) {
      need.note = error.what();
    }
    needs.push_back(std::move(need));
  }
}

}  // namespace touchstone::sim
