#include "sim/cost/scene_look.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/sha256.h"
#include "render/imager/imager.h"
#include "sim/cost/setup_cost.h"
#include "sim/cost/work_clock.h"
#include "sim/files/image_file.h"
#include "sim/press/elastic_object.h"
#include "sim/press/exposure_times.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/view/pixel_truth.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

constexpr int kMostPlayed = 40;         // frames
constexpr double kLongestNewton = 0.1;  // of the thickness: a part of a press at finite strain

/// The gel as nothing touches it. @pre `gel` has a surface
std::vector<Truth> untouched(const SceneSpec& scene, const fem::Compliance& gel) {
  constexpr double kFarAway_mm = 1e4;
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  Truth truth;
  fem::PressState& press = truth.press;
  press.traction = press.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  press.bead_displacement = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(gel_beads(scene.device).size()), 3);
  press.node_state.assign(gel.vertices.size(), fem::NodeState::open);
  press.node_owner.assign(gel.vertices.size(), -1);
  press.gel_from_object.translation.z() = kFarAway_mm;
  press.bodies.resize(moved_objects(scene).size());
  for (fem::BodyState& body : press.bodies) body.gel_from_object = press.gel_from_object;
  return {truth};
}

/// Parts of the way that a press at finite strain takes, a mean over the frames after the first.
double newton_parts(const DeviceSpec& device, std::span<const Truth> truths) {
  if (truths.size() < 2) return 0.0;
  const double longest = kLongestNewton * fem::thickness_of(gel_body(device));
  double parts = 0.0;
  for (std::size_t k = 1; k < truths.size(); ++k) {
    if (truths[k].press.contact_vertices == 0) continue;
    const double way =
        (truths[k].press.gel_from_object.translation - truths[k - 1].press.gel_from_object.translation).norm();
    parts += std::max(1.0, std::ceil(way / longest - 1e-9));
  }
  return parts / static_cast<double>(truths.size() - 1);
}

/// Evenly half full, with noise: as much work as any picture.
cv::Mat half_full(const DeviceSpec& device, const Plan& plan) {
  const render::ImagerResponse response = render::response_of(imager(device, plan.bands, false));
  const double electrons = response.electrons_per_irradiance.row(0).sum();
  const cv::Mat one(device.camera->height, device.camera->width, CV_32FC1,
                    cv::Scalar(electrons > 0.0 ? 0.5 * response.full_well_e / electrons : 0.0));
  cv::Mat light;
  cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(plan.bands.count()), one), light);
  return light;
}

/// Seconds of writing what `write` writes, and of its checksum.
template <typename Write>
double seconds_of_file(const char* ending, const Write& write) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("touchstone-look-{}{}", getpid(), ending);
  write(file);  // a process's first picture takes the library's own set-up
  const WorkClock clock;
  write(file);
  sha256_of_file(file);
  const double seconds = clock.seconds();
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  return seconds;
}

void look_at_pictures(const SceneSpec& scene, const Plan& plan, SceneLook& look) {
  const cv::Mat light = half_full(scene.device, plan);
  const render::Imager noisy = imager(scene.device, plan.bands, plan.sensor_noise);
  const render::FixedPattern pattern = render::fixed_pattern(noisy, light.size(), scene.seed);
  cv::Mat picture;
  const WorkClock clock;
  picture = render::develop(render::expose(light, noisy, pattern, scene.seed, 0), noisy);
  const double one_s = clock.seconds();
  const double png_s = seconds_of_file(".png", [&](const std::filesystem::path& file) { write_png(file, picture); });
  for (const bool wanted : {scene.outputs.frames, scene.outputs.ideal}) {
    if (!wanted) continue;
    look.develop_s += one_s;
    look.files_s += png_s;
  }
  if (!scene.outputs.radiance) return;
  look.files_s += seconds_of_file(
      ".exr", [&](const std::filesystem::path& file) { write_exr(file, light, channel_names(plan.bands)); });
}

/// Vertices in contact.
double touching(const fem::PressState& press) {
  return static_cast<double>(press.node_state.size()) -
         static_cast<double>(std::count(press.node_state.begin(), press.node_state.end(), fem::NodeState::open));
}

/// At how many moments frames are exposed, and what part of the deepest's contact there is at each, as means.
void look_at_exposures(const SceneSpec& scene, const Plan& plan, std::span<const Truth> truths, double faster,
                       SceneLook& look) {
  const bool exposed = plan.camera && scene.outputs.light();
  const ExposureTimes exposure(scene, plan);
  const double most = std::max(1.0, touching(deepest(truths).press));
  double moments = 0.0, load = 0.0;
  for (const Truth& truth : truths) {
    const std::vector<double> times = exposed ? exposure.of(truth) : std::vector{0.0};
    // What moves more slowly takes fewer.
    const double each = (1.0 + (static_cast<double>(times.size()) - 1.0) / faster) / static_cast<double>(times.size());
    for (const double time : times) {
      moments += each;
      load += each * std::min(1.0, touching(time > 0.0 ? state_after(truth, time) : truth.press) / most);
    }
  }
  look.moments = moments / static_cast<double>(truths.size());
  look.load = load / moments;
}

void look_at_geometry(const SceneView& view, const Truth& truth, const std::optional<fem::ReliefAnswer>& relief,
                      SceneLook& look) {
  const OutputSpec& outputs = view.scene.outputs;
  if (outputs.height && view.membrane) {
    const WorkClock clock;
    const cv::Mat height = view.membrane->height(truth.press, relief);
    look.height_s = clock.seconds();
    look.files_s +=
        seconds_of_file(".exr", [&](const std::filesystem::path& file) { write_exr(file, height, {"height"}); });
  }
  if (!outputs.first_hits()) return;
  const WorkClock clock;
  const LinearImage truths =
      pixel_truth(view.geometry(truth.press, relief), camera_of(*view.scene.device.camera), outputs);
  look.pixel_truth_s = clock.seconds();
  look.files_s += seconds_of_file(
      ".exr", [&](const std::filesystem::path& file) { write_exr(file, truths.image, truths.channel_names); });
}

}  // namespace

double shorten(MotionSpec& motion, int most) {
  const int all = motion.frame_count() - 1;
  if (all <= most) return 1.0;
  for (MotionKey& key : motion.keys) {
    key.frames = std::max(1, static_cast<int>(std::lround(static_cast<double>(key.frames) * most / all)));
  }
  return static_cast<double>(all) / (motion.frame_count() - 1);
}

SceneLook look_at_scene(const SceneSpec& whole, const Plan& whole_plan, const fem::Compliance* gel,
                        const std::filesystem::path& cache) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  SceneLook look;
  SceneSpec scene = whole;
  Plan plan = whole_plan;
  plan.finite_strain = false;
  plan.inertia = false;
  look.pressed = gel != nullptr;
  look.states = plan.states_a_frame;
  std::vector<Truth> truths;
  fem::Compliance rest;
  if (look.pressed) {
    const double faster = shorten(scene.motion, kMostPlayed);
    const auto elastic = set_up_elastic_objects(scene, plan, cache);
    const WorkClock clock;
    truths = play_motion(scene, plan, *gel, {}, nullptr, elastic);
    look.state_s = clock.seconds() / std::max(1.0, static_cast<double>(truths.size() - 1) * plan.states_a_frame);
    look.newton_parts = newton_parts(scene.device, truths) / faster;
    look_at_exposures(scene, plan, truths, faster, look);
  } else {
    plan.fine_relief = plan.elastic_object = plan.skin_blanching = false;
    scene.outputs.height = false;
    rest = unpressed_gel(scene.device);
    gel = &rest;
    truths = untouched(scene, rest);
  }
  if (!plan.camera && !scene.outputs.height) return look;
  const SceneView view(scene, plan, *gel);
  const Truth& hardest = deepest(truths);
  const WorkClock clock;
  const std::optional<fem::ReliefAnswer> relief = view.relief(hardest.press);
  const double hardest_s = clock.seconds();
  if (plan.fine_relief) {
    const WorkClock again;
    view.relief(truths.front().press);
    look.relief_s = look.load * hardest_s + (1.0 - look.load) * again.seconds();
    look.deepest_relief_s = hardest_s;
  }
  look_at_geometry(view, hardest, relief, look);
  if (!plan.camera || !scene.outputs.light()) return look;
  look.light = look_at_light(view, *gel, truths, relief, look.moments, look.load, whole.motion.frame_count());
  look_at_pictures(scene, plan, look);
  return look;
}

}  // namespace touchstone::sim
