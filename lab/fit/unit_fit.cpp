#include "lab/fit/unit_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "lab/fit/bounded_least_squares.h"
#include "lab/fit/fit_certainty.h"
#include "lab/fit/unit_fit_words.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kTileColumns = 8, kTileRows = 6;
constexpr double kLabelRange = 5.0;  // standard deviations that a labelled place or depth may move by
constexpr double kLeastDepth_mm = 0.01;
constexpr double kSmooth = 1e-3;  // steps of derivatives, in half ranges: of formulas
constexpr double kTraced = 2e-2;  // of what is traced anew
constexpr double kPoseStep_mm = 5e-3;
constexpr double kOfDevice = 1e-3;  // of a direction of length 1: less is of poses alone

using Vector = Eigen::VectorXd;

/// A variable of the fit beside the unknowns: something of one press.
struct PoseVariable {
  int press = 0;
  enum class Of : std::uint8_t { x, y, depth } of = Of::depth;
  double label = 0.0, deviation = 0.0;  // deviation 0: nothing was labelled
};

/// All of the fit's variables, scaled: 1 is half of the allowed range.
struct Variables {
  std::vector<PoseVariable> poses;
  Vector start, low, high, scale;
  Eigen::Index unknowns = 0;
};

double& member(PressPose& pose, PoseVariable::Of of) {
  return of == PoseVariable::Of::x ? pose.place_mm.x() : of == PoseVariable::Of::y ? pose.place_mm.y() : pose.depth_mm;
}

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

/// One picture of the recording: background (press -1) or press, with what is compared of it. Where a fit asks for
/// differences these are a press's numbers less the background's, and of the background the mean of each channel.
struct Compared {
  int press = -1;
  const BlockPicture* recorded = nullptr;
  std::vector<int> at;         // of usable numbers
  std::vector<double> values;  // that are compared, of the recording
  std::vector<double> noise;   // of these
  Eigen::Index first_row = 0;  // of the residuals
  bool means = false;          // of channels, in place of a value each
};

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

/// The fit as least squares.
struct Comparison {
  const PreparedFit& fit;
  UnitSimulation& simulation;
  const Variables& variables;
  std::vector<PressPose> labelled;
  std::vector<Compared> pictures;
  std::vector<int> forces;  // presses that have one
  Eigen::Index first_force = 0, first_label = 0, rows = 0;

  Vector unknowns(const Vector& x) const {
    return x.head(variables.unknowns).cwiseProduct(variables.scale.head(variables.unknowns));
  }

  std::vector<PressPose> poses(const Vector& x) const {
    std::vector<PressPose> all = labelled;
    for (std::size_t k = 0; k < variables.poses.size(); ++k) {
      const PoseVariable& variable = variables.poses[k];
      const auto at = variables.unknowns + static_cast<Eigen::Index>(k);
      member(all[static_cast<std::size_t>(variable.press)], variable.of) += x[at] * variables.scale[at];
    }
    return all;
  }

  /// Of a simulated picture beside the simulated background.
  std::vector<double> values(const Compared& picture, const cv::Mat& shown, const cv::Mat& background) const {
    return compared_values(picture, shown, fit.spec.differences && picture.press >= 0 ? &background : nullptr);
  }

  void put_picture(const Compared& picture, const cv::Mat& shown, const cv::Mat& background, Vector& out) const {
    const std::vector<double> simulated = values(picture, shown, background);
    for (std::size_t i = 0; i < simulated.size(); ++i) {
      out[picture.first_row + static_cast<Eigen::Index>(i)] = (simulated[i] - picture.values[i]) / picture.noise[i];
    }
  }

  const cv::Mat& picture_in(const SimulatedUnit& shown, const Compared& picture) const {
    return picture.press < 0 ? shown.background : shown.presses[static_cast<std::size_t>(picture.press)];
  }

  double force_row(int press, double force_N) const {
    const RecordedPress& recorded = fit.spec.presses[static_cast<std::size_t>(press)];
    return (force_N - *recorded.force_N) / recorded.force_sd_N;
  }

  Vector residuals(const Vector& x) const {
    const SimulatedUnit shown = simulation.show(unknowns(x), poses(x));
    Vector out(rows);
    for (const Compared& picture : pictures) put_picture(picture, picture_in(shown, picture), shown.background, out);
    for (std::size_t i = 0; i < forces.size(); ++i) {
      out[first_force + static_cast<Eigen::Index>(i)] = force_row(forces[i], shown.force_N[forces[i]]);
    }
    Eigen::Index row = first_label;
    for (std::size_t k = 0; k < variables.poses.size(); ++k) {
      if (variables.poses[k].deviation == 0.0) continue;
      const auto at = variables.unknowns + static_cast<Eigen::Index>(k);
      out[row++] = x[at] * variables.scale[at] / variables.poses[k].deviation;
    }
    return out;
  }

  /// By differences, away from a bound that is near.
  Eigen::MatrixXd jacobian(const Vector& x, const Vector& at) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(rows, x.size());
    for (Eigen::Index k = 0; k < variables.unknowns; ++k) {
      bool formula = true;
      for (const FittedNumber& number : fit.unknowns[static_cast<std::size_t>(k)].numbers) {
        formula = formula && number.acts != NumberActs::on_scene && number.acts != NumberActs::on_lamp;
      }
      const double step = formula ? kSmooth : kTraced;
      Vector beside = x;
      beside[k] += x[k] + step <= variables.high[k] ? step : -step;
      out.col(k) = (residuals(beside) - at) / (beside[k] - x[k]);
    }
    const cv::Mat background = variables.poses.empty() ? cv::Mat() : simulation.show(unknowns(x), poses(x)).background;
    for (std::size_t i = 0; i < variables.poses.size(); ++i) {
      const PoseVariable& variable = variables.poses[i];
      const auto k = variables.unknowns + static_cast<Eigen::Index>(i);
      const double step = std::min(0.5, kPoseStep_mm / variables.scale[k]);
      Vector beside = x;
      beside[k] += x[k] + step <= variables.high[k] ? step : -step;
      const PressPose pose = poses(beside)[static_cast<std::size_t>(variable.press)];
      const SimulatedUnit shown = simulation.show_press(unknowns(x), variable.press, pose);
      Vector moved = at;  // of this press alone
      for (const Compared& picture : pictures) {
        if (picture.press == variable.press) put_picture(picture, shown.presses.front(), background, moved);
      }
      for (std::size_t f = 0; f < forces.size(); ++f) {
        if (forces[f] != variable.press) continue;
        moved[first_force + static_cast<Eigen::Index>(f)] = force_row(variable.press, shown.force_N[0]);
      }
      out.col(k) = (moved - at) / (beside[k] - x[k]);
    }
    Eigen::Index row = first_label;
    for (std::size_t i = 0; i < variables.poses.size(); ++i) {
      if (variables.poses[i].deviation == 0.0) continue;
      const auto k = variables.unknowns + static_cast<Eigen::Index>(i);
      out(row++, k) = variables.scale[k] / variables.poses[i].deviation;
    }
    return out;
  }
};

/// Weights by the noise that the camera, as it is simulated at the start, has at the recorded numbers.
void lay_out(Comparison& all, const UnitRecording& recording) {
  const render::Imager imager = all.simulation.imager(Vector::Zero(all.variables.unknowns));
  const auto noise_of = [&](const BlockPicture& picture) {
    return block_noise(picture.mean, imager, all.fit.spec.coarse_px, picture.exposures);
  };
  const bool differences = all.fit.spec.differences;
  const auto add = [&](int press, const BlockPicture& picture) {
    Compared compared;
    compared.press = press;
    compared.recorded = &picture;
    compared.first_row = all.rows;
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
    all.rows += static_cast<Eigen::Index>(compared.values.size());
    all.pictures.push_back(std::move(compared));
  };
  if (!recording.background.mean.empty()) add(-1, recording.background);
  for (std::size_t i = 0; i < recording.presses.size(); ++i) add(static_cast<int>(i), recording.presses[i]);
  all.first_force = all.rows;
  for (std::size_t i = 0; i < all.fit.spec.presses.size(); ++i) {
    if (all.fit.spec.presses[i].force_N) all.forces.push_back(static_cast<int>(i));
  }
  all.rows += static_cast<Eigen::Index>(all.forces.size());
  all.first_label = all.rows;
  for (const PoseVariable& variable : all.variables.poses) all.rows += variable.deviation > 0.0 ? 1 : 0;
}

LinearisedFit linearised(const Comparison& all, const LeastSquaresResult& found, const SimulatedUnit& shown) {
  LinearisedFit fit;
  fit.jacobian = found.jacobian;
  fit.residuals = found.residuals;
  fit.tiles = kTileColumns * kTileRows;
  fit.shared = static_cast<int>(all.variables.unknowns);
  fit.tile.assign(static_cast<std::size_t>(all.rows), -1);
  fit.patch.assign(static_cast<std::size_t>(all.rows), -1);
  for (const Compared& picture : all.pictures) {
    if (picture.means) continue;
    const cv::Size size = picture.recorded->mean.size();
    const int channels = picture.recorded->mean.channels();
    for (std::size_t i = 0; i < picture.at.size(); ++i) {
      const int pixel = picture.at[i] / channels;
      const int column = pixel % size.width * kTileColumns / size.width;
      const int row = pixel / size.width * kTileRows / size.height;
      const std::size_t at = static_cast<std::size_t>(picture.first_row) + i;
      fit.tile[at] = row * kTileColumns + column;
      fit.patch[at] = ((picture.press + 1) * channels + picture.at[i] % channels) * fit.tiles + fit.tile[at];
    }
  }
  fit.mesh_error = Vector::Zero(all.rows);
  for (std::size_t i = 0; i < all.forces.size(); ++i) {
    const auto press = static_cast<std::size_t>(all.forces[i]);
    fit.mesh_error[all.first_force + static_cast<Eigen::Index>(i)] =
        shown.force_error_N[all.forces[i]] / all.fit.spec.presses[press].force_sd_N;
  }
  const SimulatedUnit other = all.simulation.show_other_light(all.unknowns(found.x), all.poses(found.x));
  fit.light_error = Vector::Zero(all.rows);
  for (const Compared& picture : all.pictures) {
    const std::vector<double> one = all.values(picture, all.picture_in(shown, picture), shown.background);
    const std::vector<double> two = all.values(picture, all.picture_in(other, picture), other.background);
    for (std::size_t i = 0; i < one.size(); ++i) {
      fit.light_error[picture.first_row + static_cast<Eigen::Index>(i)] = (two[i] - one[i]) / picture.noise[i];
    }
  }
  return fit;
}

FittedUnknown fitted(const FitUnknown& unknown, const Variables& variables, Eigen::Index k, const Vector& x,
                     const FitCertainty& certainty) {
  FittedUnknown out;
  const YamlNumber& number = unknown.numbers.front().number;
  const double scale = variables.scale[k];
  out.name = unknown.name;
  out.how = unknown.how;
  out.start = number.value;
  out.value = number_at(unknown, number, scale * x[k]);
  out.identified = certainty.identified[static_cast<std::size_t>(k)] != 0;
  out.deviation = scale * certainty.deviation[k];
  out.by_noise = scale * certainty.by_noise[k];
  out.by_model = scale * certainty.by_model[k];
  out.by_light = scale * certainty.by_light[k];
  out.by_mesh = scale * certainty.by_mesh[k];
  const bool times = unknown.how == UnknownHow::times;
  const double ends[2] = {out.identified ? number_at(unknown, number, scale * x[k] - kNormal95 * out.deviation)
                                         : (times ? 0.0 : -kInfinity),
                          out.identified ? number_at(unknown, number, scale * x[k] + kNormal95 * out.deviation)
                                         : (times && number.value < 0.0 ? -kInfinity : kInfinity)};
  out.low95 = std::min(ends[0], ends[1]);
  out.high95 = std::max(ends[0], ends[1]);
  out.at_end = x[k] <= variables.low[k] || x[k] >= variables.high[k];
  return out;
}

double root_mean_square(const Vector& of, Eigen::Index first, Eigen::Index count) {
  return count > 0 ? std::sqrt(of.segment(first, count).squaredNorm() / static_cast<double>(count)) : 0.0;
}

std::vector<FitMisfit> misfits_of(const Comparison& all, const Vector& before, const Vector& after) {
  std::vector<FitMisfit> out;
  for (const Compared& picture : all.pictures) {
    const auto count = static_cast<Eigen::Index>(picture.values.size());
    const auto numbers = [&](const Vector& of) {
      double sum = 0.0;
      for (Eigen::Index i = 0; i < count; ++i) {
        sum += std::pow(of[picture.first_row + i] * picture.noise[static_cast<std::size_t>(i)], 2);
      }
      return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
    };
    out.push_back({picture.recorded->file, root_mean_square(before, picture.first_row, count),
                   root_mean_square(after, picture.first_row, count), numbers(before), numbers(after)});
  }
  for (std::size_t i = 0; i < all.forces.size(); ++i) {
    const auto row = all.first_force + static_cast<Eigen::Index>(i);
    const double unit = all.fit.spec.presses[static_cast<std::size_t>(all.forces[i])].force_sd_N;
    out.push_back({fmt::format("force of press {}", all.forces[i]), std::abs(before[row]), std::abs(after[row]),
                   std::abs(before[row]) * unit, std::abs(after[row]) * unit});
  }
  return out;
}

}  // namespace

UnitRecording read_recording(const PreparedFit& fit) {
  UnitRecording recording;
  std::vector<BlockPicture> backgrounds;
  for (const std::filesystem::path& file : fit.spec.backgrounds) {
    backgrounds.push_back(read_block_picture(file, *fit.device.camera, fit.spec.coarse_px, fit.spec.where));
  }
  if (!backgrounds.empty()) recording.background = mean_picture(backgrounds);
  for (const RecordedPress& press : fit.spec.presses) {
    recording.presses.push_back(
        press.frame.empty()
            ? read_block_picture(press.picture, *fit.device.camera, fit.spec.coarse_px, press.where)
            : block_picture(press.frame, press.picture.string(), *fit.device.camera, fit.spec.coarse_px, press.where));
  }
  return recording;
}

UnitFit fit_unit(const PreparedFit& fit, const UnitRecording& recording, const std::filesystem::path& cache_folder,
                 const Progress& progress, const FitStep& on_step) {
  UnitSimulation simulation(fit, cache_folder, progress);
  return fit_unit(fit, recording, simulation, on_step);
}

UnitFit fit_unit(const PreparedFit& fit, const UnitRecording& recording, UnitSimulation& simulation,
                 const FitStep& on_step) {
  TS_ASSERT(recording.presses.size() == fit.spec.presses.size());
  const std::vector<PressPose> labelled = labelled_poses(fit, simulation);
  const Variables variables = variables_of(fit, labelled);
  Comparison all{fit, simulation, variables, labelled, {}, {}};
  lay_out(all, recording);

  LeastSquaresProblem problem;
  problem.residuals = [&](const Vector& x) { return all.residuals(x); };
  problem.jacobian = [&](const Vector& x, const Vector& at) { return all.jacobian(x, at); };
  problem.low = variables.low;
  problem.high = variables.high;
  if (on_step) {
    problem.on_step = [&](const Vector& x, const Vector& at, int step) {
      on_step(step, root_mean_square(at, 0, all.rows), text_at(fit, all.unknowns(x)));
    };
  }
  const Vector before = all.residuals(variables.start);
  const LeastSquaresResult found = least_squares(problem, variables.start);
  const SimulatedUnit shown = simulation.show(all.unknowns(found.x), all.poses(found.x));
  const FitCertainty certainty = certainty_of(linearised(all, found, shown));
  UnitFit out;
  for (Eigen::Index k = 0; k < variables.unknowns; ++k) {
    out.unknowns.push_back(fitted(fit.unknowns[static_cast<std::size_t>(k)], variables, k, found.x, certainty));
  }
  // Directions in which only poses move say nothing of the device.
  Eigen::MatrixXd unidentified(variables.unknowns, certainty.unidentified.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index k = 0; k < certainty.unidentified.cols(); ++k) {
    const Vector part = certainty.unidentified.col(k).head(variables.unknowns);
    if (part.norm() > kOfDevice) unidentified.col(kept++) = part;
  }
  out.unidentified =
      unidentifiable_combinations(fit.unknowns, unidentified.leftCols(kept), variables.scale.head(variables.unknowns));
  const std::vector<PressPose> poses = all.poses(found.x);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    out.presses.push_back({poses[i].place_mm.x(), poses[i].place_mm.y(), poses[i].depth_mm, 0.0, 0.0,
                           shown.force_N[static_cast<Eigen::Index>(i)]});
  }
  for (std::size_t k = 0; k < variables.poses.size(); ++k) {
    const auto at = variables.unknowns + static_cast<Eigen::Index>(k);
    FittedPress& press = out.presses[static_cast<std::size_t>(variables.poses[k].press)];
    const double deviation = variables.scale[at] * certainty.deviation[at];
    const bool at_end = found.x[at] <= variables.low[at] || found.x[at] >= variables.high[at];
    if (variables.poses[k].of == PoseVariable::Of::depth) {
      press.depth_deviation_mm = deviation;
      press.depth_at_end = at_end;
    } else {
      press.place_at_end = press.place_at_end || at_end;
      press.place_deviation_mm = std::max(press.place_deviation_mm, deviation);
    }
  }
  out.misfits = misfits_of(all, before, found.residuals);
  out.misfit_before = root_mean_square(before, 0, all.rows);
  out.misfit_after = root_mean_square(found.residuals, 0, all.rows);
  out.residuals = all.rows;
  out.steps = found.steps;
  out.converged = found.converged;
  out.lamp_setups = simulation.lamp_setups();
  out.device_text = text_at(fit, all.unknowns(found.x));
  out.doubts = doubts_of(fit, out);
  if (!recording.background.mean.empty()) out.shown.push_back(shown.background);
  out.shown.insert(out.shown.end(), shown.presses.begin(), shown.presses.end());
  return out;
}

}  // namespace touchstone::lab
