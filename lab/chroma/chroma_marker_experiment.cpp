#include "lab/chroma/chroma_marker_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/units.h"
#include "lab/chroma/chroma_force_experiment.h"
#include "lab/statistics/straight_line.h"
#include "sensors/colour/hue.h"
#include "sensors/tractions/seen_markers.h"
#include "sim/press/gel_setup.h"

namespace touchstone::lab {
namespace {

constexpr double kBall_mm = 2.0;  // radius of the ball of [Lin2019]
constexpr double kLeastMoved_mm = 0.02;

sim::ObjectSpec ball_of(double radius_mm, double friction) {
  sim::ObjectSpec ball;
  ball.name = "ball";
  ball.shape.radius_mm = radius_mm;
  ball.friction = friction;
  return ball;
}

sim::ObjectSpec cylinder_of(double radius_mm, double friction) {
  sim::ObjectSpec cylinder;
  cylinder.name = "cylinder";
  cylinder.shape.type = sim::ShapeKind::rounded_cylinder;
  cylinder.shape.radius_mm = radius_mm;
  cylinder.shape.edge_radius_mm = 0.2;
  cylinder.shape.height_mm = 6.0;
  cylinder.friction = friction;
  return cylinder;
}

sim::AxisKey at(double position_mm) {
  return {position_mm, std::nullopt};
}

/// From touch straight in, in `frames`, and then aside in `steps`.
sim::MotionSpec press_and_drag(const Eigen::Vector2d& place, double height_mm, double depth_mm, int frames,
                               const Eigen::Vector2d& drag_mm, int steps) {
  sim::MotionSpec motion;
  motion.start_mm = {place.x(), place.y(), height_mm};
  sim::MotionKey press;
  press.frames = frames;
  press.z = at(height_mm - depth_mm);
  motion.keys = {press};
  if (steps > 0) {
    sim::MotionKey drag;
    drag.frames = steps;
    drag.x = at(place.x() + drag_mm.x());
    drag.y = at(place.y() + drag_mm.y());
    motion.keys.push_back(drag);
  }
  return motion;
}

MarkerSeries read_series(const ChromaSetup& setup, const MarkerTest& test, const std::vector<ChromaRecord>& records,
                         std::size_t first) {
  const std::size_t marker = setup.marker_at(test.place_mm);
  const Eigen::Vector3d touch(test.place_mm.x(), test.place_mm.y(), kBall_mm);
  MarkerSeries series;
  for (std::size_t i = first; i < records.size(); ++i) {
    const sensors::ColourMarker& seen = records[i].reading.markers[marker];
    series.largest_strain = std::max(series.largest_strain, records[i].state.press.largest_strain);
    if (seen.flaw != sensors::MarkerFlaw::kNone) {
      ++series.flawed;
      continue;
    }
    series.ball_mm.push_back(records[i].state.press.gel_from_object.translation - touch);
    series.seen.push_back(seen);
  }
  series.depth_mm = kBall_mm - records.back().state.press.gel_from_object.translation.z();
  return series;
}

}  // namespace

std::vector<double> MarkerSeries::column_mm(int axis) const {
  std::vector<double> column;
  for (const Eigen::Vector3d& one : ball_mm) column.push_back(one[axis]);
  return column;
}

MarkerSeries press_series(const ChromaSetup& setup, const MarkerTest& test, double deepest_mm, double step_mm,
                          std::uint64_t seed) {
  const int steps = static_cast<int>(std::lround(deepest_mm / step_mm));
  const auto motion = press_and_drag(test.place_mm, kBall_mm, deepest_mm, steps, {0, 0}, 0);
  return read_series(setup, test, setup.play(marker_ball(test), motion, seed), 0);
}

MarkerSeries shear_series(const ChromaSetup& setup, const MarkerTest& test, double depth_mm,
                          const Eigen::Vector2d& end_mm, int steps, std::uint64_t seed) {
  const sim::MotionSpec motion = shear_motion(test, depth_mm, end_mm, steps);
  return read_series(setup, test, setup.play(marker_ball(test), motion, seed), 1);
}

sim::ObjectSpec marker_ball(const MarkerTest& test) {
  return ball_of(kBall_mm, test.friction);
}

sim::MotionSpec shear_motion(const MarkerTest& test, double depth_mm, const Eigen::Vector2d& end_mm, int steps) {
  return press_and_drag(test.place_mm, kBall_mm, depth_mm, 1, end_mm, steps);
}

std::vector<double> hue_repeats_deg(const ChromaSetup& setup, std::uint64_t seed, int pictures) {
  TS_ASSERT(pictures > 1);
  sensors::ColourMarkerFinder finder = setup.finder();
  const std::size_t markers = setup.rest().markers.size();
  std::vector<double> sum(markers, 0.0);
  std::vector<double> square(markers, 0.0);
  for (int i = 0; i < pictures; ++i) {
    const sensors::ColourMarkerReading& reading = finder.find(setup.sensor().background(seed, i));
    for (std::size_t m = 0; m < markers; ++m) {
      const double change =
          sensors::hue_difference(reading.markers[m].hue, setup.rest().markers[m].hue) / kRadiansPerDegree;
      sum[m] += change;
      square[m] += change * change;
    }
  }
  std::vector<double> deviations;
  for (std::size_t m = 0; m < markers; ++m) {
    deviations.push_back(std::sqrt(std::max(0.0, square[m] - sum[m] * sum[m] / pictures) / (pictures - 1)));
  }
  return deviations;
}

HueAgainstDepth hue_against_depth(const ChromaSetup& setup, const MarkerSeries& press, std::size_t marker) {
  HueAgainstDepth found;
  for (std::size_t i = 0; i < press.seen.size(); ++i) {
    found.depth_mm.push_back(-press.ball_mm[i].z());
    found.change_deg.push_back(sensors::hue_difference(press.seen[i].hue, setup.rest().markers[marker].hue) /
                               kRadiansPerDegree);
  }
  return found;
}

std::vector<sensors::HueModelForm> forms_of_one_marker() {
  std::vector<sensors::HueModelForm> forms;
  for (const sensors::HueModelForm& form : sensors::usual_hue_forms()) {
    if (!form.features.of_surroundings()) forms.push_back(form);
  }
  return forms;
}

std::vector<sensors::HueSample> samples_of(const MarkerSeries& series, std::size_t marker, int number) {
  std::vector<sensors::HueSample> samples;
  for (std::size_t i = 0; i < series.seen.size(); ++i) {
    samples.push_back({marker, series.seen[i], series.ball_mm[i], number});
  }
  return samples;
}

InverseScore score_inverse(const ChromaSetup& setup, const sensors::HueModel& model, std::size_t marker,
                           const std::vector<MarkerSeries>& series) {
  const sensors::HueEstimator estimator(model, setup.rest());
  InverseScore score;
  double squares = 0.0;
  for (const MarkerSeries& one : series) {
    std::vector<double> truth[2];
    std::vector<double> estimate[2];
    for (std::size_t i = 0; i < one.seen.size(); ++i) {
      const sensors::HueEstimate found = estimator.estimate(marker, one.seen[i]);
      if (!found.measured) continue;
      const Eigen::Vector3d error_um = 1000.0 * (found.displacement_mm - one.ball_mm[i]);
      score.largest_lateral_um = std::max(score.largest_lateral_um, error_um.head<2>().cwiseAbs().maxCoeff());
      score.largest_press_um = std::max(score.largest_press_um, std::abs(error_um.z()));
      squares += error_um.squaredNorm() / 3.0;
      ++score.samples;
      for (int axis = 0; axis < 2; ++axis) {
        truth[axis].push_back(one.ball_mm[i][axis]);
        estimate[axis].push_back(found.displacement_mm[axis]);
      }
    }
    for (int axis = 0; axis < 2; ++axis) {
      const auto [low, high] = std::ranges::minmax(truth[axis]);
      if (high - low > 0.1) score.worst_r2 = std::min(score.worst_r2, line_through(truth[axis], estimate[axis]).r2);
    }
  }
  score.largest_um = std::max(score.largest_lateral_um, score.largest_press_um);
  score.rms_um = score.samples > 0 ? std::sqrt(squares / score.samples) : std::numeric_limits<double>::quiet_NaN();
  return score;
}

sensors::HueModel calibrate_field(const ChromaSetup& setup, bool quick, std::uint64_t seed) {
  struct Touch {
    sim::ObjectSpec object;
    double height_mm, depth_mm;
    Eigen::Vector2d place, drag;
  };
  std::vector<Touch> touches = {
      {ball_of(kBall_mm, 0.8), kBall_mm, 2.5, {1.5, 1.5}, {0.8, 0.3}},
      {ball_of(6.35, 0.8), 6.35, 1.8, {-1.0, 2.0}, {-0.5, 0.7}},
      {cylinder_of(4.25, 0.8), 0.0, 1.2, {0.7, -0.9}, {0.4, -0.8}},
  };
  if (!quick) {
    touches.push_back({ball_of(kBall_mm, 0.3), kBall_mm, 1.8, {-4.5, 1.5}, {-0.6, -0.7}});
    touches.push_back({ball_of(4.0, 0.3), 4.0, 2.2, {3.6, -2.8}, {0.2, 0.9}});
    touches.push_back({ball_of(11.0, 1.0), 11.0, 1.5, {1.8, 0.4}, {0.9, 0.0}});
    touches.push_back({cylinder_of(3.0, 0.4), 0.0, 1.5, {-2.2, -3.1}, {-0.7, 0.3}});
    touches.push_back({cylinder_of(6.0, 1.0), 0.0, 0.8, {0.3, 0.6}, {0.5, 0.5}});
  }
  std::vector<sensors::HueSample> samples;
  int number = 0;
  for (const Touch& touch : touches) {
    const auto motion = press_and_drag(touch.place, touch.height_mm, touch.depth_mm, 6, touch.drag, 4);
    const auto records = setup.play(touch.object, motion, seed + static_cast<std::uint64_t>(number));
    const auto found = samples_of_moved(records, kLeastMoved_mm, number);
    samples.insert(samples.end(), found.begin(), found.end());
    ++number;
  }
  return best_hue_model(setup, samples, sensors::usual_hue_forms(), HueAim::lateral);
}

sensors::TractionInversion elastic_inversion(const ChromaSetup& setup, const std::filesystem::path& cache,
                                             const sensors::ViewParallax& parallax) {
  const sim::DeviceSpec device = with_probe_mesh(setup.sensor().device());
  const auto gel = sim::set_up_gel(device, cache);
  // Chosen on the presses of calibrate_field with another unit. Where an object is wide hue shows a fifth of the press
  // and is alike over neighbours, which noise isn't: so normal displacements count for next to nothing, lateral ones,
  // which err by 2 um where nothing touches, for all; a rim's pressure is of the order of the modulus.
  constexpr sensors::TractionSettings kNoise{.lateral_noise_mm = 0.002, .normal_noise_mm = 1.0, .scale = 1.0};
  return sensors::TractionInversion(sensors::as_seen(export_marker_compliance(device, *gel), parallax), kNoise);
}

FieldScore field_under(const ChromaSetup& setup, const sensors::HueModel& model, sensors::TractionInversion& inversion,
                       const sim::ObjectSpec& punch, double height_mm, double depth_mm, const Eigen::Vector2d& place_mm,
                       std::uint64_t seed) {
  const auto records = setup.play(punch, press_and_drag(place_mm, height_mm, depth_mm, 3, {0, 0}, 0), seed);
  const ChromaRecord& record = records.back();
  const sensors::HueField found = sensors::HueEstimator(model, setup.rest()).estimate(record.reading);
  FieldScore score;
  const sensors::MarkerField seen = sensors::as_seen(found.field, inversion.compliance(), model.parallax);
  const sensors::MarkerField elastic =
      sensors::as_they_are(sensors::displacements_under(inversion.compliance(), inversion.invert(seen).traction),
                           inversion.compliance(), model.parallax);
  score.punch = punch.name;
  score.truth = record.truth;
  double press = 0.0;
  double lateral = 0.0;
  for (std::size_t i = 0; i < record.truth.size(); ++i) {
    const double off_um = 1000.0 * (elastic.displacement[i] - record.truth[i]).norm();
    score.elastic_mean_um += off_um / static_cast<double>(record.truth.size());
    score.elastic_worst_um = std::max(score.elastic_worst_um, off_um);
    score.largest_true_um = std::max(score.largest_true_um, 1000.0 * record.truth[i].norm());
    if (found.field.measured[i] == 0) {
      ++score.flawed;
      score.estimate.push_back(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
      continue;
    }
    score.estimate.push_back(found.field.displacement[i]);
    const Eigen::Vector3d error_um = 1000.0 * (found.field.displacement[i] - record.truth[i]);
    ++score.measured;
    if (found.extrapolated[i] != 0) ++score.extrapolated;
    score.mean_um += error_um.norm();
    score.worst_um = std::max(score.worst_um, error_um.norm());
    press += error_um.z() * error_um.z();
    lateral += 0.5 * error_um.head<2>().squaredNorm();
  }
  const double n = std::max(1, score.measured);
  score.mean_um /= n;
  score.rms_um = std::sqrt((press + 2.0 * lateral) / n);
  score.press_rms_um = std::sqrt(press / n);
  score.lateral_rms_um = std::sqrt(lateral / n);
  return score;
}

std::vector<PunchTest> fig10_punches() {
  constexpr double kFriction = 0.6;
  PunchTest square;
  square.object.name = "square";
  square.object.shape.type = sim::ShapeKind::box;
  square.object.shape.size_mm = {10, 10, 6};
  square.object.friction = kFriction;
  square.height_mm = 3.0;
  square.depth_mm = 1.0;
  PunchTest cylinder{cylinder_of(5.0, kFriction), 0.0, 1.0};
  PunchTest hemisphere{ball_of(8.0, kFriction), 8.0, 2.0};
  hemisphere.object.name = "hemisphere";
  return {square, cylinder, hemisphere};
}

}  // namespace touchstone::lab
