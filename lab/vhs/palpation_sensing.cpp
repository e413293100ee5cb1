#include "lab/vhs/palpation_sensing.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/units.h"
#include "datasets/jobs/job.h"
#include "sensors/beads/bead_filter.h"
#include "sensors/beads/stiffness_training.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kFriction = 0.5;
constexpr double kSkinAlbedo = 0.5;  // skin in white light: 0.3 to 0.6
constexpr int kRestFrames = 12;      // of a waveform, that its rest is the mean of
constexpr std::int64_t kInterval_us = 1663;

std::vector<Eigen::Vector2d> in_pairs(const Eigen::VectorXd& pixels) {
  std::vector<Eigen::Vector2d> pairs;
  for (Eigen::Index k = 0; k + 1 < pixels.size(); k += 2) pairs.emplace_back(pixels[k], pixels[k + 1]);
  return pairs;
}

/// The lump as an object of a scene.
sim::ObjectSpec lump_object(const PalpationSpec& spec, const sim::ObjectSpec& probe, bool lit) {
  sim::ObjectSpec object;
  object.name = "lump";
  object.shape.type = sim::ShapeKind::sphere;
  object.shape.radius_mm = spec.lump.sphere_radius_mm;
  if (lit) {
    object.radiance = probe.radiance;
    object.screen = probe.screen;
  } else {
    object.albedo = kSkinAlbedo;
  }
  object.friction = kFriction;
  object.elastic.emplace();
  object.elastic->youngs_modulus_MPa = spec.skin.youngs_modulus_MPa;
  object.elastic->poisson_ratio = spec.lump.poisson_ratio;
  object.elastic->mesh_mm = spec.lump.mesh_mm;
  return object;
}

}  // namespace

sensors::StiffnessForceModel train_on_true_beads(const std::filesystem::path& scenes,
                                                 const std::filesystem::path& cache, const Progress& progress) {
  const datasets::Job job = datasets::read_job(scenes / "jobs" / "vhs-demo.yaml");
  sensors::ForceSamples samples;
  samples.grid = 3;
  for (const datasets::JobScene& one : job.scenes) {
    if (one.split != datasets::Split::train) continue;
    sim::SceneSpec scene = sim::read_scene(one.scene);
    if (one.start_mm) scene.motion.start_mm = *one.start_mm;
    scene.outputs.frames = false;
    const auto gel = sim::set_up_gel(scene.device, cache, progress);
    for (const sim::Truth& truth : sim::play_motion(scene, sim::make_plan(scene), *gel, progress)) {
      const auto seen = in_pairs(bead_pixels(scene.device, truth.press.bead_displacement));
      if (samples.rest.empty()) {
        samples.rest =
            in_pairs(bead_pixels(scene.device, Eigen::MatrixX3d::Zero(truth.press.bead_displacement.rows(), 3)));
      }
      samples.positions.push_back(seen);
      samples.forces.emplace_back(truth.press.wrench.head<3>());
    }
  }
  return sensors::train(samples, sensors::TrainingSettings::as_published()).model;
}

BeadNoise measure_bead_noise(const PalpationSpec& spec, const std::filesystem::path& scenes,
                             const sensors::StiffnessForceModel& model, const BeadNoiseSettings& settings,
                             const std::filesystem::path& cache, const Progress& progress) {
  TS_ASSERT(settings.repeats > 1 && !settings.depths_mm.empty());
  sim::SceneSpec scene = sim::read_scene(scenes / "vhs" / "cycle.yaml");
  scene.object = lump_object(spec, scene.object, settings.lit);
  scene.seed = settings.seed;
  scene.motion = {};
  scene.effects.motion_blur = sim::Switch::off;  // states at rest
  scene.outputs.frames = false;
  scene.outputs.radiance = true;
  const double radius = spec.lump.sphere_radius_mm;
  scene.motion.start_mm = {0.0, 0.0, radius + 0.05};
  for (const double depth : settings.depths_mm) {
    sim::MotionKey key;
    key.frames = 1;
    key.z = sim::AxisKey{.position_mm = radius - depth, .force_N = {}};
    scene.motion.keys.push_back(key);
  }
  const PalpationMaterial& material = spec.materials.at(static_cast<std::size_t>(settings.material));
  const auto gel = sim::set_up_gel(scene.device, cache, progress);
  const double ratio = material.youngs_modulus_MPa / spec.skin.youngs_modulus_MPa;
  const auto piece = sim::set_up_lump(spec.lump, ratio, cache);
  const sim::Plan plan = sim::make_plan(scene);
  const std::vector<sim::Truth> truths = sim::play_motion(
      scene, plan, *gel, progress, nullptr, {sim::as_pressing_body(spec.lump, *piece, spec.skin.youngs_modulus_MPa)});
  const sim::VirtualCamera camera(scene, plan, *gel, truths);

  sensors::BeadTracker tracker({});
  BeadNoise noise;
  std::int64_t t_us = 0;
  int frame = 0;
  double squares = 0.0, biases = 0.0;
  std::int64_t scattered = 0, states = 0;
  Eigen::VectorXd rest;
  const render::Imager imager = sim::imager(scene.device, plan.bands, true);
  for (std::size_t k = 0; k < truths.size(); ++k) {
    const cv::Mat light = camera.capture(truths[k]).radiance;
    std::vector<Eigen::VectorXd> seen;
    for (int i = 0; i < settings.repeats; ++i, ++frame) {
      const cv::Mat raw = render::expose(light, imager, settings.seed, static_cast<std::uint64_t>(frame));
      const sensors::TrackedBeads& beads = tracker.track({render::develop(raw, imager), t_us += kInterval_us});
      ++noise.frames;
      noise.lost += static_cast<int>(beads.positions.size()) - beads.found();
      Eigen::VectorXd measured(2 * static_cast<Eigen::Index>(beads.measured.size()));
      for (std::size_t b = 0; b < beads.measured.size(); ++b) {
        measured.segment<2>(2 * static_cast<Eigen::Index>(b)) = beads.measured[b];
      }
      seen.push_back(measured);
    }
    if (progress)
      progress("palpation, pictures", static_cast<std::int64_t>(k) + 1, static_cast<std::int64_t>(truths.size()));
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(seen.front().size());
    for (const Eigen::VectorXd& one : seen) mean += one / settings.repeats;
    for (const Eigen::VectorXd& one : seen) squares += (one - mean).squaredNorm();
    scattered += static_cast<std::int64_t>(mean.size()) * (settings.repeats - 1);
    const Eigen::VectorXd truly = bead_pixels(scene.device, truths[k].press.bead_displacement);
    if (rest.size() == 0) {
      rest = mean - truly;
      noise.rest_px = mean;
      continue;
    }
    const Eigen::VectorXd bias = mean - truly - rest;
    biases += bias.squaredNorm();
    states += bias.size();
    const auto rest_seen = in_pairs(noise.rest_px);
    const auto rest_true = in_pairs(noise.rest_px - rest);
    const double measured_N = sensors::estimate_force(model, in_pairs(mean), rest_seen).z();
    const double model_N = sensors::estimate_force(model, in_pairs(truly), rest_true).z();
    noise.force_N.push_back(truths[k].press.wrench[2]);
    noise.model_N.push_back(model_N);
    noise.measured_N.push_back(measured_N);
  }
  noise.noise_px = std::sqrt(squares / static_cast<double>(scattered));
  noise.bias_px = std::sqrt(biases / static_cast<double>(states));
  return noise;
}

std::vector<double> reference_waveform(const PalpationReference& reference, const PalpationRun& run, std::uint64_t seed,
                                       std::uint64_t index) {
  RandomStream random(seed, index, Purpose::kForceSensor);
  std::vector<double> forces;
  for (std::int64_t i = 0;; ++i) {
    const auto at = static_cast<std::size_t>(std::lround(static_cast<double>(i) / (reference.rate_Hz * run.step_s)));
    if (at >= run.force_N.size()) return forces;
    const double digits = run.force_N[at] * reference.digits_per_N + reference.noise_digits * random.normal();
    forces.push_back(std::round(digits) / reference.digits_per_N);
  }
}

std::vector<double> vhs_waveform(const VhsChain& chain, const PalpationLaw& law, const PalpationRun& run,
                                 std::uint64_t seed, std::uint64_t index) {
  RandomStream random(seed, index, Purpose::kImagerNoise);
  const std::size_t beads = chain.model.rest.size();
  TS_ASSERT(law.bead_px.front().size() == static_cast<Eigen::Index>(2 * beads));
  const double interval = 1.0 / chain.frame_rate_Hz;
  std::vector<sensors::BeadFilter> filters(beads);
  std::vector<Eigen::Vector2d> rest(beads, Eigen::Vector2d::Zero());
  std::vector<Eigen::Vector2d> seen(beads);
  std::vector<double> forces;
  std::vector<std::vector<Eigen::Vector2d>> all;
  for (std::int64_t frame = 0;; ++frame) {
    const double begin = static_cast<double>(frame) * interval;
    const auto first = static_cast<std::size_t>(std::lround(begin / run.step_s));
    const auto last = static_cast<std::size_t>(std::lround((begin + chain.exposure_s) / run.step_s));
    if (last > run.depth_mm.size()) break;
    // The blurred image's centroid is the mean over the exposure.
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(2 * beads));
    for (std::size_t k = first; k < last; ++k) moved += law.beads(std::clamp(run.depth_mm[k], 0.0, law.deepest_mm()));
    moved /= static_cast<double>(last - first);
    for (std::size_t b = 0; b < beads; ++b) {
      const Eigen::Vector2d error = chain.noise_px * normal_pair(random);
      const Eigen::Vector2d measured = chain.model.rest[b] + moved.segment<2>(static_cast<Eigen::Index>(2 * b)) + error;
      if (!chain.filtered) {
        seen[b] = measured;
      } else if (frame == 0) {
        filters[b].start(chain.filter, measured);
      } else {
        filters[b].predict(chain.filter, interval);
        filters[b].correct(chain.filter, measured);
      }
      if (chain.filtered) seen[b] = filters[b].position;
    }
    if (frame < kRestFrames) {
      for (std::size_t b = 0; b < beads; ++b) rest[b] += seen[b] / kRestFrames;
    }
    all.push_back(seen);
  }
  for (const auto& positions : all) forces.push_back(sensors::estimate_force(chain.model, positions, rest).z());
  return forces;
}

}  // namespace touchstone::lab
