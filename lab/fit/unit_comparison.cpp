#include "lab/fit/unit_comparison.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kLabelRange = 5.0;  // standard deviations that a labelled place or depth may move by
constexpr double kLeastDepth_mm = 0.01;
// Steps of derivatives, in half ranges: of formulas, and of what is traced anew.
constexpr double kSmooth = 1e-3;
constexpr double kTraced = kRoughWithin;
constexpr double kPoseStep_mm = 5e-3;
// Of what costs no light, which is in proportion or nearly so: all of a step is taken, and to its end.
constexpr double kSettledDamping = 1e-8, kSettledGain = 1e-3;

using Vector = Eigen::VectorXd;

double& member(PressPose& pose, PoseVariable::Of of) {
  return of == PoseVariable::Of::x ? pose.place_mm.x() : of == PoseVariable::Of::y ? pose.place_mm.y() : pose.depth_mm;
}

Variables variables_of(const PreparedFit& fit, const std::vector<PressPose>& poses) {
  Variables all;
  std::vector<std::pair<double, double>> ranges;  // about the start
  for (const FitUnknown& unknown : fit.unknowns) {
    const bool times = unknown.how == UnknownHow::times;
    ranges.emplace_back(times ? std::log(unknown.low) : unknown.low, times ? std::log(unknown.high) : unknown.high);
  }
  all.unknowns = static_cast<Eigen::Index>(ranges.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const RecordedPress& press = fit.spec.presses[i];
    const auto free = [&](PoseVariable::Of of, double label, double deviation, double low, double high) {
      all.poses.push_back({static_cast<int>(i), of, label, deviation});
      ranges.emplace_back(low - label, high - label);
    };
    if (press.place_sd_mm > 0.0) {
      const double half = kLabelRange * press.place_sd_mm;
      free(PoseVariable::Of::x, press.place_mm.x(), press.place_sd_mm, press.place_mm.x() - half,
           press.place_mm.x() + half);
      free(PoseVariable::Of::y, press.place_mm.y(), press.place_sd_mm, press.place_mm.y() - half,
           press.place_mm.y() + half);
    }
    if (!press.depth_mm) {
      free(PoseVariable::Of::depth, poses[i].depth_mm, 0.0, kLeastDepth_mm, fit.deepest_mm);
    } else if (press.depth_sd_mm > 0.0) {
      const double half = kLabelRange * press.depth_sd_mm;
      free(PoseVariable::Of::depth, *press.depth_mm, press.depth_sd_mm,
           std::min(*press.depth_mm, std::max(kLeastDepth_mm, *press.depth_mm - half)),
           std::max(*press.depth_mm, std::min(fit.deepest_mm, *press.depth_mm + half)));
    }
  }
  const auto count = static_cast<Eigen::Index>(ranges.size());
  all.start = Vector::Zero(count);
  all.low.resize(count);
  all.high.resize(count);
  all.scale.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& [low, high] = ranges[static_cast<std::size_t>(k)];
    all.scale[k] = 0.5 * (high - low);
    all.low[k] = low / all.scale[k];
    all.high[k] = high / all.scale[k];
  }
  return all;
}

/// What is compared of a picture: `background` is null where the picture itself is.
std::vector<double> compared_values(const Compared& picture, const cv::Mat& shown, const cv::Mat* background) {
  const auto* numbers = shown.ptr<double>();
  std::vector<double> values;
  if (!picture.means) {
    for (const int at : picture.at) {
      values.push_back(numbers[at] - (background == nullptr ? 0.0 : background->ptr<double>()[at]));
    }
    return values;
  }
  const int channels = shown.channels();
  for (int c = 0; c < channels; ++c) {
    double sum = 0.0;
    int count = 0;
    for (const int at : picture.at) {
      if (at % channels != c) continue;
      sum += numbers[at];
      ++count;
    }
    values.push_back(count > 0 ? sum / count : 0.0);
  }
  return values;
}

bool is_of_scene(const FitUnknown& unknown) {
  return std::any_of(unknown.numbers.begin(), unknown.numbers.end(),
                     [](const FittedNumber& number) { return number.acts == NumberActs::on_scene; });
}

/// Whose light is drawn anew.
std::set<int> lamps_of(const FitUnknown& unknown) {
  std::set<int> lamps;
  for (const FittedNumber& number : unknown.numbers) {
    if (number.acts == NumberActs::on_lamp) lamps.insert(number.lamp);
  }
  return lamps;
}

/// Costs no light.
bool is_formula(const FitUnknown& unknown) {
  return !is_of_scene(unknown) && lamps_of(unknown).empty();
}

}  // namespace

/// The poses as the labels have them.
std::vector<PressPose> labelled_poses(const PreparedFit& fit, UnitSimulation& simulation) {
  const Vector none = Vector::Zero(static_cast<Eigen::Index>(fit.unknowns.size()));
  std::vector<PressPose> poses;
  for (std::size_t i = 0; i < fit.spec.presses.size(); ++i) {
    const RecordedPress& press = fit.spec.presses[i];
    PressPose pose{press.place_mm, press.depth_mm.value_or(0.0)};
    if (!press.depth_mm) {
      const double depth = simulation.depth_of_force(none, static_cast<int>(i), pose, *press.force_N);
      pose.depth_mm = std::clamp(depth, kLeastDepth_mm, 0.95 * fit.deepest_mm);
    }
    poses.push_back(pose);
  }
  return poses;
}

UnitComparison::UnitComparison(const PreparedFit& fit, const UnitRecording& recording, UnitSimulation& simulation,
                               std::vector<PressPose> labelled)
    : fit_(fit), simulation_(simulation), labelled_(std::move(labelled)), variables_(variables_of(fit, labelled_)) {
  const render::Imager imager = simulation_.imager(Vector::Zero(variables_.unknowns));
  const auto noise_of = [&](const BlockPicture& picture) {
    return block_noise(picture.mean, imager, fit_.spec.coarse_px, picture.exposures);
  };
  const bool differences = fit_.spec.differences;
  const auto add = [&](int press, const BlockPicture& picture) {
    Compared compared;
    compared.press = press;
    compared.recorded = &picture;
    compared.first_row = rows_;
    compared.means = differences && press < 0;
    const bool less_background = differences && press >= 0;
    cv::Mat noise = noise_of(picture);
    if (less_background) cv::magnitude(noise, noise_of(recording.background), noise);
    const auto count = static_cast<int>(picture.mean.total()) * picture.mean.channels();
    for (int i = 0; i < count; ++i) {
      if (picture.usable.ptr<std::uint8_t>()[i] == 0) continue;
      if (less_background && recording.background.usable.ptr<std::uint8_t>()[i] == 0) continue;
      compared.at.push_back(i);
      compared.noise.push_back(noise.ptr<double>()[i]);
    }
    compared.values = compared_values(compared, picture.mean, less_background ? &recording.background.mean : nullptr);
    if (compared.means) {
      const double typical = cv::mean(noise)[0];
      compared.noise.assign(compared.values.size(), typical / std::sqrt(static_cast<double>(picture.mean.total())));
    }
    rows_ += static_cast<Eigen::Index>(compared.values.size());
    pictures_.push_back(std::move(compared));
  };
  if (!recording.background.mean.empty()) add(-1, recording.background);
  for (std::size_t i = 0; i < recording.presses.size(); ++i) add(static_cast<int>(i), recording.presses[i]);
  first_force_ = rows_;
  for (std::size_t i = 0; i < fit_.spec.presses.size(); ++i) {
    if (fit_.spec.presses[i].force_N) forces_.push_back(static_cast<int>(i));
  }
  rows_ += static_cast<Eigen::Index>(forces_.size());
  first_label_ = rows_;
  for (const PoseVariable& variable : variables_.poses) rows_ += variable.deviation > 0.0 ? 1 : 0;
}

Vector UnitComparison::unknowns(const Vector& x) const {
  return x.head(variables_.unknowns).cwiseProduct(variables_.scale.head(variables_.unknowns));
}

std::vector<PressPose> UnitComparison::poses(const Vector& x) const {
  std::vector<PressPose> all = labelled_;
  for (std::size_t k = 0; k < variables_.poses.size(); ++k) {
    const PoseVariable& variable = variables_.poses[k];
    const auto at = variables_.unknowns + static_cast<Eigen::Index>(k);
    member(all[static_cast<std::size_t>(variable.press)], variable.of) += x[at] * variables_.scale[at];
  }
  return all;
}

const cv::Mat& UnitComparison::picture_in(const SimulatedUnit& shown, const Compared& picture) {
  return picture.press < 0 ? shown.background : shown.presses[static_cast<std::size_t>(picture.press)];
}

std::vector<double> UnitComparison::values(const Compared& picture, const cv::Mat& shown,
                                           const cv::Mat& background) const {
  return compared_values(picture, shown, fit_.spec.differences && picture.press >= 0 ? &background : nullptr);
}

void UnitComparison::put_picture(const Compared& picture, const cv::Mat& shown, const cv::Mat& background,
                                 Vector& out) const {
  const std::vector<double> simulated = values(picture, shown, background);
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    out[picture.first_row + static_cast<Eigen::Index>(i)] = (simulated[i] - picture.values[i]) / picture.noise[i];
  }
}

double UnitComparison::force_row(int press, double force_N) const {
  const RecordedPress& recorded = fit_.spec.presses[static_cast<std::size_t>(press)];
  return (force_N - *recorded.force_N) / recorded.force_sd_N;
}

Vector UnitComparison::residuals(const Vector& x) const {
  const SimulatedUnit shown = simulation_.show(unknowns(x), poses(x));
  Vector out(rows_);
  for (const Compared& picture : pictures_) put_picture(picture, picture_in(shown, picture), shown.background, out);
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    out[first_force_ + static_cast<Eigen::Index>(i)] = force_row(forces_[i], shown.force_N[forces_[i]]);
  }
  Eigen::Index row = first_label_;
  for (std::size_t k = 0; k < variables_.poses.size(); ++k) {
    if (variables_.poses[k].deviation == 0.0) continue;
    const auto at = variables_.unknowns + static_cast<Eigen::Index>(k);
    out[row++] = x[at] * variables_.scale[at] / variables_.poses[k].deviation;
  }
  return out;
}

Eigen::MatrixXd UnitComparison::jacobian(const Vector& x, const Vector& at) const {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(rows_, x.size());
  const auto beside = [&](Eigen::Index k) {  // away from a bound that is near
    Vector moved = x;
    const double step = k >= variables_.unknowns ? std::min(0.5, kPoseStep_mm / variables_.scale[k])
                        : is_formula(fit_.unknowns[static_cast<std::size_t>(k)]) ? kSmooth
                                                                                 : kTraced;
    moved[k] += x[k] + step <= variables_.high[k] ? step : -step;
    return moved;
  };
  for (Eigen::Index k = 0; k < variables_.unknowns; ++k) {
    const Vector moved = beside(k);
    out.col(k) = (residuals(moved) - at) / (moved[k] - x[k]);
  }
  const cv::Mat background = variables_.poses.empty() ? cv::Mat() : simulation_.show(unknowns(x), poses(x)).background;
  for (std::size_t i = 0; i < variables_.poses.size(); ++i) {
    const PoseVariable& variable = variables_.poses[i];
    const auto k = variables_.unknowns + static_cast<Eigen::Index>(i);
    const Vector moved = beside(k);
    const PressPose pose = poses(moved)[static_cast<std::size_t>(variable.press)];
    const SimulatedUnit shown = simulation_.show_press(unknowns(x), variable.press, pose);
    Vector other = at;  // of this press alone
    for (const Compared& picture : pictures_) {
      if (picture.press == variable.press) put_picture(picture, shown.presses.front(), background, other);
    }
    for (std::size_t f = 0; f < forces_.size(); ++f) {
      if (forces_[f] != variable.press) continue;
      other[first_force_ + static_cast<Eigen::Index>(f)] = force_row(variable.press, shown.force_N[0]);
    }
    out.col(k) = (other - at) / (moved[k] - x[k]);
  }
  Eigen::Index row = first_label_;
  for (std::size_t i = 0; i < variables_.poses.size(); ++i) {
    if (variables_.poses[i].deviation == 0.0) continue;
    const auto k = variables_.unknowns + static_cast<Eigen::Index>(i);
    out(row++, k) = variables_.scale[k] / variables_.poses[i].deviation;
  }
  return out;
}

Vector UnitComparison::settled(const Vector& x) const {
  std::vector<Eigen::Index> which;
  for (Eigen::Index k = 0; k < variables_.unknowns; ++k) {
    if (is_formula(fit_.unknowns[static_cast<std::size_t>(k)])) which.push_back(k);
  }
  if (which.empty()) return x;
  const auto count = static_cast<Eigen::Index>(which.size());
  Vector half(count), start(count);
  LeastSquaresProblem problem;
  problem.low.resize(count);
  problem.high.resize(count);
  const auto is_factor = [&](Eigen::Index i) {
    return fit_.unknowns[static_cast<std::size_t>(which[static_cast<std::size_t>(i)])].how == UnknownHow::times;
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index k = which[static_cast<std::size_t>(i)];
    const FitUnknown& unknown = fit_.unknowns[static_cast<std::size_t>(k)];
    half[i] = 0.5 * (unknown.high - unknown.low);
    problem.low[i] = unknown.low / half[i];
    problem.high[i] = unknown.high / half[i];
    const double amount = variables_.scale[k] * x[k];
    start[i] = std::clamp((is_factor(i) ? std::exp(amount) : amount) / half[i], problem.low[i], problem.high[i]);
  }
  const auto place = [&](const Vector& amounts) {
    Vector moved = x;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index k = which[static_cast<std::size_t>(i)];
      const double amount = half[i] * amounts[i];
      moved[k] = amounts[i] <= problem.low[i] ? variables_.low[k]
                 : amounts[i] >= problem.high[i]
                     ? variables_.high[k]
                     : std::clamp((is_factor(i) ? std::log(amount) : amount) / variables_.scale[k], variables_.low[k],
                                  variables_.high[k]);
    }
    return moved;
  };
  problem.residuals = [&](const Vector& amounts) { return residuals(place(amounts)); };
  problem.jacobian = [&](const Vector& amounts, const Vector& at) {
    Eigen::MatrixXd out(rows_, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      Vector moved = amounts;
      moved[i] += amounts[i] + kSmooth <= problem.high[i] ? kSmooth : -kSmooth;
      out.col(i) = (problem.residuals(moved) - at) / (moved[i] - amounts[i]);
    }
    return out;
  };
  LeastSquaresSettings settings;
  settings.first_damping = kSettledDamping;
  settings.least_gain = kSettledGain;
  settings.least_square = 1.0;
  LeastSquaresState begin;
  begin.x = start;
  return place(least_squares(problem, begin, settings).x);
}

std::int64_t UnitComparison::pictures_of_all() const {
  return static_cast<std::int64_t>(simulation_.sources()) * static_cast<std::int64_t>(1 + fit_.spec.presses.size());
}

std::int64_t UnitComparison::pictures_of_place() const {
  std::set<int> lamps;
  for (const FitUnknown& unknown : fit_.unknowns) {
    if (is_of_scene(unknown)) return pictures_of_all();
    lamps.merge(lamps_of(unknown));
  }
  std::set<int> presses;
  for (const PoseVariable& variable : variables_.poses) presses.insert(variable.press);
  const auto moved = static_cast<std::int64_t>(presses.size());
  const auto others = static_cast<std::int64_t>(1 + fit_.spec.presses.size()) - moved;
  return moved * simulation_.sources() + others * static_cast<std::int64_t>(lamps.size());
}

std::int64_t UnitComparison::pictures_of_derivatives() const {
  const auto rest_and_presses = static_cast<std::int64_t>(1 + fit_.spec.presses.size());
  std::int64_t count = static_cast<std::int64_t>(variables_.poses.size()) * simulation_.sources();
  for (const FitUnknown& unknown : fit_.unknowns) {
    count += is_of_scene(unknown) ? pictures_of_all()
                                  : rest_and_presses * static_cast<std::int64_t>(lamps_of(unknown).size());
  }
  return count;
}

LeastSquaresProblem UnitComparison::problem() const {
  LeastSquaresProblem problem;
  problem.residuals = [this](const Vector& x) { return residuals(x); };
  problem.jacobian = [this](const Vector& x, const Vector& at) { return jacobian(x, at); };
  problem.settled = [this](const Vector& x) { return settled(x); };
  problem.low = variables_.low;
  problem.high = variables_.high;
  return problem;
}

}  // namespace touchstone::lab
