#include "lab/bench/device_bench_estimator.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>

#include "core/error.h"
#include "core/seconds_since.h"
#include "lab/bench/device_bench_parts.h"
#include "lab/bench/estimator_frames.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "lab/vhs/bead_view.h"
#include "lab/vhs/vhs_experiment.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_training.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sim/plan/plan.h"

namespace touchstone::lab {
namespace {

constexpr double kMostRowSeconds = 200.0;  // of a core: a row's frames
constexpr double kPartOfFineMesh = 0.4;    // of its half extents: where heights are pressed
constexpr int kHeightRest = 4;             // frames of the untouched gel, whose mean is the background
constexpr double kCells = 1.1;             // of the beads' cells: what is kept of their pictures
constexpr double kWindow = 0.41;           // of a cell: the window round a bead, 30 px of the paper's 73
constexpr int kForceFrames = 24;
constexpr int kStepsDown = 2;  // deep in one frame, beads go farther than the tracker believes
constexpr double kTrackedRate_Hz = 30.0;
constexpr double kBrightBead = 0.5;  // reflectance
constexpr double kMicrometre = 1e3;  // in a millimetre
constexpr std::uint64_t kTestSeed = 500, kTrainingSeed = 1000;
constexpr int kFewestPaths = 4;  // a pixel, before the first look at its noise
constexpr std::array kEdges = {1.5, 2.0};
constexpr std::array kNoise = {4.0, 16.0};  // of the imager's

/// What an estimator came to.
struct Trained {
  double error = 0.0;  ///< root mean square over the test's frames
  int left_out = 0;    ///< of its training frames: they couldn't be used
};

/// An estimator as the table needs it.
struct Family {
  std::string quantity, unit, words;
  sim::DeviceSpec device;    ///< with as much of its pictures as the estimator looks at
  sim::ObjectSpec ball;      ///< what it is trained on
  Eigen::Vector2d reach_mm;  ///< of places of presses from the gel's middle
  bool heights = false;      ///< it needs the truth of pixels
  bool dragged = false;      ///< training presses are
  int steps_down = 1;        ///< frames of a press until it's as deep as it gets
  int rest_frames = 1;
  int training_frames = 12;  ///< where nothing is asked for
  /// Trained on `count` touches of `training` from `first` on.
  std::function<Trained(const FrameSet& training, std::size_t first, std::size_t count, const FrameSet& test)> train;
  std::function<double(const FrameSet& test)> typical;     ///< root mean square of what is estimated
  std::function<std::string(const FrameSet& test)> fault;  ///< why it can't read these frames; empty if it can

  std::size_t frames_a_press(bool with_drag) const {
    return static_cast<std::size_t>(steps_down) + (with_drag ? 1 : 0);
  }
  /// As many as `frames` touches need.
  std::size_t presses(std::size_t frames, bool with_drag) const {
    return (frames + frames_a_press(with_drag) - 1) / frames_a_press(with_drag);
  }
};

double root_mean_square(double squares, std::size_t count) {
  return std::sqrt(squares / static_cast<double>(count));
}

// Heights of a coated gel.

/// Of heights that were estimated, beside the touch's.
double height_rms_um(const sensors::HeightResult& estimated, const TouchFrame& touch, double mm_per_px) {
  sim::Touch truth;
  truth.height = touch.height;
  truth.contact = touch.contact;
  return height_error(estimated, truth, mm_per_px).rms_um;
}

Trained train_heights(const sim::DeviceSpec& device, double ball_radius_mm, const FrameSet& training, std::size_t first,
                      std::size_t count, const FrameSet& test) {
  std::vector<sensors::BallPress> presses;
  for (std::size_t k = first; k < first + count; ++k) {
    sensors::BallPress press;
    press.name = fmt::format("training frame {}", k - first + 1);
    press.frame = training.touches[k].frame;
    press.ball_radius_mm = ball_radius_mm;
    press.circle = contact_circle(training.touches[k].contact);
    if (!press.circle) fail("{}: the camera doesn't see the contact", press.name);
    presses.push_back(press);
  }
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = training.mm_per_px;
  settings.gel_thickness_mm = device.gel.thickness_mm;
  const sensors::HeightCalibration made =
      sensors::calibrate_height(presses, sensors::mean_background(training.rest), settings);
  sensors::HeightEstimator estimator(made.model);
  double squares = 0.0;
  for (const TouchFrame& touch : test.touches) {
    const double rms_um = height_rms_um(estimator.estimate(touch.frame), touch, test.mm_per_px);
    squares += rms_um * rms_um;
  }
  const auto flawed = [](const sensors::PressUse& use) { return !use.flaw.empty(); };
  return {root_mean_square(squares, test.touches.size()),
          static_cast<int>(std::count_if(made.presses.begin(), made.presses.end(), flawed))};
}

double typical_height_um(const FrameSet& test) {
  double squares = 0.0;
  for (const TouchFrame& touch : test.touches) {
    sensors::HeightResult flat;
    flat.height_mm = cv::Mat(touch.height.size(), CV_32F, cv::Scalar(0));
    flat.contact = cv::Mat(touch.height.size(), CV_8U, cv::Scalar(0));
    const double rms_um = height_rms_um(flat, touch, test.mm_per_px);
    squares += rms_um * rms_um;
  }
  return root_mean_square(squares, test.touches.size());
}

Family height_family(const sim::DeviceSpec& device, const sim::ObjectSpec& object) {
  Family family;
  family.quantity = "heights";
  family.unit = "um";
  family.heights = true;
  family.rest_frames = kHeightRest;
  family.reach_mm = kPartOfFineMesh * device.mesh.fine_half_extent_mm;
  family.device = device;
  family.ball = object.shape.type == sim::ShapeKind::sphere ? object : bench_ball(device.gel.thickness_mm);
  const double radius = family.ball.shape.radius_mm;
  family.words = fmt::format(
      "the height estimator by its table of slopes (touchstone calibrate gelsight, its correction the best on presses "
      "left out), trained on a ball of {:.3g} mm pressed straight down, its contact's outline known, and {} frames of "
      "the untouched gel",
      2.0 * radius, kHeightRest);
  family.train = [device, radius](const FrameSet& training, std::size_t first, std::size_t count,
                                  const FrameSet& test) {
    return train_heights(device, radius, training, first, count, test);
  };
  family.typical = typical_height_um;
  family.fault = [](const FrameSet&) { return std::string(); };
  return family;
}

// Forces from beads.

/// Where the tracker looks, as the paper's ROI-A and ROI-B lie to its beads.
sensors::BeadTrackerSettings tracker_settings(const sim::DeviceSpec& device) {
  const double cell_px = device.beads->spacing_mm * px_per_mm(bead_view(device));
  sensors::BeadTrackerSettings settings;
  settings.grid = device.beads->grid;
  settings.roi_a_px = static_cast<int>(std::lround(settings.grid * cell_px));
  settings.roi_b_px = std::clamp(static_cast<int>(std::lround(kWindow * cell_px)), 6, 64);
  if (device.beads->reflectance.largest() > kBrightBead) {
    settings.appearance.polarity = sensors::BeadPolarity::kBright;
  }
  return settings;
}

/// Each press as a sequence that begins with the set's frame without load.
std::vector<TrackedSequence> track_frames(const FrameSet& set, std::size_t first, std::size_t count,
                                          const sensors::BeadTrackerSettings& settings) {
  std::vector<TrackedSequence> tracked;
  sensors::BeadTracker tracker(settings);
  const auto see = [&](const cv::Mat& frame, const Eigen::Vector3d& force) {
    TrackedSequence& sequence = tracked.back();
    datasets::LabelledFrame label;
    label.frame = static_cast<int>(sequence.beads.size());
    label.t_us = static_cast<std::int64_t>(1e6 * label.frame / kTrackedRate_Hz);
    label.force = force;
    label.file = fmt::format("{}, frame {}", sequence.source.name, label.frame);
    sequence.beads.push_back(tracker.track({frame, label.t_us}));
    sequence.source.frames.push_back(label);
  };
  for (std::size_t k = first; k < first + count; ++k) {
    const TouchFrame& touch = set.touches[k];
    if (k == first || touch.press != set.touches[k - 1].press) {
      tracked.emplace_back().source.name = fmt::format("press {}", touch.press + 1);
      tracker.restart();
      see(set.rest.front(), Eigen::Vector3d::Zero());
    }
    see(touch.frame, touch.force_N);
  }
  return tracked;
}

Trained train_forces(const sim::DeviceSpec& device, const FrameSet& training, std::size_t first, std::size_t count,
                     const FrameSet& test) {
  const sensors::BeadTrackerSettings settings = tracker_settings(device);
  const std::vector<TrackedSequence> tracked = track_frames(training, first, count, settings);
  const sensors::ForceSamples samples = training_samples(tracked, settings.grid);
  const sensors::TrainedModel trained = sensors::train(samples, sensors::TrainingSettings::to_convergence());
  double squares = 0.0;
  std::size_t frames = 0;
  for (const ForceRecord& record :
       estimate_forces(track_frames(test, 0, test.touches.size(), settings), trained.model, RestChoice::model)) {
    if (record.frame == 0) continue;
    squares += (record.estimate.force - *record.truth).squaredNorm();
    ++frames;
  }
  // Frames in which a bead wasn't found; each press has its own one without load, too.
  return {root_mean_square(squares, frames), static_cast<int>(count + tracked.size() - samples.forces.size())};
}

double typical_force(const FrameSet& test) {
  double squares = 0.0;
  for (const TouchFrame& touch : test.touches) squares += touch.force_N.squaredNorm();
  return root_mean_square(squares, test.touches.size());
}

Family force_family(const sim::DeviceSpec& device, const sim::ObjectSpec& object) {
  Family family;
  family.quantity = "forces";
  family.unit = "N";
  family.dragged = true;
  family.steps_down = kStepsDown;
  family.training_frames = kForceFrames;
  family.reach_mm.setConstant(0.5 * device.beads->spacing_mm);  // the paper's places: the squares between the beads
  family.device = device;
  family.ball = object;
  const sensors::BeadTrackerSettings tracker = tracker_settings(device);
  const double part = kCells * tracker.roi_a_px / std::min(device.camera->width, device.camera->height);
  if (part < 1.0) {
    family.device = middle_of(device, static_cast<int>(part * part * device.camera->width * device.camera->height));
  }
  family.words = fmt::format(
      "the stiffness model of forces from {} x {} beads (touchstone calibrate vhs --stop converged), trained on {} "
      "pressed in {} frames and dragged in one; frames are the middle {} x {} pixels, where the tracker looks",
      tracker.grid, tracker.grid, object.name, kStepsDown, family.device.camera->width, family.device.camera->height);
  family.train = [device = family.device](const FrameSet& training, std::size_t first, std::size_t count,
                                          const FrameSet& test) {
    return train_forces(device, training, first, count, test);
  };
  family.typical = typical_force;
  family.fault = [tracker, name = object.name](const FrameSet& test) -> std::string {
    const int beads = tracker.grid * tracker.grid;
    const int found = sensors::BeadTracker(tracker).track({test.rest.front(), 0}).found();
    if (found == beads) return {};
    return fmt::format(
        "before {} its tracker finds {} of {} beads; give an --object that is as bright all round, as "
        "scenes/objects/probe-6mm.yaml of the vhs sensor is with its screen",
        name, found, beads);
  };
  return family;
}

/// Why neither estimator reads this device; empty if one does.
std::string why_none(const sim::DeviceSpec& device) {
  if (!device.camera) return "it has no camera";
  if (device.camera->events) return "its pixels report events, whose estimators aren't measured here";
  if (device.camera->motion_chip) return "its chip reports motion, whose estimators aren't measured here";
  if (device.gel.scattering_per_mm.largest() > 0.0) {
    return "its gel is milky, and estimators of such pictures aren't measured here";
  }
  if (device.beads && !device.coating) return {};
  if (!device.coating) return "it has neither beads nor a coating";
  if (device.pins) return "it has pins, which no estimator here reads";
  if (device.coating->print) return "its coating is printed, and estimators of such pictures aren't measured here";
  if (device.camera->bayer == render::BayerPattern::none) {
    return "its camera is grey, and heights are read from colours";
  }
  return {};
}

bool is_of_light(const sim::SwitchedEffect& effect) {
  return effect.of == &sim::EffectSwitches::direct_light || effect.of == &sim::EffectSwitches::shared_paths;
}

/// An effect that plans may leave out, but for those that depend on the motion's speed.
bool may_be_added(const sim::SwitchedEffect& effect) {
  return effect.of == &sim::EffectSwitches::friction || effect.of == &sim::EffectSwitches::fine_relief ||
         effect.of == &sim::EffectSwitches::interreflection || effect.of == &sim::EffectSwitches::sensor_noise;
}

/// With all that its plan leaves out, as far as the device has it.
sim::EffectSwitches everything_on(sim::SceneSpec scene) {
  sim::Plan plan = sim::make_plan(scene);
  for (const sim::SwitchedEffect& effect : switched_effects()) {
    if (!may_be_added(effect) || plan.*effect.planned) continue;
    if (auto on = sim::switched(scene, plan, effect)) {
      scene = std::move(on->scene);
      plan = std::move(on->plan);
    }
  }
  return scene.effects;
}

/// One way to make training frames.
struct Trial {
  EstimatorRow row;
  FrameRecipe recipe;
  double edges = 1.0;
};

/// What is tried beside frames as planned. @param scene one of these, whose pictures came to be lit by `light`
std::vector<Trial> trials_beside(const FrameRecipe& planned, const sim::SceneSpec& scene, const std::string& light,
                                 const sim::EffectSwitches& everything) {
  std::vector<Trial> trials;
  const auto add = [&](const std::string& name, const std::string& group) -> Trial& {
    Trial& trial = trials.emplace_back();
    trial.row.name = name;
    trial.row.group = group;
    trial.recipe = planned;
    return trial;
  };
  const sim::Plan plan = sim::make_plan(scene);
  int added = 0;
  for (const sim::SwitchedEffect& effect : switched_effects()) {
    const bool on = plan.*effect.planned;
    if (is_of_light(effect)) {
      const bool direct = effect.of == &sim::EffectSwitches::direct_light;
      if (!on || light != (direct ? "direct light" : "shared paths")) continue;
      add(direct ? "paths in place of direct light" : "paths of each pixel by itself", "another light").recipe.effects.*
          effect.of = sim::Switch::off;
    } else if (on) {
      add(fmt::format("without {}", effect.name), "an effect left out").recipe.effects.*effect.of = sim::Switch::off;
    } else if (may_be_added(effect) && sim::switched(scene, plan, effect)) {
      add(fmt::format("with {}", effect.name), "an effect added").recipe.effects.*effect.of = sim::Switch::on;
      ++added;
    }
  }
  if (added > 1) add("everything on", "an effect added").recipe.effects = everything;
  for (const double edges : kEdges) {
    Trial& trial = add(fmt::format("edges x {:.3g}", edges), "a coarser mesh");
    trial.recipe.device = with_edges(planned.device, edges);
    trial.edges = edges;
  }
  if (light == "direct light") return trials;
  for (const double noise : kNoise) {
    Trial& trial = add(paths_in_words(noise), "another light");
    trial.recipe.light.noise_fraction = noise;
    trial.recipe.light.min_samples = kFewestPaths;
  }
  return trials;
}

/// Of all trials those of these names, or all if there is none.
void keep_rows(const std::vector<std::string>& names, std::vector<Trial>& trials) {
  if (names.empty()) return;
  std::string known;
  for (const Trial& trial : trials) known += fmt::format("{}'{}'", known.empty() ? "" : ", ", trial.row.name);
  for (const std::string& name : names) {
    if (std::none_of(trials.begin(), trials.end(), [&](const Trial& trial) { return trial.row.name == name; })) {
      fail("estimator: rows has '{}'; this device has {}", name, known);
    }
  }
  std::erase_if(
      trials, [&](const Trial& trial) { return std::find(names.begin(), names.end(), trial.row.name) == names.end(); });
}

}  // namespace

double EstimatorRow::mean() const {
  return std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
}

std::pair<double, double> EstimatorRow::range() const {
  const auto [least, most] = std::minmax_element(errors.begin(), errors.end());
  return {*least, *most};
}

void check(const EstimatorSettings& settings) {
  const auto even = [](const char* field, int value, int least) {
    if (value < least || value % 2 != 0) {
      fail("estimator: {} are {}; allowed are even numbers from {} on", field, value, least);
    }
  };
  if (settings.training_frames) even("training frames", *settings.training_frames, 4);
  even("test frames", settings.test_frames, 2);
  if (settings.training_sets < 2) {
    fail("estimator: training sets are {}; allowed are at least 2, since their spread is a row's range",
         settings.training_sets);
  }
}

std::vector<double> more_errors(const EstimatorRow& row, const EstimatorRow& reference) {
  std::vector<double> more;
  for (std::size_t k = 0; k < std::min(row.errors.size(), reference.errors.size()); ++k) {
    more.push_back(row.errors[k] - reference.errors[k]);
  }
  return more;
}

EstimatorBench bench_estimator(const EstimatorDevice& of, const EstimatorSettings& settings, const Progress& progress) {
  check(settings);
  EstimatorBench bench;
  bench.none = why_none(of.device);
  if (!bench.none.empty()) return bench;
  const auto begun = std::chrono::steady_clock::now();
  const Family family =
      of.device.beads && !of.device.coating ? force_family(of.device, of.object) : height_family(of.device, of.object);
  const auto frames = static_cast<std::size_t>(settings.training_frames.value_or(family.training_frames));
  const auto sets = static_cast<std::size_t>(settings.training_sets);

  /// Of each set its own presses, the first ones the same however many there are.
  const auto training = [&](std::size_t frames_a_set) {
    FrameOrder order;
    order.object = family.ball;
    for (std::size_t set = 0; set < sets; ++set) {
      const std::vector<sim::PressSpec> presses =
          drawn_presses(family.presses(frames_a_set, family.dragged), family.reach_mm, of.depth_mm, family.dragged,
                        of.seed + kTrainingSeed * (set + 1));
      order.presses.insert(order.presses.end(), presses.begin(), presses.end());
    }
    order.rest_frames = family.rest_frames;
    order.steps_down = family.steps_down;
    order.heights = family.heights;
    order.seed = of.seed + kTrainingSeed;
    order.most_seconds = kMostRowSeconds;
    return order;
  };
  FrameOrder testing;
  testing.object = of.object;
  testing.presses = drawn_presses(family.presses(static_cast<std::size_t>(settings.test_frames), true), family.reach_mm,
                                  of.depth_mm, true, of.seed + kTestSeed);
  testing.steps_down = family.steps_down;
  testing.heights = family.heights;
  testing.seed = of.seed + kTestSeed;
  testing.most_seconds = kMostRowSeconds;

  FrameRecipe planned;
  planned.device = family.device;
  FrameRecipe everything = planned;
  everything.effects = everything_on(frame_scene(planned, testing, testing.presses.front()));
  const FrameOrder large = training(2 * frames);

  const auto tell = [&](const std::string& stage) {
    return progress ? Progress([&progress, stage](const std::string& what, std::int64_t done, std::int64_t total) {
      progress(fmt::format("estimator, {}: {}", stage, what), done, total);
    })
                    : Progress();
  };
  const FrameSet test = make_frames(everything, of.gel, testing, tell("test"));
  bench.none = family.fault(test);
  if (!bench.none.empty()) return bench;
  /// Trains on all sets of `frames_a_set` touches, of each the first `count`.
  const auto train = [&](const FrameSet& made, std::size_t frames_a_set, std::size_t count, EstimatorRow& row) {
    for (std::size_t set = 0; set < sets; ++set) {
      const std::size_t first =
          set * family.presses(frames_a_set, family.dragged) * family.frames_a_press(family.dragged);
      const Trained trained = family.train(made, first, count, test);
      row.errors.push_back(trained.error);
      row.left_out += trained.left_out;
    }
  };
  /// What can't be had is in the row's note.
  const auto attempt = [](EstimatorRow& row, const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      row.errors.clear();
      row.note = error.what();
    }
  };

  const FrameSet most = make_frames(planned, of.gel, large, tell("as planned"));
  for (const std::size_t count : {frames / 4, frames / 2, frames, 2 * frames}) {
    EstimatorRow row;
    row.name = "as planned";
    row.group = "as planned";
    row.frames = static_cast<int>(count);
    row.once_s = of.gel_seconds + most.once_s;
    row.each_s = most.each_s;
    row.light = most.light;
    attempt(row, [&] { train(most, 2 * frames, count, row); });
    bench.counts.push_back(row);
    if (count == frames) bench.reference = row;
  }
  if (!bench.reference.note.empty()) {
    fail_at(of.device.where, "the estimator trained on frames as planned: {}", bench.reference.note);
  }

  std::vector<Trial> trials =
      trials_beside(planned, frame_scene(planned, large, large.presses.front()), most.light, everything.effects);
  keep_rows(settings.rows, trials);
  for (Trial& trial : trials) {
    EstimatorRow& row = trial.row;
    row.frames = static_cast<int>(frames);
    attempt(row, [&] {
      fem::Compliance coarse;
      double gel_seconds = of.gel_seconds;
      if (trial.edges != 1.0) {
        const double worked = core_seconds();
        coarse = make_gel(trial.recipe.device).gel;
        gel_seconds = core_seconds() - worked;
      }
      const FrameSet made =
          make_frames(trial.recipe, trial.edges == 1.0 ? of.gel : coarse, training(frames), tell(row.name));
      row.once_s = gel_seconds + made.once_s;
      row.each_s = made.each_s;
      row.light = made.light;
      train(made, frames, frames, row);
    });
    bench.rows.push_back(row);
  }

  bench.quantity = family.quantity;
  bench.unit = family.unit;
  bench.typical = family.typical(test);
  bench.training = family.words;
  bench.test = fmt::format(
      "{} frames of {}, {:.3g} to {:.3g} mm deep up to {:.3g} x {:.3g} mm from the gel's middle, pressed and dragged "
      "by a third of "
      "the depth, with everything on ({}), on the device's own mesh, of another unit and other presses than any "
      "training frame",
      test.touches.size(), of.object.name, 0.5 * of.depth_mm, 2.0 * of.depth_mm, family.reach_mm.x(),
      family.reach_mm.y(), test.light);
  bench.seconds = seconds_since(begun);
  return bench;
}

}  // namespace touchstone::lab
