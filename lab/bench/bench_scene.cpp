#include "lab/bench/bench_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <span>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/seconds_since.h"
#include "core/units.h"
#include "render/imager/imager.h"
#include "render/imager/mean_electrons.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kDepthSpread = 0.2;
constexpr double kDrag = 1.0 / 3.0;  // of the depth

using Clock = std::chrono::steady_clock;

constexpr int kBlur = 7;  // pixels

/// Calls act(row, place in the row, the imager's noise there) for each value of pictures of electrons that the imager
/// can tell. The noise is that of a blurred mean, since noise that knew of the paths' would weigh them by what they
/// are; and nothing is cut off at the full well, since the mean of what is cut off isn't the mean cut off.
template <typename Act>
void for_each_value(const cv::Mat& one, const cv::Mat& other, const std::vector<render::ImagerResponse>& responses,
                    const Act& act) {
  TS_ASSERT(one.size() == other.size() && one.channels() == static_cast<int>(responses.size()));
  cv::Mat mean = 0.5 * (one + other);
  cv::blur(mean, mean, {kBlur, kBlur});
  for (int row = 0; row < mean.rows; ++row) {
    const float* level = mean.ptr<float>(row);
    for (int i = 0; i < mean.cols * mean.channels(); ++i) {
      const render::ImagerResponse& response = responses[static_cast<std::size_t>(i % mean.channels())];
      if (level[i] < response.full_well_e) act(row, i, render::noise_e(response, level[i]));
    }
  }
}

}  // namespace

std::vector<sim::PressSpec> bench_presses(int count, double edge_mm, double depth_mm, std::uint64_t seed) {
  std::vector<sim::PressSpec> specs;
  for (int k = 0; k < count; ++k) {
    RandomStream random(seed, static_cast<std::uint64_t>(k), Purpose::kStudy);
    sim::PressSpec spec;
    spec.place_mm = edge_mm * (uniform_pair(random).array() - 0.5).matrix();
    spec.depth_mm = depth_mm * (1.0 + kDepthSpread * (2.0 * random.uniform() - 1.0));
    const double angle = 2.0 * kPi * (k + random.uniform()) / count;
    spec.drag_mm = kDrag * depth_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    specs.push_back(spec);
  }
  return specs;
}

/// One frame down, one aside.
static sim::MotionSpec motion_of(const BenchPresses& presses, const sim::PressSpec& spec) {
  constexpr double kFrameRate_Hz = 30.0;
  sim::MotionSpec motion = sim::press_motion(spec, presses.touch_mm, presses.object.friction, kFrameRate_Hz);
  for (sim::MotionKey& key : motion.keys) key.frames = 1;
  return motion;
}

PressForces solve_presses(const BenchPresses& presses, const fem::Compliance& gel, const sim::DeviceSpec& device,
                          double edge_mm, const fem::PressTolerance& tolerance) {
  const fem::ContactShape shape = sim::coarse_contact_shape(presses.object, edge_mm);
  PressForces found;
  std::vector<Eigen::MatrixX3d> beads;
  double seconds = 0.0;
  for (const sim::PressSpec& spec : presses.specs) {
    const sim::MotionSpec motion = motion_of(presses, spec);
    fem::Press press(gel, shape, presses.object.friction, tolerance, sim::prony_series(device.gel),
                     fem::PressOutput::forces);
    Eigen::Vector3d at = motion.start_mm;
    const auto step_to = [&](const Eigen::Vector3d& place) -> const fem::PressState& {
      fem::PressTarget target;
      for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(place[a]);
      target.seconds = 1.0 / motion.frame_rate_Hz;
      const auto begun = Clock::now();
      const fem::PressState& state = press.step(target);
      seconds += seconds_since(begun);
      found.solves += state.solves;
      return state;
    };
    try {
      step_to(at);
      for (const sim::MotionKey& key : motion.keys) {
        if (key.x) at.x() = key.x->position_mm.value();
        if (key.y) at.y() = key.y->position_mm.value();
        if (key.z) at.z() = key.z->position_mm.value();
        const fem::PressState& state = step_to(at);
        found.force_N.push_back(state.wrench.head<3>());
        for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
          if (state.node_owner[v] >= 0) found.reach_mm = std::max(found.reach_mm, gel.vertices[v].head<2>().norm());
        }
        beads.push_back(state.bead_displacement);
      }
    } catch (const Error& error) {
      fail("{} {:.3g} mm deep at ({:.3g}, {:.3g}) mm: {}", presses.object.name, *spec.depth_mm, spec.place_mm.x(),
           spec.place_mm.y(), error.what());
    }
  }
  found.seconds = seconds / (3.0 * static_cast<double>(presses.specs.size()));
  Eigen::Index rows = 0;
  for (const Eigen::MatrixX3d& one : beads) rows += one.rows();
  found.beads_mm.resize(rows, 3);
  rows = 0;
  for (const Eigen::MatrixX3d& one : beads) {
    found.beads_mm.middleRows(rows, one.rows()) = one;
    rows += one.rows();
  }
  return found;
}

double force_difference(const std::vector<Eigen::Vector3d>& forces, const std::vector<Eigen::Vector3d>& than) {
  TS_ASSERT(forces.size() == than.size() && !forces.empty());
  double sum = 0.0;
  for (std::size_t k = 0; k < forces.size(); ++k) {
    sum += (forces[k] - than[k]).squaredNorm() / than[k].squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(forces.size()));
}

sim::SceneSpec bench_scene(const sim::DeviceSpec& device, const BenchPresses& presses, const sim::PressSpec& spec,
                           std::uint64_t seed) {
  sim::SceneSpec scene;
  scene.device = device;
  scene.object = presses.object;
  scene.motion = motion_of(presses, spec);
  if (device.camera) scene.motion.frame_rate_Hz = device.camera->frame_rate_Hz;
  scene.outputs = {.frames = device.camera.has_value(), .radiance = device.camera.has_value()};
  scene.seed = seed;
  return scene;
}

sim::DeviceSpec middle_of(sim::DeviceSpec device, int most_pixels) {
  sim::CameraSpec& camera = *device.camera;
  const double pixels = static_cast<double>(camera.width) * camera.height;
  if (pixels <= most_pixels) return device;
  const double shrink = std::sqrt(most_pixels / pixels);
  // Even steps on either side keep a mosaic's pattern where it is.
  const auto less = [&](int side) {
    return std::max(4, side - 4 * static_cast<int>(std::ceil(side * (1.0 - shrink) / 4)));
  };
  const int width = less(camera.width);
  const int height = less(camera.height);
  auto* lens = std::get_if<sim::LensSpec>(&camera.optics);
  if (lens && lens->camera_matrix) {
    (*lens->camera_matrix)[2] -= 0.5 * (camera.width - width);
    (*lens->camera_matrix)[3] -= 0.5 * (camera.height - height);
  }
  if (!device.background.empty()) {
    const cv::Rect middle((camera.width - width) / 2, (camera.height - height) / 2, width, height);
    device.background = device.background(middle).clone();
  }
  device.residual.reset();
  camera.width = width;
  camera.height = height;
  return device;
}

SceneRun run_scene(const sim::SceneSpec& scene, const fem::Compliance& gel, bool whole) {
  const sim::Plan plan = sim::make_plan(scene);
  SceneRun run;
  auto begun = Clock::now();
  const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, gel);
  run.mechanics_seconds = seconds_since(begun) / static_cast<double>(truths.size());
  for (std::size_t k = 1; k < truths.size(); ++k) {
    run.force_N.push_back(truths[k].press.wrench.head<3>());
    run.largest_strain = std::max(run.largest_strain, truths[k].press.largest_strain);
  }
  if (!scene.outputs.light()) return run;
  begun = Clock::now();
  const sim::VirtualCamera camera(scene, plan, gel, whole ? std::span<const sim::Truth>() : truths);
  run.camera_seconds = seconds_since(begun);
  const std::vector<render::ImagerResponse> responses =
      render::channel_responses(sim::imager(scene.device, plan.bands, false));
  double seconds = 0.0;
  run.direct = true;
  for (std::size_t k = 1; k < truths.size(); ++k) {
    begun = Clock::now();
    const sim::Capture capture = camera.capture(truths[k]);
    seconds += seconds_since(begun);
    run.paths += capture.paths_traced;
    run.direct = run.direct && capture.direct;
    run.electrons.push_back(render::mean_electrons(capture.radiance, responses));
    run.numbers.push_back(capture.frame);
    run.light = capture.direct ? "direct light" : capture.light.empty() ? "paths" : capture.light;
  }
  run.picture_seconds = seconds / static_cast<double>(truths.size() - 1);
  return run;
}

TwoRuns run_twice(sim::SceneSpec scene, const fem::Compliance& gel, bool whole) {
  TwoRuns runs;
  runs[0] = run_scene(scene, gel, whole);
  scene.seed += kOtherSeed;
  runs[1] = runs[0].direct ? runs[0] : run_scene(scene, gel, whole);
  return runs;
}

double part_below_full_well(const TwoRuns& runs, const render::Imager& imager) {
  const std::vector<render::ImagerResponse> responses = render::channel_responses(imager);
  std::size_t below = 0, all = 0;
  for (std::size_t k = 0; k < runs[0].electrons.size(); ++k) {
    const cv::Mat& one = runs[0].electrons[k];
    for_each_value(one, runs[1].electrons[k], responses, [&](int, int, double) { ++below; });
    all += one.total() * static_cast<std::size_t>(one.channels());
  }
  return static_cast<double>(below) / static_cast<double>(all);
}

double pixel_error(const std::vector<cv::Mat>& one, const std::vector<cv::Mat>& other,
                   const std::vector<cv::Mat>& true_one, const std::vector<cv::Mat>& true_other,
                   const render::Imager& imager) {
  TS_ASSERT(one.size() == true_one.size() && other.size() == true_other.size() && one.size() == other.size());
  const std::vector<render::ImagerResponse> responses = render::channel_responses(imager);
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < one.size(); ++k) {
    for_each_value(true_one[k], true_other[k], responses, [&](int row, int i, double noise) {
      const double first = one[k].ptr<float>(row)[i] - true_one[k].ptr<float>(row)[i];
      const double second = other[k].ptr<float>(row)[i] - true_other[k].ptr<float>(row)[i];
      sum += first * second / (noise * noise);
      ++count;
    });
  }
  return count == 0 ? 0.0 : std::sqrt(std::max(0.0, sum) / static_cast<double>(count));
}

double pixel_error(const TwoRuns& shown, const TwoRuns& truth, const render::Imager& imager) {
  return pixel_error(shown[0].electrons, shown[1].electrons, truth[0].electrons, truth[1].electrons, imager);
}

double pixel_error(const SceneRun& shown, const TwoRuns& truth, const render::Imager& imager) {
  return pixel_error(shown.electrons, shown.electrons, truth[0].electrons, truth[1].electrons, imager);
}

double worst_pixel(const std::vector<cv::Mat>& electrons, const std::vector<cv::Mat>& true_one,
                   const std::vector<cv::Mat>& true_other, const render::Imager& imager) {
  TS_ASSERT(electrons.size() == true_one.size() && electrons.size() == true_other.size());
  const std::vector<render::ImagerResponse> responses = render::channel_responses(imager);
  std::vector<double> differences;
  for (std::size_t k = 0; k < electrons.size(); ++k) {
    for_each_value(true_one[k], true_other[k], responses, [&](int row, int i, double noise) {
      const double wanted = 0.5 * (true_one[k].ptr<float>(row)[i] + true_other[k].ptr<float>(row)[i]);
      differences.push_back(std::abs(electrons[k].ptr<float>(row)[i] - wanted) / noise);
    });
  }
  if (differences.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(differences.size() - 1));
  std::nth_element(differences.begin(), differences.begin() + rank, differences.end());
  return differences[static_cast<std::size_t>(rank)];
}

double number_difference(const std::vector<cv::Mat>& numbers, const std::vector<cv::Mat>& than) {
  TS_ASSERT(numbers.size() == than.size() && !than.empty());
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < than.size(); ++k) {
    const double norm = cv::norm(numbers[k], than[k], cv::NORM_L2);
    sum += norm * norm;
    count += than[k].total() * static_cast<std::size_t>(than[k].channels());
  }
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace touchstone::lab
