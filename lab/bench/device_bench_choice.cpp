// The cheapest setting for the wanted errors: found among what was measured, refined, then held against presses that it
// wasn't chosen by.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "lab/bench/device_bench_parts.h"

namespace touchstone::lab {
namespace {

constexpr double kFrames = 100.0;   // of a scene, that a camera's set-up is shared by
constexpr double kMeshShare = 0.5;  // of the squared pixel error that a mesh may take at most, where light has noise
constexpr double kFiner = 0.8;      // edges, where a choice didn't hold
constexpr double kMoreExact = 0.7;  // of the noise of paths, likewise
constexpr double kOverReference = 1.25;  // of the finest mesh that is tried, times the reference's edges
constexpr double kBelow = 0.97;          // of a wanted error: where to aim
constexpr double kAboutAsGood = 1.1;     // times the best error
constexpr int kMostVerifications = 3;
constexpr int kVerifyingPresses = 6;
constexpr double kMostWholeSeconds = 40.0;

double frame_seconds(const LightSetting& one) {
  return one.each_s + one.once_s / kFrames;
}

struct MeshPick {
  double edges = 0.0;  ///< times the device's
  BenchPoint point;
};

bool meets(const BenchPoint& point, double force_error, double pixel_error) {
  return point.force_error <= force_error && (std::isnan(point.pixel_error) || point.pixel_error <= pixel_error);
}

/// The coarsest mesh that holds, then halfway to the next coarser one. Where none does, `mesh` gets finer ones, as near
/// to the reference as it can still judge.
std::optional<MeshPick> pick_mesh(const BenchParts& parts, BenchCurve& mesh) {
  const double wanted_force = parts.settings.force_error;
  const double wanted_pixel = parts.settings.pixel_error * std::sqrt(kMeshShare);
  const double own = parts.device.mesh.fine_mm;
  HoldingMesh found = coarsest_holding(mesh, wanted_force, wanted_pixel);
  while (found.holds == nullptr) {
    const BenchPoint* finest = found.coarser;  // of those that could be had
    if (finest == nullptr || kFiner * finest->value < kOverReference * parts.finest_device.mesh.fine_mm) break;
    BenchPoint finer = mesh_point(parts, kFiner * finest->value / own);
    const bool had = std::isfinite(finer.force_error);
    mesh.points.push_back(std::move(finer));
    if (!had) break;
    found = coarsest_holding(mesh, wanted_force, wanted_pixel);
  }
  if (found.holds == nullptr) return std::nullopt;
  MeshPick best{found.holds->value / own, *found.holds};
  if (found.coarser != nullptr) {
    const double between = std::sqrt(best.edges * found.coarser->value / own);
    const BenchPoint point = mesh_point(parts, between);
    if (meets(point, wanted_force, wanted_pixel)) best = MeshPick{between, point};
  }
  return best;
}

/// The cheapest setting of light within an error; of paths also one between those that were tried.
std::optional<LightSetting> pick_light(const BenchParts& parts, const std::vector<LightSetting>& tries, double wanted) {
  std::optional<LightSetting> best;
  const LightSetting* coarser = nullptr;  // paths with more noise than wanted, the least of them
  const LightSetting* holds = nullptr;
  for (const LightSetting& one : tries) {
    if (!std::isfinite(one.pixel_error)) continue;
    if (one.pixel_error <= wanted) {
      if (!best || frame_seconds(one) < frame_seconds(*best)) best = one;
      if (one.adaptive_paths && (holds == nullptr || one.pixel_error > holds->pixel_error)) holds = &one;
    } else if (one.adaptive_paths && (coarser == nullptr || one.pixel_error < coarser->pixel_error)) {
      coarser = &one;
    }
  }
  if (best && best->adaptive_paths && holds != nullptr && coarser != nullptr) {
    // Between two that were measured the error goes as a power of the noise that is asked for. What is too small to be
    // distinguished from zero is taken for as large as it may be.
    const double measured = std::max(holds->pixel_error, parts.least_pixel_error);
    const double slope = std::log(coarser->pixel_error / measured) /
                         std::log(*coarser->light.noise_fraction / *holds->light.noise_fraction);
    LightSetting between = *holds;
    *between.light.noise_fraction *= std::pow(kBelow * wanted / measured, 1.0 / std::max(slope, 0.1));
    if (*between.light.noise_fraction > 1.05 * *holds->light.noise_fraction &&
        *between.light.noise_fraction < *coarser->light.noise_fraction) {
      between.words = paths_in_words(*between.light.noise_fraction) + parts.exact_words;
      BenchPoint point;
      between =
          try_light(parts, *parts.own_truth, parts.device, parts.own_gel, between, parts.settings.seed + 4, point);
      if (between.pixel_error <= wanted && frame_seconds(between) < frame_seconds(*best)) best = between;
    }
  }
  return best;
}

/// The cheapest of those that are about as good as the best. Nothing if none could be had.
std::optional<LightSetting> next_best(const std::vector<LightSetting>& tries) {
  double least = std::numeric_limits<double>::infinity();
  for (const LightSetting& one : tries) {
    if (one.pixel_error < least) least = one.pixel_error;
  }
  std::optional<LightSetting> best;
  for (const LightSetting& one : tries) {
    if (one.pixel_error <= kAboutAsGood * least && (!best || frame_seconds(one) < frame_seconds(*best))) best = one;
  }
  return best;
}

struct Verified {
  double force = kUnknown, pixel = kUnknown;
  double as_is_force = kUnknown, as_is_pixel = kUnknown;
};

/// The choice and the device as it is on presses that nothing was chosen by.
Verified verify(const BenchParts& parts, const BenchChoice& choice, const LightSetting* light, std::uint64_t seed) {
  const BenchParts other = with_other_presses(parts, seed);
  const sim::DeviceSpec device = with_edges(parts.device, choice.edges);
  const fem::Compliance gel = make_gel(device).gel;
  Verified verified;
  const auto off = [&](const fem::Compliance& one, double edge_mm) {
    return force_difference(solve_presses(other.presses, one, parts.device, edge_mm).force_N,
                            other.finest_forces.force_N);
  };
  verified.force = off(gel, device.mesh.fine_mm);
  verified.as_is_force = off(parts.own_gel, parts.device.mesh.fine_mm);
  if (!parts.truth) return verified;
  const TruePictures truth =
      true_pictures(other, parts.finest_device, parts.finest_gel, other.presses.specs.front(), seed);
  BenchPoint ignored;
  if (light != nullptr) verified.pixel = try_light(other, truth, device, gel, *light, seed + 7, ignored).pixel_error;
  verified.as_is_pixel = try_light(other, truth, parts.device, parts.own_gel, {}, seed + 8, ignored).pixel_error;
  return verified;
}

}  // namespace

BenchParts with_other_presses(const BenchParts& parts, std::uint64_t seed) {
  BenchParts other = parts;
  other.presses.specs = bench_presses(kVerifyingPresses, parts.whole_device.mesh.fine_mm, parts.depth_mm, seed);
  other.finest_forces = solve_presses(other.presses, parts.finest_gel, parts.device, parts.finest_device.mesh.fine_mm);
  return other;
}

WholeSeconds whole_seconds(const BenchParts& parts, double edges, const LightSetting& light) {
  WholeSeconds seconds;
  double times = 1.0;
  if (parts.truth) {
    const sim::CameraSpec& whole = *parts.whole_device.camera;
    const sim::CameraSpec& middle = *parts.device.camera;
    times = static_cast<double>(whole.width) * whole.height / (static_cast<double>(middle.width) * middle.height);
    const auto pictures = static_cast<double>(parts.truth->runs[0].electrons.size());
    sim::SceneSpec scene = bench_scene(parts.whole_device, parts.presses, parts.presses.specs.front(), 1);
    scene.effects = light.effects;
    scene.accuracy = light.accuracy;
    // Where pixels share their light a whole picture takes far less than the middle says, which has the contact's edge.
    seconds.by_middle = !sim::make_plan(scene).shared_paths && pictures * times * light.each_s > kMostWholeSeconds;
  }
  const sim::DeviceSpec device = with_edges(seconds.by_middle ? parts.device : parts.whole_device, edges);
  const MadeGel made = make_gel(device);
  sim::SceneSpec scene = bench_scene(device, parts.presses, parts.presses.specs.front(), parts.settings.seed + 5);
  if (!parts.truth) scene.outputs = {.frames = false};
  scene.light = light.light;
  scene.effects = light.effects;
  scene.accuracy = light.accuracy;
  const SceneRun run = run_scene(scene, made.gel);
  seconds.once = made.seconds + run.camera_seconds;
  seconds.frame = run.mechanics_seconds + (seconds.by_middle ? times : 1.0) * run.picture_seconds;
  return seconds;
}

HoldingMesh coarsest_holding(const BenchCurve& mesh, double force_error, double pixel_error) {
  std::vector<const BenchPoint*> by_edge;
  for (const BenchPoint& point : mesh.points) {
    if (std::isfinite(point.force_error)) by_edge.push_back(&point);
  }
  std::sort(by_edge.begin(), by_edge.end(), [](const auto* a, const auto* b) { return a->value < b->value; });
  HoldingMesh found;
  for (const BenchPoint* point : by_edge) {
    if (!meets(*point, force_error, pixel_error)) {
      found.coarser = point;
      break;
    }
    found.holds = point;
  }
  return found;
}

BenchChoice cheapest_choice(const BenchParts& parts, BenchCurve& mesh, const std::vector<LightSetting>& tries,
                            const Progress& progress) {
  const auto tell = [&](int step) {
    if (progress) progress("the cheapest setting", step, 4);
  };
  tell(0);
  BenchChoice choice;
  std::optional<MeshPick> picked = pick_mesh(parts, mesh);
  if (!picked) {
    const auto least = std::min_element(mesh.points.begin(), mesh.points.end(), [](const auto& a, const auto& b) {
      return std::isfinite(a.force_error) && !(a.force_error >= b.force_error);
    });
    choice.remark = fmt::format(
        "No mesh that was tried holds the wanted errors; the best has edges of {:.3g} mm, a force error of {:.2g} %{}.",
        least->value, 100.0 * least->force_error,
        std::isnan(least->pixel_error) ? ""
                                       : fmt::format(" and {:.2g} of the noise in its pixels", least->pixel_error));
    picked = MeshPick{least->value / parts.device.mesh.fine_mm, *least};
  }
  tell(1);
  const auto left_for_light = [&] {
    const double by_mesh = std::isnan(picked->point.pixel_error) ? 0.0 : picked->point.pixel_error;
    return std::sqrt(std::max(0.0, std::pow(parts.settings.pixel_error, 2) - by_mesh * by_mesh));
  };
  std::optional<LightSetting> light;
  if (parts.truth) {
    light = pick_light(parts, tries, left_for_light());
    if (!light) {
      light = next_best(tries);
      choice.remark += fmt::format("{}No setting of light that was tried holds the wanted pixel error; the best is {}.",
                                   choice.remark.empty() ? "" : " ", light ? light->words : "none");
    }
  }
  const bool resolved = parts.least_pixel_error <= parts.settings.pixel_error;
  if (!resolved) {
    choice.remark += fmt::format(
        "{}Pixel errors under {:.2g} of the noise can't be distinguished from zero, as the reference has noise of its "
        "own and "
        "takes long; ask for a larger --pixel-error.",
        choice.remark.empty() ? "" : " ", parts.least_pixel_error);
  }
  for (int round = 0; round < kMostVerifications; ++round) {
    tell(2);
    choice.edges = picked->edges;
    choice.force_error = picked->point.force_error;
    choice.pixel_error =
        light ? std::hypot(light->pixel_error, std::isnan(picked->point.pixel_error) ? 0.0 : picked->point.pixel_error)
              : kUnknown;
    const Verified verified = verify(parts, choice, light ? &*light : nullptr,
                                     parts.settings.seed + 1000 + 10 * static_cast<unsigned>(round));
    choice.verified_force = verified.force;
    choice.verified_pixel = verified.pixel;
    choice.as_is_force = verified.as_is_force;
    choice.as_is_pixel = verified.as_is_pixel;
    const bool force_holds = verified.force <= parts.settings.force_error;
    const bool pixel_holds = !parts.truth || (verified.pixel <= parts.settings.pixel_error && resolved);
    choice.holds = force_holds && pixel_holds;
    if (choice.holds || !choice.remark.empty() || round + 1 == kMostVerifications) break;
    const std::string found =
        fmt::format("edges of {:.3g} mm{}", picked->point.value, light ? " and " + light->words : std::string());
    const bool by_mesh =
        !force_holds || !light || !light->adaptive_paths || picked->point.pixel_error > light->pixel_error;
    if (by_mesh) {
      const MeshPick finer{kFiner * picked->edges, mesh_point(parts, kFiner * picked->edges)};
      if (!std::isfinite(finer.point.force_error)) {
        choice.remark = fmt::format(
            "The mesh that was chosen ({}) doesn't hold on other presses, and a finer one can't be had: {}.",
            picked->point.setting, finer.point.note);
        break;
      }
      picked = finer;
    } else {
      *light->light.noise_fraction *= kMoreExact;
      light->words = paths_in_words(*light->light.noise_fraction) + parts.exact_words;
    }
    choice.remark_rounds.push_back(
        fmt::format("{} didn't hold on other presses ({:.2g} %{})", found, 100.0 * verified.force,
                    parts.truth ? fmt::format(", {:.2g} of the noise", verified.pixel) : ""));
  }
  const sim::DeviceSpec chosen = with_edges(parts.whole_device, choice.edges);
  choice.fine_mm = chosen.mesh.fine_mm;
  choice.coarse_mm = chosen.mesh.coarse_mm;
  if (light) {
    choice.light = light->light;
    choice.effects = light->effects;
    choice.light_words = light->words;
  }
  tell(3);
  const WholeSeconds cheapest = whole_seconds(parts, choice.edges, light.value_or(LightSetting{}));
  const WholeSeconds as_is = whole_seconds(parts, 1.0, tries.empty() ? LightSetting{} : tries.front());
  choice.once_s = cheapest.once;
  choice.frame_s = cheapest.frame;
  choice.as_is_once_s = as_is.once;
  choice.as_is_frame_s = as_is.frame;
  choice.by_middle = cheapest.by_middle || as_is.by_middle;
  return choice;
}

}  // namespace touchstone::lab
