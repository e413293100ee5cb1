// Height maps of the gelsight sensor [Li2015, sec. 2.2]: error against the true membrane, resolution, what is visible,
// rate. Calibrated on the simulated device with a 2 mm ball as a user would, tested on what calibration never saw.

#include <fmt/format.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "lab/validation/row_list.h"

namespace touchstone::lab {
namespace {

constexpr double kPublishedRate_Hz = 20.0;        // sec. 2.2.3, Matlab, 320 x 240
constexpr double kPublishedResolution_um = 40.0;  // sec. 2.2.3: 10 to 40 um, "depending on the imaging system"
constexpr double kWantedSpeedUp = 100.0;
constexpr double kSeen = 0.1;     // of a grating's contrast: what counts as resolved
constexpr double kVisible = 3.0;  // standard deviations of the noise
constexpr std::uint64_t kCalibrationSeed = 1000;
constexpr std::uint64_t kTestSeed = 9000;
// Of the fine contact's pixels: the finest grating has 6 of them a period.
constexpr double kMembrane_um = 20.0;
constexpr double kPortableMembrane_um = 8.0;

/// What all rows share.
struct Setup {
  const sim::VirtualSensor& sensor;
  sensors::HeightEstimator& estimator;
  bool quick;
};

struct Errors {
  double mean_um = 0.0;
  double worst_um = 0.0;
  double ball_mean_um = 0.0;
  double ball_worst_um = 0.0;
};

Errors errors_of_shapes(const Setup& setup) {
  std::vector<sim::ObjectSpec> objects;
  for (const double diameter : {2.0, 4.0, 4.75, 8.0, 12.7, 22.25, 25.45}) {
    if (!setup.quick || diameter == 4.0 || diameter == 12.7) objects.push_back(ball_of(diameter));
  }
  const std::size_t balls = objects.size();
  objects.push_back(flat_cylinder_of(8.5));
  Errors errors;
  double sum = 0.0;
  double ball_sum = 0.0;
  int count = 0;
  int ball_count = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const sim::TouchObject object = setup.sensor.object(objects[i]);
    for (const double depth : {0.2, 0.5}) {
      for (const Eigen::Vector2d& place : {Eigen::Vector2d(0.7, -0.9), Eigen::Vector2d(-3.1, 2.0)}) {
        if (i >= balls && place.x() < 0.0) continue;  // it would run out of the picture
        const sim::Touch touch = setup.sensor.press(object, {.place_mm = place, .depth_mm = depth},
                                                    {.noise_seed = kTestSeed + static_cast<unsigned>(count)});
        const HeightError error = height_error(setup.estimator.estimate(touch.frame), touch, setup.sensor.mm_per_px());
        sum += error.mean_um;
        errors.worst_um = std::max(errors.worst_um, error.worst_um);
        ++count;
        if (i >= balls) continue;
        ball_sum += error.mean_um;
        errors.ball_worst_um = std::max(errors.ball_worst_um, error.worst_um);
        ++ball_count;
      }
    }
  }
  errors.mean_um = sum / count;
  errors.ball_mean_um = ball_sum / ball_count;
  return errors;
}

/// Standard deviation of a pixel's height from frame to frame, um, round the middle of a press that is held.
double noise_um(const Setup& setup, const sim::TouchObject& object, const sim::PressSpec& press) {
  constexpr int kFrames = 6;
  cv::Mat sum;
  cv::Mat squares;
  for (int i = 0; i < kFrames; ++i) {
    const sim::Touch touch =
        setup.sensor.press(object, press, {.truth = false, .noise_seed = kTestSeed + 500U + static_cast<unsigned>(i)});
    cv::Mat heights;
    setup.estimator.estimate(touch.frame).height_mm.convertTo(heights, CV_64F);
    if (sum.empty()) {
      sum = cv::Mat::zeros(heights.size(), CV_64F);
      squares = sum.clone();
    }
    sum += heights;
    squares += heights.mul(heights);
  }
  const cv::Mat variance = (squares - sum.mul(sum) / kFrames) / (kFrames - 1);
  const double half_mm = 1.0;
  const auto middle = setup.sensor.pixel_from_gel(press.place_mm);
  const int half = static_cast<int>(half_mm / setup.sensor.mm_per_px());
  const cv::Rect part(static_cast<int>(middle.x()) - half, static_cast<int>(middle.y()) - half, 2 * half, 2 * half);
  return kMicrometresPerMillimetre * std::sqrt(cv::mean(variance(part))[0]);
}

/// A square of the picture round the middle of the gel.
cv::Rect middle_square(const sim::VirtualSensor& sensor, double half_mm) {
  const Eigen::Vector2d middle = sensor.pixel_from_gel({0, 0});
  const int half = static_cast<int>(half_mm / sensor.mm_per_px());
  return {static_cast<int>(middle.x()) - half, static_cast<int>(middle.y()) - half, 2 * half, 2 * half};
}

/// A grating pressed in, and what of its contrast is in the estimate.
struct Transfer {
  double pitch_mm = 0.0;
  double estimate = 0.0;
};

Transfer transfer_of(const Setup& setup, double pitch_mm) {
  constexpr double kAmplitude_um = 20.0;
  constexpr double kDepth_mm = 0.12;
  sim::ObjectSpec object = flat_cylinder_of(4.0);
  object.relief = sim::ReliefSpec{sim::WavesRelief{kAmplitude_um, pitch_mm}};
  const sim::TouchObject grating = setup.sensor.object(object);
  const sim::Touch touch =
      setup.sensor.press(grating, {.depth_mm = kDepth_mm}, {.truth = false, .noise_seed = kTestSeed + 700U});
  const cv::Rect part = middle_square(setup.sensor, 1.1);
  const double wavelength_px = pitch_mm / setup.sensor.mm_per_px();
  const double half_um = 0.5 * kAmplitude_um;
  const double amplitude_mm = wave_amplitude(setup.estimator.estimate(touch.frame).height_mm, part, wavelength_px);
  return {pitch_mm, kMicrometresPerMillimetre * amplitude_mm / half_um};
}

std::vector<Transfer> transfers(const Setup& setup, const std::vector<double>& pitches_mm) {
  std::vector<Transfer> result;
  for (const double pitch : pitches_mm) result.push_back(transfer_of(setup, pitch));
  return result;
}

/// Coarse to fine.
std::vector<double> fingertip_pitches_mm(bool quick) {
  if (quick) return {0.5, 0.2, 0.16};
  return {1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.16, 0.13, 0.115};
}

/// For the pixels of gelsight-portable, which are 19 um on the gel.
std::vector<double> portable_pitches_mm(bool quick) {
  if (quick) return {0.18, 0.085, 0.07};
  return {0.35, 0.25, 0.18, 0.13, 0.1, 0.085, 0.07, 0.06, 0.05};
}

/// Gratings on the portable device, which has more pixels than the fingertip. It's calibrated on a coarser membrane,
/// for a ball has no detail; the unit is the same.
std::vector<Transfer> portable_transfers(const ValidateOptions& options, CalibrationPresses presses) {
  sim::VirtualSensorSettings settings;
  settings.membrane_um = kMembrane_um;
  const sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "gelsight-portable.yaml");
  presses.extent_mm = {7.0, 4.6};  // it sees 12 x 9 mm
  sensors::HeightEstimator estimator(
      calibrate_heights(sim::VirtualSensor(device, options.cache, settings), presses, {}, kCalibrationSeed)
          .calibration.model);
  settings.membrane_um = kPortableMembrane_um;
  const sim::VirtualSensor sensor(device, options.cache, settings);
  return transfers({sensor, estimator, options.quick}, portable_pitches_mm(options.quick));
}

/// The pitch at which the estimate's contrast falls to kSeen, between two pitches on a logarithmic scale; the finest
/// pitch that was tried if it's more there.
double resolved_pitch_mm(const std::vector<Transfer>& transfers) {
  for (std::size_t i = 0; i < transfers.size(); ++i) {
    if (transfers[i].estimate >= kSeen) continue;
    if (i == 0) return transfers[0].pitch_mm;
    const Transfer& coarse = transfers[i - 1];
    const Transfer& fine = transfers[i];
    const double share = (coarse.estimate - kSeen) / (coarse.estimate - fine.estimate);
    return std::exp(std::log(coarse.pitch_mm) + share * std::log(fine.pitch_mm / coarse.pitch_mm));
  }
  return transfers.back().pitch_mm;
}

/// How far the detail of an object stands over the noise: standard deviation of the estimate about its own blur over
/// the middle of the contact, in standard deviations of the frame-to-frame noise of a plain press.
double detail_over_noise(const Setup& setup, const sim::ObjectSpec& spec, double depth_mm, double noise) {
  const sim::TouchObject object = setup.sensor.object(spec);
  const sim::Touch touch =
      setup.sensor.press(object, {.depth_mm = depth_mm}, {.truth = false, .noise_seed = kTestSeed + 800U});
  const cv::Mat part = setup.estimator.estimate(touch.frame).height_mm(middle_square(setup.sensor, 2.0));
  cv::Mat smooth;
  const int width = 2 * static_cast<int>(0.5 / setup.sensor.mm_per_px()) + 1;
  cv::blur(part, smooth, {width, width}, {-1, -1}, cv::BORDER_REFLECT);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(part - smooth, mean, deviation);
  return kMicrometresPerMillimetre * deviation[0] / noise;
}

/// Frames a second of one core: the best of some rounds.
double rate_Hz(sensors::HeightEstimator& estimator, const cv::Mat& frame) {
  constexpr int kRounds = 10;
  constexpr int kFrames = 50;
  double best = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const double begun = thread_seconds();
    for (int i = 0; i < kFrames; ++i) estimator.estimate(frame);
    best = std::max(best, kFrames / (thread_seconds() - begun));
  }
  return best;
}

}  // namespace

std::vector<ValidationRow> validate_gelsight_height(const ValidateOptions& options) {
  RowList rows("gelsight.height.", options, RowList::Since::last_row);
  const auto report = [&](std::int64_t done) {
    if (options.progress) options.progress("gelsight: height", done, 6);
  };
  report(0);
  sim::VirtualSensorSettings sensor_settings;
  sensor_settings.membrane_um = kMembrane_um;
  const sim::VirtualSensor sensor(sim::read_device(options.scenes / "devices" / "gelsight-flat.yaml"), options.cache,
                                  sensor_settings);
  CalibrationPresses presses;
  if (options.quick) {
    presses.columns = 3;
    presses.depths_mm = {0.5};
  }
  const HeightCalibrationResult calibrated = calibrate_heights(sensor, presses, {}, kCalibrationSeed);
  sensors::HeightEstimator estimator(calibrated.calibration.model);
  const Setup setup{sensor, estimator, options.quick};
  report(1);

  const Errors errors = errors_of_shapes(setup);
  rows.add("error_um",
           "height against the true membrane, mean over the picture; balls and a flat cylinder, 0.2 and 0.5 mm deep",
           "um", errors.mean_um, Better::lower, errors.mean_um <= kPublishedResolution_um)
      .reference = kPublishedResolution_um;
  rows.add("worst_um", "the same, the worst pixel of all pictures", "um", errors.worst_um, Better::lower,
           errors.worst_um <= 10.0 * kPublishedResolution_um)
      .reference = 10.0 * kPublishedResolution_um;
  rows.add("ball_error_um", "the balls alone, mean", "um", errors.ball_mean_um, Better::lower,
           errors.ball_mean_um <= kPublishedResolution_um)
      .reference = kPublishedResolution_um;
  rows.add("ball_worst_um", "the balls alone, the worst pixel", "um", errors.ball_worst_um, Better::lower,
           errors.ball_worst_um <= 10.0 * kPublishedResolution_um)
      .reference = 10.0 * kPublishedResolution_um;
  report(2);

  const auto add_resolution = [&](const std::string& id, const std::string& pixels,
                                  const std::vector<Transfer>& curve) {
    const double pitch_um = kMicrometresPerMillimetre * resolved_pitch_mm(curve);
    const double groove_um = 0.5 * pitch_um;
    ValidationRow& row = rows.add(
        id,
        fmt::format("width of a pressed grating's grooves (its pitch is {:.0f} um) at which a tenth of its contrast "
                    "is left, {}",
                    pitch_um, pixels),
        "um", groove_um, Better::lower, groove_um <= kPublishedResolution_um);
    row.published = kPublishedResolution_um;
    ValidationSeries series{"pitch, mm", "contrast of the estimate / of the grating", {}};
    for (const Transfer& transfer : curve) series.points.emplace_back(transfer.pitch_mm, transfer.estimate);
    row.series = std::move(series);
  };
  add_resolution("resolution_um", "320 x 240 pixels of 53 um", transfers(setup, fingertip_pitches_mm(options.quick)));
  report(3);
  add_resolution("portable_resolution_um", "portable device, 640 x 480 pixels of 19 um",
                 portable_transfers(options, presses));
  report(4);

  const sim::TouchObject plain = sensor.object(flat_cylinder_of(4.0));
  const double noise = noise_um(setup, plain, {.depth_mm = 0.12});
  rows.add("smallest_um", "height that stands three standard deviations over one pixel's noise in one frame", "um",
           kVisible * noise, Better::lower, kVisible * noise <= kPublishedResolution_um)
      .reference = kPublishedResolution_um;
  for (const auto& [name, depth] : {std::pair{"hair-100um", 0.15}, {"print-60um", 0.15}, {"fingerprint", 0.2}}) {
    const sim::ObjectSpec object = sim::read_object(options.scenes / "objects" / (std::string(name) + ".yaml"));
    const double ratio = detail_over_noise(setup, object, depth, noise);
    rows.add(std::string(name) + "_over_noise", "detail of it in the height map, in standard deviations of the noise",
             "1", ratio, Better::higher, ratio >= kVisible)
        .reference = kVisible;
  }
  report(5);

  const double rate = rate_Hz(estimator, sensor.background(kTestSeed));
  rows.add("rate_Hz", "frames of 320 x 240 to heights on one core; 100 times the published rate is asked for", "Hz",
           rate, Better::higher, rate >= kWantedSpeedUp * kPublishedRate_Hz)
      .published = kPublishedRate_Hz;
  report(6);
  return rows.rows();
}

}  // namespace touchstone::lab
