// Fig. 6 of [Lin2019, sec. III.D] on markers that light made: how well hue and a black marker's size tell a
// displacement with few pixels and in uneven light; and how fast the estimator is.

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "core/seconds_since.h"
#include "lab/chroma/chroma_setup.h"
#include "lab/chroma/rendered_robustness.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "lab/validation/row_list.h"
#include "sensors/colour/hue_estimator.h"
#include "sim/scene/device.h"

namespace touchstone::lab {
namespace {

constexpr double kPublishedHueR2 = 0.98;
constexpr double kPublishedHue_percent = 1.0;
constexpr double kPublishedSize_percent = 50.0;
constexpr double kFewest_px = 4.0;
constexpr double kCamera_Hz = 30.0;
constexpr std::uint64_t kSeed = 6000;

struct Ladder {
  std::vector<RobustnessRung> rungs;
  RobustnessSettings settings;
};

/// The blur that the paper puts over its pictures mixes so much white into the film's yellow that none of it has the
/// saturation of 0.5 that the sensor asks for; as in the drawing half of that is asked for here.
Ladder rendered_ladder(const ValidateOptions& options) {
  RenderedRungs how;
  if (options.quick) {
    how.filter_px = 64.0;
    how.count = 13;
  }
  Ladder ladder{rendered_robustness_rungs(read_tilt_spectra(options.scenes / "spectra"), how, kSeed),
                drawn_robustness_settings()};
  ladder.settings.filter_px = how.filter_px;
  return ladder;
}

/// Pictures of the device at rest and under a ball that is pressed in and sheared, and a model for them.
struct Clip {
  cv::Mat rest;
  std::vector<cv::Mat> frames;
  sensors::HueModel model;
};

Clip make_clip(const ValidateOptions& options) {
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / "chroma.yaml"), options.cache,
                                  chroma_sensor_settings(kSeed));
  const ChromaSetup setup(sensor, kSeed);
  const sim::ObjectSpec ball = with_friction(ball_of(8.0), 1.0);
  sim::MotionSpec motion;
  const double touching = sim::first_touch({}, ball, sensor.device().gel);
  motion.start_mm = {0.0, 0.0, touching};
  sim::MotionKey press, shear;
  press.frames = 2;
  press.z = sim::AxisKey{touching - 1.5, std::nullopt};
  shear.frames = 2;
  shear.x = sim::AxisKey{0.6, std::nullopt};
  motion.keys = {press, shear};
  const sim::TouchObject touched = sensor.object(ball);
  std::vector<sim::Truth> states = sensor.play(touched, motion);
  states.erase(states.begin());  // the ball only just touches
  Clip clip;
  clip.rest = sensor.background(kSeed);
  clip.frames = setup.pictures(touched, states, kSeed);
  sensors::HueCalibrationSettings settings;
  settings.spacing_mm = setup.spacing_mm();
  settings.parallax = parallax_of(sensor.device());
  const std::vector<sensors::HueSample> samples = samples_of_moved(setup.read(clip.frames, states), 0.02, 0);
  clip.model = sensors::calibrate_hue(setup.rest(), samples, settings);
  return clip;
}

/// The device's square picture as a camera of another size has it: its height filled, its sides with what is at the
/// edges.
cv::Mat seen_by(const cv::Mat& picture, const cv::Size& size) {
  cv::Mat scaled, whole;
  cv::resize(picture, scaled, {size.height, size.height}, 0.0, 0.0,
             size.height < picture.rows ? cv::INTER_AREA : cv::INTER_LINEAR);
  const int left = (size.width - size.height) / 2;
  cv::copyMakeBorder(scaled, whole, 0, 0, left, size.width - size.height - left, cv::BORDER_REPLICATE);
  return whole;
}

/// Frames to fields a second of one core: the best of some rounds.
double rate_Hz(const Clip& clip, const cv::Size& size) {
  constexpr int kRounds = 6;
  constexpr int kTurns = 4;  // of the clip, a round
  sensors::ColourMarkerFinder finder({});
  const sensors::HueEstimator estimator(clip.model, finder.find_rest(seen_by(clip.rest, size)));
  std::vector<cv::Mat> frames;
  for (const cv::Mat& frame : clip.frames) frames.push_back(seen_by(frame, size));
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  double best = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const double begun = thread_seconds();
    for (int turn = 0; turn < kTurns; ++turn) {
      for (const cv::Mat& frame : frames) estimator.estimate(finder.find(frame));
    }
    best = std::max(best, kTurns * static_cast<double>(frames.size()) / (thread_seconds() - begun));
  }
  cv::setNumThreads(threads);
  return best;
}

}  // namespace

std::vector<ValidationRow> validate_chroma_robustness(const ValidateOptions& options) {
  RowList rows("chroma.", options, RowList::Since::last_row);
  const auto report = [&](std::int64_t done) {
    if (options.progress) options.progress("chroma: robustness", done, 3);
  };

  /// Both methods over all sizes, and the rows of the smallest.
  const auto add_pixels = [&](const Ladder& ladder, const std::string& prefix, const std::string& what) {
    const std::vector<PixelRobustness> sizes = pixel_robustness(ladder.rungs, ladder.settings);
    const PixelRobustness& few = sizes.back();
    const auto series = [&](double PixelRobustness::*member, const std::string& y) {
      ValidationSeries made{"marker's side, px", y, {}};
      for (const PixelRobustness& size : sizes) made.points.emplace_back(size.marker_px, size.*member);
      return made;
    };
    ValidationRow& hue = rows.add(
        fmt::format("pixels.{}hue_r2_4px", prefix),
        fmt::format("R2 of displacement by hue, fit of second order, {:.0f} px a marker; {}", few.marker_px, what), "1",
        few.hue_r2, Better::higher, few.hue_r2 > kPublishedHueR2);
    hue.published = kPublishedHueR2;
    hue.series = series(&PixelRobustness::hue_r2, "R2 by hue");
    ValidationRow& size = rows.add(
        fmt::format("pixels.{}size_r2_4px", prefix),
        fmt::format("the rival that hue is to beat: R2 by a black marker's pixels; holds where hue beats it, and few "
                    "pixels cost it half of what they cost in the paper or more; {}",
                    what),
        "1", few.size_r2, Better::near, few.hue_r2 > few.size_r2);
    size.published = kPublishedSizeR2;
    if (!size_is_lost(few)) deny(size, "the size of a marker of 4 x 4 px shows little of a displacement");
    size.series = series(&PixelRobustness::size_r2, "R2 by size");
  };
  const auto add_gradient = [&](const Ladder& ladder, double marker_px, const std::string& suffix,
                                const std::string& what) {
    const GradientShift worst = gradient_robustness(ladder.rungs, ladder.settings, marker_px).worst;
    rows.add("gradient." + suffix + "hue_percent",
             fmt::format("hue's change by a gradient of light of 25 %, of its range, worst; {}", what), "%",
             worst.hue_percent, Better::lower, worst.hue_percent < kPublishedHue_percent)
        .published = kPublishedHue_percent;
    rows.add(
            "gradient." + suffix + "size_percent",
            fmt::format(
                "the rival that hue is to beat, and holds where it does: a black marker's luminosity, worst; {}", what),
            "%", worst.darkness_percent, Better::near, worst.hue_percent < worst.darkness_percent)
        .published = kPublishedSize_percent;
  };

  report(0);
  const Ladder rendered = rendered_ladder(options);
  const double most_px = rendered.settings.filter_px;
  add_pixels(rendered, "", "markers traced in bands");
  add_gradient(rendered, most_px, "", fmt::format("markers traced in bands, {:.0f} px", most_px));
  add_gradient(rendered, kFewest_px, "4px_", "markers traced in bands, 4 px");
  Ladder hazy = rendered;
  hazy.settings.kind = LightGradient::overlay;
  add_gradient(hazy, most_px, "haze_", "laid over as black to white, which adds grey; markers traced in bands");
  Ladder sharp = rendered;
  sharp.settings.blur = 0.0;
  sharp.settings.least_saturation = RobustnessSettings().least_saturation;
  add_pixels(sharp, "sharp_", "traced, without the paper's blur, pixels of more than half saturation");
  report(1);

  const Ladder drawn{drawn_robustness_rungs(), drawn_robustness_settings()};
  add_pixels(drawn, "drawn_", "the paper's drawing");
  add_gradient(drawn, drawn.settings.filter_px, "drawn_", "the paper's drawing");
  report(2);

  const Clip clip = make_clip(options);
  const auto add_rate = [&](const std::string& id, const cv::Size& size) {
    const double rate = rate_Hz(clip, size);
    rows.add(id, fmt::format("frames of {} x {}, the device's scaled, to fields on one core", size.width, size.height),
             "Hz", rate, Better::higher, rate >= kCamera_Hz)
        .reference = kCamera_Hz;
  };
  add_rate("rate_Hz", {640, 480});
  add_rate("rate_text_Hz", {7952, 5304});
  report(3);
  return rows.rows();
}

}  // namespace touchstone::lab
