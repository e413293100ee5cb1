#include "sensors/events/grasp_force_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

std::string fault_of(const GraspForceModel& model) {
  if (model.error) {
    for (const double number : {model.error->left_out_N, model.error->absolute_N, model.error->relative}) {
      if (!(number >= 0.0 && std::isfinite(number)))
        return fmt::format("an error is {}; it must be at least 0", number);
    }
  }
  if (const auto* network = std::get_if<TimeDelayNetwork>(&model.estimator)) {
    if (network->features.size() == 2) return fault_of(*network);
    return fmt::format("the network reads {} features; ON and OFF counts are given", network->features.size());
  }
  const auto& process = std::get<GaussianProcess>(model.estimator);
  if (process.inputs.cols() == 3) return {};
  return fmt::format("the Gaussian process has {} inputs; ON and OFF counts and time are given", process.inputs.cols());
}

GraspForceError fit_force_error(std::span<const double> off_N, std::span<const double> force_N) {
  TS_ASSERT(off_N.size() == force_N.size() && !off_N.empty());
  const auto count = static_cast<double>(off_N.size());
  double ee = 0.0, ff = 0.0, eeff = 0.0, ffff = 0.0;  // means of squares and their products
  for (std::size_t i = 0; i < off_N.size(); ++i) {
    const double e = off_N[i] * off_N[i], f = force_N[i] * force_N[i];
    ee += e / count;
    ff += f / count;
    eeff += e * f / count;
    ffff += f * f / count;
  }
  const double spread = ffff - ff * ff;
  constexpr double kRounding = 1e-9;  // forces that are all one show nothing that grows
  double relative = spread > kRounding * ffff ? std::max(0.0, (eeff - ee * ff) / spread) : 0.0;  // squared
  double absolute = ee - relative * ff;
  if (absolute < 0.0) {
    absolute = 0.0;
    relative = ee / ff;  // so that the mean square is still that of the errors
  }
  return {std::sqrt(ee), std::sqrt(absolute), std::sqrt(relative)};
}

std::optional<double> GraspForceModel::sigma_N(double force_N, double variance) const {
  if (error) return std::sqrt(variance + std::pow(error->absolute_N, 2) + std::pow(error->relative * force_N, 2));
  if (const auto* process = std::get_if<GaussianProcess>(&estimator)) {
    return std::hypot(std::sqrt(variance), process->parameters.noise);
  }
  return std::nullopt;
}

}  // namespace touchstone::sensors
