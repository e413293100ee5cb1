#include "lab/studies/colour_design_study.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/named_file.h"
#include "lab/chroma/chroma_marker_experiment.h"
#include "lab/studies/centroid_bound.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kUnit = 41;
constexpr std::uint64_t kRest = 1000;
constexpr std::uint64_t kPress = 2000;
constexpr std::uint64_t kShear = 3000;
constexpr std::uint64_t kDiagonal = 4000;
constexpr std::uint64_t kTest = 5000;
constexpr int kRestPictures = 10;
constexpr double kBoundStep_mm = 0.05;  // of the ball, to either side: wide against what direct light's rays miss
constexpr double kBoundShear = 0.25;    // of the shear: where the bound is asked for
constexpr double kBall_mm = 2.0;        // radius of the ball of [Lin2019]

/// Least standard deviations (mm) of the ball's x, y, z from one whole picture, at mid depth.
Eigen::Vector3d least_error(const ColourDesignSpec& spec, const sim::VirtualSensor& sensor,
                            const Eigen::Vector2d& place) {
  sim::ObjectSpec ball;
  ball.name = "ball";
  ball.shape.radius_mm = kBall_mm;
  ball.friction = spec.friction;
  const sim::TouchObject object = sensor.object(ball);
  const double depth = spec.shear_depths_mm[spec.shear_depths_mm.size() / 2];
  const auto light_at = [&](const Eigen::Vector3d& by) {
    sim::MotionSpec motion;
    motion.start_mm = {place.x(), place.y(), kBall_mm};
    sim::MotionKey press;
    press.z = sim::AxisKey{kBall_mm - depth + by.z(), std::nullopt};
    sim::MotionKey drag;
    drag.frames = 2;
    drag.x = sim::AxisKey{place.x() + kBoundShear * spec.shear_mm + by.x(), std::nullopt};
    drag.y = sim::AxisKey{place.y() + kBoundShear * spec.shear_mm + by.y(), std::nullopt};
    motion.keys = {press, drag};
    return sensor.capture(object, sensor.play(object, motion).back().press, kRest, 0, false).light;
  };
  sim::SceneSpec scene;
  scene.device = sensor.device();
  scene.object = ball;
  const render::Imager imager = sim::imager(sensor.device(), sim::choose_bands(scene), true);
  std::vector<cv::Mat> slopes;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d step = kBoundStep_mm * Eigen::Vector3d::Unit(a);
    slopes.push_back((light_at(step) - light_at(-step)) / (2.0 * kBoundStep_mm));
  }
  const Eigen::MatrixXd information = picture_information(light_at({0, 0, 0}), slopes, imager);
  return information.inverse().diagonal().cwiseSqrt();
}

enum Figure {
  kLargest,
  kLargestPress,
  kLargestLateral,
  kRms,
  kNoise,
  kSlope,
  kHueNoise,
  kBoundPress,
  kBoundLateral,
  kFlawed,
  kStrain,
  kFigures
};

}  // namespace

void fields(YamlReader& in, ColourDesignSpec& spec) {
  std::string device;
  in.required("device", device);
  plan_fields(in, spec.plan);
  in.optional("place_mm", spec.place_mm);
  in.optional("friction", spec.friction, Allowed::above(0.0));
  in.optional("deepest_mm", spec.deepest_mm, Allowed::above(0.0));
  in.optional("press_step_mm", spec.press_step_mm, Allowed::above(0.0));
  in.optional("shear_depths_mm", spec.shear_depths_mm, Allowed::above(0.0));
  in.optional("shear_mm", spec.shear_mm, Allowed::above(0.0));
  in.optional("shear_steps", spec.shear_steps, Allowed::within(2, 1000));
  in.optional("error_um", spec.error_um, Allowed::above(0.0));
  if (in.describing()) return;  // the file that it names isn't there
  check_plan(in, spec.plan);
  if (spec.shear_depths_mm.size() < 2 || !std::is_sorted(spec.shear_depths_mm.begin(), spec.shear_depths_mm.end())) {
    fail_at(in.where("shear_depths_mm"), "shear_depths_mm: needs two depths or more, rising");
  }
  spec.base = read_design_base(named_file(in, "device", device));
  const sim::DeviceSpec& read = spec.base.device;
  if (!read.coating || !read.coating->print || !read.camera) {
    fail_at(in.where("device"), "device: {} has no {}; this study needs printed markers and a camera", read.name,
            read.camera ? "printed markers" : "camera");
  }
  check_paths(spec.base, spec.plan);
}

std::vector<DesignFigure> colour_design_figures(const ColourDesignSpec& spec) {
  const std::string test =
      fmt::format("in shears of {:.4g} mm along a diagonal that wasn't calibrated on", spec.shear_mm);
  return {
      {"largest_error_um", Better::lower, "largest error of a component of the displacement " + test},
      {"largest_press_error_um", Better::lower, "likewise of the normal one"},
      {"largest_lateral_error_um", Better::lower, "likewise of the lateral ones"},
      {"rms_error_um", Better::lower, "root mean square error of a component there"},
      {"depth_noise_um", Better::lower, "what the hue's noise makes of a depth: hue_noise_deg over hue_deg_per_mm"},
      {"hue_deg_per_mm", Better::higher, "how fast the hue changes with the depth of the ball"},
      {"hue_noise_deg", Better::lower, "standard deviation of a marker's hue in pictures of the untouched device"},
      {"bound_press_um", Better::lower,
       "least standard deviation that any unbiased estimate of the ball's depth from a picture can have (Cramer-Rao, "
       "all pixels)"},
      {"bound_lateral_um", Better::lower, "likewise of its place along the gel, the worse axis"},
      {"flawed", Better::lower, "pictures in which the marker couldn't be read"},
      {"largest_strain", Better::near, "of the gel's surface in the deepest press"},
  };
}

std::vector<double> colour_design(const ColourDesignSpec& spec, const sim::DeviceSpec& device,
                                  const std::filesystem::path& cache) {
  const sim::VirtualSensor sensor(device, cache, chroma_sensor_settings(kUnit));
  const ChromaSetup setup(sensor, kRest);
  const std::size_t marker = setup.marker_at(spec.place_mm);
  const MarkerTest test{setup.markers().markers[marker].centre, spec.friction};
  std::vector<double> figures(kFigures, kNone);

  const MarkerSeries press = press_series(setup, test, spec.deepest_mm, spec.press_step_mm, kPress);
  int flawed = press.flawed;
  std::vector<sensors::HueSample> samples = samples_of(press, marker, 0);
  int series = 1;
  const auto add = [&](const MarkerSeries& one) {
    flawed += one.flawed;
    const auto more = samples_of(one, marker, series++);
    samples.insert(samples.end(), more.begin(), more.end());
  };
  const auto& depths = spec.shear_depths_mm;
  for (std::size_t k = 0; k < depths.size(); ++k) {
    add(shear_series(setup, test, depths[k], {spec.shear_mm, 0}, spec.shear_steps, kShear + k));
  }
  // A model that isn't linear has to see shear in more than one direction; at depths between those that are tested.
  for (std::size_t k = 0; k + 1 < depths.size(); ++k) {
    const Eigen::Vector2d shear(spec.shear_mm, spec.shear_mm);
    add(shear_series(setup, test, 0.5 * (depths[k] + depths[k + 1]), shear, spec.shear_steps, kDiagonal + k));
  }
  std::vector<MarkerSeries> tests;
  for (std::size_t k = 1; k < depths.size(); ++k) {
    const Eigen::Vector2d shear(spec.shear_mm, spec.shear_mm);
    tests.push_back(shear_series(setup, test, depths[k], shear, spec.shear_steps, kTest + k));
    flawed += tests.back().flawed;
  }
  const sensors::HueModel model = best_hue_model(setup, samples, forms_of_one_marker(), HueAim::displacement);
  const InverseScore score = score_inverse(setup, model, marker, tests);
  if (score.samples == 0) fail("no picture of the test could be read");
  figures[kLargest] = score.largest_um;
  figures[kLargestPress] = score.largest_press_um;
  figures[kLargestLateral] = score.largest_lateral_um;
  figures[kRms] = score.rms_um;
  figures[kHueNoise] = hue_repeats_deg(setup, kRest, kRestPictures)[marker];
  figures[kSlope] = std::abs(hue_against_depth(setup, press, marker).line().slope);
  figures[kNoise] = 1000.0 * figures[kHueNoise] / figures[kSlope];
  const Eigen::Vector3d least_um = 1000.0 * least_error(spec, sensor, test.place_mm);
  figures[kBoundPress] = least_um.z();
  figures[kBoundLateral] = least_um.head<2>().maxCoeff();
  figures[kFlawed] = flawed;
  figures[kStrain] = press.largest_strain;
  return figures;
}

DesignTable run_colour_design(const ColourDesignSpec& spec, const std::filesystem::path& cache,
                              const Progress& progress) {
  return try_designs(
      spec.plan, spec.base, colour_design_figures(spec),
      [&](const sim::DeviceSpec& device) { return colour_design(spec, device, cache); }, false, progress);
}

StudyResult report(const std::string& name, const ColourDesignSpec& spec, const DesignTable& table) {
  const auto number = [&](const char* figure) { return figure_number(table.figures, figure, {}); };
  const std::size_t largest = number("largest_error_um");
  std::optional<std::size_t> best;
  int meeting = 0, had = 0;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    if (!table.faults[d].empty()) continue;
    ++had;
    meeting += table.values[d][largest] <= spec.error_um;
    if (!best || table.values[d][largest] < table.values[*best][largest]) best = d;
  }
  DesignStory report;
  report.name = name;
  report.title =
      fmt::format("{} designs; wanted is a largest error of {:.4g} um in presses that the model wasn't calibrated on.",
                  table.points.size(), spec.error_um);
  report.answer = fmt::format("{} of {} designs can be read, {} of them meet it.\n", had, table.points.size(), meeting);
  if (best) {
    const std::vector<double>& of = table.values[*best];
    report.chosen = {*best};
    report.answer += fmt::format(
        "\n**{}: {}**: {:.3g} um at worst ({:.3g} um as the device is), {:.3g} um root mean square ({:.3g}). Its hue "
        "turns by "
        "{:.3g} degrees a mm ({:.3g}), so its noise is worth {:.2g} um of depth ({:.2g}); a whole picture could "
        "measure "
        "the depth to "
        "{:.2g} um and the place to {:.2g} um (bounds; as it is {:.2g} and {:.2g}).\n",
        meeting > 0 ? "The smallest error" : "None meets it. Nearest comes",
        name_of_point(table.plan, table.points[*best]), of[kLargest], table.base[kLargest], of[kRms], table.base[kRms],
        of[kSlope], table.base[kSlope], of[kNoise], table.base[kNoise], of[kBoundPress], of[kBoundLateral],
        table.base[kBoundPress], table.base[kBoundLateral]);
    report.answer +=
        of[kRms] > 3.0 * std::max(of[kBoundPress], of[kBoundLateral])
            ? "\nThe picture knows more than the model reads from one marker: another estimator would help more than "
              "another sensor.\n"
            : "\nThe model is near what the picture knows: to be better, the sensor must change.\n";
  }
  report.pareto = {number("rms_error_um"), number("depth_noise_um"), number("bound_press_um")};
  for (const char* drawn : {"largest_error_um", "rms_error_um", "depth_noise_um", "hue_deg_per_mm", "bound_press_um"}) {
    report.drawn.push_back(number(drawn));
  }
  return design_report(table, report);
}

}  // namespace touchstone::lab
