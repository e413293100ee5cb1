#include "lab/studies/bead_design_study.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "fem/contact/press.h"
#include "lab/press/marker_compliance_export.h"
#include "lab/studies/centroid_bound.h"
#include "lab/studies/force_bound.h"
#include "lab/vhs/bead_view.h"
#include "lab/vhs/ideal_tracking.h"
#include "lab/vhs/vhs_experiment.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_training.h"
#include "sim/plan/plan.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kSeed = 11;
constexpr int kTouches = 5;                // pictures from the first touch to the load: as a tracker gets them
constexpr double kFirstDepth_mm = 0.02;    // of the first one
constexpr std::int64_t kFrame_us = 33333;  // between them
constexpr double kWindow = 1.65;           // ROI-B in diameters of a bead: 30 px for 18 in [VisioHaptic2024]
constexpr int kDraws = 2000;               // of noise on an estimate
constexpr int kRangeSteps = 24;
constexpr double kClear_mm = 0.05;  // above the gel where a press begins
constexpr double kRim = 1.1;        // of a bead and its blur: what a tracker looks at

/// What the pictures say.
struct Seen {
  double deviation_px = 0.0;     // of a tracked coordinate, from exposure to exposure
  double displacement_um = 0.0;  // error of the beads' displacements up to the load, root mean square
  Eigen::VectorXd least_px;      // of each coordinate, 2 m
};

sensors::BeadTrackerSettings tracker_settings(const sim::DeviceSpec& device, const BeadView& view) {
  const double scale = px_per_mm(view);
  sensors::BeadTrackerSettings settings;
  settings.grid = device.beads->grid;
  const double cell = device.beads->spacing_mm * scale;
  settings.roi_a_px = static_cast<int>(std::lround(cell * settings.grid));
  const double window = std::min({kWindow * device.beads->diameter_mm * scale, cell, 64.0});
  settings.roi_b_px = std::max(6, static_cast<int>(window));
  const Eigen::MatrixX2d rest = bead_pixels(view, Eigen::MatrixX3d::Zero(settings.grid * settings.grid, 3));
  settings.first_centre_px = Eigen::Vector2d(rest.colwise().mean().transpose());
  return settings;
}

render::Imager imager_of(const sim::DeviceSpec& device, const sim::ObjectSpec& object) {
  sim::SceneSpec scene;
  scene.device = device;
  scene.object = object;
  return sim::imager(device, sim::choose_bands(scene), true);
}

Seen look_at(const BeadDesignSpec& spec, const sim::VirtualSensor& pictures, const BeadView& view) {
  const sim::DeviceSpec& device = pictures.device();
  const sim::TouchObject object = pictures.object(spec.object);
  std::vector<sim::Touch> touches;
  touches.push_back(pictures.press(object, {.depth_mm = kFirstDepth_mm}));
  for (int k = 1; k <= kTouches; ++k)
    touches.push_back(pictures.press(object, {.force_N = spec.load_N * k / kTouches}));
  const auto beads = static_cast<Eigen::Index>(view.rest_mm.size());
  const Eigen::MatrixX2d first = bead_pixels(view, touches.front().press.bead_displacement);
  const Eigen::MatrixX2d last = bead_pixels(view, touches.back().press.bead_displacement);
  const sensors::BeadTrackerSettings settings = tracker_settings(device, view);
  Eigen::MatrixX2d sum = Eigen::MatrixX2d::Zero(beads, 2), squares = sum;
  double displacement2 = 0.0;
  for (int n = 0; n < spec.exposures; ++n) {
    sensors::BeadTracker tracker(settings);
    Eigen::MatrixX2d from(beads, 2), to(beads, 2);
    for (std::size_t k = 0; k < touches.size(); ++k) {
      Frame frame;
      frame.t_us = static_cast<std::int64_t>(k) * kFrame_us;
      frame.image = touches[k].expose(kSeed + static_cast<std::uint64_t>(n) * touches.size() + k);
      const sensors::TrackedBeads& found = tracker.track(frame);
      for (Eigen::Index i = 0; i < beads; ++i) {
        const auto b = static_cast<std::size_t>(i);
        if (!sensors::is_found(found.status[b])) {
          fail("the tracker loses bead {} at {:.3g} N", i, spec.load_N * static_cast<double>(k) / kTouches);
        }
        if (k == 0) from.row(i) = found.measured[b].transpose();
        if (k + 1 == touches.size()) to.row(i) = found.measured[b].transpose();
      }
    }
    sum += to;
    squares += to.cwiseAbs2();
    displacement2 += ((to - from) - (last - first)).squaredNorm() / static_cast<double>(2 * beads * spec.exposures);
  }
  Seen seen;
  const double n = spec.exposures;
  seen.deviation_px = std::sqrt(std::max(0.0, ((squares - sum.cwiseAbs2() / n) / (n - 1.0)).mean()));
  seen.displacement_um = 1e3 * std::sqrt(displacement2) / px_per_mm(view);
  const render::Imager imager = imager_of(device, spec.object);
  const sim::CameraSpec& camera = *device.camera;
  const double away = (camera.position_mm - view.rest_mm.front()).norm();
  const double radius = kRim * (0.5 * device.beads->diameter_mm * px_per_mm(view) +
                                0.5 * sim::blur_disc_px(sim::camera_of(camera), away));
  seen.least_px.resize(2 * beads);
  for (Eigen::Index i = 0; i < beads; ++i) {
    const Eigen::Matrix2d information =
        shift_information(touches.back().light, imager, last.row(i).transpose(), radius);
    if (!std::isfinite(least_deviation_px(information))) fail("bead {} has no contrast", i);
    seen.least_px.segment<2>(2 * i) = information.inverse().diagonal().cwiseSqrt();
  }
  return seen;
}

sensors::StiffnessForceModel trained_model(const BeadDesignSpec& spec, const sim::DeviceSpec& device,
                                           const fem::Compliance& gel, double noise_px) {
  std::vector<Eigen::Vector2d> places = spec.training_mm;
  if (places.empty()) {
    const int squares = device.beads->grid - 1;
    for (int row = 0; row < squares; ++row) {
      for (int column = 0; column < squares; ++column) {
        places.push_back(device.beads->spacing_mm *
                         Eigen::Vector2d(column - 0.5 * (squares - 1), row - 0.5 * (squares - 1)));
      }
    }
  }
  if (spec.training_centre) places.emplace_back(0.0, 0.0);
  std::vector<TrackedSequence> cycles;
  for (std::size_t k = 0; k < places.size(); ++k) {
    sim::SceneSpec scene;
    scene.device = device;
    scene.object = spec.object;
    scene.motion = spec.training;
    scene.motion.start_mm.head<2>() = places[k];
    cycles.push_back(track_ideally(fmt::format("training at ({:.3g}, {:.3g}) mm", places[k].x(), places[k].y()), scene,
                                   gel, noise_px, kSeed + k));
  }
  const sensors::TrainingSettings settings = spec.training_ends == sensors::StopRule::kConvergence
                                                 ? sensors::TrainingSettings::to_convergence()
                                                 : sensors::TrainingSettings::as_published();
  return sensors::train(training_samples(cycles, device.beads->grid), settings).model;
}

std::array<AxisErrors, 3> errors_in(const BeadDesignSpec& spec, const sim::DeviceSpec& device,
                                    const fem::Compliance& gel, const sensors::StiffnessForceModel& model,
                                    const sim::MotionSpec& motion, const std::string& name, double noise_px,
                                    std::uint64_t seed) {
  sim::SceneSpec scene;
  scene.device = device;
  scene.object = spec.object;
  scene.motion = motion;
  const std::vector<TrackedSequence> played = {track_ideally(name, scene, gel, noise_px, seed)};
  return verify_forces(estimate_forces(played, model, RestChoice::model)).errors;
}

/// Errors (root mean square of each axis, N) of the estimate where noise is drawn anew on pixels of a known force.
Eigen::Vector3d scatter(const sensors::StiffnessForceModel& model, const Eigen::VectorXd& pixels,
                        const Eigen::Vector3d& force, double noise_px) {
  RandomStream random(kSeed, 0, Purpose::kCentroidNoise);
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  std::vector<Eigen::Vector2d> positions(static_cast<std::size_t>(pixels.size() / 2));
  for (int draw = 0; draw < kDraws; ++draw) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double x = random.normal(), y = random.normal();
      positions[i] = pixels.segment<2>(2 * static_cast<Eigen::Index>(i)) + noise_px * Eigen::Vector2d(x, y);
    }
    squares += (sensors::estimate_force(model, positions, model.rest) - force).array().square() / kDraws;
  }
  return squares.sqrt();
}

/// The normal force at which the press goes deeper than allowed or a bead leaves its cell.
double range_of(const BeadDesignSpec& spec, const sim::DeviceSpec& device, const fem::Compliance& gel,
                const BeadView& view, const fem::ContactShape& contact, double start_z) {
  const double half_cell = 0.5 * device.beads->spacing_mm * px_per_mm(view);
  const Eigen::MatrixX2d rest =
      bead_pixels(view, Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(view.rest_mm.size()), 3));
  fem::Press press(gel, contact, spec.object.friction, {}, {}, fem::PressOutput::forces);
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(0.0), fem::AxisControl::at(0.0), fem::AxisControl::at(start_z)};
  press.step(target);
  double before = 0.0;  // how far to the limit at the step before, 1 is there
  for (int k = 1; k <= kRangeSteps; ++k) {
    const double step = spec.most_N / kRangeSteps;
    target.axis[2] = fem::AxisControl::with_force(step * k);
    double now = 0.0;
    try {
      const fem::PressState& state = press.step(target);
      const double depth = start_z - kClear_mm - state.gel_from_object.translation.z();
      const double moved =
          (bead_pixels(view, state.bead_displacement) - rest).rowwise().lpNorm<Eigen::Infinity>().maxCoeff();
      now = std::max(depth / (spec.deepest_share * device.gel.thickness_mm), moved / half_cell);
    } catch (const Error&) {
      return step * (k - 1);  // deeper than the gel, say: the last that could be had
    }
    if (now >= 1.0) return step * (k - 1 + (1.0 - before) / (now - before));
    before = now;
  }
  return spec.most_N;
}

enum Figure {
  kErrorX,
  kErrorY,
  kErrorZ,
  kError,
  kElsewhere,
  kErrorAtLoad,
  kNoise,
  kBound,
  kBoundUnknownPlace,
  kBoundPatch,
  kOverBound,
  kDisplacement,
  kTrackerNoise,
  kLeastNoise,
  kRange,
  kDepth,
  kStrain,
  kFrameRate,
  kFigures
};

}  // namespace

std::vector<DesignFigure> bead_design_figures(const BeadDesignSpec& spec) {
  const std::string load = fmt::format("{:.4g} N", spec.load_N);
  return {
      {"error_x_N", Better::lower, "mean absolute error of the verification along x"},
      {"error_y_N", Better::lower, "likewise along y"},
      {"error_z_N", Better::lower, "likewise along z, the normal"},
      {"error_N", Better::lower, "the largest of the three"},
      {"elsewhere_N", Better::lower, "likewise of the load cycle at a place that wasn't trained"},
      {"error_at_load_N", Better::lower,
       fmt::format("root mean square error of a press of {}, worst axis: bias and noise", load)},
      {"noise_N", Better::lower,
       "standard deviation of the force without load, worst axis: the least force that is detected"},
      {"bound_N", Better::lower,
       fmt::format(
           "least standard deviation that any unbiased estimate can have at {}, worst axis, for who knows where "
           "the object is (Cramer-Rao)",
           load)},
      {"bound_unknown_place_N", Better::lower, "likewise for who must find out where it is"},
      {"bound_patch_N", Better::lower,
       "likewise of the normal forces on the squares between the beads, all at once, without load: the largest"},
      {"error_over_bound", Better::lower,
       "error at the load over the bound there, the least of the axes: below 1 an estimate would be better than can "
       "be"},
      {"displacement_error_um", Better::lower,
       fmt::format("root mean square error of the beads' tracked displacements from touch to {}: noise and all else",
                   load)},
      {"tracker_noise_px", Better::lower, "standard deviation of a tracked coordinate from exposure to exposure"},
      {"least_noise_px", Better::lower, "the least that any method could have from the same light (Cramer-Rao)"},
      {"range_N", Better::higher,
       fmt::format("normal force at which the press is deeper than {:.3g} of the gel's thickness, or a bead leaves its "
                   "cell; {:.4g} is the end of the search",
                   spec.deepest_share, spec.most_N)},
      {"depth_mm", Better::near, fmt::format("how far {} press in", load)},
      {"largest_strain", Better::lower,
       fmt::format("of the gel's surface at {}; above 0.2 linear elasticity is off by percents", load)},
      {"frame_rate_Hz", Better::higher, "of the camera, as far as its exposure allows"},
  };
}

std::vector<double> bead_design(const BeadDesignSpec& spec, const sim::DeviceSpec& device,
                                const std::filesystem::path& cache) {
  const BeadView view = bead_view(device);
  const sim::VirtualSensor pictures(device, cache);
  const fem::Compliance& gel = pictures.gel();
  const fem::ContactShape contact = sim::contact_shape(spec.object);
  const double start_z = sim::first_touch(sim::PressSpec{}, spec.object, device.gel) + kClear_mm;
  const Seen seen = look_at(spec, pictures, view);
  const sensors::StiffnessForceModel model = trained_model(spec, device, gel, seen.deviation_px);
  std::vector<double> figures(kFigures, kNone);
  const auto verified =
      errors_in(spec, device, gel, model, spec.verification, "verification", seen.deviation_px, kSeed + 100);
  sim::MotionSpec there = spec.training;
  there.start_mm.head<2>() = spec.elsewhere_mm;
  const auto elsewhere = errors_in(spec, device, gel, model, there, "elsewhere", seen.deviation_px, kSeed + 101);
  for (int a = 0; a < 3; ++a) figures[kErrorX + a] = verified[a].mean_absolute;
  figures[kError] = std::max({figures[kErrorX], figures[kErrorY], figures[kErrorZ]});
  figures[kElsewhere] = std::max({elsewhere[0].mean_absolute, elsewhere[1].mean_absolute, elsewhere[2].mean_absolute});
  const BoundLoad load{{0, 0}, {0, 0, spec.load_N}};
  const ForceSensitivity at = force_sensitivity(gel, view, contact, spec.object.friction, start_z, load);
  const ForceBound bound = force_bound(at, seen.least_px);
  const Eigen::Vector3d error = scatter(model, at.pixels, load.force_N, seen.deviation_px);
  figures[kErrorAtLoad] = error.maxCoeff();
  Eigen::VectorXd rest(at.pixels.size());
  for (std::size_t i = 0; i < model.rest.size(); ++i) rest.segment<2>(2 * static_cast<Eigen::Index>(i)) = model.rest[i];
  figures[kNoise] = scatter(model, rest, Eigen::Vector3d::Zero(), seen.deviation_px).maxCoeff();
  figures[kBound] = bound.place_known.maxCoeff();
  figures[kBoundUnknownPlace] = bound.place_unknown.maxCoeff();
  const int squares = device.beads->grid - 1;
  const double side = device.beads->spacing_mm;
  const PatchGrid patches{{squares, squares}, side, Eigen::Vector2d::Constant(-0.5 * side * (squares - 1))};
  figures[kBoundPatch] =
      distribution_bound(bead_compliance(gel, view.rest_mm, patches), view, seen.least_px).row(2).maxCoeff();
  figures[kOverBound] = error.cwiseQuotient(bound.place_known).minCoeff();
  figures[kDisplacement] = seen.displacement_um;
  figures[kTrackerNoise] = seen.deviation_px;
  figures[kLeastNoise] = std::sqrt(seen.least_px.squaredNorm() / static_cast<double>(seen.least_px.size()));
  figures[kRange] = range_of(spec, device, gel, view, contact, start_z);
  figures[kDepth] = at.depth_mm - kClear_mm;
  figures[kStrain] = at.largest_strain;
  figures[kFrameRate] = std::min(device.camera->frame_rate_Hz, 1e6 / device.camera->exposure_us);
  return figures;
}

DesignTable run_bead_design(const BeadDesignSpec& spec, const Progress& progress) {
  return try_designs(
      spec.plan, spec.base, bead_design_figures(spec),
      [&](const sim::DeviceSpec& device) { return bead_design(spec, device, {}); }, true, progress);
}

}  // namespace touchstone::lab
