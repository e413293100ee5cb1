#include "sim/relief.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/units.h"
#include "sim/image_file.h"

namespace touchstone::sim {
namespace {

constexpr int kPointsAWave = 64;
constexpr int kPointsAHair = 64;
constexpr double kMicrometresPerMillimetre = 1000.0;

/// The picture as shares of white, 32 bit floats.
cv::Mat read_shares(const ReliefSpec& relief) {
  try {
    const bool floats = relief.file.extension() == ".exr";
    cv::Mat picture = floats ? read_exr(relief.file).image : read_image(relief.file);
    if (picture.channels() != 1)
      fail("{}: has {} channels; a relief is grey", relief.file.string(), picture.channels());
    cv::Mat shares;
    picture.convertTo(shares, CV_32F,
                      picture.depth() == CV_8U    ? 1.0 / 255
                      : picture.depth() == CV_16U ? 1.0 / 65535
                                                  : 1.0);
    return shares;
  } catch (const Error& error) {
    fail_at(relief.where, "relief.file: {}", error.what());
  }
}

fem::ReliefMap image_map(const ReliefSpec& relief) {
  const cv::Mat shares = read_shares(relief);
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  const Eigen::Vector2d spacing(relief.size_mm.x() / shares.cols, relief.size_mm.y() / shares.rows);
  std::vector<float> heights;
  heights.reserve(shares.total());
  for (int j = 0; j < shares.rows; ++j) {  // the picture's rows run down, the map's up
    const float* row = shares.ptr<float>(shares.rows - 1 - j);
    for (int i = 0; i < shares.cols; ++i) {
      const double share = row[i];
      if (!(share >= 0.0 && share <= 1.0)) {
        fail_at(relief.where, "relief.file: {}: a pixel is {}; floats must be from 0 to 1", relief.file.string(),
                share);
      }
      heights.push_back(static_cast<float>(amplitude * share));
    }
  }
  return {shares.cols,       shares.rows, 0.5 * (spacing - relief.size_mm), spacing, {relief.repeat, relief.repeat},
          std::move(heights)};
}

}  // namespace

EnumNames<ReliefKind> enum_names(ReliefKind) {
  return {{"waves", ReliefKind::waves},
          {"grid", ReliefKind::grid},
          {"hair", ReliefKind::hair},
          {"image", ReliefKind::image}};
}

void fields(YamlReader& in, ReliefSpec& relief) {
  relief.where = in.where();
  in.required("type", relief.type);
  in.required("amplitude_um", relief.amplitude_um, Allowed::above_up_to(0.0, 5000.0));
  switch (relief.type) {
    case ReliefKind::waves:
    case ReliefKind::grid:
      in.required("pitch_mm", relief.pitch_mm, Allowed::above_up_to(0.0, 100.0));
      break;
    case ReliefKind::hair:
      in.optional("pitch_mm", relief.pitch_mm, Allowed::within(relief.amplitude_um / kMicrometresPerMillimetre, 100.0));
      break;
    case ReliefKind::image: {
      std::string file;
      in.required("file", file);
      relief.file = in.folder() / file;
      relief.where = in.where("file");
      in.required("size_mm", relief.size_mm, Allowed::above_up_to(0.0, 1000.0));
      in.optional("repeat", relief.repeat);
      break;
    }
  }
}

double finest_detail(const ReliefSpec& relief) {
  switch (relief.type) {
    case ReliefKind::waves:
    case ReliefKind::grid:
      return relief.pitch_mm;
    case ReliefKind::hair:
      return relief.amplitude_um / kMicrometresPerMillimetre;
    case ReliefKind::image:
      break;
  }
  const cv::Mat shares = read_shares(relief);
  return 2.0 * std::min(relief.size_mm.x() / shares.cols, relief.size_mm.y() / shares.rows);
}

fem::ReliefMap relief_map(const ReliefSpec& relief) {
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  std::vector<float> heights;
  switch (relief.type) {
    case ReliefKind::waves:
      for (int i = 0; i < kPointsAWave; ++i) {
        heights.push_back(static_cast<float>(0.5 * amplitude * (1.0 - std::cos(2.0 * kPi * i / kPointsAWave))));
      }
      return {kPointsAWave, 1, {0, 0}, {relief.pitch_mm / kPointsAWave, 1.0}, {true, true}, std::move(heights)};
    case ReliefKind::grid:
      for (int j = 0; j < kPointsAWave; ++j) {
        for (int i = 0; i < kPointsAWave; ++i) {
          const double sum = std::cos(2.0 * kPi * i / kPointsAWave) + std::cos(2.0 * kPi * j / kPointsAWave);
          heights.push_back(static_cast<float>(0.25 * amplitude * (2.0 - sum)));
        }
      }
      return {kPointsAWave, kPointsAWave,      {0, 0}, Eigen::Vector2d::Constant(relief.pitch_mm / kPointsAWave),
              {true, true}, std::move(heights)};
    case ReliefKind::hair: {
      // A round hair that lies on the floor, seen from below: at its sides the map falls straight to the floor.
      const double radius = 0.5 * amplitude;
      const bool repeated = relief.pitch_mm > 0.0;
      const double step = amplitude / kPointsAHair;
      const int points = repeated ? std::max(1, static_cast<int>(std::lround(relief.pitch_mm / step))) : kPointsAHair;
      const double spacing = repeated ? relief.pitch_mm / points : step;
      const double first = -0.5 * spacing * (points - 1);
      for (int i = 0; i < points; ++i) {
        const double x = first + spacing * i;
        const double rest = radius * radius - x * x;
        heights.push_back(rest > 0.0 ? static_cast<float>(radius + std::sqrt(rest)) : 0.0F);
      }
      return {points, 1, {first, 0}, {spacing, 1.0}, {repeated, true}, std::move(heights)};
    }
    case ReliefKind::image:
      break;
  }
  return image_map(relief);
}

}  // namespace touchstone::sim
