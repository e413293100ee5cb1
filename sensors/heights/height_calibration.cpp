#include "sensors/heights/height_calibration.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sensors {
namespace {

constexpr double kLeastAlike = 0.4;
constexpr double kGainsMove = 0.01;
constexpr int kPressesToCompare = 3;
constexpr std::size_t kPressesForNetwork = 5;
constexpr double kPoorTable = 0.08;  // slope error from which a network is tried
constexpr std::size_t kFolds = 5;
constexpr double kSteepestRim = 0.9;      // contact radius by the ball's, of circles that a network learns from
constexpr double kSameCircle = 0.25;      // of the radius: how far a found circle may lie from the given one
constexpr double kWeakestBalance = 0.78;  // of the other white balances that a network is shown
constexpr double kStrongestBalance = 1.25;
constexpr int kBalances = 3;                        // of each press, beside its own
constexpr std::size_t kCellsToCompare = 1U << 17U;  // coarser tables serve to compare corrections

using Samples = std::vector<ColourSample>;

Samples corrected_samples(const Samples& samples, const ColourCorrection& correction) {
  Samples corrected = samples;
  for (ColourSample& sample : corrected) {
    sample.colour = (correction.at(sample.place.cast<double>()) * sample.colour.cast<double>()).cast<float>();
  }
  return corrected;
}

struct FittedLight {
  LampModel lamps;
  ColourCorrection correction;
};

FittedLight fit_light(const Samples& samples, const Background& background, const HeightCalibrationSettings& settings,
                      LightCorrection kind) {
  const ColourCorrection by_background = ColourCorrection::by_background(background.mean);
  FittedLight light;
  light.lamps = fit_lamps(corrected_samples(samples, by_background), background.mean.size(), settings.lamps);
  if (kind == LightCorrection::background) light.correction = by_background;
  if (kind == LightCorrection::fitted) light.correction = ColourCorrection::by_lamps(background.mean, light.lamps);
  return light;
}

/// The samples as they would have been seen in the middle, and the table made of them.
struct Learnt {
  FittedLight light;
  Samples corrected;
  SlopeTable table;
};

Learnt learn(const Samples& samples, const Background& background, const HeightCalibrationSettings& settings,
             LightCorrection kind) {
  Learnt learnt;
  learnt.light = fit_light(samples, background, settings, kind);
  learnt.corrected = corrected_samples(samples, learnt.light.correction);
  // The table's own lamps: of the corrected colours, which are the same everywhere.
  LampFit even = kEvenLamps;
  even.steepest = settings.lamps.steepest;
  const LampModel middle = fit_lamps(learnt.corrected, background.mean.size(), even);
  learnt.table = build_slope_table(learnt.corrected, middle.nodes.front(), settings.table);
  return learnt;
}

double squared_error(const SlopeTable& table, const Samples& corrected) {
  double sum = 0.0;
  for (const ColourSample& sample : corrected) {
    sum += (table.slopes[table.index_of(sample.colour)] - sample.slope).squaredNorm();
  }
  return sum;
}

double left_out_error(const std::vector<Samples>& presses, const Background& background,
                      HeightCalibrationSettings settings, LightCorrection kind) {
  settings.table.most_cells = std::min(settings.table.most_cells, kCellsToCompare);
  double squares = 0.0;
  std::size_t pixels = 0;
  for (std::size_t out = 0; out < presses.size(); ++out) {
    Samples others;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      if (i != out) others.insert(others.end(), presses[i].begin(), presses[i].end());
    }
    const Learnt learnt = learn(others, background, settings, kind);
    squares += squared_error(learnt.table, corrected_samples(presses[out], learnt.light.correction));
    pixels += presses[out].size();
  }
  return std::sqrt(squares / (2.0 * static_cast<double>(pixels)));
}

/// A press that is used.
struct UsedPress {
  const BallPress* press = nullptr;
  SeenPress seen;
  Samples samples;
};

PressSettings press_settings(const HeightCalibrationSettings& settings) {
  return {settings.mm_per_px, settings.gel_thickness_mm, settings.rim_px, settings.most_lost};
}

/// Fills `uses` but for circles: frames, gains, and what isn't the background's picture. Returns whether gains move.
bool find_gains(std::span<const BallPress> presses, const Background& background, GainFinder& finder,
                std::vector<PressUse>& uses) {
  double squares = 0.0;
  int count = 0;
  for (const BallPress& press : presses) {
    PressUse use;
    use.name = press.name;
    if (const std::string fault = frame_fault(press.frame, background.mean.size()); !fault.empty()) {
      use.flaw = fmt::format("{}: the frame {}", press.name, fault);
    } else {
      use.gain = finder.find(press.frame);
      if (use.gain.alike < kLeastAlike) {
        use.flaw = fmt::format(
            "{}: only {:.0f} % of the picture is as the untouched gel's, at least {:.0f} % are needed: is it of "
            "another "
            "sensor or unit, upside down, or of several contacts?",
            press.name, 100.0 * use.gain.alike, 100.0 * kLeastAlike);
      } else {
        for (int c = 0; c < 3; ++c) squares += std::pow(std::log(use.gain.gain[c]), 2);
        count += 3;
      }
    }
    uses.push_back(std::move(use));
  }
  return count > 0 && std::sqrt(squares / count) > kGainsMove;
}

std::vector<UsedPress> use_presses(std::span<const BallPress> presses, const Background& background,
                                   const HeightCalibrationSettings& settings, bool white_balance,
                                   std::vector<PressUse>& uses) {
  const PressSettings how = press_settings(settings);
  std::vector<UsedPress> used;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (!uses[i].flaw.empty()) continue;
    try {
      const cv::Vec3d gain = white_balance ? uses[i].gain.gain : cv::Vec3d(1.0, 1.0, 1.0);
      UsedPress one{&presses[i], see_press(presses[i], background, gain, how), {}};
      one.samples = samples_of(presses[i], one.seen, how);
      if (one.samples.empty()) fail("{}: it has no pixel that can be used", presses[i].name);
      uses[i].circle = one.seen.circle;
      uses[i].found = one.seen.found;
      used.push_back(std::move(one));
    } catch (const Error& error) {
      uses[i].flaw = error.what();
    }
  }
  if (used.empty()) {
    fail("none of {} ball presses can be used; the first: {}", presses.size(), uses.front().flaw);
  }
  return used;
}

/// The circles that a network learns from. One drawn by hand is good to some pixels, and so would a network's slopes
/// near the rim be; the edge that the picture itself shows is sharper. So a given circle takes the found one's place
/// among the others, and what all given ones differ from it in the mean stays.
std::vector<ContactCircle> sharpened_circles(const std::vector<UsedPress>& used, const Background& background,
                                             const HeightCalibrationSettings& settings) {
  std::vector<ContactCircle> circles;
  std::vector<std::size_t> moved;
  ContactCircle drift;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const ContactCircle given = used[i].seen.circle;
    circles.push_back(given);
    if (used[i].seen.found) continue;
    try {
      const ContactCircle found =
          find_contact_circle(used[i].seen.difference, background, used[i].press->ball_radius_mm,
                              press_settings(settings), used[i].press->name);
      if ((found.centre - given.centre).norm() > kSameCircle * given.radius ||
          std::abs(found.radius - given.radius) > kSameCircle * given.radius) {
        continue;
      }
      drift.centre += given.centre - found.centre;
      drift.radius += given.radius - found.radius;
      circles[i] = found;
      moved.push_back(i);
    } catch (const Error&) {  // the given one stays
    }
  }
  for (const std::size_t i : moved) {
    circles[i].centre += drift.centre / static_cast<double>(moved.size());
    circles[i].radius += drift.radius / static_cast<double>(moved.size());
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double most = kSteepestRim * used[i].press->ball_radius_mm / settings.mm_per_px;
    circles[i].radius = std::min(circles[i].radius, most);
  }
  return circles;
}

/// What a network learns from: each press as it is and, where cameras have a white balance, with some others, since
/// they cut off other pixels; last the untouched gel.
std::vector<LabelledPicture> labelled_pictures(const std::vector<UsedPress>& used, const Background& background,
                                               const HeightCalibrationSettings& settings, bool white_balance,
                                               GainFinder& finder) {
  const std::vector<ContactCircle> circles = sharpened_circles(used, background, settings);
  std::vector<LabelledPicture> pictures;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const BallPress& press = *used[i].press;
    if (!white_balance) {
      pictures.push_back({used[i].seen.difference, press.frame, circles[i], press.ball_radius_mm});
      continue;
    }
    const auto add = [&](const cv::Mat& frame) {
      cv::Mat difference = difference_to(background, frame, finder.find(frame).gain, SlopeNetwork::kCeiling_DN);
      pictures.push_back({std::move(difference), frame, circles[i], press.ball_radius_mm});
    };
    add(press.frame);
    RandomStream random(settings.learning.seed, i, Purpose::kSearch);
    for (int balance = 0; balance < kBalances; ++balance) {
      cv::Scalar factors;
      for (int c = 0; c < 3; ++c) {
        factors[c] = kWeakestBalance + (kStrongestBalance - kWeakestBalance) * random.uniform();
      }
      cv::Mat other;
      cv::multiply(press.frame, factors, other);
      add(other);
    }
  }
  pictures.push_back({cv::Mat::zeros(background.mean.size(), CV_32FC3), {}, {}, 0.0});
  return pictures;
}

/// Each fifth of the presses, read by a network of the others: on the same pixels as the table's error.
double network_left_out_error(const std::vector<UsedPress>& used, const std::vector<LabelledPicture>& pictures,
                              double mm_per_px, const SlopeLearning& learning) {
  const std::size_t copies = (pictures.size() - 1) / used.size();
  double squares = 0.0;
  std::size_t pixels = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<LabelledPicture> others;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      if (i / copies % kFolds != fold || i + 1 == pictures.size()) others.push_back(pictures[i]);
    }
    SlopeReader reader(learn_slopes(others, mm_per_px, learning), pictures[0].difference.size(), mm_per_px);
    cv::Mat slope_u;
    cv::Mat slope_v;
    for (std::size_t i = fold; i < used.size(); i += kFolds) {
      reader.read(pictures[i * copies].difference, slope_u, slope_v);
      for (const ColourSample& sample : used[i].samples) {
        const auto u = static_cast<int>(sample.place.x());
        const auto v = static_cast<int>(sample.place.y());
        squares += (Eigen::Vector2f(slope_u.at<float>(v, u), slope_v.at<float>(v, u)) - sample.slope).squaredNorm();
      }
      pixels += used[i].samples.size();
    }
  }
  return std::sqrt(squares / (2.0 * static_cast<double>(pixels)));
}

/// Gives the model a network, if that's asked for and, under `best`, better than a table that errs by `table_error`.
void add_network(const std::vector<UsedPress>& used, const Background& background,
                 const HeightCalibrationSettings& settings, double table_error, GainFinder& finder,
                 HeightCalibration& result) {
  if (settings.slopes == SlopeRegressor::table) return;
  const bool best = settings.slopes == SlopeRegressor::best;
  if (best && (used.size() < kPressesForNetwork || table_error <= kPoorTable)) return;
  SlopeLearning learning = settings.learning;
  learning.gel_thickness_mm = settings.gel_thickness_mm;
  const std::vector<LabelledPicture> pictures =
      labelled_pictures(used, background, settings, result.model.white_balance, finder);
  if (used.size() >= kPressesForNetwork) {
    result.network_left_out = network_left_out_error(used, pictures, settings.mm_per_px, learning);
    if (best && *result.network_left_out >= table_error) return;
  }
  result.model.network = learn_slopes(pictures, settings.mm_per_px, learning);
}

}  // namespace

HeightCalibration calibrate_height(std::span<const BallPress> presses, const Background& background,
                                   const HeightCalibrationSettings& settings) {
  if (!(settings.mm_per_px > 0.0) || !std::isfinite(settings.mm_per_px)) {
    fail("mm_per_px {}: it must be above 0", settings.mm_per_px);
  }
  if (presses.empty()) fail("no ball press: at least one calibration frame is needed");
  HeightCalibration result;
  HeightModel& model = result.model;
  GainFinder finder(background);
  model.white_balance = find_gains(presses, background, finder, result.presses);
  const std::vector<UsedPress> used = use_presses(presses, background, settings, model.white_balance, result.presses);
  std::vector<Samples> parts;
  Samples all;
  for (const UsedPress& press : used) {
    parts.push_back(press.samples);
    all.insert(all.end(), press.samples.begin(), press.samples.end());
  }
  LightCorrection kind = settings.correction.value_or(LightCorrection::background);
  const bool compares = settings.cross_validate || !settings.correction || settings.slopes == SlopeRegressor::best;
  double table_error = 0.0;
  if (compares && parts.size() >= kPressesToCompare) {
    for (const LightCorrection tried : {LightCorrection::none, LightCorrection::background, LightCorrection::fitted}) {
      result.left_out.push_back({tried, left_out_error(parts, background, settings, tried)});
    }
    const auto best = std::min_element(result.left_out.begin(), result.left_out.end(),
                                       [](const SlopeError& a, const SlopeError& b) { return a.rms < b.rms; });
    if (!settings.correction) kind = best->correction;
    const auto taken = std::find_if(result.left_out.begin(), result.left_out.end(),
                                    [&](const SlopeError& one) { return one.correction == kind; });
    table_error = taken->rms;
  }
  Learnt learnt = learn(all, background, settings, kind);
  result.pixels = all.size();
  result.rms_slope_error =
      std::sqrt(squared_error(learnt.table, learnt.corrected) / (2.0 * static_cast<double>(all.size())));
  result.bounded_share = learnt.light.correction.bounded_share();
  result.coverage = coverage_of(learnt.table, learnt.corrected);
  model.mm_per_px = settings.mm_per_px;
  model.background = background;
  model.correction = kind;
  model.lamps = std::move(learnt.light.lamps);
  model.table = std::move(learnt.table);
  model.steepest_calibrated = result.coverage.steepest_slope;
  model.presses = static_cast<int>(used.size());
  add_network(used, background, settings, table_error, finder, result);
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("the calibration gave no usable model: {}", fault);
  return result;
}

void require_all_used(const HeightCalibration& calibration) {
  for (const PressUse& use : calibration.presses) {
    if (!use.flaw.empty()) fail("{}", use.flaw);
  }
}

}  // namespace touchstone::sensors
