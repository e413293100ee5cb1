#include "sensors/heights/height_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::sensors {

std::string fault_of(const HeightModel& model) {
  if (!(model.mm_per_px > 0.0) || !std::isfinite(model.mm_per_px)) {
    return fmt::format("mm_per_px is {}; it must be above 0", model.mm_per_px);
  }
  const cv::Mat& mean = model.background.mean;
  if (mean.empty() || mean.type() != CV_32FC3) return "the background isn't a picture of three channels";
  if (!cv::checkRange(mean, true, nullptr, 0.0, 255.001)) return "the background has values out of 0 to 255";
  if (model.background.frames < 1) return "the background is of no frame";

  const LampModel& lamps = model.lamps;
  if (lamps.width != mean.cols || lamps.height != mean.rows) return "the lamps are of another picture size";
  for (const int side : {lamps.columns, lamps.rows}) {
    if (side < 1 || side > kMostNodes)
      return fmt::format("the lamps have {} nodes a side; 1 to {} are allowed", side, kMostNodes);
  }
  if (static_cast<int>(lamps.nodes.size()) != lamps.columns * lamps.rows) return "the lamps don't fit their nodes";
  for (const Eigen::Matrix3d& node : lamps.nodes) {
    if (!node.allFinite()) return "the lamps aren't finite";
  }

  const SlopeTable& table = model.table;
  std::size_t cells = 1;
  for (const int side : table.cells) {
    if (side < 1 || side > 1024)
      return fmt::format("the table has {} cells along a channel; 1 to 1024 are allowed", side);
    cells *= static_cast<std::size_t>(side);
  }
  if (table.slopes.size() != cells || table.hits.size() != cells) return "the table's entries don't fit its cells";
  if (!(table.step >= kFinestStep_DN && table.step <= 255.0F)) {
    return fmt::format("the table's step is {}; it must be {} to 255", table.step, kFinestStep_DN);
  }
  if (!(table.lowest.array().abs() < 2048.0F).all()) return "the table begins out of range";
  const bool finite = std::all_of(table.slopes.begin(), table.slopes.end(),
                                  [](const Eigen::Vector2f& slope) { return slope.allFinite(); });
  if (!finite) return "the table has slopes that aren't finite";
  if (!(model.steepest_calibrated >= 0.0) || !std::isfinite(model.steepest_calibrated)) {
    return "the steepest calibrated slope isn't a number from 0 on";
  }
  if (model.network) {
    if (std::string fault = fault_of(*model.network); !fault.empty()) return "the network: " + fault;
  }
  if (model.presses < 1) return "it is made of no press";
  return {};
}

ColourCorrection correction_of(const HeightModel& model) {
  switch (model.correction) {
    case LightCorrection::none:
      return {};
    case LightCorrection::background:
      return ColourCorrection::by_background(model.background.mean);
    case LightCorrection::fitted:
      break;
  }
  return ColourCorrection::by_lamps(model.background.mean, model.lamps);
}

}  // namespace touchstone::sensors
