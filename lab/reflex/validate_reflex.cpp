// The reflex device [Knoop2013]: the paper's figures of reflex and explore mode, and beyond them other loads, shear,
// collisions and pictures without information. The tree, the forces and Z are learned from a plate pressed straight
// down with one seed of noise; all but the rows that the paper gives for its training set are of other seeds or loads.

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <span>
#include <string>

#include "datasets/sets/processor.h"
#include "lab/reflex/reflex_experiment.h"
#include "lab/reflex/reflex_presses.h"
#include "lab/validation/row_list.h"
#include "sim/scene/device.h"

namespace touchstone::lab {
namespace {

constexpr double kSpeed_mm_s = 2.0;  // the paper's reciprocation
constexpr double kGap_mm = 1.0;      // how far it goes back over the touch: fig. 6 shows some travel without force
constexpr double kDeepest_mm = 5.0;
constexpr double kPublishedError_percent = 2.1, kPublishedMissed_N = 0.09;
constexpr double kPublishedRms_N = 0.65, kPublishedLightRms_N = 0.30, kPublishedResponse_ms = 2.0;
constexpr double kPublishedZRms_mm = 0.39, kPublishedZError_mm = 0.80, kPublishedLargestForceError_N = 2.14;
constexpr double kPublishedZ_mm = 16.03;
constexpr double kAllowedDecision_us = 1.0;  // issue 8 of this project: "well under" it
constexpr double kAllowedDrift_mm = 0.1;     // "none" of the paper, as far as a picture of 6 bits can show

enum Seed : std::uint64_t {
  kTraining = 1,
  kTest,
  kLoads,
  kMixed,
  kPictures,
  kStill,
  kRest,
  kShearTraining,
  kShearTest,
  kCrash
};

/// Coarser where seconds count: the contact's first half millimetre and the light are then rough.
struct Scale {
  explicit Scale(bool quick)
      : mesh(quick ? 2.0 : 1.0), every(quick ? 9 : 36), pictures(quick ? 150 : 1000), crashes(quick ? 2 : 8) {
    if (!quick) return;
    light.side = 4;
    path_light.allowed = 1.0 / 63;
  }
  double mesh;   ///< edges, in those of the device
  int every;     ///< frames a training point: 1000 points over one reciprocation or four
  int pictures;  ///< of explore mode's record
  int crashes;   ///< for each speed and watcher, at other phases of the frames
  ReflexLightSettings light;
  ReflexPathLightSettings path_light;
};

std::string says(const ReflexScore& score) {
  return fmt::format("missed {:.1f}, false {:.1f} % of {}; largest error {:.2f} N", score.missed_percent,
                     score.false_percent, score.points, score.largest_error_N);
}

std::string says(const ExploreScore& score) {
  return fmt::format("{} pictures: {} absolute, {} relative, {} held", score.pictures, score.absolute, score.relative,
                     score.held);
}

/// Processor time of a decision, us.
double decision_us(const sensors::ReflexModel& model, std::span<const ReflexPoint> points) {
  constexpr int kRounds = 1000;
  sensors::ReflexLoop loop(model, {.stop_above_N = 1e9});
  double sum_N = 0.0;
  const std::clock_t begun = std::clock();
  for (int round = 0; round < kRounds; ++round) {
    for (const ReflexPoint& one : points) sum_N += loop.next(one.statistics).force_N;
  }
  const double seconds = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  TS_ASSERT(std::isfinite(sum_N));
  return 1e6 * seconds / (kRounds * static_cast<double>(points.size()));
}

/// The rows of reflex mode; gives what was learned.
sensors::ReflexModel add_reflex_rows(const ReflexSetup& setup, const Scale& scale, RowList& rows,
                                     sensors::ReflexBudget& budget) {
  const ReflexTouch& plate = setup.touch("plate");
  const ReflexMotion motion = reciprocation(-kGap_mm, std::min(kDeepest_mm, plate.end()), kSpeed_mm_s);
  const auto record = [&](const ReflexTouch& touch, const ReflexMotion& how, std::uint64_t seed) {
    return record_points(setup, touch, how, 1000, scale.every, seed);
  };
  const std::vector<ReflexPoint> training = record(plate, motion, kTraining);
  sensors::ReflexModel model = train_reflex(training);
  const ReflexScore score = score_reflex(model, training);
  rows.add_bounded(
      "contact.error_percent",
      fmt::format("contact classified wrongly on the training set, '{}': {}", rule_of(model.tree), says(score)), "%",
      Better::lower, kPublishedError_percent, true, score.error_percent);
  rows.add_bounded("contact.missed_below_N",
                   fmt::format("the largest force of a contact that wasn't detected, {:.2f} mm", score.missed_below_mm),
                   "N", Better::lower, kPublishedMissed_N, true, score.missed_below_N);
  rows.add_bounded("force.rms_N", "force by tree and linear model on the training set", "N", Better::lower,
                   kPublishedRms_N, true, score.rms_N);
  rows.add_bounded("force.rms_below_1N_N", "likewise, in contact with less than 1 N", "N", Better::lower,
                   kPublishedLightRms_N, true, score.rms_below_1N_N);
  budget.decision_us = decision_us(model, training);
  rows.add_bounded("decision_us", "from a frame's statistics to stop or go on, force and shear, processor time", "us",
                   Better::lower, kAllowedDecision_us, false, budget.decision_us);
  rows.add_bounded(
      "response_ms",
      fmt::format("from a touch to the decision, at most: a frame of {:.0f} us, {} registers of {:.0f} us, "
                  "while those of the frame before are read; {:.2f} on average",
                  budget.frame_us, budget.registers, budget.register_us, 1e-3 * budget.mean_us()),
      "ms", Better::lower, kPublishedResponse_ms, true, 1e-3 * budget.most_us());

  const sensors::ReflexModel curved = train_reflex(training, 2);
  rows.add_bounded("curved.rms_N", "force with the statistics' products as well (beyond the paper); bound: the line's",
                   "N", Better::lower, score.rms_N, false, score_reflex(curved, training).rms_N);
  const std::vector<ReflexPoint> again = record(plate, motion, kTest);
  const ReflexScore other = score_reflex(model, again);
  rows.add_bounded("again.error_percent", fmt::format("the same motion with other noise: {}", says(other)), "%",
                   Better::lower, kPublishedError_percent, false, other.error_percent);
  rows.add_bounded("again.rms_N", fmt::format("its force; with products {:.2f}", score_reflex(curved, again).rms_N),
                   "N", Better::lower, kPublishedRms_N, false, other.rms_N);
  // Once along all of a touch's path, some 1000 points.
  const auto along = [&](const ReflexTouch& touch, std::uint64_t seed) {
    const int frames = static_cast<int>((touch.end() + kGap_mm) / kSpeed_mm_s * setup.chip.frame_rate_Hz);
    const int every = std::max(frames / 1000, 1);
    return record_points(setup, touch, single_stroke(-kGap_mm, touch.end(), kSpeed_mm_s), frames / every, every, seed);
  };
  for (const ReflexTouch& touch : setup.touches) {
    if (&touch == &plate) continue;
    const ReflexScore held = score_reflex(model, along(touch, kLoads));
    rows.add_bounded(
        touch.name + ".missed_below_N",
        fmt::format("a load that nothing was learned from; {:.2f} mm, {}", held.missed_below_mm, says(held)), "N",
        Better::lower, kPublishedMissed_N, false, held.missed_below_N);
    rows.add_bounded(touch.name + ".rms_N", "its force", "N", Better::lower, kPublishedRms_N, false, held.rms_N);
  }
  if (setup.touches.size() == 1) return model;
  // The remedy: learn from several loads.
  std::vector<ReflexPoint> mixed = training;
  for (const char* name : {"ball", "cylinder", "shear-x-4"}) {
    const auto more = along(setup.touch(name), kMixed);
    mixed.insert(mixed.end(), more.begin(), more.end());
  }
  const sensors::ReflexModel broad = train_reflex(mixed, 2);
  for (const char* name : {"tilt", "shear-45-3"}) {
    const ReflexScore held = score_reflex(broad, along(setup.touch(name), kLoads));
    rows.add_bounded(
        fmt::format("mixed.{}.rms_N", name),
        fmt::format("learned from plate, ball, cylinder and shear along x at 4 mm, with products, '{}': {}",
                    rule_of(broad.tree), says(held)),
        "N", Better::lower, kPublishedRms_N, false, held.rms_N);
  }
  return model;
}

/// The rows of explore mode; gives what was learned, without shear.
sensors::ExploreModel add_explore_rows(const ReflexSetup& setup, const Scale& scale, RowList& rows) {
  const ReflexTouch& plate = setup.touch("plate");
  const double deepest_mm = std::min(kDeepest_mm, plate.end());
  const auto pictures =
      record_pictures(setup, plate, reciprocation(0.0, deepest_mm, kSpeed_mm_s), scale.pictures, kPictures);
  constexpr int kPoints = 50;  // 0 to 5 mm and back
  std::vector<double> places;
  for (int i = 0; i < kPoints; ++i) {
    places.push_back(deepest_mm * (i < kPoints / 2 ? i : kPoints - 1 - i) / (kPoints / 2 - 1));
  }
  const auto still = record_still(setup, plate, places, kStill);
  const sensors::ExponentialForce law = fit_law(plate);

  const auto add = [&](const std::string& prefix, const sensors::ExploreSettings& settings, int terms,
                       int rest_pictures, bool published, const std::array<double, 3>& bounds) {
    const cv::Mat rest = rest_picture(setup, rest_pictures, kRest);
    const auto readings = explore(rest, pictures, settings);
    sensors::ExploreModel model;
    model.force = law;
    model.press = fit_press(readings, pictures, terms);
    const ExploreScore score = score_explore(model, readings, pictures);
    rows.add_bounded(prefix + "z_rms_mm",
                     fmt::format("press of dilation at {} mm/s, Z = {:.2f} mm (paper: {}), largest error {:.2f}; {}",
                                 kSpeed_mm_s, model.press.mm[0], kPublishedZ_mm, score.largest_mm, says(score)),
                     "mm", Better::lower, bounds[0], published, score.rms_mm);
    const auto still_readings = explore(rest, still, settings);
    const ExploreScore test = score_explore(model, still_readings, still);
    rows.add_bounded(prefix + "max_z_error_mm", fmt::format("{} still points there and back; {}", kPoints, says(test)),
                     "mm", Better::lower, bounds[1], published, test.largest_mm);
    rows.add_bounded(prefix + "max_force_error_N",
                     fmt::format("their forces by {:.3f} (exp({:.3f} z) - 1) N; root mean square {:.2f}", law.scale_N,
                                 law.rate_per_mm, test.rms_N),
                     "N", Better::lower, bounds[2], published, test.largest_N);
    const double back_mm = std::abs(model.press.press_mm(still_readings.back().motion.dilation));
    rows.add_bounded(prefix + "drift_mm", "the press that is estimated when the plate has gone back to the touch", "mm",
                     Better::lower, kAllowedDrift_mm, false, std::max(back_mm, score.drift_mm));
    return std::pair(model, std::array<double, 3>{score.rms_mm, test.largest_mm, test.largest_N});
  };
  const auto text = add("explore.", sensors::text_explore_settings(), 1, 1, true,
                        {kPublishedZRms_mm, kPublishedZError_mm, kPublishedLargestForceError_N});
  sensors::ExploreSettings ours;
  ours.times = sensors::chip_pixel_times(1.0 / setup.chip.frame_rate_Hz);
  return add("explore.ours.", ours, 3, 8, false, text.second).first;
}

void add_shear_rows(const ReflexSetup& setup, const sensors::ReflexModel& reflex, sensors::ExploreModel& model,
                    RowList& rows) {
  std::vector<sensors::ShearSample> counts, shifts;
  std::vector<sensors::LateralSample> lateral;
  sensors::ExploreSettings settings;
  settings.times = sensors::chip_pixel_times(1.0 / setup.chip.frame_rate_Hz);
  const cv::Mat rest = rest_picture(setup, 8, kRest);
  struct Record {
    std::vector<ReflexPoint> points;
    std::vector<ReflexPicture> pictures;
    std::vector<sensors::ExploreReading> readings;
  };
  const auto record = [&](const ReflexTouch& touch, std::uint64_t seed) {
    const ReflexMotion motion = single_stroke(-kGap_mm, touch.end(), kSpeed_mm_s);
    const double seconds = (touch.end() + kGap_mm) / kSpeed_mm_s;
    const int frames = static_cast<int>(seconds * setup.chip.frame_rate_Hz);
    Record one;
    one.points = record_points(setup, touch, motion, frames, 1, seed);
    one.pictures = record_pictures(setup, touch, motion, frames / kChipPixels, seed);
    one.readings = explore(rest, one.pictures, settings);
    return one;
  };
  std::vector<Record> training;
  for (const ReflexTouch& touch : setup.touches) {
    if (touch.name.rfind("shear-x", 0) != 0 && touch.name.rfind("shear-y", 0) != 0) continue;
    training.push_back(record(touch, kShearTraining));
    const Record& one = training.back();
    for (std::size_t i = 0; i < one.pictures.size(); ++i) {
      if (one.pictures[i].truth.contact) lateral.push_back({one.readings[i].motion, one.pictures[i].truth.lateral_mm});
    }
  }
  model.lateral_mm_per_px = sensors::fit_lateral(lateral);
  for (const Record& one : training) {
    const auto more = reflex_shear_samples(reflex, one.points, 10);
    counts.insert(counts.end(), more.begin(), more.end());
    const auto seen = explore_shear_samples(model, one.readings, one.pictures);
    shifts.insert(shifts.end(), seen.begin(), seen.end());
  }
  const sensors::ShearLaw of_counts = sensors::fit_shear_law(counts);
  model.shear = sensors::fit_shear_law(shifts);
  const Record test = record(setup.touch("shear-45-3"), kShearTest);
  const auto samples = reflex_shear_samples(reflex, test.points, 10);
  const auto seen = explore_shear_samples(model, test.readings, test.pictures);
  const double half_N = 0.5 * shear_size_N(samples);
  rows.add_bounded(
      "shear.reflex_rms_N",
      fmt::format("shear of counts, 1.5 mm to and fro at 45 degrees under a press of 3 mm, learned along x "
                  "and y under 2 and 4 mm ({:.2f} there); bound: half of the shear's own root mean square",
                  of_counts.rms_residual_N),
      "N", Better::lower, half_N, false, shear_rms_N(of_counts, samples));
  rows.add_bounded(
      "shear.explore_rms_N",
      fmt::format("the same by the dots' shift ({:.2f} where it was learned)", model.shear->rms_residual_N), "N",
      Better::lower, half_N, false, shear_rms_N(*model.shear, seen));
}

void add_collision_rows(const ReflexSetup& setup, const sensors::ReflexModel& reflex,
                        const sensors::ExploreModel& model, const Scale& scale, const sensors::ReflexBudget& budget,
                        RowList& rows) {
  const ReflexTouch& plate = setup.touch("plate");
  const cv::Mat rest = rest_picture(setup, 8, kRest);
  for (const double speed_mm_s : {5.0, 10.0, 20.0, 50.0, 100.0}) {
    struct Sum {
      double peak_N = 0.0, reaction_ms = 0.0;
      int stops = 0, beyond = 0, early = 0;
    };
    std::array<Sum, 3> sums;
    for (const Watcher watcher : {Watcher::reflex, Watcher::explore, Watcher::nobody}) {
      Sum& sum = sums[static_cast<std::size_t>(watcher)];
      for (int i = 0; i < scale.crashes; ++i) {
        ReflexCollisionSettings settings;
        settings.budget = budget;
        settings.collision.speed_mm_s = speed_mm_s;
        // The touch comes at any time of a frame and of a picture.
        settings.collision.gap_mm = kGap_mm + speed_mm_s * kChipPixels / setup.chip.frame_rate_Hz * i / scale.crashes;
        const Collision run =
            collide(setup, plate, watcher, reflex, model, rest, settings, kCrash + static_cast<std::uint64_t>(i));
        sum.peak_N = std::max(sum.peak_N, run.peak_force_N);
        sum.beyond += run.beyond_law ? 1 : 0;
        if (!run.reaction_ms()) continue;
        ++sum.stops;
        sum.early += *run.reaction_ms() < 0.0 ? 1 : 0;
        sum.reaction_ms += *run.reaction_ms();
      }
    }
    const auto peak = [](const Sum& sum) {
      return fmt::format("{}{:.2f} N", sum.beyond > 0 ? "over " : "", sum.peak_N);
    };
    const Sum &fast = sums[0], &slow = sums[1], &none = sums[2];
    const auto when = [](const Sum& sum) {
      return sum.stops > 0 ? fmt::format("{:.1f} ms after the touch", sum.reaction_ms / sum.stops) : "too late";
    };
    rows.add_bounded(
        fmt::format("collision.{}mm_s_peak_N", speed_mm_s),
        fmt::format("largest force of {} collisions with a reflex, which brakes {} on average ({} before it); with "
                    "explore mode alone {}, {}; with nobody watching {}",
                    scale.crashes, when(fast), fast.early, peak(slow), when(slow), peak(none)),
        "N", Better::lower, slow.peak_N, false, fast.peak_N);
  }
}

/// Light without information, to both modes: it has to be said.
void add_fault_rows(const ReflexSetup& setup, const sensors::ReflexModel& reflex, RowList& rows) {
  const cv::Mat rest = rest_picture(setup, 8, kRest);
  cv::Mat light, bare;
  setup.touches.front().path_light.light_at(0.0, light);
  const cv::Scalar mean = cv::mean(light);
  bare = cv::Mat(light.size(), light.type(), mean);
  struct Case {
    cv::Mat light;
    sensors::ChipFault chip;
    sensors::PictureFault picture;
  };
  const std::vector<Case> cases = {{light * 0.0, sensors::ChipFault::dark, sensors::PictureFault::dark},
                                   {light * 1e4, sensors::ChipFault::saturated, sensors::PictureFault::saturated},
                                   {bare, sensors::ChipFault::flat, sensors::PictureFault::flat}};
  int detected = 0;
  std::string titles;
  for (const Case& one : cases) {
    render::MotionChip chip = setup.start_chip(kTest);
    render::PixelGrabber grabber;
    sensors::ReflexLoop loop(reflex, {});
    sensors::ExploreTracker tracker(rest, {});
    sensors::ReflexDecision decision;
    std::optional<GrabbedImage> image;
    bool blind = false, chip_says = false;
    while (!image) {
      const render::ChipFrame frame = chip.expose(one.light);
      decision = loop.next(frame.statistics);
      blind = blind || decision.fault != sensors::ChipFault::none;
      chip_says = chip_says || decision.fault == one.chip;
      image = grabber.add(frame);
    }
    const sensors::PictureFault fault = tracker.next({image->image, image->first_us}).fault;
    detected += (blind ? 1 : 0) + (fault != sensors::PictureFault::none ? 1 : 0);
    titles += fmt::format("{}{}: {}, {}", titles.empty() ? "" : "; ", name_of(one.picture),
                          chip_says ? name_of(one.chip) : name_of(decision.fault), name_of(fault));
  }
  rows.add_bounded("faults.detected_percent",
                   fmt::format("of pictures without information, detected by reflex and by explore mode ({})", titles),
                   "%", Better::higher, 100.0, false, 100.0 * detected / (2.0 * static_cast<double>(cases.size())));
}

}  // namespace

std::vector<ValidationRow> validate_reflex(const ValidateOptions& options) {
  datasets::use_one_blas_thread();
  const Scale scale(options.quick);
  RowList rows("reflex.", options, RowList::Since::last_row);
  sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "reflex.yaml");
  device.mesh.fine_mm *= scale.mesh;
  device.mesh.coarse_mm *= scale.mesh;
  const ReflexSetup setup = set_up_reflex(device, options.cache, reflex_row_touches(options.quick), scale.light,
                                          scale.path_light, options.progress);
  const ReflexTouch& plate = setup.touch("plate");
  rows.add_bounded("law.rms_N", "force of a plate from 0 to 5 mm, of finite elements, against eq. 1", "N",
                   Better::lower, kReflexLawRms_N, true,
                   reflex_law_rms([&](double z_mm) { return plate.truth(z_mm).normal_N; }));
  ValidationSeries law{"depth, mm", "force, N", {}, false};
  for (int k = 0; k <= 50; ++k) law.points.emplace_back(0.1 * k, plate.truth(0.1 * k).normal_N);
  rows.last().series = law;
  sensors::ReflexBudget budget;
  const sensors::ReflexModel reflex = add_reflex_rows(setup, scale, rows, budget);
  sensors::ExploreModel model = add_explore_rows(setup, scale, rows);
  if (!options.quick) add_shear_rows(setup, reflex, model, rows);
  add_collision_rows(setup, reflex, model, scale, budget, rows);
  add_fault_rows(setup, reflex, rows);
  return rows.rows();
}

}  // namespace touchstone::lab
