#include "lab/fit/unit_fit.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "lab/fit/fit_certainty.h"
#include "lab/fit/unit_fit_words.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kTileColumns = 8, kTileRows = 6;
constexpr double kOfDevice = 1e-3;  // of a direction of length 1: less is of poses alone

using Vector = Eigen::VectorXd;

LinearisedFit linearised(const UnitComparison& all, const LeastSquaresResult& found, const SimulatedUnit& shown) {
  LinearisedFit fit;
  fit.jacobian = found.jacobian;
  fit.residuals = found.residuals;
  fit.tiles = kTileColumns * kTileRows;
  fit.shared = static_cast<int>(all.variables().unknowns);
  fit.tile.assign(static_cast<std::size_t>(all.rows()), -1);
  fit.patch.assign(static_cast<std::size_t>(all.rows()), -1);
  for (const Compared& picture : all.pictures()) {
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
  fit.mesh_error = Vector::Zero(all.rows());
  for (std::size_t i = 0; i < all.forces().size(); ++i) {
    const auto press = static_cast<std::size_t>(all.forces()[i]);
    fit.mesh_error[all.first_force() + static_cast<Eigen::Index>(i)] =
        shown.force_error_N[all.forces()[i]] / all.fit().spec.presses[press].force_sd_N;
  }
  const SimulatedUnit other = all.simulation().show_other_light(all.unknowns(found.x), all.poses(found.x));
  fit.light_error = Vector::Zero(all.rows());
  for (const Compared& picture : all.pictures()) {
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

std::vector<FitMisfit> misfits_of(const UnitComparison& all, const Vector& before, const Vector& after) {
  std::vector<FitMisfit> out;
  for (const Compared& picture : all.pictures()) {
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
  for (std::size_t i = 0; i < all.forces().size(); ++i) {
    const auto row = all.first_force() + static_cast<Eigen::Index>(i);
    const double unit = all.fit().spec.presses[static_cast<std::size_t>(all.forces()[i])].force_sd_N;
    out.push_back({fmt::format("force of press {}", all.forces()[i]), std::abs(before[row]), std::abs(after[row]),
                   std::abs(before[row]) * unit, std::abs(after[row]) * unit});
  }
  return out;
}

constexpr double kLeastSquare = 1.0;  // residuals are in standard deviations

FitPlan plan_of(const UnitComparison& all, double first_s) {
  const double picture_s = first_s / static_cast<double>(all.pictures_of_all());
  return {picture_s * static_cast<double>(all.pictures_of_derivatives() + all.pictures_of_place()), first_s,
          LeastSquaresSettings{}.most_steps};
}

/// Of a file that was kept, whose checksum is right.
void require_own(const FitSoFar& so_far, const UnitComparison& all) {
  const LeastSquaresState& search = so_far.search;
  const Variables& variables = all.variables();
  const Eigen::Index count = variables.low.size();
  const auto has = [](Eigen::Index size, Eigen::Index wanted) { return size == 0 || size == wanted; };
  const bool own =
      search.x.size() == count && has(search.residuals.size(), all.rows()) && so_far.before.size() == all.rows() &&
      (search.jacobian.size() == 0 || (search.jacobian.rows() == all.rows() && search.jacobian.cols() == count)) &&
      (search.x.array() >= variables.low.array()).all() && (search.x.array() <= variables.high.array()).all() &&
      so_far.level < all.fit().spec.field_accuracy.size();
  if (!own) fail("what was kept is of another fit");
}

/// With one accuracy of the light field after the other.
LeastSquaresResult search(const UnitComparison& all, const FitCourse& course, FitSoFar& so_far) {
  UnitSimulation& simulation = all.simulation();
  const std::vector<double>& accuracies = all.fit().spec.field_accuracy;
  LeastSquaresProblem problem = all.problem();
  LeastSquaresSettings settings;
  settings.least_square = kLeastSquare;
  settings.rough_within = kRoughWithin;
  const auto expect = [&](double misfit) {
    simulation.expect(fmt::format("step {}, misfit {:.2f}", so_far.search.steps + 1, misfit),
                      all.pictures_of_derivatives() + all.pictures_of_place());
  };
  int told = so_far.search.steps;
  problem.on_state = [&](const LeastSquaresState& at) {
    so_far.search = at;
    if (course.keep) course.keep(so_far);
    const double misfit = root_mean_square(at.residuals, 0, all.rows());
    if (at.jacobian.size() == 0) expect(misfit);
    if (at.steps == told) return;
    told = at.steps;
    if (course.on_step) course.on_step(at.steps, misfit, text_at(all.fit(), all.unknowns(at.x)));
  };
  for (;;) {
    simulation.set_field_accuracy(accuracies[so_far.level]);
    settings.most_steps = LeastSquaresSettings{}.most_steps + so_far.steps_before;
    const LeastSquaresResult found = least_squares(problem, so_far.search, settings);
    if (so_far.level + 1 == accuracies.size()) return found;
    ++so_far.level;
    so_far.steps_before = found.steps;
    so_far.search = {};
    so_far.search.x = found.x;
    so_far.search.steps = found.steps;
    if (course.keep) course.keep(so_far);
  }
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
                 const Progress& progress, const FitCourse& course) {
  UnitSimulation simulation(fit, cache_folder, progress);
  return fit_unit(fit, recording, simulation, course);
}

UnitFit fit_unit(const PreparedFit& fit, const UnitRecording& recording, UnitSimulation& simulation,
                 const FitCourse& course) {
  TS_ASSERT(recording.presses.size() == fit.spec.presses.size());
  const std::size_t presses = fit.spec.presses.size();
  if (course.from && course.from->labelled.size() != presses) fail("what was kept is of another fit");
  simulation.expect("first pictures", static_cast<std::int64_t>(simulation.sources() * (1 + presses)));
  FitSoFar so_far;
  so_far.labelled = course.from ? course.from->labelled : labelled_poses(fit, simulation);
  const UnitComparison all(fit, recording, simulation, so_far.labelled);
  const Variables& variables = all.variables();
  if (course.from) {
    require_own(*course.from, all);
    so_far = *course.from;
  } else {
    const auto begun = std::chrono::steady_clock::now();
    simulation.set_field_accuracy(fit.spec.field_accuracy.front());
    so_far.search.x = variables.start;
    so_far.before = all.residuals(variables.start);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
    if (course.on_plan) course.on_plan(plan_of(all, taken.count()));
  }
  const LeastSquaresResult found = search(all, course, so_far);
  const Vector& before = so_far.before;
  simulation.expect("last pictures", all.pictures_of_all());
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
  out.misfit_before = root_mean_square(before, 0, all.rows());
  out.misfit_after = root_mean_square(found.residuals, 0, all.rows());
  out.residuals = all.rows();
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
