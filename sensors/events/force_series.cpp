#include "sensors/events/force_series.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

std::string fault_of(const ForceSeries& series) {
  if (series.features.rows() != series.force_N.size()) {
    return fmt::format("{} windows of features and {} of force", series.features.rows(), series.force_N.size());
  }
  if (series.features.size() == 0) return "it has no windows or no features";
  if (series.judged.empty()) return "no window of it is judged";
  for (const int row : series.judged) {
    if (row < 0 || row >= series.features.rows()) {
      return fmt::format("window {} is judged, there are {}", row, series.features.rows());
    }
  }
  for (Eigen::Index row = 0; row < series.features.rows(); ++row) {
    if (!series.features.row(row).allFinite()) return fmt::format("a feature of window {} isn't finite", row);
    if (!std::isfinite(series.force_N[row])) return fmt::format("the force of window {} isn't finite", row);
  }
  return {};
}

StackedSeries stack(std::span<const ForceSeries> series, std::span<const int> chosen) {
  Eigen::Index rows = 0;
  Eigen::Index features = 0;
  for (const int index : chosen) {
    if (index < 0 || index >= static_cast<int>(series.size())) {
      fail("force series: series {} is chosen, there are {}", index, series.size());
    }
    const ForceSeries& one = series[static_cast<std::size_t>(index)];
    const std::string fault = fault_of(one);
    if (!fault.empty()) fail("force series {}: {}", index, fault);
    if (features == 0) features = one.features.cols();
    if (one.features.cols() != features) {
      fail("force series {}: it has {} features, {} are needed", index, one.features.cols(), features);
    }
    rows += static_cast<Eigen::Index>(one.judged.size());
  }
  StackedSeries result;
  result.features.resize(rows, features);
  result.force_N.resize(rows);
  Eigen::Index next = 0;
  for (const int index : chosen) {
    const ForceSeries& one = series[static_cast<std::size_t>(index)];
    for (const int row : one.judged) {
      result.features.row(next) = one.features.row(row);
      result.force_N[next++] = one.force_N[row];
    }
  }
  return result;
}

}  // namespace touchstone::sensors
