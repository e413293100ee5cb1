#include "sim/sensor/light_between.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "render/direct/sheet_between.h"
#include "sim/plan/image_motion.h"
#include "sim/press/state_between.h"
#include "sim/scene/device_gel.h"
#include "sim/sensor/sheet_motion.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

/// A state drawn in full.
struct Key {
  fem::PressState press;
  render::SheetBetween sheet;
};

/// A state whose picture waits until it is known which key comes next.
struct Waiting {
  std::int64_t t_us = 0;
  fem::PressState press;
  cv::Mat light;  ///< moved from the last key
};

constexpr std::size_t kMostKeys = 8;  // that are kept, some 20 MB each
constexpr double kNear = 0.5;         // of the reach: an older key that is as near is taken again
constexpr int kMostSteps = 256;       // from one state that is played to the next

/// The root of the mean square of the difference of two lights' logarithms.
double rms_of_logs(const cv::Mat& one, const cv::Mat& other) {
  double sum = 0.0;
  for (int row = 0; row < one.rows; ++row) {
    const auto* a = one.ptr<float>(row);
    const auto* b = other.ptr<float>(row);
    for (int column = 0; column < one.cols; ++column) {
      if (!(a[column] > 0.0f && b[column] > 0.0f)) continue;
      const double off = std::log(double(a[column]) / double(b[column]));
      sum += off * off;
    }
  }
  return std::sqrt(sum / static_cast<double>(one.total()));
}

}  // namespace

std::string unfit_for_light_between(const SceneSpec& scene, const Plan& plan) {
  const DeviceSpec& device = scene.device;
  if (!plan.direct_light) return "there is no direct light";
  if (device.coating->type != CoatingType::matt) return "the coating is of metal";
  if (plan.translucent_coating) return "objects are seen through the coating";
  if (!is_gentle(device.gel)) return "the gel is neither flat nor a dome that slopes by 0.5 rad at most";
  const bool scattered = device.coating->print && device.coating->print->pattern == PrintPattern::scattered;
  if (scattered && device.gel.dome() != nullptr) return "the print is laid out along a dome";
  if (device.films) return "there are films before the gel";
  if (device.pins) return "pins stand before the coating";
  if (device.beads) return "there are beads in the gel";
  return {};
}

struct LightBetween::Parts {
  LightOfKeys light;
  SheetMotion motion;
  ImageScale scale;
  double object_radius_mm;
  Show show;
  LightBetweenReport report{};
  std::shared_ptr<const Key> key{};
  std::vector<std::shared_ptr<const Key>> kept{};  // all that are kept, the one used last at the end
  std::vector<Waiting> waiting{};
  std::optional<std::pair<std::int64_t, fem::PressState>> last{};  // that was played
  // Memory that each state uses again.
  render::SheetMove move{};
  std::vector<float> radiance{};
  cv::Mat irradiance{};
  std::vector<cv::Mat> spare{};  // pictures

  /// How far a state is from a key, in parts of the reach: above 1 it is too far.
  double distance(const render::SheetReach& gone) const {
    const double reach_px = light.view.scene.light.event_reach_px;
    return reach_px == 0.0 ? 2.0 : std::max(gone.pixels / reach_px, gone.slope / LightBetween::kReachSlope);
  }

  /// A key that is near to the state: an older one, or a new one.
  std::shared_ptr<const Key> key_at(const fem::PressState& press, bool& is_new) {
    auto best = kept.end();
    double least = kNear;
    for (auto it = kept.begin(); it != kept.end(); ++it) {
      motion.between((*it)->press, press, move);
      const double far = distance((*it)->sheet.reach(move));
      if (far >= least) continue;
      least = far;
      best = it;
    }
    is_new = best == kept.end();
    std::shared_ptr<const Key> found = is_new ? std::make_shared<const Key>(make_key(press)) : *best;
    if (!is_new) kept.erase(best);
    if (kept.size() == kMostKeys) kept.erase(kept.begin());
    kept.push_back(found);
    return found;
  }

  Key make_key(const fem::PressState& press) {
    ++report.keys;
    const SceneView& view = light.view;
    const SeenGeometry geometry = view.geometry(press, view.relief(press));
    render::Scene scene = view.seen_coating(press, geometry);
    render::Surface& sheet = scene.surfaces.front();
    if (!sheet.print) {
      render::Print& places = sheet.print.emplace();
      for (const Eigen::Vector3d& rest : geometry.sheet.rest) places.material_mm.emplace_back(rest.head<2>());
    }
    std::optional<render::SheetPoints> points = light.direct.points(scene);
    if (!points) fail("events: the gel has gone where the light field of direct light doesn't reach");
    return {press, render::SheetBetween(std::move(*points), sheet)};
  }

  /// The light of a key's sheet moved to another state.
  cv::Mat moved(const Key& from, const fem::PressState& to, render::SheetReach* reach = nullptr) {
    motion.between(from.press, to, move);
    const render::SheetReach gone = from.sheet.radiance(move, radiance);
    if (reach != nullptr) *reach = gone;
    light.direct.picture_of(radiance, irradiance);
    cv::Mat picture;
    if (!spare.empty()) {
      picture = std::move(spare.back());
      spare.pop_back();
    }
    light.currents(irradiance, picture);
    return picture;
  }

  /// Shows all that waits, going over to the key `next`, if there is one: drawn at the last state, or an older one.
  void release(const Key* next, bool is_new) {
    for (std::size_t k = 0; k < waiting.size(); ++k) {
      Waiting& one = waiting[k];
      if (next != nullptr) {
        const double part = static_cast<double>(k + 1) / static_cast<double>(waiting.size());
        const cv::Mat back = moved(*next, one.press);
        if (is_new && k + 1 == waiting.size()) {
          report.worst_rms = std::max(report.worst_rms, rms_of_logs(one.light, back));
        }
        cv::addWeighted(one.light, 1.0 - part, back, part, 0.0, one.light);
        spare.push_back(back);
      }
      show(one.t_us, one.light);
      spare.push_back(std::move(one.light));
    }
    waiting.clear();
  }

  void add(std::int64_t t_us, const fem::PressState& press) {
    ++report.pictures;
    bool is_new = false;
    if (!key) {
      key = key_at(press, is_new);
      show(t_us, moved(*key, press));
      return;
    }
    render::SheetReach reach;
    waiting.push_back({t_us, press, moved(*key, press, &reach)});
    if (distance(reach) > 1.0) {
      std::shared_ptr<const Key> next = key_at(press, is_new);
      release(next.get(), is_new);
      key = std::move(next);
    } else if (waiting.size() >= kMostWaiting) {
      release(nullptr, false);
    }
  }
};

LightBetween::LightBetween(LightOfKeys light, const fem::Compliance& gel, Show show)
    : parts_(new Parts{light, SheetMotion(gel, light.view.scene.device.mesh.fine_mm),
                       ImageScale(light.view.scene.device), largest_object_radius(light.view.scene), std::move(show)}) {
  TS_ASSERT(parts_->light.direct.has_points());
}

LightBetween::~LightBetween() = default;

void LightBetween::add(std::int64_t t_us, const fem::PressState& press) {
  Parts& parts = *parts_;
  if (parts.last) {
    const auto& [from_us, from] = *parts.last;
    const auto span_us = static_cast<double>(t_us - from_us);
    const double wanted = std::ceil(image_motion(parts.scale, from, press, parts.object_radius_mm) / kMovedStep_px);
    const int steps = std::max(1, static_cast<int>(std::min({wanted, span_us, static_cast<double>(kMostSteps)})));
    for (int k = 1; k < steps; ++k) {
      const std::int64_t between_us = from_us + (t_us - from_us) * k / steps;
      parts.add(between_us, state_between(from, press, static_cast<double>(between_us - from_us) / span_us));
    }
  }
  parts.add(t_us, press);
  parts.last.emplace(t_us, press);
}

void LightBetween::finish() {
  parts_->release(nullptr, false);
}

const LightBetweenReport& LightBetween::report() const {
  return parts_->report;
}

}  // namespace touchstone::sim
