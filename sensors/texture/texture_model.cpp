#include "sensors/texture/texture_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "core/error.h"
#include "sensors/texture/height_gray.h"

namespace touchstone::sensors {
namespace {

constexpr double kPitchTolerance = 0.02;

}  // namespace

std::string fault_of(const TextureModel& model) {
  try {
    check(model.op);
  } catch (const Error& error) {
    return error.what();
  }
  if (!(std::isfinite(model.gray_step_mm) && model.gray_step_mm > 0.0)) {
    return fmt::format("a gray level is {} mm high; it must be above 0", model.gray_step_mm);
  }
  if (!(std::isfinite(model.mm_per_px) && model.mm_per_px >= 0.0)) {
    return fmt::format("{} mm a pixel; it must be above 0, or 0 for an unknown one", model.mm_per_px);
  }
  if (model.classes.size() > kMostTextureClasses) return fmt::format("{} classes are too many", model.classes.size());
  std::set<std::string> names;
  for (const std::string& name : model.classes) {
    if (name.empty()) return "a class has no name";
    if (!names.insert(name).second) return fmt::format("two classes are called '{}'", name);
  }
  const auto samples = static_cast<Eigen::Index>(model.labels.size());
  if (model.features.rows() != samples) {
    return fmt::format("{} features have {} labels", model.features.rows(), samples);
  }
  if (samples > 0 && model.features.cols() != feature_size(model.op)) {
    return fmt::format("features of {} numbers; {} are needed", model.features.cols(), feature_size(model.op));
  }
  for (Eigen::Index i = 0; i < samples; ++i) {
    const int label = model.labels[i];
    if (label < 0 || label >= static_cast<int>(model.classes.size())) {
      return fmt::format("sample {} is of class {}, there are {}", i, label, model.classes.size());
    }
    const double length = model.features.row(i).cast<double>().norm();
    if (!(std::abs(length - 1.0) < 1e-4) || model.features.row(i).minCoeff() < 0.0F) {
      return fmt::format("the feature of sample {} isn't the square root of shares", i);
    }
  }
  return {};
}

void learn_texture(TextureModel& model, const std::string& name, const cv::Mat& heights_mm) {
  if (name.empty()) fail("a material has no name");
  const Eigen::VectorXf feature = texture_feature(height_gray(heights_mm, model.gray_step_mm), model.op);
  auto known = std::find(model.classes.begin(), model.classes.end(), name);
  if (known == model.classes.end()) known = model.classes.insert(known, name);
  model.labels.push_back(static_cast<int>(known - model.classes.begin()));
  model.features.conservativeResize(static_cast<Eigen::Index>(model.labels.size()), feature.size());
  model.features.bottomRows(1) = feature.transpose();
}

TextureMatch classify(const TextureModel& model, const Eigen::VectorXf& feature) {
  constexpr int kNeighbours = 3;
  const Eigen::Index samples = model.features.rows();
  if (samples == 0) fail("the texture model has no sample");
  if (feature.size() != model.features.cols()) {
    fail("the feature has {} numbers, the model's have {}", feature.size(), model.features.cols());
  }
  std::array<double, kNeighbours> nearest;
  nearest.fill(std::numeric_limits<double>::infinity());
  std::array<int, kNeighbours> labels{-1, -1, -1};
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double squared = (model.features.row(i).transpose() - feature).squaredNorm();
    if (squared >= nearest.back()) continue;
    const auto place = std::upper_bound(nearest.begin(), nearest.end(), squared) - nearest.begin();
    std::copy_backward(nearest.begin() + place, nearest.end() - 1, nearest.end());
    std::copy_backward(labels.begin() + place, labels.end() - 1, labels.end());
    nearest[place] = squared;
    labels[place] = model.labels[i];
  }
  const int label = labels[1] == labels[2] && labels[1] >= 0 ? labels[1] : labels[0];
  return {.label = label,
          .votes = static_cast<int>(std::count(labels.begin(), labels.end(), label)),
          .distance = std::sqrt(nearest[0]) / std::numbers::sqrt2};
}

TextureMatch classify_texture(const TextureModel& model, const cv::Mat& heights_mm, double mm_per_px) {
  if (!(std::isfinite(mm_per_px) && mm_per_px >= 0.0)) fail("{} mm a pixel; it must be 0 or above", mm_per_px);
  if (mm_per_px > 0.0 && model.mm_per_px > 0.0 && std::abs(mm_per_px / model.mm_per_px - 1.0) > kPitchTolerance) {
    fail("the image has {} mm a pixel, the model was trained on {}", mm_per_px, model.mm_per_px);
  }
  return classify(model, texture_feature(height_gray(heights_mm, model.gray_step_mm), model.op));
}

}  // namespace touchstone::sensors
