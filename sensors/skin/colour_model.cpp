#include "sensors/skin/colour_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>

#include "core/cie_colour.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/models/json_payload.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.colour_model";
constexpr int kVersion = 1;
constexpr int kLargestSide = 8192;
constexpr double kLargest_DN = 255.0;

ColourMatrix matrix_of(std::span<const ColourPatch> patches) {
  Eigen::MatrixX3d rgb(std::ssize(patches), 3), xyz(std::ssize(patches), 3);
  for (Eigen::Index k = 0; k < rgb.rows(); ++k) {
    const ColourPatch& patch = patches[static_cast<std::size_t>(k)];
    rgb.row(k) = patch.rgb.transpose();
    xyz.row(k) = xyz_from_lab(patch.lab).transpose();
  }
  return fit_colour_matrix(rgb, xyz);
}

double error_of(const ColourMatrix& matrix, const ColourPatch& patch) {
  return ciede2000(matrix.lab(patch.rgb), patch.lab);
}

}  // namespace

std::string fault_of(const ColourModel& model) {
  const cv::Mat& white = model.field.white;
  const cv::Mat& trusted = model.field.trusted;
  if (white.empty() || white.type() != CV_32FC3) return "it has no white card";
  if (trusted.type() != CV_8UC1 || trusted.size() != white.size()) return "its mask isn't of the white card's size";
  for (int row = 0; row < white.rows; ++row) {
    const auto* values = white.ptr<cv::Vec3f>(row);
    const auto* mask = trusted.ptr<std::uint8_t>(row);
    for (int column = 0; column < white.cols; ++column) {
      if (mask[column] != 0 && mask[column] != 255) return "its mask has other values than 0 and 255";
      for (int k = 0; k < 3; ++k) {
        const float value = values[column][k];
        // Where it's trusted pictures are divided by it.
        if (!(value >= 0.0F && value <= 65535.0F) || (mask[column] != 0 && !(value > 0.0F))) {
          return "its white card has values that aren't finite, or dark where it's trusted";
        }
      }
    }
  }
  if (!model.matrix.xyz_from_rgb.allFinite()) return "its matrix has values that aren't finite";
  if (model.patches < 3) return fmt::format("it was fitted to {} patches, at least 3 are needed", model.patches);
  for (const double error : {model.mean_error_de2000, model.largest_error_de2000}) {
    if (!(error >= 0.0) || !std::isfinite(error)) return "its errors must be at least 0 and finite";
  }
  return {};
}

ColourModel calibrate_colour(FlatField field, std::span<const ColourPatch> patches) {
  for (const ColourPatch& patch : patches) {
    if (!patch.lab.allFinite()) fail("colour model: a patch's known colour isn't finite");
  }
  ColourModel model;
  model.field = std::move(field);
  // A card that one channel doesn't see divides nothing.
  cv::Mat lit;
  cv::inRange(model.field.white, cv::Scalar::all(1e-3), cv::Scalar::all(kLargest_DN), lit);
  model.field.trusted = model.field.trusted & lit;
  model.matrix = matrix_of(patches);
  model.patches = static_cast<int>(patches.size());
  for (const ColourPatch& patch : patches) {
    const double error = error_of(model.matrix, patch);
    model.mean_error_de2000 += error / static_cast<double>(patches.size());
    model.largest_error_de2000 = std::max(model.largest_error_de2000, error);
  }
  return model;
}

std::vector<double> cross_validate_colour(std::span<const ColourPatch> patches) {
  std::vector<double> errors;
  if (patches.size() < 4) return errors;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    std::vector<ColourPatch> others(patches.begin(), patches.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    try {
      errors.push_back(error_of(matrix_of(others), patches[i]));
    } catch (const Error&) {
      return {};
    }
  }
  return errors;
}

RegionColour colour_of(const ColourModel& model, const cv::Mat& picture, const cv::Mat& mask) {
  const cv::Mat& white = model.field.white;
  if (picture.type() != CV_8UC3 || picture.size() != white.size()) {
    fail("is {} x {} with {} channels of {} bit; the model's pictures are {} x {} with 3 of 8", picture.cols,
         picture.rows, picture.channels(), picture.depth() == CV_8U ? 8 : 16, white.cols, white.rows);
  }
  // Sums of light mean nothing where the sensor's numbers end.
  cv::Mat bright, wanted = mask.clone();
  cv::inRange(picture, cv::Scalar::all(0), cv::Scalar::all(kLargest_DN - 1), bright);
  if (mask.type() == CV_8UC1 && mask.size() == picture.size()) wanted.setTo(0, ~bright);
  RegionColour colour;
  colour.lab = model.matrix.lab(mean_of_white(picture, model.field, wanted));
  const int all = cv::countNonZero(mask);
  colour.trusted_share = all > 0 ? cv::countNonZero(wanted & model.field.trusted) / static_cast<double>(all) : 0.0;
  return colour;
}

cv::Mat rectangle_mask(const cv::Size& size, const cv::Rect& rectangle) {
  const bool inside = rectangle.x >= 0 && rectangle.y >= 0 && rectangle.width > 0 && rectangle.height > 0 &&
                      rectangle.x <= size.width - rectangle.width && rectangle.y <= size.height - rectangle.height;
  if (!inside) {
    fail("a rectangle of {} x {} px at ({}, {}) isn't within the picture's {} x {}", rectangle.width, rectangle.height,
         rectangle.x, rectangle.y, size.width, size.height);
  }
  cv::Mat mask(size, CV_8UC1, cv::Scalar(0));
  mask(rectangle).setTo(255);
  return mask;
}

std::string to_bytes(const ColourModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("colour model: {}", fault);
  const cv::Mat white = model.field.white.isContinuous() ? model.field.white : model.field.white.clone();
  const cv::Mat trusted = model.field.trusted.isContinuous() ? model.field.trusted : model.field.trusted.clone();
  std::string payload;
  append(payload, white.ptr<float>(), 3 * white.total());
  append(payload, trusted.ptr<std::uint8_t>(), trusted.total());
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["width_px"] = white.cols;
  json["height_px"] = white.rows;
  json["patches"] = model.patches;
  json["mean_error_de2000"] = model.mean_error_de2000;
  json["largest_error_de2000"] = model.largest_error_de2000;
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    const Eigen::Vector3d values = model.matrix.xyz_from_rgb.row(row);
    rows.push_back({values.x(), values.y(), values.z()});
  }
  json["xyz_from_rgb"] = rows;
  return with_payload(std::move(json), payload);
}

ColourModel colour_model_from_bytes(std::string_view bytes, const std::string& name) {
  auto [json, payload] = split_payload(bytes, "a colour model", name);
  const JsonField root{json, "", name};
  root.expect_format(kFormat, kVersion);
  root.expect_map({"format", "version", "width_px", "height_px", "patches", "mean_error_de2000", "largest_error_de2000",
                   "xyz_from_rgb", "sha256"});
  ColourModel model;
  const auto width = static_cast<int>(root.at("width_px").whole_number(1, kLargestSide));
  const auto height = static_cast<int>(root.at("height_px").whole_number(1, kLargestSide));
  model.patches = static_cast<int>(root.at("patches").whole_number(3, std::numeric_limits<int>::max()));
  model.mean_error_de2000 = root.at("mean_error_de2000").number();
  model.largest_error_de2000 = root.at("largest_error_de2000").number();
  const auto rows = root.at("xyz_from_rgb").vectors<3>(3);
  for (int row = 0; row < 3; ++row)
    model.matrix.xyz_from_rgb.row(row) = rows[static_cast<std::size_t>(row)].transpose();
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  expect_payload(root, payload, pixels * (3 * sizeof(float) + 1));
  model.field.white.create(height, width, CV_32FC3);
  model.field.trusted.create(height, width, CV_8UC1);
  take(payload, model.field.white.ptr<float>(), 3 * pixels);
  take(payload, model.field.trusted.ptr<std::uint8_t>(), pixels);
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const ColourModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_bytes(model));
}

ColourModel load_colour_model(const std::filesystem::path& path) {
  return colour_model_from_bytes(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
