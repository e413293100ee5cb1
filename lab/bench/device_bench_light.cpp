// What pictures cost.

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/seconds_since.h"
#include "lab/bench/device_bench_parts.h"
#include "sim/plan/plan.h"
#include "sim/plan/plan_direct.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPlenty = 4096;  // paths a pixel: enough for the noise that is asked for to decide
constexpr std::array kNoiseFractions = {8.0, 4.0, 2.0, 1.0, 0.5};  // of the wanted pixel error
constexpr double kReferenceShare =
    0.35;  // of the wanted pixel error: the least error that is to be distinguished from zero
constexpr double kNoisiestReference = 4.0;    // of the imager's noise
constexpr double kMostReferenceSeconds = 20;  // for the pictures of one scene; there are some twenty
constexpr double kWithFewReferences = 4.0;    // times as many seconds where one reference is all there is
constexpr int kPilotPaths = 8;
constexpr double kLeastUnsaturated = 0.5;  // of a picture's pixels: those below their full well
constexpr double kEnough = 0.7;  // of the wanted error: what is better costs a multiple, and nobody asked for it
constexpr std::array kSamples = {1, 4, 16, 64, 256};
constexpr std::array kBandCounts = {1, 3, 8, 16};
constexpr std::array kPixelsAnEdge = {2.5, 5.0, 10.0};
constexpr double kFinestPixelsAnEdge = 20.0;

std::int64_t pictures_of(const SceneRun& run) {
  return static_cast<std::int64_t>(run.electrons.size());
}

void add_run(const SceneRun& run, BenchPoint& point) {
  point.once_s = run.camera_seconds;
  point.each_s = run.picture_seconds;
  point.work = static_cast<double>(run.paths) / static_cast<double>(pictures_of(run) * run.electrons.front().total());
}

/// The settings of light that this device's scenes can be shown by.
std::vector<LightSetting> settings_of_light(const BenchParts& parts) {
  const sim::SceneSpec scene = bench_scene(parts.device, parts.presses, parts.presses.specs.front(), 1);
  std::vector<LightSetting> tries;
  using sim::Switch;
  const auto add = [&](const std::string& words, Switch direct, Switch shared, double noise_fraction, bool exact,
                       bool adaptive_paths = false) {
    LightSetting one;
    one.words = words;
    one.adaptive_paths = adaptive_paths;
    if (exact) {
      one.effects = parts.exact;
      one.words += parts.exact_words;
    }
    one.effects.direct_light = direct;
    one.effects.shared_paths = shared;
    one.light.noise_fraction = noise_fraction;
    one.light.max_samples = kPlenty;
    sim::SceneSpec tried = scene;
    tried.effects = one.effects;
    tried.light = one.light;
    try {
      sim::make_plan(tried);
    } catch (const Error&) {
      return;  // this device has no such light
    }
    tries.push_back(one);
  };
  tries.emplace_back().words = "as the plan decides";
  for (const bool exact : {false, true}) {
    if (exact && parts.exact_words.empty()) continue;  // the same once more
    add("direct light", Switch::on, Switch::off, 1.0, exact);
    for (const double noise : {1.0, 0.5}) {
      add(fmt::format("shared paths to {:.3g} of the imager's noise", noise), Switch::off, Switch::on, noise, exact);
    }
  }
  for (const double fraction : kNoiseFractions) {
    const double noise = fraction * parts.settings.pixel_error;
    add(paths_in_words(noise), Switch::off, Switch::off, noise, true, true);
  }
  return tries;
}

BenchCurve light_curve(const BenchParts& parts, const TruePictures& truth, std::vector<LightSetting>& tries,
                       const Progress& progress) {
  BenchCurve curve;
  curve.name = "light";
  curve.what =
      "Ways to make the pictures, on the device's own mesh, against paths traced twice. A picture's own noise of paths "
      "counts as its error.";
  curve.once = "a scene's camera, s";
  curve.each = "a picture, s";
  curve.work = "paths a pixel";
  tries = settings_of_light(parts);
  std::int64_t done = 0;
  bool enough = false;
  double last_s = 0.0;  // of paths; half of the noise takes four times as much
  for (LightSetting& one : tries) {
    if (enough && one.adaptive_paths) continue;
    if (one.adaptive_paths && 4.0 * last_s > kMostSeconds) {
      BenchPoint left_out;
      left_out.setting = one.words;
      left_out.note = fmt::format("left out: it would take some {:.0f} s", 4.0 * last_s);
      curve.points.push_back(left_out);
      break;
    }
    if (progress) progress("light", done, static_cast<std::int64_t>(tries.size()));
    ++done;
    BenchPoint point;
    one = try_light(parts, truth, parts.device, parts.own_gel, std::move(one), parts.settings.seed + 2, point);
    point.as_is = done == 1;
    if (!point.as_is && std::isfinite(point.pixel_error)) point.note.clear();  // it says the same once more
    curve.points.push_back(point);
    if (one.adaptive_paths)
      last_s = one.once_s + static_cast<double>(parts.truth->runs[0].electrons.size()) * one.each_s;
    enough = enough || (one.adaptive_paths && one.pixel_error < kEnough * parts.settings.pixel_error);
  }
  return curve;
}

BenchCurve samples_curve(const BenchParts& parts, const TruePictures& truth, const Progress& progress) {
  BenchCurve curve;
  curve.name = "samples";
  curve.what =
      "Paths a pixel, the same number in every pixel: beside the curve of light it shows what it saves to stop where "
      "the imager's noise is reached.";
  curve.each = "a picture, s";
  curve.work = "paths a pixel";
  for (const int samples : kSamples) {
    if (progress) progress("samples", static_cast<std::int64_t>(curve.points.size()), kSamples.size());
    BenchPoint point;
    point.setting = fmt::format("{} paths a pixel", samples);
    point.value = samples;
    sim::SceneSpec scene = reference_scene(parts, parts.device, truth.spec, parts.settings.seed + 3);
    scene.light.min_samples = scene.light.max_samples = samples;
    const SceneRun run = run_scene(scene, parts.own_gel, true);
    add_run(run, point);
    point.once_s = kUnknown;  // key frames, which whole pictures don't use
    point.pixel_error = pixel_error(run, truth.runs, truth.imager);
    point.pixel_worst = worst_pixel(run.electrons, truth.runs[0].electrons, truth.runs[1].electrons, truth.imager);
    curve.points.push_back(point);
    const double took_s = static_cast<double>(run.electrons.size()) * run.picture_seconds;
    if (point.pixel_error < kEnough * parts.settings.pixel_error || 4.0 * took_s > kMostSeconds) break;
  }
  return curve;
}

/// A reference's scene; what is held beside it may have the scene's own seed.
TruePictures render_truth(sim::SceneSpec scene, const fem::Compliance& gel, const sim::PressSpec& spec) {
  scene.seed += 2 * kOtherSeed;
  return {spec, run_twice(scene, gel, true), sim::imager(scene.device, sim::make_plan(scene).bands, true)};
}

/// A setting whose error is to be free of the paths' noise: it's shown twice.
BenchPoint noise_free_point(const BenchParts& parts, const TruePictures& truth, const sim::SceneSpec& scene) {
  BenchPoint point;
  try {
    const TwoRuns runs = run_twice(scene, parts.own_gel, true);
    add_run(runs[0], point);
    point.once_s = kUnknown;
    point.each_s = 0.5 * (runs[0].picture_seconds + runs[1].picture_seconds);
    point.pixel_error = pixel_error(runs, truth.runs, truth.imager);
  } catch (const Error& error) {
    point.note = error.what();
  }
  return point;
}

BenchCurve bands_curve(const BenchParts& parts, const Progress& progress) {
  BenchCurve curve;
  curve.name = "bands";
  curve.each = "a picture, s";
  curve.work = "paths a pixel";
  sim::DeviceSpec device = parts.device;
  const sim::BandsSpec own = *device.bands;
  curve.what =
      fmt::format("Bands of wavelength between {:.4g} and {:.4g} nm, free of the paths' noise, against {} of them.",
                  own.from_nm, own.to_nm, kBandCounts.back());
  const sim::PressSpec& spec = parts.presses.specs.front();
  const int planned = sim::make_plan(bench_scene(device, parts.presses, spec, 1)).bands.count();
  device.bands->count = kBandCounts.back();
  const TruePictures truth = true_pictures(parts, device, parts.own_gel, spec, parts.settings.seed + 40);
  for (const int count : kBandCounts) {
    if (progress) progress("bands", static_cast<std::int64_t>(curve.points.size()), kBandCounts.size());
    device.bands->count = count;
    BenchPoint point;
    if (count == kBandCounts.back()) {
      add_run(truth.runs[0], point);
      point.once_s = kUnknown;
      point.pixel_error = 0.0;
      point.note = "the reference";
    } else {
      point = noise_free_point(parts, truth, reference_scene(parts, device, spec, parts.settings.seed + 50));
    }
    point.setting = count == 1 ? "1 band" : fmt::format("{} bands", count);
    point.value = count;
    point.as_is = count == planned;
    curve.points.push_back(point);
  }
  return curve;
}

BenchCurve membrane_curve(const BenchParts& parts, const sim::Plan& plan, const Progress& progress) {
  BenchCurve curve;
  curve.name = "contact pixels";
  curve.what = fmt::format(
      "Pixels of the fine contact, which gives what is seen its shape, free of the paths' noise, against pixels of "
      "{:.3g} um.",
      1e3 * parts.device.mesh.fine_mm / kFinestPixelsAnEdge);
  curve.each = "mechanics and a picture, s";
  curve.work = "paths a pixel";
  const sim::PressSpec& spec = parts.presses.specs.front();
  sim::SceneSpec scene = reference_scene(parts, parts.device, spec, parts.settings.seed + 60);
  const auto pixel_um = [&](double an_edge) { return 1e3 * parts.device.mesh.fine_mm / an_edge; };
  scene.membrane.pixel_um = pixel_um(kFinestPixelsAnEdge);
  const TruePictures truth = render_truth(scene, parts.own_gel, spec);
  for (const double an_edge : kPixelsAnEdge) {
    if (progress) progress("contact pixels", static_cast<std::int64_t>(curve.points.size()), kPixelsAnEdge.size());
    scene.membrane.pixel_um = pixel_um(an_edge);
    BenchPoint point = noise_free_point(parts, truth, scene);
    point.setting = fmt::format("membrane.pixel_um {:.3g}", scene.membrane.pixel_um);
    point.value = scene.membrane.pixel_um;
    point.as_is = plan.fine_relief && std::abs(1e3 * plan.relief_pixel_mm - point.value) < 1e-6 * point.value;
    curve.points.push_back(point);
  }
  return curve;
}

/// What the plan leaves out of pictures because it shows little: the reference has it.
void find_exact_effects(BenchParts& parts) {
  sim::SceneSpec scene = bench_scene(parts.device, parts.presses, parts.presses.specs.front(), 1);
  const sim::Plan plan = sim::make_plan(scene);
  std::vector<std::string> left_out;
  for (const sim::SwitchedEffect& one : sim::kSeenEffects) {
    sim::SceneSpec with = scene;
    with.effects.*one.of = sim::Switch::on;
    try {
      if (!(sim::make_plan(with).*one.planned)) continue;
    } catch (const Error&) {
      continue;  // this device has none
    }
    scene = with;
    if (!(plan.*one.planned)) left_out.emplace_back(one.name);
  }
  parts.exact = scene.effects;
  for (std::size_t k = 0; k < left_out.size(); ++k) {
    parts.exact_words += k == 0 ? ", with " : k + 1 == left_out.size() ? " and " : ", ";
    parts.exact_words += left_out[k];
  }
}

}  // namespace

std::string paths_in_words(double noise_fraction) {
  return fmt::format("paths to {:.3g} of the imager's noise", noise_fraction);
}

LightSetting try_light(const BenchParts& parts, const TruePictures& truth, const sim::DeviceSpec& device,
                       const fem::Compliance& gel, LightSetting one, std::uint64_t seed, BenchPoint& point) {
  point.setting = one.words;
  point.series = one.adaptive_paths ? "paths" : one.words;
  point.value = one.adaptive_paths ? *one.light.noise_fraction : kUnknown;
  try {
    sim::SceneSpec scene = bench_scene(device, parts.presses, truth.spec, seed);
    scene.light = one.light;
    scene.effects = one.effects;
    scene.accuracy = one.accuracy;
    const SceneRun run = run_scene(scene, gel);
    add_run(run, point);
    point.pixel_error = pixel_error(run, truth.runs, truth.imager);
    point.pixel_worst = worst_pixel(run.electrons, truth.runs[0].electrons, truth.runs[1].electrons, truth.imager);
    point.note = run.light;
    one.pixel_error = point.pixel_error;
    one.once_s = point.once_s;
    one.each_s = point.each_s;
  } catch (const Error& error) {
    point.note = error.what();
  }
  return one;
}

sim::SceneSpec reference_scene(const BenchParts& parts, const sim::DeviceSpec& device, const sim::PressSpec& spec,
                               std::uint64_t seed) {
  sim::SceneSpec scene = bench_scene(device, parts.presses, spec, seed);
  scene.effects = parts.exact;
  scene.effects.direct_light = sim::Switch::off;
  scene.effects.shared_paths = sim::Switch::off;
  // The same number in all pixels: where sampling stops by what was sampled, it favours what happened to be dark.
  scene.light.min_samples = scene.light.max_samples = parts.reference_paths;
  return scene;
}

TruePictures true_pictures(const BenchParts& parts, const sim::DeviceSpec& device, const fem::Compliance& gel,
                           const sim::PressSpec& spec, std::uint64_t seed) {
  return render_truth(reference_scene(parts, device, spec, seed), gel, spec);
}

namespace {

/// What pictures are compared, for people.
std::string pictures_in_words(const BenchParts& parts, const std::string& saturated) {
  const sim::CameraSpec& camera = *parts.device.camera;
  const sim::CameraSpec& whole = *parts.whole_device.camera;
  std::string words = fmt::format("{} x {} pixels", camera.width, camera.height);
  if (camera.width != whole.width || camera.height != whole.height) {
    words += fmt::format(" out of the middle of {} x {}", whole.width, whole.height);
  }
  return words +
         fmt::format(
             ", of a pressed and a dragged state; {} paths a pixel for the reference{}, so that errors under {:.2g} "
             "can't be distinguished from zero",
             parts.reference_paths, parts.exact_words, parts.least_pixel_error) +
         saturated;
}

}  // namespace

std::string prepare_pictures(BenchParts& parts) {
  if (!parts.device.camera) return "none: the device has no camera";
  const sim::PressSpec& spec = parts.presses.specs.front();
  std::string saturated;
  try {
    find_exact_effects(parts);
    parts.reference_paths = kPilotPaths;
    const TruePictures pilot = true_pictures(parts, parts.device, parts.own_gel, spec, parts.settings.seed + 10);
    // Each against the other as if that were true: half of the squares are either one's.
    const double noise = pixel_error(pilot.runs[0], {pilot.runs[1], pilot.runs[1]}, pilot.imager) / std::sqrt(2.0);
    const double unsaturated_part = part_below_full_well(pilot.runs, pilot.imager);
    if (unsaturated_part < kLeastUnsaturated) {
      return fmt::format(
          "none: {:.3g} % of the pixels are at their full well; a shorter camera.exposure_us separates them",
          100.0 * (1.0 - unsaturated_part));
    }
    if (unsaturated_part < 1.0)
      saturated = fmt::format("; {:.2g} % are at their full well and left out", 100.0 * (1.0 - unsaturated_part));
    const cv::Mat& picture = pilot.runs[0].electrons.front();
    const double values =
        unsaturated_part * static_cast<double>(pilot.runs[0].electrons.size() * picture.total()) * picture.channels();
    // A reference's noise is left in a mean over N values by its square over sqrt(N).
    const double left = std::pow(values, -0.25);
    const double least = kReferenceShare * parts.settings.pixel_error;
    const double wanted = std::pow(noise / std::min(kNoisiestReference, least / left), 2);
    const double seconds = static_cast<double>(pictures_of(pilot.runs[0])) * pilot.runs[0].picture_seconds;
    const bool once = parts.settings.planned_alone;
    const double afforded = (once ? kWithFewReferences : 1.0) * kMostReferenceSeconds / seconds;
    const double times = std::clamp(std::min(wanted, afforded), 1.0, static_cast<double>(kPlenty) / kPilotPaths);
    parts.reference_paths = static_cast<int>(std::ceil(kPilotPaths * times));
    parts.least_pixel_error = std::max(least, noise * left / std::sqrt(times));
    if (once) {  // planned_bench has presses of its own
      parts.truth = pilot;
      return pictures_in_words(parts, saturated);
    }
    parts.truth = true_pictures(parts, parts.finest_device, parts.finest_gel, spec, parts.settings.seed);
    parts.own_truth = true_pictures(parts, parts.device, parts.own_gel, spec, parts.settings.seed + 30);
  } catch (const Error& error) {
    return fmt::format("none: {}", error.what());
  }
  return pictures_in_words(parts, saturated);
}

double mesh_pixel_error(const BenchParts& parts, const sim::DeviceSpec& device, const fem::Compliance& gel) {
  const TruePictures& truth = *parts.truth;
  return pixel_error(true_pictures(parts, device, gel, truth.spec, parts.settings.seed + 20).runs, truth.runs,
                     truth.imager);
}

std::vector<BenchCurve> light_curves(const BenchParts& parts, std::vector<LightSetting>& tries,
                                     const Progress& progress) {
  std::vector<BenchCurve> curves;
  if (parts.truth) {
    const sim::PressSpec& spec = parts.presses.specs.front();
    curves.push_back(light_curve(parts, *parts.own_truth, tries, progress));
    curves.push_back(samples_curve(parts, *parts.own_truth, progress));
    if (parts.device.bands) curves.push_back(bands_curve(parts, progress));
    const sim::Plan plan = sim::make_plan(bench_scene(parts.device, parts.presses, spec, 1));
    if (parts.exact.fine_relief == sim::Switch::on) curves.push_back(membrane_curve(parts, plan, progress));
  }
  if (parts.device.camera && parts.device.camera->events) curves.push_back(events_curve(parts, progress));
  return curves;
}

}  // namespace touchstone::lab
